//! The ground that the road is built on, box, lattices, band and memory, and the sides that are found on it: what the points ask for is known in
//! part before f̂ is found and in part after it.

use zeroset_bspline::{CellBand, Derivatives};
use zeroset_trust_region::normal_deviation;
use zeroset_watch::CancelToken;

use crate::error::ReconstructError;
use crate::lattice::cell_widths::Lattices;
use crate::lattice::domain::Domain;
use crate::memory::{self, Counts, MemoryReport};
use crate::options::{Normals, Options};
use crate::points::frame::Frame;
use crate::points::known_normals::Known;
use crate::points::spacing::Spacing;
use crate::refinement;
use crate::report::StageFigures;
use crate::sides::averaging;
use crate::sides::facing_sheets::facing_share;
use crate::sides::normals::normals;
use crate::sides::{SHALLOW, SPARSE, SideSearch, Sides};

/// Above this score, without what noise adds, few points are searched again with those that lie on no surface with others, and for means of
/// points no finer lattices.
const UNCONVINCING: f64 = 0.2;
/// A score up to this, without what noise adds, says that means have been found on the right surface: it is 0.03 and less where they have.
const CONVINCING: f64 = 0.08;
/// Fewer means than this leave no shape.
const FEWEST_MEANS: usize = 100;
/// Where more than this share of the points face another sheet within a cell of the dense lattice, some of them have no node between them, and
/// their sides are lost: then its cells are halved once more, which in space takes eight times the nodes.
const MOST_FACING: f64 = 0.001;
/// But not if a cell is no wider than so many spacings: then the points do not tell the sheets apart either.
const TOLD_APART: f64 = 2.5;
/// Below this share of its mean the gradient of f̂ does not tell which way a sheet faces.
const TELLING: f64 = 0.3;

/// What the road begins with.
pub struct Beginning<'a, const D: usize> {
    /// How many points came.
    pub points: usize,
    /// Those of them that are looked at, in the frame.
    pub distinct: &'a [[f64; D]],
    pub frame: &'a Frame<D>,
    /// In the frame.
    pub margin: f64,
    pub known: Option<Known<'a, D>>,
    /// Whether they are means of points with deep noise.
    pub are_means: bool,
    pub options: &'a Options,
    pub cancel: &'a CancelToken,
}

/// The lattices that points ask for.
pub struct Ground<const D: usize> {
    pub lattices: Lattices<D>,
    /// Where the levels above the dense lattice are refined, as far as memory reaches; none if they are not.
    pub band: Option<CellBand<D>>,
    pub memory: MemoryReport,
}

/// f̂, and the ground that it was found on.
pub type Founded<const D: usize> = ((Ground<D>, Sides<D>), StageFigures);

impl<const D: usize> Beginning<'_, D> {
    fn counts(&self, spacing: &Spacing, domain: &Domain<D>, halvings: u32, band: Option<&CellBand<D>>) -> Counts {
        Counts::of(self.points, spacing, domain, halvings, self.options, band)
    }

    /// The ground for points that are heard.
    ///
    /// # Errors
    /// If memory does not suffice, or the lattices are not valid.
    pub fn ground(&self, heard: &[[f64; D]], spacing: &Spacing) -> Result<Ground<D>, ReconstructError> {
        let options = self.options;
        let lattices = Lattices::of(self.frame, spacing, self.margin, options);
        let Lattices { domain, halvings, levels } = &lattices;
        let band = match options.refine && options.degree == 3 {
            true => Some(refinement::band(heard, spacing, domain, *halvings, *levels, false)?),
            false => None,
        };
        let counts = self.counts(spacing, domain, *halvings, band.as_ref());
        let memory = counts.within(memory::memory_limit(options.memory))?;
        let band = band.map(|band| band.shallower(memory.levels));
        Ok(Ground { lattices, band, memory })
    }

    /// f̂ for points that are heard, and the ground that it was found on: where few points have no convincing sides without those that lie on no
    /// surface with others, these may well be a sparse part of it, and all are heard if that gives better ones, or unit normals that agree. Where
    /// noise is deeper than the points are apart f̂ is one of means of them, if its sides are not doubtful.
    ///
    /// # Errors
    /// If f̂ cannot be found.
    pub fn sides(
        &self,
        ground: Ground<D>,
        heard: Vec<[f64; D]>,
        spacing: Spacing,
    ) -> Result<Founded<D>, ReconstructError> {
        let is_all = heard.len() == self.distinct.len();
        let (sides, figures) = self.sides_on(&ground, heard.clone(), spacing, f64::INFINITY)?;
        let sparse = D == 3 && !is_all && self.distinct.len() <= SPARSE;
        if self.options.open {
            return Ok(((ground, sides), figures));
        }
        let other =
            if sparse && sides.score > UNCONVINCING { self.of_all(&sides) } else { self.of_means(&heard, &sides) };
        match other {
            Ok(Some(found)) => Ok(found),
            Err(error) if error.is_cancelled() => Err(error),
            _ => Ok(((ground, sides), figures)),
        }
    }

    /// For all points, if that gives better sides.
    fn of_all(&self, sides: &Sides<D>) -> Result<Option<Founded<D>>, ReconstructError> {
        let spacing = Spacing::of(self.distinct);
        let ground = self.ground(self.distinct, &spacing)?;
        let (other, figures) = self.sides_on(&ground, self.distinct.to_vec(), spacing, sides.score)?;
        let is_better = other.agreed || other.score <= UNCONVINCING || (!sides.agreed && other.score < sides.score);
        Ok(is_better.then_some(((ground, other), figures)))
    }

    /// For means of the points, if their noise is deeper than they are apart and means do not contradict each other.
    fn of_means(&self, heard: &[[f64; D]], sides: &Sides<D>) -> Result<Option<Founded<D>>, ReconstructError> {
        let trusted = self.known.is_some() && self.options.normals == Normals::Trust;
        let wanted = self.options.smoothing.is_some();
        if trusted || wanted || sides.depth <= SHALLOW || sides.spacing.lines.is_some() {
            return Ok(None);
        }
        let Some(depth) = averaging::depth(heard, &sides.spacing) else { return Ok(None) };
        let of_balls = self.on_means(averaging::in_balls(heard, depth))?;
        for f_hat in of_balls.iter().map(|((_, first), _)| &first.f_hat).chain([&sides.f_hat]) {
            // Better known now: where tubes are hardly wider than the noise, no ball is flat.
            let depth = normal_deviation(f_hat.evaluate(heard, Derivatives::Gradient).sampson_distances());
            let found = self.on_means(averaging::on_zero_set(heard, f_hat, depth))?;
            if let Some(found) = found.filter(|((_, of_means), _)| of_means.score <= CONVINCING) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// For means that take the place of all points, if these are enough.
    fn on_means(&self, means: Vec<[f64; D]>) -> Result<Option<Founded<D>>, ReconstructError> {
        if means.len() < FEWEST_MEANS {
            return Ok(None);
        }
        let spacing = Spacing::of(&means);
        let ground = self.ground(&means, &spacing)?;
        let beginning = Beginning { distinct: &means, known: None, are_means: true, ..*self };
        let (sides, figures) = beginning.sides_on(&ground, means.clone(), spacing, UNCONVINCING)?;
        Ok(Some(((ground, sides), figures)))
    }

    fn sides_on(
        &self,
        ground: &Ground<D>,
        heard: Vec<[f64; D]>,
        spacing: Spacing,
        to_beat: f64,
    ) -> Result<(Sides<D>, StageFigures), ReconstructError> {
        let Lattices { domain, halvings, .. } = &ground.lattices;
        let search = SideSearch {
            domain,
            halvings: *halvings,
            options: self.options,
            frame: self.frame,
            known: self.known,
            are_means: self.are_means,
            memory: &ground.memory,
            to_beat,
            cancel: self.cancel,
        };
        let left_out = self.distinct.len() - heard.len();
        search.run(heard, spacing, left_out)
    }

    /// The ground for the rest of the road: as it is, unless the sides have shown that it does not do, and memory suffices for what does. Where
    /// noise is deep the band is wide, and where sheets face each other within a cell of the dense lattice cells are halved once more.
    ///
    /// # Errors
    /// If the band is not valid.
    pub fn adapted(&self, ground: Ground<D>, sides: &Sides<D>) -> Result<Ground<D>, ReconstructError> {
        let Ground { lattices: Lattices { domain, halvings, levels }, band: Some(_), memory } = &ground else {
            return Ok(ground);
        };
        let wide = refinement::is_deep(sides.noise, &sides.spacing);
        if !wide && (*levels == Some(0) || !is_narrow(sides, domain.spacing(*halvings))) {
            return Ok(ground);
        }
        let more = u32::from(!wide);
        let (halvings, levels) = (halvings + more, levels.map(|levels| levels - more));
        let band = refinement::band(&sides.points, &sides.spacing, domain, halvings, levels, wide)?;
        match self.counts(&sides.spacing, domain, halvings, Some(&band)).within(memory.limit) {
            Ok(need) if need.levels + more as usize >= memory.levels => Ok(Ground {
                band: Some(band.shallower(need.levels)),
                memory: need,
                lattices: Lattices { domain: domain.clone(), halvings, levels },
            }),
            _ => Ok(ground),
        }
    }
}

/// Whether gaps or walls that the points tell apart are narrower than a `cell` of the dense lattice.
fn is_narrow<const D: usize>(sides: &Sides<D>, cell: f64) -> bool {
    let (few, _) = sides.few();
    D == 3
        && cell > TOLD_APART * sides.spacing.typical
        && facing_share(few, &normals(&sides.f_hat, few, TELLING), cell) > MOST_FACING
}
