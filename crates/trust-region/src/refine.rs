//! The iteration of section 2.3.

use std::ops::ControlFlow;
use std::time::Instant;
use zeroset_bspline::{Collocation, DerivativeEnergy, Spline};

use crate::error::Error;
use crate::holdout::held_out;
use crate::more_sorensen::{MOST_EXACT, more_sorensen};
use crate::objective::{Current, Objective};
use crate::options::{Options, SubProblem};
use crate::preconditioner::{Inverse, Kind};
use crate::quadratic_model::{Complement, QuadraticModel};
use crate::report::{Iteration, Report, StoppingRule, SubProblemEnd};
use crate::sampson::SampsonError;
use crate::steihaug::{Step, Truncation, steihaug};

/// A step is taken when the objective falls by more than this share of the prediction.
const ACCEPT: f64 = 0.1;
/// Below this gain ratio the radius is halved.
const POOR: f64 = 0.25;
/// Above this gain ratio the radius is doubled, if it bounded the step.
const GOOD: f64 = 0.75;
/// Predictions below this share of the objective are rounding.
const ROUNDING: f64 = 1e-13;

/// Lowers `R(f) = Σ aᵢ f(Pᵢ)²/‖∇f(Pᵢ)‖² + w_k Eng(f)` from an initial shape, section 2.3 of the paper.
///
/// `points` (`N × D`) must lie in the box of `initial`; `areas` holds one relative weight per point, all equal if absent.
/// The result lives on the knots of `initial`, keeps its sign, and is scaled so that `‖∇f‖` averages 1 at the points.
///
/// # Errors
/// If there are no points, lengths or options do not fit, a point lies outside the box or is not finite, the degree is
/// below 2, the initial function has no gradient at the points, or the matrices cannot be factored (points on a line or
/// plane).
pub fn refine<const D: usize>(
    points: &[[f64; D]],
    areas: Option<&[f64]>,
    initial: &Spline<D>,
    options: &Options,
) -> Result<(Spline<D>, Report), Error> {
    refine_with(points, areas, initial, options, &|_| ControlFlow::Continue(()))
}

/// As [`refine`], with an observer that sees every iteration and may break off; then the best function so far is
/// returned, with [`StoppingRule::Cancelled`].
///
/// # Errors
/// As [`refine`].
pub fn refine_with<const D: usize>(
    points: &[[f64; D]],
    areas: Option<&[f64]>,
    initial: &Spline<D>,
    options: &Options,
    observer: &dyn Fn(&Iteration) -> ControlFlow<()>,
) -> Result<(Spline<D>, Report), Error> {
    let start = Instant::now();
    options.check()?;
    let areas = mean_one(areas, points.len())?;
    let collocation = Collocation::new(initial.knots(), points)?;
    let energy = DerivativeEnergy::thin_plate(initial.knots())?;
    let unknowns = collocation.coefficient_count();
    if options.sub_problem == SubProblem::Exact && unknowns > MOST_EXACT {
        return Err(Error::TooLargeForExact { found: unknowns, most: MOST_EXACT });
    }

    let held = held_out(points, options.holdout, options.seed);
    let part = |wanted: bool| -> Result<SampsonError<D>, Error> {
        let of = |i: &usize| held[*i] == wanted;
        let positions: Vec<[f64; D]> = (0..points.len()).filter(of).map(|i| points[i]).collect();
        let weights: Vec<f64> = (0..points.len()).filter(of).map(|i| areas[i]).collect();
        let collocation = Collocation::new(initial.knots(), &positions)?;
        Ok(SampsonError::new(collocation, &weights, options.gradient_floor))
    };
    let held_out_points = held.iter().filter(|&&h| h).count();
    let fitted = part(false)?;
    let judge = if held_out_points > 0 { Some(part(true)?) } else { None };
    let share = fitted.total_area() / points.len() as f64;
    let objective = Objective { fitted, held_out: judge, energy, normalisation: options.normalisation };

    let mut run = Run::new(&objective, options, share, initial.as_flat().to_vec())?;
    let stopping_rule = run.iterate(observer)?;
    let best = if stopping_rule == StoppingRule::SampsonErrorReached { &run.current } else { run.best() };
    let best_iteration = if stopping_rule == StoppingRule::SampsonErrorReached {
        run.iterations.iter().rev().find(|i| i.accepted).map(|i| i.iteration)
    } else {
        run.best_iteration()
    };

    // One factor for the end: ‖∇f‖ averages 1 over all points, those held out included.
    let all = SampsonError::new(collocation, &areas, options.gradient_floor).at(&best.f)?;
    let scale = 1.0 / all.mean_gradient();
    let spline = Spline::from_flat(initial.knots().clone(), best.f.iter().map(|c| scale * c).collect())?;
    let report = Report {
        fitted_points: points.len() - held_out_points,
        held_out_points,
        coefficients: unknowns,
        initial: run.initial,
        result: objective.errors(best)?,
        best_iteration,
        floored: all.floored(),
        stopping_rule,
        operator_applications: run.operator_applications,
        factorisations: run.factorisations,
        iterations: run.iterations,
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((spline, report))
}

/// Checks area weights and scales their mean to one.
fn mean_one(areas: Option<&[f64]>, needed: usize) -> Result<Vec<f64>, Error> {
    if needed == 0 {
        return Err(Error::NoPoints);
    }
    let Some(areas) = areas else { return Ok(vec![1.0; needed]) };
    if areas.len() != needed {
        return Err(Error::Areas { found: areas.len(), needed });
    }
    if let Some(index) = areas.iter().position(|a| !(a.is_finite() && *a >= 0.0)) {
        return Err(Error::BadArea(index));
    }
    let mean = areas.iter().sum::<f64>() / needed as f64;
    if !(mean.is_finite() && mean > 0.0) {
        return Err(Error::BadArea(0));
    }
    Ok(areas.iter().map(|a| a / mean).collect())
}

/// The state of the iteration.
struct Run<'a, const D: usize> {
    objective: &'a Objective<D>,
    options: &'a Options,
    /// Share of the points that are fitted: their density is that share of ρ.
    share: f64,
    kind: Kind<D>,
    current: Current<D>,
    initial: crate::report::Errors,
    /// The function with the lowest held-out error, its error, and the iteration that made it.
    held_out_best: Option<(Current<D>, f64, Option<usize>)>,
    /// The lowest held-out error after any step, and accepted steps since.
    since_best: (f64, usize),
    radius: f64,
    first_radius: Option<f64>,
    /// Accepted steps: the k of `w_k`. A rejected step does not lower the weight, since the model was not minimised yet.
    accepted: usize,
    iterations: Vec<Iteration>,
    operator_applications: usize,
    factorisations: usize,
}

impl<'a, const D: usize> Run<'a, D> {
    fn new(objective: &'a Objective<D>, options: &'a Options, share: f64, f: Vec<f64>) -> Result<Self, Error> {
        let current = objective.at(f)?;
        let initial = objective.errors(&current)?;
        Ok(Self {
            objective,
            options,
            share,
            kind: match options.sub_problem {
                SubProblem::Steihaug => Kind::choose(&objective.energy, options),
                SubProblem::Exact => Kind::None,
            },
            held_out_best: initial.held_out_rms.map(|rms| (current.clone(), rms, None)),
            since_best: (f64::INFINITY, 0),
            current,
            initial,
            radius: options.radius.unwrap_or(f64::INFINITY),
            first_radius: options.radius,
            accepted: 0,
            iterations: Vec::new(),
            operator_applications: 0,
            factorisations: 0,
        })
    }

    fn best(&self) -> &Current<D> {
        self.held_out_best.as_ref().map_or(&self.current, |best| &best.0)
    }

    fn best_iteration(&self) -> Option<usize> {
        match &self.held_out_best {
            Some(best) => best.2,
            None => self.iterations.iter().rev().find(|i| i.accepted).map(|i| i.iteration),
        }
    }

    fn iterate(&mut self, observer: &dyn Fn(&Iteration) -> ControlFlow<()>) -> Result<StoppingRule, Error> {
        if self.options.target_error.is_some_and(|target| self.initial.sampson_rms <= target) {
            return Ok(StoppingRule::SampsonErrorReached);
        }
        loop {
            // One model per accepted step; a rejected one is solved again inside a smaller radius.
            let objective = self.objective;
            let weight = self.options.weight(self.accepted, self.share);
            let model = objective.model(&self.current, weight);
            let inverse = self.kind.invert(&model)?;
            self.factorisations += usize::from(matches!(inverse, Inverse::Cholesky(_)));
            let complement = Complement::new(&model.normal, inverse.apply(&model, &model.normal));
            let stopped = loop {
                if self.iterations.len() >= self.options.most_iterations {
                    break Some(StoppingRule::IterationLimit);
                }
                let step = self.solve(&model, &inverse, &complement)?;
                let accepted = self.try_step(&model, weight, &step)?;
                let cancelled = self.iterations.last().is_some_and(|iteration| {
                    tracing::debug!(?iteration, "trust-region iteration");
                    observer(iteration).is_break()
                });
                if let Some(rule) = self.stop(weight, &step) {
                    break Some(rule);
                }
                if cancelled {
                    break Some(StoppingRule::Cancelled);
                }
                if accepted {
                    break None;
                }
                if is_free(&step) && step.predicted_decrease <= ROUNDING * self.current.objective(model.weight) {
                    // At the minimum for this weight: go on to the next.
                    self.accepted += 1;
                    break None;
                }
            };
            self.operator_applications += model.applications();
            if let Some(rule) = stopped {
                return Ok(rule);
            }
        }
    }

    fn solve(&self, model: &QuadraticModel<'_, D>, inverse: &Inverse, complement: &Complement) -> Result<Step, Error> {
        match self.options.sub_problem {
            SubProblem::Exact => more_sorensen(|g| model.apply(g), &model.gradient, &model.normal, self.radius),
            SubProblem::Steihaug => Ok(steihaug(
                |g| model.apply(g),
                |r| inverse.apply(model, r),
                &model.gradient,
                complement,
                &Truncation {
                    radius: self.radius,
                    most_steps: self.options.most_cg_steps,
                    tolerance: self.options.cg_tolerance,
                },
            )),
        }
    }

    /// Judges a step by the true change of the objective, takes it or not, and adapts the radius.
    fn try_step(&mut self, model: &QuadraticModel<'_, D>, weight: f64, step: &Step) -> Result<bool, Error> {
        let objective_before = self.current.objective(model.weight);
        let moved = self.current.f.iter().zip(&step.g).map(|(f, g)| f + g).collect();
        let trial = self.objective.at(moved).ok();
        let objective_after = trial.as_ref().map_or(f64::INFINITY, |t| t.objective(model.weight));
        let decrease = objective_before - objective_after;
        let gain_ratio =
            if step.predicted_decrease > 0.0 { decrease / step.predicted_decrease } else { f64::NEG_INFINITY };
        let radius = self.radius.is_finite().then_some(self.radius);
        if gain_ratio < POOR {
            self.radius = 0.5 * self.radius.min(step.norm);
            self.first_radius.get_or_insert(step.norm);
        } else if gain_ratio > GOOD && !is_free(step) {
            self.radius *= 2.0;
        }
        let accepted = gain_ratio > ACCEPT;
        let mut objective = objective_before;
        if let (true, Some(trial)) = (accepted, trial) {
            self.current = trial;
            self.accepted += 1;
            objective = objective_after;
        }
        let errors = self.objective.errors(&self.current)?;
        self.iterations.push(Iteration {
            iteration: self.iterations.len(),
            weight,
            smoothing_length: (weight / (self.options.density * self.share)).cbrt(),
            objective_before,
            objective,
            errors,
            step_norm: step.norm,
            radius,
            gain_ratio,
            accepted,
            cg_steps: step.cg_steps,
            sub_problem: step.end,
            floored: self.current.state.floored(),
        });
        Ok(accepted)
    }

    /// The stopping rules, in this order of precedence.
    fn stop(&mut self, weight: f64, step: &Step) -> Option<StoppingRule> {
        let last = self.iterations.last()?;
        if self.options.target_error.is_some_and(|target| last.errors.sampson_rms <= target) {
            return Some(StoppingRule::SampsonErrorReached);
        }
        if let (true, Some(rms)) = (last.accepted, last.errors.held_out_rms) {
            if self.held_out_best.as_ref().is_none_or(|best| rms < best.1) {
                self.held_out_best = Some((self.current.clone(), rms, Some(last.iteration)));
            }
            // The initial shape does not count here: the first, smoothest steps may well lie above it.
            if rms < self.since_best.0 {
                self.since_best = (rms, 0);
            } else {
                self.since_best.1 += 1;
                if self.since_best.1 >= self.options.patience {
                    return Some(StoppingRule::HoldOut);
                }
            }
        }
        let least = self.options.relative_decrease * last.objective_before;
        let at_floor = weight <= self.options.smallest_weight(self.share);
        let decrease = last.objective_before - last.objective;
        if at_floor && ((last.accepted && decrease <= least) || (is_free(step) && step.predicted_decrease <= least)) {
            return Some(StoppingRule::RelativeDecrease);
        }
        if self.first_radius.is_some_and(|first| self.radius < self.options.smallest_radius * first) {
            return Some(StoppingRule::RadiusTooSmall);
        }
        None
    }
}

/// Whether the trust region did not bound a step.
fn is_free(step: &Step) -> bool {
    matches!(step.end, SubProblemEnd::Interior | SubProblemEnd::Truncated)
}
