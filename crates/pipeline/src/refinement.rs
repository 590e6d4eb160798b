//! Settings of the dynamic reconstruction: cells and smoothing length from the sampling and its noise.

use std::ops::ControlFlow;

use ndarray::ArrayD;
use tracing::debug;
use zeroset_bspline::{CellBand, Derivatives, HierarchicalSpline, Implicit, Spline, levels_for_spacing};
use zeroset_trust_region as trust_region;
use zeroset_watch::CancelToken;

use crate::error::ReconstructError;
use crate::lattice::domain::Domain;
use crate::points::heavy_tails::{HeavyTails, Noise};
use crate::points::spacing::{NOISY, SECOND_ORDER, Spacing};
use crate::report::StageFigures;
use crate::sides::normals::normals;
use crate::topology::strays::{Stray, strays, strays_alone};
use crate::topology::topology_changes::{TopologyChange, topology_changes};

pub(crate) mod anchor;
pub(crate) mod mistakes;
pub(crate) mod ramp;
pub(crate) mod twicing;

/// Cells on the finest level, in spacings of the points there. (Finer ones bring less than they cost; with three quarters Chamfer
/// distances of clean data were 3 to 5 % larger.)
const FINEST_CELL: f64 = 0.6;
/// Of a surface with more points than these, cells grow with the root of their number,
const MANY: f64 = 40_000.0;
/// up to so many times that: at twice the size time and memory are halved, and the distance from the surface, which is far below
/// the spacing by then, grows by a third or so.
const COARSENED: f64 = 2.0;
/// Levels above the dense lattice at most.
const MOST_LEVELS: u8 = 6;
/// Cells on each side of those that hold points which a level reaches.
const BAND: usize = 3;
/// On the dense lattice at least so many spacings, that the surface between points is fitted too; but no more cells than
/// a band can have.
const NEAR: f64 = 2.5;
const WIDEST: usize = 7;
/// Steps of conjugate gradients for a Gauss–Newton step, where cells are as large as spacings.
const CG_STEPS: f64 = 12.0;
/// With more noise than this share of the spacing f̂ and the initial shape are far enough from the surface that refinement has to move
/// them over many cells at once, of which conjugate gradients learn cell by cell: on the dense lattice they make so many steps then, where
/// cells are as large as spacings.
const DEEP: f64 = 0.2;
const CG_STEPS_DEEP: f64 = 30.0;
/// And above this share the noise, rather than detail, decides how smooth a fit is to be: what a fit follows of it is allowed for.
const DECIDES: f64 = 0.4;
/// It is estimated two percent too large then, with detail that it hides: distances are to be this share of it, unless that changes the
/// topology.
const LEFT: f64 = 0.98;
/// And ℓ is at least so many spacings for noise of one, growing with this power of the noise: Sampson distances hardly tell what is below
/// the best length, and that grows slowly.
const SMALLEST: f64 = 1.05;
const SMALLEST_POWER: f64 = 0.4;
/// Of many points it is no more than so many times that either: the more there are, the less distances tell of what a longer one loses.
const LARGEST: f64 = 1.4;
/// Held-out points do not end the refinement of clean points with a smoothing length above this, in spacings: where f̂ is far from
/// them, around tubes of a few spacings, their error rises first.
const PATIENT_ABOVE: f64 = 0.5;
/// Held-out points this close, in spacings, leave nothing to see: of a perfectly smooth shape finer levels would go on forever.
const CLOSE_ENOUGH: f64 = 1e-4;
/// Where the gradient of f̂ is below this share of its mean, it does not tell the side.
const TELLING: f64 = 0.3;
/// The first smoothing length, in that of the ladder's choice, and at least so many standard deviations of the noise.
const FIRST_LENGTH: f64 = 2.0;
const FIRST_LENGTH_NOISE: f64 = 3.0;
/// Of points in lines those in cubes of so many spacings are held out together: one alone is told by the others of its line, whatever lies
/// between the lines.
const HELD_OUT_SIDE: f64 = 1.0;
/// The smoothing length may fall to so many spacings,
const SMALLEST_LENGTH: f64 = 0.05;
/// and for points in lines to so many: those that are held out in a line still tell too little of what is between.
const SMALLEST_LENGTH_IN_LINES: f64 = 0.2;
/// Of fewer points, the held-out ones are a small sample, and f̂ is rough between them; and since nothing holds their topology, noisy ones are
/// not to move the initial shape far.
const FEW: usize = 3000;
/// The refinement is done so often again with what it has changed held, of noisy points more often, for what is held in one place lets the
/// next one go,
const ROUNDS: u32 = 3;
const ROUNDS_NOISY: u32 = 6;
/// at this share of the initial shape's values there,
const HELD: f64 = 0.6;
const HELD_NOISY: f64 = 1.0;
/// unless what points do not tell of, and is not deep, is at more places than this share of them: then these are too sparse for their
/// shape everywhere, and holding f there would cost more accuracy and time than it brings;
const MOST_HELD: f64 = 0.01;
/// but noise alone changes the topology at many places, of which the initial shape knows better: there it may be this share.
const MOST_HELD_NOISY: f64 = 0.3;
/// Where noise has heavy tails points are weighted again so often, and fitted: the second time those that are far off have not pulled.
const REWEIGHTED: usize = 2;
/// Points with less than this weight are counted.
const HALF: f64 = 0.5;
/// No more points than this share are dropped because the function has come to nothing around them,
const MOST_STRAYS: f64 = 0.02;
/// and changes are looked for so many spacings or cells, whatever is larger, around the points.
const CHANGES: f64 = 2.0;

/// What refinement depends on; frame units.
#[derive(Debug, Clone, Copy)]
pub struct Refinement<'a, const D: usize> {
    pub points: &'a [[f64; D]],
    pub spacing: &'a Spacing,
    pub f_hat: &'a Spline<D>,
    /// Standard deviation of the points' distances from their surface.
    pub noise: f64,
    /// The smoothing length of f̂ in spacings.
    pub ratio: f64,
    pub domain: &'a Domain<D>,
    /// From the coarsest lattice to that of the initial shape.
    pub halvings: u32,
    /// The levels above that lattice; without them degree is not 3, and refinement is on one lattice.
    pub band: Option<&'a CellBand<D>>,
    /// d on the nodes of the initial shape's lattice.
    pub distance: &'a ArrayD<f64>,
    /// The smoothing length that is wanted, if not what the data suggest.
    pub smoothing: Option<f64>,
    /// The loss length that is wanted, if not what the noise suggests.
    pub loss_length: Option<f64>,
    /// Ends the refinement early.
    pub cancel: &'a CancelToken,
}

/// A level that fewer points than this share want is not made: where points are random some are closer together than the rest by chance.
const WORTHWHILE: f64 = 0.05;
/// But for so many that want it by half a level more, which chance does not do: a small part that is scanned more closely.
const SURE: usize = 24;

/// The finest level that enough points want, given the sides of cells that they ask for.
fn worthwhile(cell: f64, sides: &[f64], finest: u8) -> u8 {
    let wanted = |larger: f64, count: usize| {
        let sides: Vec<f64> = sides.iter().map(|side| larger * side).collect();
        let mut levels = levels_for_spacing(cell, &sides, finest);
        levels.sort_unstable_by(|a, b| b.cmp(a));
        levels.get(count).copied().unwrap_or(0)
    };
    wanted(1.0, (WORTHWHILE * sides.len() as f64) as usize).max(wanted(std::f64::consts::SQRT_2, SURE))
}

/// Cells on the finest level, in spacings: what they cost grows with their number, which in the plane is never large.
fn finest_cell<const D: usize>(points: usize) -> f64 {
    let coarsened = if D == 3 { (points as f64 / MANY).sqrt().clamp(1.0, COARSENED) } else { 1.0 };
    FINEST_CELL * coarsened
}

/// The levels above the dense lattice, finer where the points are denser; `levels` is how many there are at the typical spacing,
/// if that is not for the spacing to say. Where `wide`, for noise that [`is_deep`], the dense lattice is corrected as far from the
/// points as a band can reach: what holds f at its edge holds the surface too, if ℓ is as long as the band is wide.
pub fn band<const D: usize>(
    points: &[[f64; D]],
    spacing: &Spacing,
    domain: &Domain<D>,
    halvings: u32,
    levels: Option<u32>,
    wide: bool,
) -> Result<CellBand<D>, ReconstructError> {
    let cell = domain.spacing(halvings);
    let (finest, share) = match levels {
        Some(levels) => (levels as u8, cell / f64::from(1u32 << levels) / spacing.typical),
        None => (MOST_LEVELS, finest_cell::<D>(points.len())),
    };
    // Smoothed: else levels follow chance where samples are random, and bands get holes.
    let sides: Vec<f64> = spacing.smoothed(points).iter().map(|s| share * s).collect();
    let mut levels = levels_for_spacing(cell, &sides, finest);
    let finest = worthwhile(cell, &sides, finest);
    levels.iter_mut().for_each(|level| *level = (*level).min(finest));
    let near = if wide { WIDEST } else { ((NEAR * spacing.typical / cell).ceil() as usize).clamp(BAND, WIDEST) };
    Ok(CellBand::new(&domain.knots(3, halvings)?, points, &levels, [near, BAND])?)
}

/// Whether there is so much noise that the initial shape is to be moved far, and enough points to hold its topology all the same.
pub fn is_deep(noise: f64, spacing: &Spacing) -> bool {
    noise > DEEP * spacing.typical && spacing.count() >= FEW
}

/// What comes of refinement.
pub struct Outcome<const D: usize> {
    pub function: Function<D>,
    /// Which points were not fitted in the end.
    pub stray: Vec<bool>,
    /// How points far off have lost their weight, in the frame.
    pub heavy_tails: Option<HeavyTails>,
}

/// A refined function with its figures.
pub type Function<const D: usize> = (HierarchicalSpline<D>, StageFigures);
pub type Refined<const D: usize> = Result<Function<D>, ReconstructError>;

impl<const D: usize> Refinement<'_, D> {
    /// Level by level where there is a band, otherwise as the paper does it.
    pub fn run(&self, initial: &Spline<D>) -> Result<Outcome<D>, ReconstructError> {
        let mut stray = vec![false; self.points.len()];
        let Some(band) = self.band else {
            let fit = |areas: &[f64]| self.on_one_lattice(initial, areas);
            let (function, _, heavy_tails) = self.reweighted(self.areas(), fit)?;
            return Ok(Outcome { function, stray, heavy_tails });
        };
        let mut sides = trust_region::Sides::default();
        let few = self.spacing.count() < FEW;
        let left = if self.is_decided_by_noise() && !few { LEFT } else { 1.0 };
        if !few {
            // f̂ knows which wall is which where they are thinner than the cells.
            sides.normals = normals(self.f_hat, self.points, TELLING);
        }
        let fit = |areas: &[f64]| self.on_levels(initial, band, &sides, areas, left * self.noise);
        let (mut refined, mut areas, heavy_tails) = self.reweighted(self.areas(), fit)?;
        let mut known = None;
        if left < 1.0 && !self.cancel.is_cancelled() {
            let found = self.mistakes(initial, &refined.0);
            if found.iter().all(Vec::is_empty) {
                known = Some(found);
            } else {
                refined = self.on_levels(initial, band, &sides, &areas, self.noise)?;
            }
        }
        let most_held = if self.is_noisy() { MOST_HELD_NOISY } else { MOST_HELD };
        let (rounds, share) = if self.is_noisy() { (ROUNDS_NOISY, HELD_NOISY) } else { (ROUNDS, HELD) };
        for round in 0..rounds {
            if self.cancel.is_cancelled() {
                break;
            }
            let [mut changes, others] = known.take().unwrap_or_else(|| self.mistakes(initial, &refined.0));
            changes.extend(self.if_few(most_held, others));
            let dropped = self.if_few(MOST_STRAYS, self.strays(&refined.0, &stray));
            if changes.is_empty() && dropped.is_empty() {
                break;
            }
            debug!(
                places = changes.len(),
                points = dropped.len(),
                "refinement has changed the topology, and is done again with these places held and without these points"
            );
            let held = |at, value, weight| trust_region::Place { at, bound: share * value, weight };
            // What has changed again beside a place that was held is held faster.
            let weight = f64::from(1u32 << round);
            sides.places.extend(changes.into_iter().map(|(at, value)| held(at, value, weight)));
            for Stray { index, places, value } in dropped {
                (stray[index], areas[index]) = (true, 0.0);
                sides.places.extend(places.into_iter().map(|at| held(at, value, 1.0)));
            }
            refined = self.on_levels(initial, band, &sides, &areas, self.noise)?;
        }
        Ok(Outcome { function: self.twiced(refined, &sides, &areas)?, stray, heavy_tails })
    }

    /// A fit of all points with their areas, done again with less weight for those that are far off where their noise has heavy tails
    /// (iteratively reweighted least squares). Also gives what they weigh in the end.
    fn reweighted(
        &self,
        areas: Vec<f64>,
        fit: impl Fn(&[f64]) -> Refined<D>,
    ) -> Result<(Function<D>, Vec<f64>, Option<HeavyTails>), ReconstructError> {
        let mut refined = fit(&areas)?;
        let (mut weighted, mut heavy_tails) = (areas.clone(), None);
        // In the plane noisy points hardly move the initial shape, whatever they weigh.
        let wanted = self.loss_length.is_some() || (D == 3 && self.is_noisy());
        for _ in 0..if wanted { REWEIGHTED } else { 0 } {
            if self.cancel.is_cancelled() {
                break;
            }
            let noise = Noise::around(&refined.0.evaluate(self.points, Derivatives::Gradient), self.points);
            let Some(loss_length) = self.loss_length.or_else(|| noise.loss_length(&areas)) else { break };
            let weights = noise.weights(loss_length);
            let points = weights.iter().filter(|weight| **weight < HALF).count();
            debug!(loss_length, points, "points far off lose their weight");
            heavy_tails = Some(HeavyTails { loss_length, points });
            weighted = areas.iter().zip(&weights).map(|(area, weight)| area * weight).collect();
            refined = fit(&weighted)?;
        }
        Ok((refined, weighted, heavy_tails))
    }

    fn is_noisy(&self) -> bool {
        self.noise > NOISY * self.spacing.typical
    }

    fn is_decided_by_noise(&self) -> bool {
        self.noise > DECIDES * self.spacing.typical
    }

    /// What the points weigh: the area around each, of noisy points averaged over their neighbours, for those that noise has taken
    /// farthest would weigh most.
    fn areas(&self) -> Vec<f64> {
        if self.is_noisy() { self.spacing.smoothed_areas(self.points) } else { self.spacing.areas.clone() }
    }

    /// What was found, or nothing if it is more than a share of the points.
    fn if_few<T>(&self, share: f64, found: Vec<T>) -> Vec<T> {
        if found.len() > (share * self.points.len() as f64) as usize { Vec::new() } else { found }
    }

    /// Points with a speck to themselves that are not `known`; none where the points are noisy, and not fitted closely.
    fn strays(&self, refined: &HierarchicalSpline<D>, known: &[bool]) -> Vec<Stray<D>> {
        if self.is_noisy() {
            return Vec::new();
        }
        let mut found = strays(refined, self.points, &self.spacing.local);
        found.retain(|stray| !known[stray.index]);
        let mut known = known.to_vec();
        found.iter().for_each(|stray| known[stray.index] = true);
        found.extend(strays_alone(refined, self.points, self.spacing, &known));
        found
    }

    /// Where one function near the points has another topology than the one before.
    pub fn topology_changes(&self, before: &impl Implicit<D>, after: &impl Implicit<D>) -> Vec<TopologyChange<D>> {
        // What is looked at is to stay in proportion to the points, however uneven they are: the surface has the area of as many
        // squares of the spacing's root mean square.
        let squares = self.spacing.local.iter().map(|s| s * s).sum::<f64>();
        let spacing = (squares / self.points.len() as f64).sqrt();
        let cell = self.domain.spacing(self.halvings);
        let near = |index: [usize; D]| self.distance[&index[..]] < CHANGES * spacing.max(cell);
        topology_changes(before, after, self.domain, self.halvings, near, spacing)
    }

    /// Level by level. For cubics.
    fn on_levels(
        &self,
        initial: &Spline<D>,
        band: &CellBand<D>,
        sides: &trust_region::Sides<D>,
        areas: &[f64],
        noise: f64,
    ) -> Refined<D> {
        let settings = self.level_options(noise);
        let (spline, report) =
            trust_region::refine_levels(self.points, Some(areas), Some(sides), initial, band, &settings)?;
        Ok((spline, StageFigures::Refinement(report)))
    }

    /// Settings for the levels and for points with so much noise.
    pub fn level_options(&self, noise: f64) -> trust_region::LevelOptions {
        let (spacing, cell) = (self.spacing.typical, self.domain.spacing(self.halvings));
        let (deep, in_lines) = (is_deep(self.noise, self.spacing), self.spacing.lines.is_some());
        let noise = self.is_noisy().then_some(noise);
        let first =
            (FIRST_LENGTH * self.ratio * spacing).max(0.5 * cell).max(FIRST_LENGTH_NOISE * noise.unwrap_or(0.0));
        // The more cells lie between points, the more work it is to bring word from one to the next.
        let cg_steps = |steps: f64| (steps * (spacing / cell).max(1.0)).ceil() as usize;
        let mut settings = trust_region::LevelOptions {
            smoothing_length: first,
            smallest_smoothing_length: if in_lines { SMALLEST_LENGTH_IN_LINES } else { SMALLEST_LENGTH } * spacing,
            third_order: Some(SECOND_ORDER * spacing),
            noise,
            close_enough: CLOSE_ENOUGH * spacing,
            patient_above: if noise.is_some() { f64::INFINITY } else { PATIENT_ABOVE * spacing },
            cg_steps: cg_steps(CG_STEPS),
            first_cg_steps: cg_steps(if deep { CG_STEPS_DEEP } else { CG_STEPS }),
            merge: !self.is_noisy(),
            cancel: self.cancel.clone(),
            density: self.spacing.density,
            holdout_side: if in_lines { HELD_OUT_SIDE * spacing } else { 0.0 },
            ..trust_region::LevelOptions::for_spacing::<D>(spacing)
        };
        if let (Some(noise), true) = (noise, deep) {
            // A point that noise has taken a standard deviation away is to say as much by its slope as by its place.
            (settings.normal_length, settings.unit_slopes) = (noise, true);
        }
        if let (Some(noise), true) = (noise, self.is_decided_by_noise()) {
            settings.degrees_of_freedom = true;
            settings.smallest_smoothing_length = SMALLEST * spacing * (noise / spacing).powf(SMALLEST_POWER);
            if self.spacing.count() >= FEW {
                settings.largest_smoothing_length = LARGEST * settings.smallest_smoothing_length;
            }
        }
        if self.spacing.count() < FEW {
            // So few are held out that their error may turn by chance.
            settings.patience = 5;
        }
        if let Some(length) = self.smoothing {
            settings.smoothing_length = length.max(first);
            settings.smallest_smoothing_length = length;
            (settings.noise, settings.holdout) = (None, 0.0);
        }
        settings
    }

    /// On the lattice of the initial shape, as the paper does it. For any degree.
    fn on_one_lattice(&self, initial: &Spline<D>, areas: &[f64]) -> Refined<D> {
        let (spacing, cell) = (self.spacing.typical, self.domain.spacing(self.halvings));
        let mut settings = trust_region::Options::for_spacing::<D>(spacing);
        // A lattice coarser than the data cannot follow detail below its cells.
        settings.smoothing_length = spacing.max(0.5 * cell);
        settings.smallest_smoothing_length = SMALLEST_LENGTH * settings.smoothing_length;
        // One more step after the held-out error has turned costs as much as all that it could still gain; but of few
        // points so few are held out that their error may turn by chance.
        settings.patience = if self.points.len() < FEW { 3 } else { 1 };
        if let Some(length) = self.smoothing {
            settings.smoothing_length = length.max(settings.smoothing_length);
            settings.smallest_smoothing_length = length;
            settings.holdout = 0.0;
        }
        let degree = initial.knots()[0].degree();
        settings.stiffness = anchor::stiffness(self.domain, self.halvings, degree, self.distance, cell.max(spacing));
        let (spline, report) = trust_region::refine_with(self.points, Some(areas), initial, &settings, &|_| {
            if self.cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        Ok((HierarchicalSpline::new(spline)?, StageFigures::DenseRefinement(report)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sides of cells, so many of each, all between 0.1 and 0.12 to begin with.
    fn sides(more: &[(usize, f64)]) -> Vec<f64> {
        let even = (0..10_000).map(|i| 0.1 + 0.02 * (f64::from(i) * 0.618_033_988_749_895).fract());
        even.chain(more.iter().flat_map(|(count, side)| std::iter::repeat_n(*side, *count))).collect()
    }

    #[test]
    fn small_parts_get_finer_levels_if_they_clearly_want_them() {
        // From cells of 0.4 to 0.1 it is two halvings, to 0.024 four.
        assert_eq!(worthwhile(0.4, &sides(&[]), 6), 2);
        assert_eq!(worthwhile(0.4, &sides(&[(25, 0.024)]), 6), 4);
        assert_eq!(worthwhile(0.4, &sides(&[(25, 0.024)]), 3), 3);
        assert_eq!(worthwhile(0.4, &sides(&[(24, 0.024)]), 6), 2, "too few");
        // By chance some want cells of 0.065, which are nearer to 0.05.
        assert_eq!(worthwhile(0.4, &sides(&[(400, 0.065)]), 6), 2);
        assert_eq!(worthwhile(0.4, &sides(&[(600, 0.065)]), 6), 3, "one point in twenty");
    }
}
