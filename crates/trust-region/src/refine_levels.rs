//! The cascade: one band level after the other, each with everything coarser fixed.

use std::sync::Arc;
use std::time::Instant;
use zeroset_bspline::{BlockField, CellBand, DerivativeEnergy, Derivatives, HierarchicalSpline, Spline};
use zeroset_multigrid::{BandSolver, Truncation};

use crate::error::Error;
use crate::holdout::held_out;
use crate::level_objective::{LevelObjective, LevelState, Weighted, squared_distance};
use crate::level_options::{LevelError, LevelOptions};
use crate::level_report::{LevelErrors, LevelStep, LevelSummary, LevelsReport};
use crate::rows::dot;

/// A step is taken when the objective falls by more than this share of the prediction.
const ACCEPT: f64 = 0.1;
/// A step that is not taken is halved so often.
const ATTEMPTS: usize = 6;
/// A score counts as lower when it is lower by this share.
const SIGNIFICANT: f64 = 0.05;

/// Refines a function on the levels of a band, from coarse to fine: on each, `R = Σ aᵢ f(Pᵢ)²/‖∇f(Pᵢ)‖² + w Eng(f)` is
/// lowered over the level's corrections by a few Gauss–Newton steps with falling weight, everything coarser being fixed.
///
/// `points` (`N × D`) must lie in the box of `initial`; `areas` holds one relative weight per point, all equal if absent. The
/// zero set of `initial` must be near the points. Held-out points decide which step of a level is kept, and end the cascade
/// when a level brings nothing. The result is scaled so that `‖∇f‖` averages 1 at the points.
///
/// # Errors
/// If there are no points, lengths or options do not fit, a point lies outside the box or is not finite, the initial
/// function has no gradient at the points, or the band does not belong to its lattice.
pub fn refine_levels<const D: usize>(
    points: &[[f64; D]],
    areas: Option<&[f64]>,
    initial: &Spline<D>,
    band: &CellBand<D>,
    options: &LevelOptions,
) -> Result<(HierarchicalSpline<D>, LevelsReport), LevelError> {
    let start = Instant::now();
    options.check()?;
    let areas = crate::refine::mean_one(areas, points.len())?;
    let held = held_out(points, options.holdout, options.seed);
    let part = |wanted: bool| {
        let chosen: Vec<usize> = (0..points.len()).filter(|i| held[*i] == wanted).collect();
        Weighted {
            points: chosen.iter().map(|i| points[*i]).collect(),
            roots: chosen.iter().map(|i| areas[*i].sqrt()).collect(),
        }
    };
    let (fitted, judge) = (part(false), part(true));

    let size = gradient_size(points, initial)?;
    let mut spline = HierarchicalSpline::new(initial.scaled(1.0 / size).map_err(Error::from)?)?;
    let mut cascade = Cascade {
        options,
        floor: options.gradient_floor,
        share: dot(&fitted.roots, &fitted.roots) / points.len() as f64,
        fitted: &fitted,
        judge: &judge,
        energy: root_energy(&spline, options)?,
        smoothing_length: options.smoothing_length,
    };
    let first = cascade.errors(&spline);
    let (mut levels, mut stopped) = (Vec::new(), false);
    for active in band.active() {
        spline.push_level(Arc::clone(active))?;
        let (corrections, summary) = cascade.refine(&spline, levels.len() + 1);
        if let Some(best) = summary.best_step.map(|step| &summary.steps[step]) {
            spline.correct_finest(corrections)?;
            (cascade.smoothing_length, cascade.energy) = (best.smoothing_length, best.errors.energy);
        } else {
            spline.pop_level();
            stopped = true;
        }
        levels.push(summary);
        if stopped {
            break;
        }
    }

    let at = spline.evaluate(points, Derivatives::Gradient);
    let norms: Vec<f64> = at.gradients.iter().map(|g| dot(g, g).sqrt()).collect();
    let mean = norms.iter().sum::<f64>() / norms.len() as f64;
    let spline = spline.scaled(1.0 / mean)?;
    let report = LevelsReport {
        fitted_points: fitted.points.len(),
        held_out_points: judge.points.len(),
        initial: first,
        result: cascade.errors(&spline),
        levels,
        stopped_by_hold_out: stopped,
        floored: norms.iter().filter(|n| **n < options.gradient_floor).count(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((spline, report))
}

/// Root mean square of `‖∇f‖` at the points.
fn gradient_size<const D: usize>(points: &[[f64; D]], f: &Spline<D>) -> Result<f64, Error> {
    let (lower, upper) = f.domain();
    for (index, point) in points.iter().enumerate() {
        let is_outside = |axis: &usize| !(lower[*axis]..=upper[*axis]).contains(&point[*axis]);
        if let Some(axis) = (0..D).find(is_outside) {
            return Err(zeroset_bspline::CollocationError::Outside { index, axis }.into());
        }
    }
    let gradients = f.evaluate(points, Derivatives::Gradient).gradients;
    let size = (gradients.iter().map(|g| dot(g, g)).sum::<f64>() / points.len() as f64).sqrt();
    let largest = f.as_flat().iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
    let side = (0..D).map(|axis| upper[axis] - lower[axis]).fold(0.0, f64::max);
    // The derivative of a constant is not zero but the rounding of its coefficients.
    if size.is_finite() && size * side > 1e-11 * largest { Ok(size) } else { Err(Error::NoGradient) }
}

fn root_energy<const D: usize>(spline: &HierarchicalSpline<D>, options: &LevelOptions) -> Result<f64, LevelError> {
    let (root, mut sum) = (spline.root(), 0.0);
    for (order, weight) in options.fairness().weights.into_iter().enumerate().filter(|(_, weight)| *weight > 0.0) {
        sum += weight * DerivativeEnergy::new(root.knots(), order)?.energy(root.as_flat());
    }
    Ok(sum)
}

/// What all levels have in common.
struct Cascade<'a, const D: usize> {
    options: &'a LevelOptions,
    /// Gradients count as at least this long; their root mean square was 1 at the beginning.
    floor: f64,
    /// Share of the points that are fitted: their density is that share of ρ.
    share: f64,
    fitted: &'a Weighted<D>,
    judge: &'a Weighted<D>,
    /// Of the function so far.
    energy: f64,
    /// The one that gave the function so far.
    smoothing_length: f64,
}

impl<const D: usize> Cascade<'_, D> {
    fn errors(&self, f: &HierarchicalSpline<D>) -> LevelErrors {
        let rms = |part: &Weighted<D>| {
            let at = f.evaluate(&part.points, Derivatives::Gradient);
            let distances = at.values.iter().zip(&at.gradients).map(|(v, g)| squared_distance(*v, g, self.floor));
            let sum: f64 = distances.zip(&part.roots).map(|(r, a)| a * a * r).sum();
            (sum / dot(&part.roots, &part.roots)).sqrt()
        };
        let held_out_rms = (!self.judge.points.is_empty()).then(|| rms(self.judge));
        LevelErrors { sampson_rms: rms(self.fitted), held_out_rms, energy: self.energy }
    }

    /// Refines the finest level of a spline. Gives the corrections of the best step; none of its steps is the best if the
    /// function without the level was better.
    fn refine(&self, spline: &HierarchicalSpline<D>, number: usize) -> (Vec<f64>, LevelSummary) {
        let start = Instant::now();
        let level = &spline.levels()[number - 1];
        let parts = [self.fitted, self.judge];
        let objective = LevelObjective::new(level, parts, self.options.fairness(), self.energy, self.floor);
        let mut total = objective.coefficients();
        let mut current = objective.at(vec![0.0; level.active().len()], &mut total);
        let initial = objective.errors(&current, &total);
        let (mut best, mut best_step, mut best_errors) = (Vec::new(), None, initial);
        let mut steps: Vec<LevelStep> = Vec::with_capacity(self.options.steps);
        for index in 0..self.options.steps {
            let weight = self.options.weight(self.smoothing_length, index, self.share);
            let step = self.step(&objective, &mut current, &mut total, weight);
            tracing::debug!(level = number, ?step, "Gauss–Newton step");
            if step.accepted && is_better(&step.errors, &best_errors) {
                (best_step, best_errors) = (Some(index), step.errors);
                best.clone_from(&current.corrections);
            }
            steps.push(step);
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
        (best, summary)
    }

    /// One Gauss–Newton step inside a trust region that shrinks until the objective falls.
    fn step(
        &self,
        objective: &LevelObjective<D>,
        current: &mut LevelState<D>,
        total: &mut BlockField<D>,
        (smoothing_length, weight): (f64, f64),
    ) -> LevelStep {
        let before = current.objective(weight);
        let (most_steps, tolerance) = (self.options.cg_steps, self.options.cg_tolerance);
        let mut truncation = Truncation { most_steps, tolerance, radius: f64::INFINITY };
        let (mut gain_ratio, mut accepted, mut cg_steps) = (f64::NAN, false, 0);
        let (operator, right) = objective.model(current, weight);
        let solver = BandSolver::new(&operator);
        for _ in 0..ATTEMPTS {
            let step = solver.solve(&right, &truncation);
            cg_steps += step.steps;
            let moved = current.corrections.iter().zip(&step.x).map(|(c, x)| c + x).collect();
            let trial = objective.at(moved, total);
            // The model is that of R / 2.
            gain_ratio = (before - trial.objective(weight)) / (2.0 * step.predicted_decrease);
            accepted = gain_ratio > ACCEPT;
            if accepted {
                *current = trial;
                break;
            }
            truncation.radius = 0.5 * step.norm;
        }
        if !accepted {
            // `total` is to hold the current function again.
            *current = objective.at(std::mem::take(&mut current.corrections), total);
        }
        let objectives = [before, current.objective(weight)];
        let errors = objective.errors(current, total);
        LevelStep { weight, smoothing_length, gain_ratio, accepted, cg_steps, objective: objectives, errors }
    }
}

/// By the product of held-out error and the root of the energy, as on the dense lattice; without held-out points the later
/// function is the better.
fn is_better(new: &LevelErrors, old: &LevelErrors) -> bool {
    let score = |e: &LevelErrors| e.held_out_rms.map(|rms| rms * e.energy.max(0.0).sqrt());
    match (score(new), score(old)) {
        (Some(new), Some(old)) => new < (1.0 - SIGNIFICANT) * old,
        _ => true,
    }
}
