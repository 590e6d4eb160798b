//! The road: points → frame → f̂ → distance → φ → initial shape → f*.

use std::cell::LazyCell;
use std::time::Instant;

use zeroset_bspline::{CellBand, Derivatives, HierarchicalSpline, Spline};
use zeroset_eikonal_sweep::{self as eikonal_sweep, Lattice};
use zeroset_lsq_init as lsq_init;
use zeroset_watch::{CancelToken, Watch};

use crate::calibration::{calibrated, distance_figures};
use crate::crossings::{Closeness, crossings, gaps, supported_share};
use crate::denoising::denoised;
use crate::domain::Domain;
use crate::error::ReconstructError;
use crate::facing_sheets::facing_share;
use crate::far_off::far_off;
use crate::frame::{Frame, finite, not_flat};
use crate::heavy_tails::HeavyTails;
use crate::hole_filling::{Filling, fill_holes};
use crate::isolated::isolated;
use crate::known_normals::Known;
use crate::lattices::Lattices;
use crate::left_out::{kept, mark, without};
use crate::memory::{self, Counts, MemoryReport};
use crate::normals::normals as normals_of;
use crate::one_sided::turning;
use crate::options::{Options, Topology};
use crate::point::{Point, Reconstruct};
use crate::redistancing::Redistancing;
use crate::refinement::{self, Outcome, Refinement};
use crate::report::{DistanceReport, FrameReport, InputReport, REPORT_VERSION, Report, StageFigures, StageReport};
use crate::sides::{SPARSE, SideSearch, Sides};
use crate::sign::{SignReport, synthesize};
use crate::sign_field::{SignField, sign_field};
use crate::spacing::Spacing;
use crate::trust::{self, shape_name};
use crate::volume;

/// What a reconstruction leaves: the function, the points that it belongs to, and the report.
#[derive(Debug, Clone)]
pub struct Reconstruction<const D: usize> {
    /// f in the frame: negative inside, and away from the points the distance from its zero set in the median.
    pub spline: HierarchicalSpline<D>,
    /// How the frame and the data are related.
    pub frame: Frame<D>,
    /// The points in the frame, without repetitions and without those that lie many times farther away than the others reach.
    pub points: Vec<[f64; D]>,
    /// Which of them lie on no part of the surface, and were not fitted.
    pub outliers: Vec<bool>,
    /// How far apart the fitted ones are.
    pub spacing: Spacing,
    /// The box and its lattices.
    pub domain: Domain<D>,
    /// How often the coarse lattice's cells were halved for the final one.
    pub halvings: u32,
    /// f̂, where the points are so noisy that their normals are better taken from it: f* follows detail that their noise
    /// hides, and many points do not lie beside the part of it that they were taken from.
    pub guide: Option<Spline<D>>,
    /// The initial shape, if it was refined.
    pub initial: Option<Spline<D>>,
    /// Whether the zero set is to end where the points do: [`Options::open`].
    pub open: bool,
    /// Everything worth knowing about how it came about.
    pub report: Report,
}

/// Holes are filled up to this noise, in spacings.
const FILLABLE_NOISE: f64 = 0.5;
/// Noise below this share of the spacing is none, if the surface is open,
const CLEAN: f64 = 0.1;
/// and the smoothing length from which refinement starts then is at most so many spacings.
const CLEAN_RATIO: f64 = 0.4;
/// Above this share of points that were left out a warning is given: what strays there are among points of one surface are fewer, and more
/// are often a part of it that is far sparser than the rest.
const MOST_LEFT_OUT: f64 = 0.04;
/// Above this score, without what noise adds, few points are searched again with those that lie on no surface with others.
const UNCONVINCING: f64 = 0.2;
/// Where more than this share of the points face another sheet within a cell of the dense lattice, some of them have no node between them, and
/// their sides are lost: then its cells are halved once more, which in space takes eight times the nodes.
const MOST_FACING: f64 = 0.001;
/// But not if a cell is no wider than so many spacings: then the points do not tell the sheets apart either.
const TOLD_APART: f64 = 2.5;
/// Below this share of its mean the gradient of f̂ does not tell which way a sheet faces.
const TELLING: f64 = 0.3;
/// Below this share of zero-set edges with data nearby, a warning is given.
const SUPPORT_EXPECTED: f64 = 0.7;
/// An open surface whose sides meet at more of its points is not to be trusted.
const ONE_SIDED: f64 = 0.02;

/// Reconstructs a closed curve (`D` = 2) or surface (`D` = 3) from points on it, `N × D` in any unit, as the zero set of
/// a B-spline that is negative inside. With [`Options::open`] the zero set is cut where the points end when it is extracted.
///
/// # Errors
/// Points that have no shape, options out of range, or a stage that could not go on; the message names it.
pub fn reconstruct<const D: usize>(
    points: &[[f64; D]],
    options: &Options,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    reconstruct_watched(points, options, &Watch::default())
}

/// As [`reconstruct`], for somebody who watches: `watch.progress` is told when a stage begins and ends, by the stage's name in the
/// report, and `watch.cancel` ends the work, within an iteration in the long stages (topology and refinement), otherwise when the
/// stage is done.
///
/// ```
/// use zeroset::{CancelToken, Options, Watch, reconstruct_watched};
/// let cancel = CancelToken::new();
/// cancel.cancel(); // usually from another thread
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0], [0.5, 1.0]];
/// let error = reconstruct_watched(&square, &Options::default(), &Watch { cancel, ..Watch::default() }).unwrap_err();
/// assert!(error.is_cancelled());
/// ```
///
/// # Errors
/// As [`reconstruct`], and [`ReconstructError::is_cancelled`] errors.
pub fn reconstruct_watched<const D: usize>(
    points: &[[f64; D]],
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    Reconstruct::reconstruct(points, None, options, watch)
}

/// As [`reconstruct_watched`], for points that have normals, `N × D` of any length, zero where one is not known; what they are
/// used for [`Options::normals`] says.
///
/// # Errors
/// As [`reconstruct_watched`], not one normal per point, or one that is not finite.
pub fn reconstruct_with_normals<const D: usize>(
    points: &[[f64; D]],
    normals: &[[f64; D]],
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError>
where
    [f64; D]: Point<D>,
{
    Reconstruct::reconstruct(points, Some(normals), options, watch)
}

/// See [`reconstruct_watched`].
pub(crate) fn road<const D: usize>(
    points: &[[f64; D]],
    normals: Option<&[[f64; D]]>,
    options: &Options,
    watch: &Watch,
) -> Result<Reconstruction<D>, ReconstructError> {
    options.check()?;
    finite(points)?;
    let known = normals.map(|normals| Known::new(points, normals)).transpose()?;
    let far = far_off(points);
    let near = far.as_ref().map(|far| kept(points, far));
    let near = near.as_deref().unwrap_or(points);
    let (frame, distinct) = Frame::of(near)?;
    let spacing = Spacing::of(&distinct);
    let beginning = Beginning {
        points: points.len(),
        distinct: &distinct,
        frame: &frame,
        margin: options.margin_in_frame(frame.scale)?,
        known,
        options,
        cancel: &watch.cancel,
    };
    let (mut outliers, heard, spacing) = isolated(&distinct, spacing);
    if heard.len() < distinct.len() {
        // The frame has seen that all of them are not.
        not_flat(&heard)?;
    }
    let ground = beginning.ground(&heard, &spacing)?;
    let mut road = Road { stages: Vec::new(), watch };

    let name = if options.topology == Topology::Paper { "topology" } else { "ladder" };
    let (ground, sides) = road.stage(name, || beginning.sides(ground, heard, spacing))?;
    let Ground { lattices: Lattices { domain, halvings, levels }, band, mut memory } = ground;
    let Sides { f_hat, calibration, ratio, noise, agreed, strays, points: heard, spacing, few, .. } = sides;
    if strays.len() == distinct.len() {
        // All were heard in the end.
        outliers.fill(false);
    }
    mark(&mut outliers, &strays);
    let (few, few_spacing) = few.as_ref().map_or((&heard, &spacing), |(few, spacing)| (few, spacing));

    let (band, halvings) = match band {
        Some(band) if refinement::is_deep(noise, &spacing) => {
            let wide = refinement::band(&heard, &spacing, &domain, halvings, levels, true)?;
            match beginning.counts(&spacing, &domain, halvings, Some(&wide)).within(memory.limit) {
                Ok(need) if need.levels == memory.levels => {
                    memory = need;
                    (Some(wide.shallower(memory.levels)), halvings)
                }
                _ => (Some(band), halvings),
            }
        }
        Some(band) if levels != Some(0) && is_narrow(&f_hat, few, &spacing, domain.spacing(halvings)) => {
            let levels = levels.map(|levels| levels - 1);
            let fine = refinement::band(&heard, &spacing, &domain, halvings + 1, levels, false)?;
            match beginning.counts(&spacing, &domain, halvings + 1, Some(&fine)).within(memory.limit) {
                Ok(need) if need.levels + 1 >= memory.levels => {
                    memory = need;
                    (Some(fine.shallower(memory.levels)), halvings + 1)
                }
                _ => (Some(band), halvings),
            }
        }
        band => (band, halvings),
    };
    let cell = domain.spacing(halvings);
    let nodes = domain.nodes(halvings);
    // The referee knows closed surfaces only and may take an open one for noisy: its choice of a long smoothing length is then
    // heard only if neighbouring points differ as noisy ones do.
    let misjudged = options.open && noise < CLEAN * spacing.typical;
    let smoothed = ratio * spacing.typical;
    let ratio = if misjudged { ratio.min(CLEAN_RATIO) } else { ratio };
    let smooth = if misjudged { None } else { denoised(&f_hat, &heard, spacing.typical) };
    let sites = smooth.as_ref().unwrap_or(&heard);
    let noisy = smooth.is_some();
    let mut distance = road.stage("distance", || unsigned_distance(sites, &domain, halvings, options))?;

    // Data support the zero set where they lie within a cell and a spacing of both ends of a lattice edge.
    let reach = |spacing: f64| 1.5 * cell.max(spacing) + cell;
    let mut no_room = false;
    let (phi, off) = road.stage("sign", || {
        let mut field = match agreed {
            true => SignField::of(&f_hat, &domain, halvings),
            false => sign_field(&f_hat, few, few_spacing, &domain, halvings, &distance, calibration)?,
        };
        let (mut phi, mut report) = synthesize(&field, &distance, reach(spacing.typical));
        let mut places = crossings(&field.value, &phi, &nodes);
        let closeness = Closeness { points: &heard, local: &spacing.local, detail: cell.max(smoothed), noise };
        let off = closeness.off_the_surface(&places);
        let sites = kept(sites, &off);
        // What is left open needs no filling, and where noise is deep what is far from all points may well be f̂'s mistake.
        if !options.open && noise < FILLABLE_NOISE * spacing.typical {
            let (guide, lattice) = ((&f_hat, ratio), (&domain, halvings));
            match fill_holes(&mut field, &places, &sites, guide, lattice, &memory)? {
                Filling::Filled(nodes_filled) => {
                    let (filled, found) = synthesize(&field, &distance, reach(spacing.typical));
                    let crossed = crossings(&field.value, &filled, &nodes);
                    // Unless little is left of a shape that was all hole.
                    if closeness.is_kept(&crossed, &places) {
                        (phi, report, places) = (filled, SignReport { nodes_filled, ..found }, crossed);
                    }
                }
                Filling::NoRoom => no_room = true,
                Filling::NoHoles => {}
            }
        }
        // Between sparse points it runs where points are, too.
        let local = LazyCell::new(|| spacing.smoothed(&heard));
        report.supported = supported_share(&places, &heard, reach(spacing.typical), |i| reach(local[i]));
        let gaps = gaps(&places, &sites, cell.max(spacing.typical));
        if !gaps.is_empty() || sites.len() < heard.len() {
            (distance, _) = unsigned_distance(&[sites, gaps].concat(), &domain, halvings, options)?;
            phi.zip_mut_with(&distance, |phi, d| *phi = d.copysign(*phi));
        }
        Ok(((phi, off), StageFigures::Sign(report)))
    })?;
    let (mut fitted, mut fitted_spacing) = without(&heard, &off, spacing.clone());
    mark(&mut outliers, &off);

    let knots = domain.knots(options.degree, halvings)?;
    let initial = road.stage("initial-shape", || {
        let fairness = lsq_init::Fairness::Length(0.5 * cell);
        let settings = lsq_init::Options { fairness, ..lsq_init::Options::default() };
        let (spline, report) = lsq_init::fit(phi.view(), &nodes, &knots, &settings)?;
        Ok((spline, StageFigures::InitialShape(report)))
    })?;

    let (spline, initial, heavy_tails) = if options.refine {
        let settings = Refinement {
            points: &fitted,
            spacing: &fitted_spacing,
            f_hat: &f_hat,
            noise,
            ratio,
            domain: &domain,
            halvings,
            band: band.as_ref(),
            distance: &distance,
            smoothing: options.smoothing.map(|length| length * frame.scale),
            loss_length: options.loss_length.map(|length| length * frame.scale),
            cancel: &watch.cancel,
        };
        let (spline, stray, heavy_tails) =
            road.stage(if band.is_some() { "refinement" } else { "dense-refinement" }, || {
                let Outcome { function: (spline, figures), stray, heavy_tails } = settings.run(&initial)?;
                Ok(((spline, stray, heavy_tails), figures))
            })?;
        (fitted, fitted_spacing) = without(&fitted, &stray, fitted_spacing);
        mark(&mut outliers, &stray);
        (spline, Some(initial), heavy_tails)
    } else {
        (HierarchicalSpline::new(initial)?, None, None)
    };

    let mut spline = calibrated(spline, &domain, halvings, &distance, fitted_spacing.typical)?;

    let coarse = domain.knots(options.degree, 0)?;
    let trust = trust::judge(
        &spline,
        (&fitted, &fitted_spacing),
        (few, few_spacing),
        (noise, heavy_tails.is_some()),
        &coarse,
        &frame,
    )?;
    // What hangs on little is seen where f hardly leaves zero: afterwards it is as far from it as a distance would be.
    if let Some(band) = &band {
        let settings = Redistancing {
            points: &fitted,
            spacing: &fitted_spacing,
            noise,
            domain: &domain,
            halvings,
            band,
            distance: &distance,
            cancel: &watch.cancel,
        };
        spline = road.stage("redistancing", || settings.run(spline))?;
    }
    let distance = distance_figures(&spline, &domain, halvings, &distance, (few, fitted_spacing.typical));
    let (warning, mut doubt) = trust::verdict::<D>(&trust, options.open, agreed);
    let mut of_volume = None;
    if doubt.is_none() {
        (of_volume, doubt) = volume::verdict(&fitted, options.smoothing.is_some());
    }
    if doubt.is_none() && options.open {
        let gradients = spline.evaluate(&fitted, Derivatives::Gradient).gradients;
        let share = turning(&fitted, &gradients, &fitted_spacing.local);
        if share > ONE_SIDED {
            doubt = Some(format!(
                "no trustworthy open {} was found: at {:.1} % of the points its two sides meet; it may have one side only, as \
                 a Möbius band, or walls closer than its points: try a denser scan, or parts of it",
                shape_name(D),
                100.0 * share
            ));
        }
    }
    let mut warnings = warnings(&road.stages, options.open);
    warnings.extend(warning.into_iter().chain(of_volume));
    warnings.extend(memory.warning(cell));
    if no_room {
        warnings.push(
            "holes of the data are closed more flatly than what is around them: there is too little memory for the fit that \
             follows its curvature; allow more (--memory)"
                .into(),
        );
    }
    let left_out = distinct.len() - fitted.len();
    if left_out as f64 > MOST_LEFT_OUT * distinct.len() as f64 {
        warnings.push(format!(
            "{:.1} % of the points were left out, for they lie on no {} with others: if they belong to the shape (--oriented names \
             them), it is sampled too sparsely there",
            100.0 * left_out as f64 / distinct.len() as f64,
            shape_name(D)
        ));
    }
    if near.len() < points.len() {
        warnings.push(format!(
            "{} of the points lie many times farther away than the others reach: they were left out",
            points.len() - near.len()
        ));
    }
    let report = Report {
        version: REPORT_VERSION,
        input: InputReport {
            dimension: D,
            points: points.len(),
            repeated: near.len() - distinct.len(),
            outliers: left_out + points.len() - near.len(),
            spacing: spacing.typical / frame.scale,
            noise: noise / frame.scale,
            heavy_tails: heavy_tails.map(|found| HeavyTails { loss_length: found.loss_length / frame.scale, ..found }),
        },
        frame: FrameReport {
            origin: frame.origin.to_vec(),
            scale: frame.scale,
            coarse_cells: domain.cells(0).to_vec(),
            cells: domain.cells(halvings).to_vec(),
            cell: cell / frame.scale,
        },
        memory,
        stages: road.stages,
        trust,
        distance,
        warnings,
        doubt,
    };
    let guide = noisy.then_some(f_hat);
    Ok(Reconstruction {
        spline,
        frame,
        points: distinct,
        outliers,
        spacing: fitted_spacing,
        domain,
        halvings,
        guide,
        initial,
        open: options.open,
        report,
    })
}

/// What the road begins with.
struct Beginning<'a, const D: usize> {
    /// How many points came.
    points: usize,
    distinct: &'a [[f64; D]],
    frame: &'a Frame<D>,
    /// In the frame.
    margin: f64,
    known: Option<Known<'a, D>>,
    options: &'a Options,
    cancel: &'a CancelToken,
}

/// The lattices that points ask for.
struct Ground<const D: usize> {
    lattices: Lattices<D>,
    /// As far as memory reaches.
    band: Option<CellBand<D>>,
    memory: MemoryReport,
}

impl<const D: usize> Beginning<'_, D> {
    fn counts(&self, spacing: &Spacing, domain: &Domain<D>, halvings: u32, band: Option<&CellBand<D>>) -> Counts {
        Counts::of(self.points, spacing, domain, halvings, self.options, band)
    }

    fn ground(&self, heard: &[[f64; D]], spacing: &Spacing) -> Result<Ground<D>, ReconstructError> {
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
    /// surface with others, these may well be a sparse part of it, and all are heard if that gives better ones, or unit normals that agree.
    fn sides(
        &self,
        ground: Ground<D>,
        heard: Vec<[f64; D]>,
        spacing: Spacing,
    ) -> Result<((Ground<D>, Sides<D>), StageFigures), ReconstructError> {
        let is_all = heard.len() == self.distinct.len();
        let (sides, figures) = self.sides_on(&ground, heard, spacing, f64::INFINITY)?;
        if D == 2 || is_all || self.distinct.len() > SPARSE || self.options.open || sides.score <= UNCONVINCING {
            return Ok(((ground, sides), figures));
        }
        let of_all = || -> Result<_, ReconstructError> {
            let spacing = Spacing::of(self.distinct);
            let ground = self.ground(self.distinct, &spacing)?;
            Ok((self.sides_on(&ground, self.distinct.to_vec(), spacing, sides.score)?, ground))
        };
        let is_better = |other: &Sides<D>| {
            other.agreed || other.score <= UNCONVINCING || (!sides.agreed && other.score < sides.score)
        };
        match of_all() {
            Ok(((other, figures), all)) if is_better(&other) => Ok(((all, other), figures)),
            Err(error) if error.is_cancelled() => Err(error),
            _ => Ok(((ground, sides), figures)),
        }
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
            memory: &ground.memory,
            to_beat,
            cancel: self.cancel,
        };
        let left_out = self.distinct.len() - heard.len();
        search.run(heard, spacing, left_out)
    }
}

impl<const D: usize> Reconstruction<D> {
    /// The points that were fitted, in the frame.
    pub fn fitted(&self) -> Vec<[f64; D]> {
        kept(&self.points, &self.outliers)
    }

    /// The function in the data's unit of length, on knots relative to the returned origin: `f(x) = spline(x − origin)`.
    ///
    /// # Errors
    /// If the data's unit is so small or large that the knots cannot be told apart in it.
    pub fn in_data_units(&self) -> Result<([f64; D], HierarchicalSpline<D>), ReconstructError> {
        Ok((self.frame.origin, self.spline.mapped(1.0 / self.frame.scale, [0.0; D])?))
    }
}

/// Collects the stages' reports.
struct Road<'a> {
    stages: Vec<StageReport>,
    watch: &'a Watch<'a>,
}

impl Road<'_> {
    /// Runs a stage, which has the name of its figures.
    fn stage<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> Result<(T, StageFigures), ReconstructError>,
    ) -> Result<T, ReconstructError> {
        let start = Instant::now();
        let (result, figures) = self.watch.stage(name, work)??;
        debug_assert_eq!(name, figures.name());
        self.stages.push(StageReport { seconds: start.elapsed().as_secs_f64(), figures });
        Ok(result)
    }
}

/// Whether gaps or walls that the points tell apart are narrower than a `cell` of the dense lattice; f̂ was fitted to these few of them.
fn is_narrow<const D: usize>(f_hat: &Spline<D>, few: &[[f64; D]], spacing: &Spacing, cell: f64) -> bool {
    D == 3
        && cell > TOLD_APART * spacing.typical
        && facing_share(few, &normals_of(f_hat, few, TELLING), cell) > MOST_FACING
}

fn unsigned_distance<const D: usize>(
    points: &[[f64; D]],
    domain: &Domain<D>,
    halvings: u32,
    options: &Options,
) -> Result<(ndarray::ArrayD<f64>, StageFigures), ReconstructError> {
    let shape = domain.cells(halvings).map(|cells| cells + 1);
    let lattice = Lattice::new(domain.lower, domain.spacing(halvings), shape)?;
    let settings = eikonal_sweep::Options { method: options.distance, ..eikonal_sweep::Options::default() };
    let distance = eikonal_sweep::distance(points, &lattice, &settings)?;
    let report = DistanceReport {
        nodes: shape.to_vec(),
        sweeps: distance.report.sweeps,
        last_change: distance.report.last_change,
    };
    Ok((distance.values, StageFigures::Distance(report)))
}

/// That a surface is open is no news where an `open` one is wanted.
fn warnings(stages: &[StageReport], open: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    for stage in stages {
        match &stage.figures {
            StageFigures::Topology(report) if report.continuation.stages.iter().any(|stage| !stage.settled) => {
                warnings.push(
                    "the orientation of the points did not settle: some may be on the wrong side; try another \
                     --resolution"
                        .into(),
                );
            }
            StageFigures::Sign(report) if report.supported < SUPPORT_EXPECTED && !open => {
                warnings.push(format!(
                    "only {:.0} % of the surface runs where points are: the data have large holes, or the shape is open \
                     (--open)",
                    100.0 * report.supported
                ));
            }
            StageFigures::Sign(report) if report.nodes_clipped > 0 && !open => {
                warnings.push(format!(
                    "{} lattice nodes on the faces of the box were inside and were cut off: the shape may be open (--open)",
                    report.nodes_clipped
                ));
            }
            _ => {}
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use zeroset_watch::{CancelToken, Progress};

    use super::*;

    #[test]
    fn every_stage_is_told_of_and_can_be_called_off() {
        let points: Vec<[f64; 2]> = (0..120)
            .map(|i| (f64::from(i) / 120.0 * std::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [3.0 * c, 2.0 * s])
            .collect();
        for options in [Options::default(), Options { degree: 2, topology: Topology::Paper, ..Options::default() }] {
            let (begun, done) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
            let note = |progress| match progress {
                Progress::Started { stage } => begun.borrow_mut().push(stage),
                Progress::Finished { stage, .. } => done.borrow_mut().push(stage),
                _ => {}
            };
            let watch = Watch { progress: Some(&note), ..Watch::default() };
            let result = reconstruct_watched(&points, &options, &watch).unwrap();
            let stages: Vec<&str> = result.report.stages.iter().map(|stage| stage.figures.name()).collect();
            assert_eq!((&*begun.borrow(), &*done.borrow()), (&stages, &stages));
            for called_off in stages {
                let (cancel, done) = (CancelToken::new(), RefCell::new(Vec::new()));
                let note = |progress| match progress {
                    Progress::Started { stage } if stage == called_off => cancel.cancel(),
                    Progress::Finished { stage, .. } => done.borrow_mut().push(stage),
                    _ => {}
                };
                let watch = Watch { cancel: cancel.clone(), progress: Some(&note) };
                let error = reconstruct_watched(&points, &options, &watch).unwrap_err();
                assert!(error.is_cancelled() && !done.borrow().contains(&called_off), "{called_off}: {error}");
            }
        }
    }
}
