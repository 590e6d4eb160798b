//! Twicing (Tukey 1977): what a smooth fit of noisy points has left is smoothed once more, and added as far as it is more than noise.

use rayon::prelude::*;
use std::sync::Arc;
use zeroset_bspline::{CellBand, Collocation, Derivatives, HierarchicalSpline, IndexSet, KnotVector, Level, Spline};
use zeroset_multigrid::{Truncation, solve_truncated};

use crate::error::Error;
use crate::level_objective::{CHUNK, LevelObjective};
use crate::level_options::{LevelError, LevelOptions};
use crate::level_report::{LevelsReport, Twicing};
use crate::refine_levels::{of_mean_slope_one, weighted};
use crate::sides::Sides;

/// How often. (The first brings most of it, a third one nothing.)
const TIMES: usize = 2;
/// So many times as long is ℓ here, of which twicing gives back more than this takes away.
const LENGTHENED: f64 = 1.1;
/// Movements of so many times the variance of noise may still be noise: means over a few ℓ are uncertain, and noise that passes for
/// shape costs more than shape that passes for noise.
const DOUBT: f64 = 3.0;
/// Means are taken by quadratic B-splines on cells of so many ℓ: over about three ℓ around a place.
const AROUND: f64 = 4.0;
/// But on no more cells than these along an axis.
const MOST_CELLS: f64 = 128.0;
/// So many points are collocated at once, each with half a kilobyte.
const AT_ONCE: usize = 1 << 15;
/// The mean over all points counts as much as this share of a full cell, and alone where there are no points.
const ELSEWHERE: f64 = 1e-3;

/// What twicing adds to a function.
#[derive(Debug, Clone)]
pub struct Increment<const D: usize> {
    active: Arc<IndexSet<D>>,
    /// Where the active functions are largest.
    centres: Vec<[f64; D]>,
    coefficients: Vec<f64>,
    /// The coefficients are for a function so many times as steep.
    slope: f64,
    twicings: Vec<Twicing>,
}

/// What the fit of noisy points has left over, smoothed as the fit itself was and added in proportion to what it is beyond noise: twice,
/// after a step with an ℓ a tenth longer. Smoothing flattens what is curved, and this gives part of that back.
///
/// Takes what [`refine_levels`](crate::refine_levels) was given, with the function and the report that it has returned; the finest level
/// changes, or the dense one's functions near the points if there is no other. Nothing comes of it where noise has not ended the steps.
///
/// # Errors
/// If the numbers of points and areas differ, options or sides are not valid, a point in the level's cells lies outside the box, or the
/// band does not belong to the function's lattice.
pub fn twice<const D: usize>(
    points: &[[f64; D]],
    areas: Option<&[f64]>,
    sides: &Sides<D>,
    (f, report): (&HierarchicalSpline<D>, &LevelsReport),
    band: &CellBand<D>,
    options: &LevelOptions,
) -> Result<Option<Increment<D>>, LevelError> {
    options.check()?;
    sides.check(points.len())?;
    let (Some(noise), Some(length)) = (options.noise, report.noise_length) else { return Ok(None) };
    let areas = crate::refine::mean_one(areas, points.len())?;
    let fitted = weighted(points, &areas, &sides.normals, &|_| true);
    // As steep as it was fitted: the weight of the energy goes by that.
    let f = f.scaled(report.mean_slope)?;
    let dense;
    let (level, most_steps) = match f.levels().last() {
        Some(level) => (level, options.cg_steps),
        None => {
            dense = Level::of_dense(f.root(), Arc::clone(band.near()))?;
            (&dense, options.first_cg_steps)
        }
    };
    let length = LENGTHENED * length;
    let weight = options.weight(length, 1.0);
    let truncation = Truncation { most_steps, tolerance: options.cg_tolerance, radius: f64::INFINITY };
    let objective = LevelObjective::new(level, &fitted, &[], sides, 0.0, options);
    let mut total = objective.coefficients();
    let centres = centres(level);
    let start = objective.at(vec![0.0; centres.len()], &mut total);
    let (operator, right) = objective.model(&start, weight);
    let mut current = objective.at(solve_truncated(&operator, &right, &truncation).x, &mut total);
    let (mut left, mut twicings) = (vec![1.0], vec![]);
    for _ in 0..TIMES {
        if options.cancel.is_cancelled() {
            return Ok(None);
        }
        let (operator, right) = objective.increment_model(&current, weight);
        let step = solve_truncated(&operator, &right, &truncation);
        let plus = |share: &(dyn Fn(usize) -> f64 + Sync)| {
            let both = current.corrections.par_iter().zip(&step.x).enumerate().with_min_len(CHUNK);
            both.map(|(index, (c, x))| c + share(index) * x).collect()
        };
        let all = objective.at(plus(&|_| 1.0), &mut total);
        let moved = objective.moved(&current, &all);
        let noise_rms = noise * options.noise_smoothed::<D>(length, &left).sqrt();
        let shares = moved.shares(level, &centres, options.density, length, noise_rms.powi(2))?;
        let next = plus(&|index| shares[index]);
        current = objective.at(next, &mut total);
        let kept = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
        // L (1 − k S) = (1 − k) L + k L (1 − S).
        left.push(0.0);
        let before = |i: usize| if i > 0 { left[i - 1] } else { 0.0 };
        left = (0..left.len()).map(|i| (1.0 - kept) * left[i] + kept * before(i)).collect();
        let (smoothing_length, moved_rms) = (length, moved.rms());
        twicings.push(Twicing { smoothing_length, cg_steps: step.steps, moved_rms, noise_rms, kept });
    }
    let (active, coefficients) = (Arc::clone(level.active()), current.into_corrections());
    Ok(Some(Increment { active, centres, coefficients, slope: report.mean_slope, twicings }))
}

impl<const D: usize> Increment<D> {
    /// What it is the sum of, beside the first step.
    pub fn twicings(&self) -> &[Twicing] {
        &self.twicings
    }

    /// The function with a share of the increment, which may depend on the place: each active function has that of its centre. The
    /// result is scaled so that `‖∇f‖` averages 1 at the points.
    ///
    /// # Errors
    /// If `f` does not have the levels of the function that the increment was found for, or a coefficient overflows.
    pub fn added_to(
        &self,
        f: &HierarchicalSpline<D>,
        share: impl Fn(&[f64; D]) -> f64 + Sync,
        points: &[[f64; D]],
    ) -> Result<HierarchicalSpline<D>, LevelError> {
        let both = self.coefficients.par_iter().zip(&self.centres).with_min_len(CHUNK);
        let added: Vec<f64> = both.map(|(c, centre)| share(centre) * c / self.slope).collect();
        let spline = match f.levels().last() {
            Some(level) => {
                let corrections = level.corrections().iter().zip(&added).map(|(old, new)| old + new).collect();
                let mut f = f.clone();
                f.correct_finest(corrections)?;
                f
            }
            None => {
                let level = Level::of_dense(f.root(), Arc::clone(&self.active))?;
                HierarchicalSpline::new(level.corrected(f.root(), &added)?)?
            }
        };
        Ok(of_mean_slope_one(&spline, points)?.0)
    }
}

/// By how much an increment has moved the zero set at points.
#[derive(Debug)]
pub(crate) struct Moved<const D: usize> {
    pub(crate) points: Vec<[f64; D]>,
    /// Weights, whose mean over all points is one.
    pub(crate) areas: Vec<f64>,
    pub(crate) distances: Vec<f64>,
}

impl<const D: usize> Moved<D> {
    /// Squares of the distances, with the points' weights.
    fn squares(&self) -> Vec<f64> {
        self.areas.iter().zip(&self.distances).map(|(a, d)| a * d * d).collect()
    }

    /// Root mean square.
    fn rms(&self) -> f64 {
        (self.squares().iter().sum::<f64>() / self.areas.iter().sum::<f64>()).sqrt()
    }

    /// `max(0, 1 − 3 v/T)` at each of the centres, where T is the mean of the squared distances near by and v what it
    /// were if all were noise: `variance` where points have the weight one. (James and Stein 1961, with more doubt.)
    fn shares(
        &self,
        level: &Level<D>,
        centres: &[[f64; D]],
        density: f64,
        length: f64,
        variance: f64,
    ) -> Result<Vec<f64>, LevelError> {
        let (lattice, cell) = around(level, length)?;
        // Where all points have the weight a, so has the variance.
        let noise: Vec<f64> = self.areas.iter().map(|a| a * a * variance).collect();
        let elsewhere = ELSEWHERE * density * cell.powi(D as i32 - 1);
        let near = |sums: Vec<f64>| -> Result<Vec<f64>, LevelError> {
            let sums = Spline::from_flat(lattice.clone(), sums).map_err(Error::from)?;
            Ok(sums.evaluate(centres, Derivatives::Value).values)
        };
        let [noise, squares] = self.summed([&noise, &self.squares()], &lattice, elsewhere)?;
        let kept = |(noise, squares): (f64, f64)| (1.0 - DOUBT * noise / squares.max(f64::MIN_POSITIVE)).max(0.0);
        Ok(near(noise)?.into_par_iter().zip(near(squares)?).with_min_len(CHUNK).map(kept).collect())
    }

    /// What there is of two amounts of the points in the support of each of a lattice's functions, with so many points of the mean
    /// amount beside.
    fn summed(
        &self,
        amounts: [&[f64]; 2],
        lattice: &[KnotVector; D],
        elsewhere: f64,
    ) -> Result<[Vec<f64>; 2], LevelError> {
        let functions = lattice.iter().map(KnotVector::basis_count).product();
        let mut sums = amounts.map(|amounts| {
            let mean = amounts.iter().sum::<f64>() / amounts.len().max(1) as f64;
            vec![elsewhere * mean; functions]
        });
        for start in (0..self.points.len()).step_by(AT_ONCE) {
            let part = start..self.points.len().min(start + AT_ONCE);
            let collocation = Collocation::new(lattice, &self.points[part.clone()]).map_err(Error::from)?;
            for (amounts, sums) in amounts.iter().zip(&mut sums) {
                collocation.add_values_transposed(&amounts[part.clone()], sums);
            }
        }
        Ok(sums)
    }
}

/// The lattice of the functions by which means are taken in a level's box, with its cells' side.
fn around<const D: usize>(level: &Level<D>, length: f64) -> Result<([KnotVector; D], f64), LevelError> {
    let sides = level.knots().each_ref().map(|knots| knots.domain().1 - knots.domain().0);
    let cell = sides.iter().fold(AROUND * length, |cell, side| cell.max(side / MOST_CELLS));
    let mut lattice = level.knots().clone();
    for (knots, side) in lattice.iter_mut().zip(sides) {
        // One cell more: rounding.
        *knots = KnotVector::uniform(2, knots.domain().0, cell, (side / cell) as usize + 1)?;
    }
    Ok((lattice, cell))
}

/// Where the active functions of a level are largest.
fn centres<const D: usize>(level: &Level<D>) -> Vec<[f64; D]> {
    // The middle one of a cubic's five knots.
    let centre = |index: [u32; D]| std::array::from_fn(|axis| level.knots()[axis].knots()[index[axis] as usize + 2]);
    level.active().iter().map(centre).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_what_exceeds_noise_near_by() {
        let knots = KnotVector::uniform(3, 0.0, 0.125, 16).unwrap();
        let root = Spline::from_flat([knots.clone(), knots.clone()], vec![0.0; 19 * 19]).unwrap();
        let all: Vec<[u32; 2]> = (3..16).flat_map(|i| (3..16).map(move |j| [i, j])).collect();
        let level = Level::of_dense(&root, Arc::new(IndexSet::new([19, 19], &all))).unwrap();
        let centres = centres(&level);
        assert_eq!((centres[0], centres[168]), ([0.25, 0.25], [1.75, 1.75]));
        // A thousand points on a line; on its left half they have moved by six standard deviations of noise, on its right by one; those
        // of the left have twice the weight, and so twice the variance.
        let at = |i: usize| (i as f64 + 0.5) / 500.0;
        let moved = Moved {
            points: (0..1000).map(|i| [at(i), 1.0]).collect(),
            areas: (0..1000).map(|i| if i < 500 { 4.0 / 3.0 } else { 2.0 / 3.0 }).collect(),
            distances: (0..1000).map(|i| if i < 500 { 0.6 } else { 0.1 }).collect(),
        };
        let shares = moved.shares(&level, &centres, 500.0, 0.02, 0.01).unwrap();
        let share = |x: f64, y: f64| {
            let near = |c: &[f64; 2]| (c[0] - x).abs() < 1e-9 && (c[1] - y).abs() < 1e-9;
            shares[centres.iter().position(near).unwrap()]
        };
        // 1 − 3 · 0.01 · 4/3 / 0.36, and up to what is far away, a share of 1e-3.
        assert!((share(0.25, 1.0) - 8.0 / 9.0).abs() < 1e-3, "{}", share(0.25, 1.0));
        assert_eq!(share(1.75, 1.0), 0.0);
        // Where there are no points, all count: noise 0.01 (16/9 + 4/9) / 2, squares (0.36 · 4/3 + 0.01 · 2/3) / 2.
        let (noise, squares): (f64, f64) = (0.01 * 10.0 / 9.0, (0.48 + 0.01 / 1.5) / 2.0);
        assert!((share(1.0, 1.75) - (1.0 - 3.0 * noise / squares)).abs() < 1e-9, "{}", share(1.0, 1.75));
        let root_mean_square = squares.sqrt();
        // Rounding of sums of a thousand terms.
        assert!((moved.rms() - root_mean_square).abs() < 1e-12);
    }
}
