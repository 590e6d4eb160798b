//! Continuation in the exponent p: generalized eigenvector fitting made robust.
//!
//! The constraint (8) fixes only the *sum* of the squared gradients, so the eigenvector concentrates its gradient where
//! the surface is simple and leaves it near zero elsewhere, with random sign. Maximising
//!
//! ```text
//! J_p(f) = (1/p) Σ aᵢ ‖∇f(Pᵢ)‖ᵖ   subject to   fᵀ A f = 1
//! ```
//!
//! is the same problem for p = 2 and gives every point the same say for p = 1. For p ≥ 1 `J_p` is convex, so that
//! maximising its linearisation never lets it fall: `f ← A⁻¹ Σ aᵢ Gᵢᵀ ‖gᵢ‖ᵖ⁻² gᵢ`, scaled, with the same `A` each time.
//! That holds for inexact solves too, as long as they do not lower `bᵀf / √(fᵀAf)`: see [`NormalSolver`].

use serde::Serialize;
use zeroset_bspline::Collocation;
use zeroset_watch::CancelToken;

use crate::error::GefmError;
use crate::lanczos::dot;
use crate::normal_solver::NormalSolver;

/// Settings of [`continue_exponent`].
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuationOptions {
    /// The exponents in turn, each in `[1, 2]`. Empty: no continuation, the paper's method alone.
    pub exponents: Vec<f64>,
    /// A stage ends when no more than one point in a thousand turns its gradient by more than this angle, in degrees.
    pub angle: f64,
    /// Most iterations per exponent.
    pub most_iterations: usize,
    /// Looked at before every iteration.
    pub cancel: CancelToken,
}

impl Default for ContinuationOptions {
    fn default() -> Self {
        Self { exponents: vec![1.5, 1.0], angle: 1.0, most_iterations: 100, cancel: CancelToken::new() }
    }
}

/// One exponent's iterations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContinuationStage {
    /// The exponent p.
    pub exponent: f64,
    /// Iterations, one solve each.
    pub iterations: usize,
    /// Share of the points whose gradient turned by more than 90 degrees over the whole stage.
    pub flipped: f64,
    /// `J_p` after each iteration, at `fᵀ A f = 1`; never falls.
    pub objective: Vec<f64>,
    /// Whether the stage ended because the gradients stopped turning.
    pub settled: bool,
}

/// What [`continue_exponent`] did.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct ContinuationReport {
    /// One stage per exponent.
    pub stages: Vec<ContinuationStage>,
}

/// Continues from coefficients `f` (an eigenvector, p = 2) down to the last exponent, with a solver of `A` for θ = 1.
///
/// # Errors
/// If an exponent lies outside `[1, 2]`, all gradients vanish, or somebody cancelled.
pub fn continue_exponent<const D: usize>(
    collocation: &Collocation<D>,
    solver: &impl NormalSolver,
    areas: &[f64],
    mut f: Vec<f64>,
    options: &ContinuationOptions,
) -> Result<(Vec<f64>, ContinuationReport), GefmError> {
    let mut report = ContinuationReport::default();
    let cosine = options.angle.to_radians().cos();
    let mut gradients = collocation.gradients(&f);
    for (exponent_index, &exponent) in options.exponents.iter().enumerate() {
        if !(1.0..=2.0).contains(&exponent) {
            return Err(GefmError::Exponent(exponent));
        }
        let before = gradients.clone();
        let mut stage = ContinuationStage { exponent, iterations: 0, flipped: 0.0, objective: vec![], settled: false };
        // Steps need not be exact as long as gradients turn, or another exponent is to come.
        let (mut rough, last) = (true, exponent_index + 1 == options.exponents.len());
        while stage.iterations < options.most_iterations && !stage.settled {
            options.cancel.check()?;
            let pulls: Vec<[f64; D]> = gradients
                .iter()
                .zip(areas)
                .map(|(g, a)| {
                    let norm = dot(g, g).sqrt();
                    // A vanishing gradient has no direction and contributes nothing.
                    let factor = if norm > 0.0 { a * norm.powf(exponent - 2.0) } else { 0.0 };
                    g.map(|g| factor * g)
                })
                .collect();
            let mut right = vec![0.0; f.len()];
            collocation.add_gradients_transposed(&pulls, &mut right);
            let roughly = if rough { solver.solve_roughly(&right, &mut f) } else { None };
            rough = roughly.is_some();
            let energy = roughly.unwrap_or_else(|| solver.solve(&right, &mut f));
            if !(energy.is_finite() && energy > 0.0) {
                return Err(GefmError::NoGradient);
            }
            let scale = 1.0 / energy.sqrt();
            f.iter_mut().for_each(|c| *c *= scale);
            let turned = collocation.gradients(&f);
            stage.objective.push(objective(&turned, areas, exponent));
            let turning = gradients.iter().zip(&turned).filter(|(a, b)| !within(a, b, cosine)).count();
            stage.settled = turning * 1000 <= gradients.len();
            if stage.settled && rough && last {
                (stage.settled, rough) = (false, false);
            }
            stage.iterations += 1;
            gradients = turned;
        }
        let flipped = before.iter().zip(&gradients).filter(|(a, b)| dot(*a, *b) < 0.0).count();
        stage.flipped = flipped as f64 / gradients.len() as f64;
        report.stages.push(stage);
    }
    Ok((f, report))
}

/// `J_p`.
fn objective<const D: usize>(gradients: &[[f64; D]], areas: &[f64], exponent: f64) -> f64 {
    gradients.iter().zip(areas).map(|(g, a)| a * dot(g, g).powf(0.5 * exponent)).sum::<f64>() / exponent
}

fn within<const D: usize>(a: &[f64; D], b: &[f64; D], cosine: f64) -> bool {
    dot(a, b) >= cosine * (dot(a, a) * dot(b, b)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use zeroset_bspline::KnotVector;
    use zeroset_multigrid::Multigrid;

    use crate::normal_solver::Iterative;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn inexact_solves_never_lower_the_objective(
            radii in proptest::collection::vec(0.25..0.45f64, 120),
            normals in proptest::collection::vec(-1.0..1.0f64, 240),
            tolerance in 1e-3..0.5f64,
        ) {
            let angle = |i: usize| i as f64 / 120.0 * std::f64::consts::TAU;
            let points: Vec<[f64; 2]> =
                radii.iter().enumerate().map(|(i, r)| [r * angle(i).cos(), r * angle(i).sin()]).collect();
            let areas = vec![1.0; 120];
            let knots = KnotVector::uniform(3, -0.6, 0.2, 6).unwrap();
            let multigrid = Multigrid::new(&[knots.clone(), knots], 2, &points, &areas, 60.0 * 0.02f64.powi(3)).unwrap();
            let collocation = Collocation::new(multigrid.knots(), &points).unwrap();
            let start: Vec<[f64; 2]> = normals.chunks(2).map(|n| [n[0], n[1]]).collect();
            let mut right = vec![0.0; multigrid.size()];
            collocation.add_gradients_transposed(&start, &mut right);
            let solver = Iterative::new(&multigrid, tolerance);
            let mut f = vec![0.0; multigrid.size()];
            solver.solve(&right, &mut f);
            let (_, report) =
                continue_exponent(&collocation, &solver, &areas, f, &ContinuationOptions::default()).unwrap();
            for stage in &report.stages {
                // Monotone at any tolerance; the slack is rounding.
                prop_assert!(stage.objective.windows(2).all(|j| j[1] >= j[0] * (1.0 - 1e-12)), "{:?}", stage);
            }
        }
    }
}
