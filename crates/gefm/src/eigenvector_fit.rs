//! Steps (a) to (d) of section 3.

use serde::Serialize;
use zeroset_bspline::Collocation;
use zeroset_multigrid::{Factor, NormalEquations};

use crate::error::GefmError;
use crate::gradient_form::apply_b;
use crate::lanczos::{EigenpairSummary, dot, smallest_eigenpair};

/// Settings of [`eigenvector_fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct EigenvectorOptions {
    /// `ε` of step (d): the iteration ends when the Sampson error falls by less than this fraction. In (0, 1).
    pub epsilon: f64,
    /// Most iterations of steps (b) to (d); at least 1.
    pub most_iterations: usize,
    /// Relative residual at which an eigenpair is accepted.
    pub tolerance: f64,
    /// Most Lanczos steps per eigenpair.
    pub most_steps: usize,
}

impl Default for EigenvectorOptions {
    fn default() -> Self {
        Self { epsilon: 0.05, most_iterations: 10, tolerance: 1e-6, most_steps: 200 }
    }
}

/// One pass through steps (b) to (d).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EigenvectorIteration {
    /// The smallest generalized eigenvalue λ.
    pub lambda: f64,
    /// Relative residual of the eigenpair.
    pub residual: f64,
    /// Lanczos steps taken.
    pub steps: usize,
    /// `Err_sps(f̃)`, equation (5), frame units squared.
    pub sampson_error: f64,
    /// `ρ` of step (c); none in the first iteration, which has nothing to compare with.
    pub ratio: Option<f64>,
    /// Whether `f̃` was taken over: `ρ < 1`.
    pub accepted: bool,
}

/// What [`eigenvector_fit`] did.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct EigenvectorReport {
    /// Its iterations.
    pub iterations: Vec<EigenvectorIteration>,
    /// Number of control coefficients.
    pub unknowns: usize,
    /// Entries of the Cholesky factor of `A`.
    pub factor_entries: usize,
}

/// Generalized eigenvector fitting, steps (a) to (d): returns f̂ with `fᵀ B f = N`, up to its global sign.
///
/// `areas` are the weights aᵢ (all 1 in the paper), `energy_weight` is w. The second value is the first iterate, that of
/// `θ = 1`, with the factor of its `A`: where a continuation in p begins.
///
/// # Errors
/// If the normal matrix cannot be assembled or factored, or all gradients vanish.
pub fn eigenvector_fit<const D: usize>(
    collocation: &Collocation<D>,
    equations: &NormalEquations<D>,
    areas: &[f64],
    energy_weight: f64,
    options: &EigenvectorOptions,
) -> Result<(Vec<f64>, FirstIterate, EigenvectorReport), GefmError> {
    let count = collocation.point_count() as f64;
    let apply_b = |f: &[f64]| apply_b(collocation, areas, f);
    let mut report = EigenvectorReport { unknowns: equations.size(), ..Default::default() };
    let mut first = None;
    let mut current: Option<(Vec<f64>, f64)> = None;
    let mut weights = areas.to_vec();
    for _ in 0..options.most_iterations.max(1) {
        let factor = equations.factor(&equations.weighted(collocation, &weights, energy_weight)?)?;
        report.factor_entries = factor.entries();
        let start = match &current {
            Some((f, _)) => f.clone(),
            None => rough_start(equations.size()),
        };
        let pair = smallest_eigenpair(|b| factor.solve(b), apply_b, start, options.tolerance, options.most_steps);
        let (mut f, EigenpairSummary { lambda, residual, steps }) = pair.ok_or(GefmError::NoGradient)?;
        // Constraint (8).
        let scale = (count / dot(&f, &apply_b(&f))).sqrt();
        f.iter_mut().for_each(|c| *c *= scale);

        let (error, thetas) = sampson_error(collocation, areas, &f);
        let ratio = current.as_ref().map(|(_, before)| error / before);
        let accepted = ratio.is_none_or(|ratio| ratio < 1.0);
        report.iterations.push(EigenvectorIteration { lambda, residual, steps, sampson_error: error, ratio, accepted });
        first.get_or_insert_with(|| FirstIterate { coefficients: f.clone(), factor });
        if accepted {
            current = Some((f, error));
        }
        if ratio.is_some_and(|ratio| ratio >= 1.0 - options.epsilon) {
            break;
        }
        weights = thetas.iter().zip(areas).map(|(theta, a)| a * theta * theta).collect();
    }
    let ((f, _), first) = current.zip(first).ok_or(GefmError::NoGradient)?;
    Ok((f, first, report))
}

/// The eigenvector for `θ = 1`, with the factored `A` that it belongs to.
#[derive(Debug)]
pub struct FirstIterate {
    /// Its control coefficients, with `fᵀ B f = N`.
    pub coefficients: Vec<f64>,
    /// The factor of `A` for `θ = 1`.
    pub factor: Factor,
}

/// `Err_sps`, equation (5), and `θᵢ = 1 / ‖∇f(Pᵢ)‖`.
///
/// A gradient may vanish at a point; θ is then held at the value of a gradient a thousand times below the root mean
/// square, for otherwise that one point would outweigh all others.
fn sampson_error<const D: usize>(collocation: &Collocation<D>, areas: &[f64], f: &[f64]) -> (f64, Vec<f64>) {
    let norms: Vec<f64> = collocation.gradients(f).iter().map(|g| dot(g, g).sqrt()).collect();
    let mean_square = norms.iter().map(|n| n * n).sum::<f64>() / norms.len() as f64;
    let floor = 1e-3 * mean_square.sqrt();
    let thetas: Vec<f64> = norms.iter().map(|n| 1.0 / n.max(floor)).collect();
    let values = collocation.values(f);
    let error = values.iter().zip(&thetas).zip(areas).map(|((v, theta), a)| a * (v * theta).powi(2)).sum();
    (error, thetas)
}

/// A fixed vector without symmetry, so that it is orthogonal to no eigenvector of interest (a linear congruence).
fn rough_start(size: usize) -> Vec<f64> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    (0..size)
        .map(|_| {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        })
        .collect()
}
