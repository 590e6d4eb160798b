//! The way in: checks, the points that are held out, the scale of the result.

use std::ops::ControlFlow;
use std::time::Instant;
use zeroset_bspline::{DerivativeEnergy, Spline};

use crate::anchor::Anchor;
use crate::error::Error;
use crate::holdout::held_out;
use crate::iteration::Run;
use crate::more_sorensen::MOST_EXACT;
use crate::objective::Objective;
use crate::options::{Options, SubProblem};
use crate::report::{Iteration, Report, StoppingRule};
use crate::sampson::{SampsonError, is_rounding};

/// Most iterations with all points once the held-out ones have decided where to stop.
const FINISHING: usize = 2;

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
/// returned, with [`StoppingRule::Cancelled`](crate::StoppingRule::Cancelled).
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
    let all = SampsonError::new(initial.knots(), points.to_vec(), &areas, options.gradient_floor)?;
    let energy = DerivativeEnergy::thin_plate(initial.knots())?;
    let unknowns = initial.as_flat().len();
    if !(options.stiffness.is_empty() || options.stiffness.len() == unknowns) {
        return Err(Error::Stiffness { found: options.stiffness.len(), needed: unknowns });
    }
    if options.sub_problem == SubProblem::Exact && unknowns > MOST_EXACT {
        return Err(Error::TooLargeForExact { found: unknowns, most: MOST_EXACT });
    }

    let held = held_out(points, options.holdout, 0.0, options.seed);
    let part = |wanted: bool| -> Result<SampsonError<D>, Error> {
        let of = |i: &usize| held[*i] == wanted;
        let positions: Vec<[f64; D]> = (0..points.len()).filter(of).map(|i| points[i]).collect();
        let weights: Vec<f64> = (0..points.len()).filter(of).map(|i| areas[i]).collect();
        SampsonError::new(initial.knots(), positions, &weights, options.gradient_floor)
    };
    let held_out_points = held.iter().filter(|&&h| h).count();
    let fitted = part(false)?;
    let judge = if held_out_points > 0 { Some(part(true)?) } else { None };
    let share = fitted.total_area() / points.len() as f64;
    if is_rounding(initial, fitted.at(initial.as_flat())?.mean_square_gradient.sqrt()) {
        return Err(Error::NoGradient);
    }
    let anchor = Anchor::new(&options.stiffness, initial.as_flat());
    let objective = Objective { anchor, fitted, held_out: judge, energy, normalisation: options.normalisation };

    let mut run = Run::new(initial.knots(), &objective, options, share, initial.as_flat().to_vec())?;
    let stopping_rule = run.iterate(observer)?;
    let (best, best_iteration) = run.best(stopping_rule);
    let result = objective.errors(best)?;
    let mut f = best.f.clone();
    let Run { initial: errors_before, iterations, mut operator_applications, mut factorisations, .. } = run;

    // The points that were held out have decided the weight; now they count like the others.
    let objective = Objective { fitted: all, held_out: None, ..objective };
    if let (true, Some(iteration)) = (held_out_points > 0, best_iteration) {
        let smoothing_length = iterations[iteration].smoothing_length;
        let finish =
            Options { smoothing_length, holdout: 0.0, most_iterations: FINISHING, decay: 1.0, ..options.clone() };
        let mut last = Run::new(initial.knots(), &objective, &finish, 1.0, f)?;
        last.iterate(&|_| ControlFlow::Continue(()))?;
        operator_applications += last.operator_applications;
        factorisations += last.factorisations;
        f = last.best(StoppingRule::IterationLimit).0.f.clone();
    }

    // One factor for the end: ‖∇f‖ averages 1 over all points, those held out included.
    let all = objective.fitted.at(&f)?;
    let scale = 1.0 / all.mean_gradient();
    let spline = Spline::from_flat(initial.knots().clone(), f.iter().map(|c| scale * c).collect())?;
    let report = Report {
        fitted_points: points.len() - held_out_points,
        held_out_points,
        coefficients: unknowns,
        initial: errors_before,
        result,
        best_iteration,
        floored: all.floored(),
        stopping_rule,
        operator_applications,
        factorisations,
        iterations,
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((spline, report))
}

/// Checks area weights and scales their mean to one.
pub(crate) fn mean_one(areas: Option<&[f64]>, needed: usize) -> Result<Vec<f64>, Error> {
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
