//! The whole topology stage: eigenvector, continuation, global sign.

use serde::Serialize;
use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector, Spline};
use zeroset_multigrid::NormalEquations;

use crate::eigenvector_fit::{EigenvectorOptions, EigenvectorReport, eigenvector_fit};
use crate::error::GefmError;
use crate::lanczos::dot;
use crate::orientation::enclosed_volume;
use crate::p_continuation::{ContinuationOptions, ContinuationReport, continue_exponent};

/// Settings of [`fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Smoothing length ℓ in frame units; the weight of the fairness term is `w = ρ ℓ³`.
    pub smoothing_length: f64,
    /// Density ρ of the points: per unit length in 2D, per unit area in 3D, in frame units.
    pub density: f64,
    /// Steps (a) to (d).
    pub eigenvector: EigenvectorOptions,
    /// The continuation; without exponents the result is the paper's f̂.
    pub continuation: ContinuationOptions,
}

impl Default for Options {
    /// For points at distance 0.02 on curves or surfaces in a frame of size 1, with the continuation. It begins at the
    /// eigenvector for θ = 1, so that the reweighting would be wasted: one iteration.
    fn default() -> Self {
        Self {
            smoothing_length: 0.01,
            density: 50.0,
            eigenvector: EigenvectorOptions { most_iterations: 1, ..EigenvectorOptions::default() },
            continuation: ContinuationOptions::default(),
        }
    }
}

impl Options {
    /// Section 3 of the paper as written: steps (a) to (d), no continuation.
    pub fn paper() -> Self {
        let continuation = ContinuationOptions { exponents: Vec::new(), ..ContinuationOptions::default() };
        Self { eigenvector: EigenvectorOptions::default(), continuation, ..Self::default() }
    }
}

/// What [`fit`] did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The weight w of the fairness term.
    pub energy_weight: f64,
    /// Steps (a) to (d).
    pub eigenvector: EigenvectorReport,
    /// The continuation.
    pub continuation: ContinuationReport,
    /// `‖∇f‖` at the points, relative to its mean: the smallest and the largest.
    pub gradient_range: [f64; 2],
    /// Share of the points whose gradient is below a tenth of the mean: there the sign is weak.
    pub weak: f64,
}

/// Fits a spline whose sign tells inside (negative) from outside, scaled so that `mean ‖∇f(Pᵢ)‖² = 1`, equation (8).
///
/// `areas` holds one weight per point with mean 1: the share of surface that the point stands for.
///
/// # Errors
/// If there are no points, lengths or options do not fit, a point lies outside the knots' domain, the matrices cannot be
/// factored (points on a line or plane), or no gradient is left.
pub fn fit<const D: usize>(
    points: &[[f64; D]],
    areas: &[f64],
    knots: &[KnotVector; D],
    options: &Options,
) -> Result<(Spline<D>, Report), GefmError> {
    if points.is_empty() {
        return Err(GefmError::NoPoints);
    }
    if areas.len() != points.len() {
        return Err(GefmError::Areas { found: areas.len(), needed: points.len() });
    }
    let (length, density) = (options.smoothing_length, options.density);
    let energy_weight = density * length.powi(3);
    if !(energy_weight.is_finite() && energy_weight > 0.0 && length > 0.0) {
        return Err(GefmError::Smoothing { length, density });
    }
    let collocation = Collocation::new(knots, points)?;
    let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(knots)?);
    let (mut f, first, eigenvector) =
        eigenvector_fit(&collocation, &equations, areas, energy_weight, &options.eigenvector)?;
    let mut continuation = ContinuationReport::default();
    if !options.continuation.exponents.is_empty() {
        // From θ = 1, whose maximum of J_2 has no rivals; the reweighted vector would be one more local start.
        (f, continuation) =
            continue_exponent(&collocation, &first.factor, areas, first.coefficients, &options.continuation)?;
    }

    let norms: Vec<f64> = collocation.gradients(&f).iter().map(|g| dot(g, g).sqrt()).collect();
    let count = norms.len() as f64;
    let mean = norms.iter().sum::<f64>() / count;
    let spline = normalise(&collocation, points, areas, knots, f)?;
    let report = Report {
        energy_weight,
        eigenvector,
        continuation,
        gradient_range: [
            norms.iter().copied().fold(f64::INFINITY, f64::min) / mean,
            norms.iter().copied().fold(0.0, f64::max) / mean,
        ],
        weak: norms.iter().filter(|&&n| n < 0.1 * mean).count() as f64 / count,
    };
    Ok((spline, report))
}

/// Settles the global sign and scales so that `mean ‖∇f(Pᵢ)‖² = 1`, equation (8).
pub(crate) fn normalise<const D: usize>(
    collocation: &Collocation<D>,
    points: &[[f64; D]],
    areas: &[f64],
    knots: &[KnotVector; D],
    mut f: Vec<f64>,
) -> Result<Spline<D>, GefmError> {
    let gradients = collocation.gradients(&f);
    let mean_square = gradients.iter().map(|g| dot(g, g)).sum::<f64>() / gradients.len() as f64;
    if !(mean_square.is_finite() && mean_square > 0.0) {
        return Err(GefmError::NoGradient);
    }
    let outward = enclosed_volume(collocation, points, areas, &f) >= 0.0;
    let scale = if outward { 1.0 } else { -1.0 } / mean_square.sqrt();
    f.iter_mut().for_each(|c| *c *= scale);
    Ok(Spline::from_flat(knots.clone(), f)?)
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    fn outline(count: usize, radius: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        (0..count)
            .map(|i| i as f64 / count as f64 * std::f64::consts::TAU)
            .map(|t| [radius(t) * t.cos(), radius(t) * t.sin()])
            .collect()
    }

    fn lattice(half: f64, cells: usize) -> [KnotVector; 2] {
        let knots = KnotVector::uniform(3, -half, 2.0 * half / cells as f64, cells).unwrap();
        [knots.clone(), knots]
    }

    fn options(spacing: f64) -> Options {
        Options { smoothing_length: 0.5 * spacing, density: 1.0 / spacing, ..Options::default() }
    }

    /// Share of points where f grows outward, along the direction from the centre.
    fn right_side(f: &Spline<2>, points: &[[f64; 2]]) -> f64 {
        let right = points.iter().filter(|p| dot(&f.value_and_gradient(p).1, *p) > 0.0).count();
        right as f64 / points.len() as f64
    }

    #[test]
    fn a_star_needs_the_continuation() {
        let points = outline(300, |t| 0.35 + 0.13 * (5.0 * t).cos());
        let spacing = 3.0 / 300.0;
        let (f, report) = fit(&points, &[1.0; 300], &lattice(0.6, 20), &options(spacing)).unwrap();
        assert_eq!(right_side(&f, &points), 1.0);
        assert!(f.value(&[0.0, 0.0]) < 0.0);
        for stage in &report.continuation.stages {
            assert!(stage.settled);
            // Monotone by convexity; the slack is rounding.
            assert!(stage.objective.windows(2).all(|j| j[1] >= j[0] * (1.0 - 1e-12)), "{stage:?}");
        }
    }

    #[test]
    fn the_papers_own_steps_report_themselves() {
        let points = outline(200, |t| 0.4 + 0.05 * (3.0 * t).sin());
        let options = Options { smoothing_length: 0.00635, density: 1.0 / 0.0127, ..Options::paper() };
        let (f, report) = fit(&points, &[1.0; 200], &lattice(0.6, 12), &options).unwrap();
        let iterations = &report.eigenvector.iterations;
        assert!(iterations.len() >= 2 && iterations[0].ratio.is_none());
        assert!(iterations.iter().all(|i| i.lambda > 0.0 && i.residual <= 1e-6));
        for pair in iterations.windows(2) {
            // What the ρ test says is what the errors say.
            let ratio = pair[1].ratio.unwrap();
            assert_eq!(pair[1].accepted, ratio < 1.0);
        }
        let last = iterations.last().unwrap();
        assert!(last.ratio.unwrap() >= 0.95 || iterations.len() == 10);
        assert_eq!(right_side(&f, &points), 1.0);
        // Scaled by (8).
        let mean: f64 = points.iter().map(|p| f.value_and_gradient(p).1).map(|g| dot(&g, &g)).sum::<f64>() / 200.0;
        assert!((mean - 1.0).abs() < 1e-12, "rounding only");
    }

    /// λ is the minimum of the Rayleigh quotient: no other vector does better, and the residual of (10) vanishes.
    fn solves_the_dense_problem(points: &[[f64; 2]], areas: &[f64], length: f64) {
        let knots = lattice(0.6, 6);
        let collocation = Collocation::new(&knots, points).unwrap();
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots).unwrap());
        let weight = length.powi(4);
        let tight = EigenvectorOptions { tolerance: 1e-12, most_iterations: 1, ..Default::default() };
        let (f, _, report) = eigenvector_fit(&collocation, &equations, areas, weight, &tight).unwrap();
        let a = equations.weighted(&collocation, areas, weight).unwrap();
        let gradient_gram = |f: &[f64]| {
            let mut gradients = collocation.gradients(f);
            gradients.iter_mut().zip(areas).for_each(|(g, area)| *g = g.map(|g| area * g));
            let mut b = vec![0.0; f.len()];
            collocation.add_gradients_transposed(&gradients, &mut b);
            b
        };
        let lambda = report.iterations[0].lambda;
        let largest = |values: &[f64]| values.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let residual: Vec<f64> = a.apply(&f).iter().zip(gradient_gram(&f)).map(|(a, b)| a - lambda * b).collect();
        // 1e-12 in the norms of A⁻¹ and A is at most 1e-12 ‖A‖ ‖f‖, that is 1e-12 · 49 entries of a row · √81 unknowns
        // times the largest entries.
        let size = largest(&a.diagonal()) * largest(&f);
        assert!(largest(&residual) < 1e-9 * size, "{} points, {length}: {:e}", points.len(), largest(&residual) / size);
        for nudge in 0..f.len() {
            let other: Vec<f64> = f.iter().enumerate().map(|(k, f)| f + if k == nudge { 0.1 } else { 0.0 }).collect();
            assert!(dot(&other, &a.apply(&other)) >= lambda * dot(&other, &gradient_gram(&other)) * (1.0 - 1e-9));
        }
    }

    #[test]
    fn few_points_end_the_krylov_space_early() {
        // B has rank 6, 10, 14: Lanczos comes to its end between two looks at the residual.
        for count in [3, 5, 7] {
            for turn in 0..40 {
                let angle = f64::from(turn);
                let points = outline(count, |t| 0.4 + 0.1 * (t + angle).sin());
                for length in [0.02, 0.1] {
                    solves_the_dense_problem(&points, &vec![1.0; count], length);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn the_eigenpair_solves_the_dense_problem(
            points in vec([-0.55..0.55f64, -0.55..0.55], 3..120),
            areas in vec(0.1..2.0f64, 120),
            length in 0.02..0.3f64,
        ) {
            solves_the_dense_problem(&points, &areas[..points.len()], length);
        }
    }

    #[test]
    fn bad_input_is_refused() {
        let knots = lattice(0.6, 6);
        assert_eq!(fit::<2>(&[], &[], &knots, &Options::default()).unwrap_err(), GefmError::NoPoints);
        let error = fit(&[[0.0, 0.0]], &[], &knots, &Options::default()).unwrap_err();
        assert_eq!(error, GefmError::Areas { found: 0, needed: 1 });
        let options = Options { smoothing_length: f64::NAN, ..Options::default() };
        assert!(matches!(fit(&[[0.0, 0.0]], &[1.0], &knots, &options), Err(GefmError::Smoothing { .. })));
        let mut options = Options::default();
        options.continuation.exponents = vec![0.5];
        let points = outline(20, |_| 0.4);
        assert_eq!(fit(&points, &[1.0; 20], &knots, &options).unwrap_err(), GefmError::Exponent(0.5));
    }
}
