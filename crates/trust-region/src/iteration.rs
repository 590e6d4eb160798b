//! The iteration of section 2.3.

use std::ops::ControlFlow;

use zeroset_bspline::KnotVector;

use crate::error::Error;
use crate::more_sorensen::more_sorensen;
use crate::objective::{Current, Objective};
use crate::options::{Options, SubProblem};
use crate::preconditioner::{Inverse, Kind};
use crate::quadratic_model::{Complement, QuadraticModel};
use crate::report::{Errors, Iteration, StoppingRule, SubProblemEnd};
use crate::steihaug::{Step, Truncation, steihaug};

/// A step is taken when the objective falls by more than this share of the prediction.
pub(crate) const ACCEPT: f64 = 0.1;
/// Below this gain ratio the radius is halved.
const POOR: f64 = 0.25;
/// Above this gain ratio the radius is doubled, if it bounded the step.
const GOOD: f64 = 0.75;
/// A score counts as lower when it is lower by this share.
const SIGNIFICANT: f64 = 0.05;
/// The initial shape is kept if its held-out error is below this share of the best one. (It may have been made from the
/// points that are held out, so that a little better says nothing.)
const MUCH_BETTER: f64 = 0.5;
/// Predictions below this share of the objective are rounding.
const ROUNDING: f64 = 1e-13;

/// The function with the lowest [`score`] of all that a step has led to.
struct Best<const D: usize> {
    at: Current<D>,
    score: f64,
    errors: Errors,
    iteration: usize,
}

/// Root of held-out error times energy: its minimum marks the corner of the L-curve (Regińska 1996).
///
/// The held-out error alone would not do: among noisy points a rough function has so many sheets that every point is near
/// one. Then the energy rises steeply for a small gain in distance, while a shape that is really found costs little.
fn score(errors: &Errors) -> Option<f64> {
    errors.held_out_rms.map(|rms| rms * errors.energy.max(0.0).sqrt())
}

/// The state of the iteration.
pub(crate) struct Run<'a, const D: usize> {
    objective: &'a Objective<D>,
    options: &'a Options,
    /// Share of the points that are fitted: their density is that share of ρ.
    share: f64,
    kind: Kind<D>,
    current: Current<D>,
    start: Current<D>,
    pub(crate) initial: Errors,
    held_out_best: Option<Best<D>>,
    /// Accepted steps since that one.
    since_best: usize,
    radius: f64,
    first_radius: Option<f64>,
    /// Accepted steps: the k of `w_k`. A rejected step does not lower the weight, since the model was not minimised yet.
    accepted: usize,
    pub(crate) iterations: Vec<Iteration>,
    pub(crate) operator_applications: usize,
    pub(crate) factorisations: usize,
}

impl<'a, const D: usize> Run<'a, D> {
    pub(crate) fn new(
        knots: &[KnotVector; D],
        objective: &'a Objective<D>,
        options: &'a Options,
        share: f64,
        f: Vec<f64>,
    ) -> Result<Self, Error> {
        let current = objective.at(f)?;
        let initial = objective.errors(&current)?;
        Ok(Self {
            objective,
            options,
            share,
            kind: match options.sub_problem {
                SubProblem::Steihaug => Kind::choose(knots, objective, options),
                SubProblem::Exact => Kind::None,
            },
            held_out_best: None,
            since_best: 0,
            start: current.clone(),
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

    /// The function to return, and the iteration that made it: the one that reached the target; else the best by the
    /// held-out points; without those the last.
    pub(crate) fn best(&self, rule: StoppingRule) -> (&Current<D>, Option<usize>) {
        match &self.held_out_best {
            Some(best) if rule != StoppingRule::SampsonErrorReached => {
                // Steps that only made it worse: the initial shape was better than they.
                if self.initial.held_out_rms < best.errors.held_out_rms.map(|rms| MUCH_BETTER * rms) {
                    (&self.start, None)
                } else {
                    (&best.at, Some(best.iteration))
                }
            }
            _ => (&self.current, self.iterations.iter().rev().find(|i| i.accepted).map(|i| i.iteration)),
        }
    }

    pub(crate) fn iterate(&mut self, observer: &dyn Fn(&Iteration) -> ControlFlow<()>) -> Result<StoppingRule, Error> {
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

    fn solve(
        &self,
        model: &QuadraticModel<'_, D>,
        inverse: &Inverse<D>,
        complement: &Complement,
    ) -> Result<Step, Error> {
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
        if let (true, Some(score)) = (last.accepted, score(&last.errors)) {
            if self.held_out_best.as_ref().is_none_or(|best| score < (1.0 - SIGNIFICANT) * best.score) {
                let best = Best { at: self.current.clone(), score, errors: last.errors, iteration: last.iteration };
                self.held_out_best = Some(best);
                self.since_best = 0;
            } else {
                self.since_best += 1;
                if self.since_best >= self.options.patience {
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
