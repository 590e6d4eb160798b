//! Refinement level by level: first with points held out, then with all.

use zeroset_bspline::{CellBand, DerivativeEnergy, Derivatives, HierarchicalSpline, Spline};

use crate::cascade::{Cascade, Guidance, Refined};
use crate::error::Error;
use crate::holdout::held_out;
use crate::level_objective::{Judge, Weighted};
use crate::level_options::{LevelError, LevelOptions};
use crate::level_report::LevelsReport;
use crate::rows::dot;
use crate::sampson::is_rounding;
use crate::sides::Sides;

/// Refines a function near points, level by level from coarse to fine: on each, `R = Σ aᵢ f(Pᵢ)²/‖∇f(Pᵢ)‖² + w Eng(f)` is
/// lowered over the level's corrections by Gauss–Newton steps with falling weight, everything coarser being fixed. The first
/// level is that of the initial function itself.
///
/// `points` (`N × D`) must lie in the box of `initial`; `areas` holds one relative weight per point, all equal if absent; `sides`
/// is what is known beside the points, nothing if absent. The
/// zero set of `initial` must be near the points. Held-out points decide which step of a level is kept, and end the cascade
/// when a level brings nothing; then each level does one more step with all points. Where the noise is known, it decides alone. The result is scaled so that `‖∇f‖` averages 1 at the points.
///
/// # Errors
/// If there are no points, lengths or options do not fit, something in `sides` is not finite, a point lies outside the box or is not finite, the initial
/// function has no gradient at the points, or the band does not belong to its lattice.
pub fn refine_levels<const D: usize>(
    points: &[[f64; D]],
    areas: Option<&[f64]>,
    sides: Option<&Sides<D>>,
    initial: &Spline<D>,
    band: &CellBand<D>,
    options: &LevelOptions,
) -> Result<(HierarchicalSpline<D>, LevelsReport), LevelError> {
    options.check()?;
    let areas = crate::refine::mean_one(areas, points.len())?;
    let nothing = Sides::default();
    let sides = sides.unwrap_or(&nothing);
    sides.check(points.len())?;
    let size = gradient_size(points, initial)?;
    let dense = initial.scaled(1.0 / size).map_err(Error::from)?;

    let holdout = if options.noise.is_some() { 0.0 } else { options.holdout };
    let held = held_out(points, holdout, options.holdout_side, options.seed);
    let normals = &sides.normals;
    let weighted = |wanted: &dyn Fn(usize) -> bool| weighted(points, &areas, normals, wanted);
    let (fitted, judge) = (weighted(&|i| !held[i]), Judge::new(weighted(&|i| held[i])));
    let held_out_points = points.len() - fitted.points.len();
    let energy = energy_of(&dense, options)?;
    let mut cascade = Cascade::new(options, points.len(), &fitted, sides, judge, energy);
    let first = cascade.errors(&dense);
    let Refined { mut spline, found, levels } = cascade.run(&dense, band, Guidance::HeldOut)?;
    let result = cascade.errors(&spline);

    let mut levels_with_all = vec![];
    if held_out_points > 0 {
        let all = weighted(&|_| true);
        let mut cascade = Cascade::new(options, points.len(), &all, sides, Judge::none(), energy);
        Refined { spline, levels: levels_with_all, .. } = cascade.run(&dense, band, Guidance::Found(&found))?;
    }

    let (spline, mean_slope, norms) = of_mean_slope_one(&spline, points)?;
    let noise_length = cascade.noise_length();
    let report = LevelsReport {
        fitted_points: points.len() - held_out_points,
        held_out_points,
        initial: first,
        result,
        stopped_early: levels.last().is_some_and(|level| level.best_step.is_none()),
        levels,
        levels_with_all,
        held_places: sides.places.len(),
        noise_length,
        mean_slope,
        twicings: vec![],
        floored: norms.iter().filter(|n| **n < options.gradient_floor).count(),
    };
    Ok((spline, report))
}

/// Some of the points, with the roots of their areas, and their normals if there are any.
pub(crate) fn weighted<const D: usize>(
    points: &[[f64; D]],
    areas: &[f64],
    normals: &[[f64; D]],
    wanted: &dyn Fn(usize) -> bool,
) -> Weighted<D> {
    let chosen: Vec<usize> = (0..points.len()).filter(|i| wanted(*i)).collect();
    Weighted {
        points: chosen.iter().map(|i| points[*i]).collect(),
        roots: chosen.iter().map(|i| areas[*i].sqrt()).collect(),
        normals: if normals.is_empty() { vec![] } else { chosen.iter().map(|i| normals[*i]).collect() },
    }
}

/// The function divided by the mean of `‖∇f‖` at the points, with that mean and all of which it is the mean.
pub(crate) fn of_mean_slope_one<const D: usize>(
    f: &HierarchicalSpline<D>,
    points: &[[f64; D]],
) -> Result<(HierarchicalSpline<D>, f64, Vec<f64>), LevelError> {
    let at = f.evaluate(points, Derivatives::Gradient);
    let norms: Vec<f64> = at.gradients.iter().map(|g| dot(g, g).sqrt()).collect();
    let mean = norms.iter().sum::<f64>() / norms.len() as f64;
    Ok((f.scaled(1.0 / mean)?, mean, norms))
}

/// What its smoothness costs.
fn energy_of<const D: usize>(f: &Spline<D>, options: &LevelOptions) -> Result<f64, LevelError> {
    let mut energy = 0.0;
    for (order, weight) in options.fairness().weights.into_iter().enumerate().filter(|(_, weight)| *weight > 0.0) {
        energy += weight * DerivativeEnergy::new(f.knots(), order)?.energy(f.as_flat());
    }
    Ok(energy)
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
    if size.is_finite() && !is_rounding(f, size) { Ok(size) } else { Err(Error::NoGradient) }
}
