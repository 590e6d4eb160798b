//! The cascade: one level after the other, each with everything coarser fixed.

use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use zeroset_bspline::{BlockField, CellBand, Derivatives, HierarchicalSpline, Implicit, Level, Spline};
use zeroset_multigrid::{Truncation, solve_truncated};

use crate::iteration::ACCEPT;
use crate::level_objective::{CHUNK, Judge, LevelObjective, LevelState, Weighted, squared_distance};
use crate::level_options::{LevelError, LevelOptions};
use crate::level_report::{LevelErrors, LevelStep, LevelSummary};
use crate::merged::merged;
use crate::rows::dot;
use crate::sides::Sides;

/// A step that is not taken is halved so often.
const ATTEMPTS: usize = 6;
/// A score counts as lower when it is lower by this share.
const SIGNIFICANT: f64 = 0.01;
/// Of two functions that predict the held-out points equally well the smoother one is wanted: their error is multiplied by
/// this power of the energy.
const ENERGY_POWER: f64 = 0.1;
/// Where a finer level follows, ℓ stays above so many cells: what a coarse level does to fit detail that it cannot hold
/// reaches farther than the finer level's band.
const COARSE: f64 = 0.3;
/// Where a finer level follows, points within this share of a cell are taken for one: a few for each function near the surface.
const MERGED: f64 = 0.5;
/// Lengths are the same up to rounding.
const TRIED: f64 = 1.0 + 1e-9;

/// Where a level's best step has led.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    smoothing_length: f64,
    corrections: Vec<f64>,
    /// Of the function up to this level.
    energy: f64,
    /// Points that lie in the level's cells.
    points: usize,
}

/// What decides the steps.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Guidance<'a> {
    /// The points that are held out; without such points all steps are done.
    HeldOut,
    /// What was found before, with some points held out: a level starts there and does one step, unless all points lie in the
    /// next one's cells too, whose corrections belong to this level as it is. There are no more levels.
    Found(&'a [Found]),
}

/// Where all levels have led.
#[derive(Debug)]
pub(crate) struct Refined<const D: usize> {
    pub(crate) spline: HierarchicalSpline<D>,
    /// Of the levels that the spline has, the first being the dense one.
    pub(crate) found: Vec<Found>,
    pub(crate) levels: Vec<LevelSummary>,
}

/// What all levels have in common.
#[derive(Debug)]
pub(crate) struct Cascade<'a, const D: usize> {
    options: &'a LevelOptions,
    /// Share of the points that are fitted: their density is that share of ρ.
    share: f64,
    fitted: &'a Weighted<D>,
    sides: &'a Sides<D>,
    judge: Judge<D>,
    /// Of the function so far.
    energy: f64,
    /// The one that gave the function so far.
    smoothing_length: f64,
    /// Whether the points are fitted as closely as their noise allows.
    at_noise: bool,
    /// Whether the held-out points are as close as is wanted.
    is_close: bool,
}

impl<'a, const D: usize> Cascade<'a, D> {
    /// Before the first step; `points` are all there are, `energy` is that of the dense function.
    pub(crate) fn new(
        options: &'a LevelOptions,
        points: usize,
        fitted: &'a Weighted<D>,
        sides: &'a Sides<D>,
        judge: Judge<D>,
        energy: f64,
    ) -> Self {
        Self {
            options,
            share: dot(&fitted.roots, &fitted.roots) / points as f64,
            fitted,
            sides,
            judge,
            energy,
            smoothing_length: options.smoothing_length,
            at_noise: false,
            is_close: false,
        }
    }

    /// The smoothing length at which noise ended the steps, if it did.
    pub(crate) fn noise_length(&self) -> Option<f64> {
        self.at_noise.then_some(self.smoothing_length)
    }

    /// Errors over all points.
    pub(crate) fn errors(&self, f: &impl Implicit<D>) -> LevelErrors {
        let at = f.evaluate(&self.fitted.points, Derivatives::Gradient);
        let floor = self.options.gradient_floor;
        let distances = at.values.iter().zip(&at.gradients).map(|(v, g)| squared_distance(*v, g, floor));
        let sum: f64 = distances.zip(&self.fitted.roots).map(|(r, a)| a * a * r).sum();
        let at = f.evaluate(self.judge.points(), Derivatives::Gradient);
        let found: Vec<(f64, [f64; D])> = at.values.into_iter().zip(at.gradients).collect();
        LevelErrors {
            sampson_rms: (sum / dot(&self.fitted.roots, &self.fitted.roots)).sqrt(),
            held_out: self.judge.error(0..found.len(), &found),
            energy: self.energy,
        }
    }

    /// Refines the dense function and the levels of the band, until one brings nothing.
    pub(crate) fn run(
        &mut self,
        dense: &Spline<D>,
        band: &CellBand<D>,
        guidance: Guidance,
    ) -> Result<Refined<D>, LevelError> {
        let ends_before = |number: usize| matches!(guidance, Guidance::Found(found) if number >= found.len());
        let start = || HierarchicalSpline::new(dense.clone());
        let mut levels = Vec::new();
        if ends_before(0) {
            return Ok(Refined { spline: start()?, found: vec![], levels });
        }
        let near = Level::of_dense(dense, Arc::clone(band.near()))?;
        let Some(first) = self.advance(&near, 0, band.depth() > 0, guidance, &mut levels) else {
            return Ok(Refined { spline: start()?, found: vec![], levels });
        };
        let mut spline = HierarchicalSpline::new(near.corrected(dense, &first.corrections)?)?;
        let mut found = vec![first];
        for (number, active) in (1..).zip(band.active()) {
            if self.at_noise || self.is_close || ends_before(number) {
                break;
            }
            spline.push_level(Arc::clone(active))?;
            let level = &spline.levels()[number - 1];
            let Some(next) = self.advance(level, number, number < band.depth(), guidance, &mut levels) else {
                spline.pop_level();
                break;
            };
            spline.correct_finest(next.corrections.clone())?;
            found.push(next);
        }
        Ok(Refined { spline, found, levels })
    }

    /// What a level brings, if anything; `finer` tells whether another level can follow.
    fn advance(
        &mut self,
        level: &Level<D>,
        number: usize,
        finer: bool,
        guidance: Guidance,
        levels: &mut Vec<LevelSummary>,
    ) -> Option<Found> {
        let given = match guidance {
            Guidance::HeldOut => None,
            Guidance::Found(found) => {
                let all = self.fitted.points.len() + self.judge.points().len();
                if found.get(number + 1).is_some_and(|next| next.points == all) {
                    self.energy = found[number].energy;
                    return Some(found[number].clone());
                }
                Some(&found[number])
            }
        };
        let (found, summary) = self.refine(level, number, given, finer);
        levels.push(summary);
        found
    }

    /// Refines a level without corrections, by steps with falling smoothing lengths as long as they bring something, or from
    /// corrections that were found before by one step. Gives what the best step has led to, or what was found before if there
    /// is none; nothing if no step is better than the function without the level.
    fn refine(
        &mut self,
        level: &Level<D>,
        number: usize,
        given: Option<&Found>,
        finer: bool,
    ) -> (Option<Found>, LevelSummary) {
        let start = Instant::now();
        // What a level gets wrong for want of points is mended by the next one, or by the step with all points.
        let may_merge = self.options.merge && finer && given.is_none();
        let merged = may_merge.then(|| merged(self.fitted, &level.cell_sides().map(|side| MERGED * side))).flatten();
        let fitted = merged.as_ref().unwrap_or(self.fitted);
        let objective = LevelObjective::new(level, fitted, self.judge.points(), self.sides, self.energy, self.options);
        let (lengths, corrections) = match given {
            Some(found) => (vec![found.smoothing_length], found.corrections.clone()),
            None => (self.lengths(level.cell_side(), number, finer), vec![0.0; level.active().len()]),
        };
        let most_steps = if number == 0 { self.options.first_cg_steps } else { self.options.cg_steps };
        let mut total = objective.coefficients();
        let mut current = objective.at(corrections, &mut total);
        let initial = objective.errors(&current, &total, &self.judge);
        let (mut best, mut best_step, mut best_errors) = (current.corrections.clone(), None, initial);
        let mut steps: Vec<LevelStep> = Vec::with_capacity(lengths.len());
        // That of the noise, as a fit with this smoothing length sees it.
        let deviation = |state: &LevelState<D>, length: f64| {
            self.options.noise.map_or(0.0, |_| objective.spread(state) / self.options.left_of_noise::<D>(length))
        };
        // Of the level before, too.
        let mut last = (number > 0).then(|| (self.smoothing_length, deviation(&current, self.smoothing_length)));
        let mut idle = 0;
        for (index, mut length) in lengths.into_iter().enumerate() {
            let before = self.options.noise.map(|noise| (noise, current.clone()));
            let mut step;
            (current, step) = self.step(&objective, current, &mut total, (length, most_steps));
            if let Some((noise, before)) = before {
                let found = deviation(&current, length);
                let largest = self.options.largest_smoothing_length;
                // The next step would be one below the largest length.
                let within = self.options.after(length, 1) <= largest;
                let close = found <= noise && within;
                self.at_noise = close || length <= self.options.smallest_smoothing_length;
                let previous = last.replace((length, found));
                if let (true, Some(previous)) = (close, previous) {
                    length = at_target(previous, (length, found), noise).min(largest);
                    (current, step) = self.step(&objective, before, &mut total, (length, most_steps));
                }
            }
            if step.accepted && self.judge.has_no_normals() {
                // The first function that is smooth for certain.
                self.judge.take_normals(&objective.judged_gradients(&total, self.judge.points().len()));
                step.errors = objective.errors(&current, &total, &self.judge);
            }
            tracing::debug!(level = number, ?step, "Gauss–Newton step");
            let better = step.accepted && (given.is_some() || is_better(&step.errors, &best_errors));
            if better {
                (best_step, best_errors) = (Some(index), step.errors);
                best.copy_from_slice(&current.corrections);
                (self.smoothing_length, self.energy) = (length, step.errors.energy);
            }
            steps.push(step);
            idle = if better { 0 } else { idle + usize::from(length <= self.options.patient_above) };
            self.is_close = best_errors.held_out.is_some_and(|error| error < self.options.close_enough);
            let sooner = usize::from(!finer && best_step.is_some());
            let patience = (self.options.patience - sooner).max(1);
            if idle >= patience || self.at_noise || self.is_close || self.options.cancel.is_cancelled() {
                break;
            }
        }
        let summary = LevelSummary {
            level: number,
            cell: level.cell_side(),
            active: level.active().len(),
            cells: level.cells().len(),
            points: objective.points(),
            initial,
            steps,
            best_step,
            seconds: start.elapsed().as_secs_f64(),
        };
        if given.is_some() && best_step.is_none() {
            self.energy = initial.energy;
        }
        let whole = |fitted: &Weighted<D>| fitted.points.len() + self.judge.points().len();
        let found = (given.is_some() || best_step.is_some()).then_some(Found {
            smoothing_length: self.smoothing_length,
            corrections: best,
            energy: self.energy,
            // All, if all that stand for them.
            points: if summary.points == whole(fitted) { whole(self.fitted) } else { summary.points },
        });
        (found, summary)
    }

    /// The smoothing lengths of a level's steps, if another one follows not below what its cells can hold. Where that has
    /// ended the level before, its length has been tried.
    fn lengths(&self, cell: f64, number: usize, finer: bool) -> Vec<f64> {
        let tried = number > 0 && self.smoothing_length <= TRIED * COARSE * 2.0 * cell;
        let first = self.options.after(self.smoothing_length, usize::from(tried));
        self.options.lengths(first, if finer { COARSE * cell } else { 0.0 })
    }

    /// One Gauss–Newton step with a smoothing length and so many steps of conjugate gradients at most, inside a trust region that shrinks
    /// until the objective falls. Gives the state that is kept.
    fn step(
        &self,
        objective: &LevelObjective<'_, D>,
        current: LevelState<D>,
        total: &mut BlockField<D>,
        (smoothing_length, most_steps): (f64, usize),
    ) -> (LevelState<D>, LevelStep) {
        let weight = self.options.weight(smoothing_length, self.share);
        let before = current.objective(weight);
        let mut truncation = Truncation { most_steps, tolerance: self.options.cg_tolerance, radius: f64::INFINITY };
        let (mut gain_ratio, mut next, mut cg_steps) = (f64::NAN, None, 0);
        let (operator, right) = objective.model(&current, weight);
        // What else is known of them takes memory, and is worked out again in case that no step is taken.
        let corrections = current.into_corrections();
        for _ in 0..ATTEMPTS {
            let step = solve_truncated(&operator, &right, &truncation);
            cg_steps += step.steps;
            let moved = corrections.par_iter().zip(&step.x).with_min_len(CHUNK).map(|(c, x)| c + x).collect();
            let trial = objective.at(moved, total);
            // The model is that of R / 2.
            gain_ratio = (before - trial.objective(weight)) / (2.0 * step.predicted_decrease);
            if gain_ratio > ACCEPT {
                next = Some(trial);
                break;
            }
            truncation.radius = 0.5 * step.norm;
        }
        let accepted = next.is_some();
        // `total` is to hold the function that is kept.
        let kept = next.unwrap_or_else(|| objective.at(corrections, total));
        let objectives = [before, kept.objective(weight)];
        let errors = objective.errors(&kept, total, &self.judge);
        (kept, LevelStep { weight, smoothing_length, gain_ratio, accepted, cg_steps, objective: objectives, errors })
    }
}

/// By the held-out error, and a little by the energy; without a held-out error the later function is the better.
fn is_better(new: &LevelErrors, old: &LevelErrors) -> bool {
    let score = |e: &LevelErrors| e.held_out.map(|error| error * e.energy.max(0.0).powf(ENERGY_POWER));
    match (score(new), score(old)) {
        (Some(new), Some(old)) => new < (1.0 - SIGNIFICANT) * old,
        _ => true,
    }
}

/// The smoothing length for a given spread, between two lengths with theirs, by a power law; the second if they say nothing.
fn at_target(before: (f64, f64), after: (f64, f64), spread: f64) -> f64 {
    let share = (before.1 / spread).ln() / (before.1 / after.1).ln();
    if (0.0..=1.0).contains(&share) { before.0 * (after.0 / before.0).powf(share) } else { after.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_length_for_a_spread_is_found_by_a_power_law() {
        // Spreads that grow with the square of the length.
        let square = |length: f64| (length, length * length);
        assert!((at_target(square(0.1), square(0.4), 0.04) - 0.2).abs() < 1e-15);
        assert!((at_target(square(0.4), square(0.1), 0.04) - 0.2).abs() < 1e-15);
        // A spread that is not between them, and spreads that do not change, say nothing.
        assert_eq!(at_target(square(0.1), square(0.4), 0.17), 0.4);
        assert_eq!(at_target((0.1, 0.03), (0.4, 0.03), 0.02), 0.4);
        assert_eq!(at_target((0.1, 0.03), (0.4, 0.03), 0.03), 0.4);
    }
}
