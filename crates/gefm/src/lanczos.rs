//! The smallest eigenpair of `A f = λ B f`, equation (10).
//!
//! `A` is positive definite and factored, `B` only semidefinite: so the largest μ of `A⁻¹ B f = μ f` is sought, λ = 1/μ,
//! by Lanczos' method in the A inner product, in which `A⁻¹ B` is self-adjoint. With the products `A v` kept beside the
//! vectors `v`, a step costs one solve and one application of `B`, and `A` itself is never applied.

use serde::Serialize;

use crate::tridiagonal::largest_eigenpair;

/// How an eigenpair was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EigenpairSummary {
    /// The smallest generalized eigenvalue λ.
    pub lambda: f64,
    /// `‖B f − μ A f‖ / (μ ‖f‖)` in the norms of `A⁻¹` and `A`, μ = 1/λ.
    pub residual: f64,
    /// Lanczos steps: one solve and one application of `B` each.
    pub steps: usize,
}

/// The smallest eigenpair, its vector with `fᵀ A f = 1`. `None` if the start has no component on which `B` acts.
pub(crate) fn smallest_eigenpair(
    solve: impl Fn(&[f64]) -> Vec<f64>,
    apply_b: impl Fn(&[f64]) -> Vec<f64>,
    start: Vec<f64>,
    tolerance: f64,
    most_steps: usize,
) -> Option<(Vec<f64>, EigenpairSummary)> {
    // One application brings the start into the range of A⁻¹B, and gives A v without applying A.
    let mut image = apply_b(&start);
    let mut vector = solve(&image);
    let (mut basis, mut images): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let (mut diagonal, mut off) = (Vec::new(), Vec::new());
    let mut best = None;
    let mut norm = dot(&vector, &image).max(0.0).sqrt();
    if !(norm.is_finite() && norm > 0.0) {
        return None;
    }
    for step in 1..=most_steps {
        vector.iter_mut().for_each(|v| *v /= norm);
        image.iter_mut().for_each(|v| *v /= norm);
        let mut next_image = apply_b(&vector);
        diagonal.push(dot(&next_image, &vector));
        basis.push(std::mem::take(&mut vector));
        images.push(std::mem::take(&mut image));
        // Twice is enough (Kahan): the basis stays orthogonal to rounding.
        for _ in 0..2 {
            for (v, u) in basis.iter().zip(&images) {
                let share = dot(&next_image, v);
                axpy(-share, u, &mut next_image);
            }
        }
        // Solved for only now, so that it fits its image however little was left of that. Where few points end the Krylov
        // space, rounding errors are left; a vector that does not belong to its image would be taken for an eigenvector.
        let next = solve(&next_image);
        norm = dot(&next, &next_image).max(0.0).sqrt();

        let exhausted = norm <= 1e-14 * diagonal[0] || step == most_steps;
        if exhausted || step % 4 == 0 {
            let (mu, ritz) = largest_eigenpair(&diagonal, &off);
            let residual = norm * ritz[step - 1].abs() / mu;
            if exhausted || residual <= tolerance {
                best = Some((mu, ritz, residual, step));
                break;
            }
        }
        off.push(norm);
        vector = next;
        image = next_image;
    }
    let (mu, ritz, residual, steps) = best?;
    if !(mu.is_finite() && mu > 0.0) {
        return None;
    }
    let mut f = vec![0.0; basis[0].len()];
    for (v, share) in basis.iter().zip(&ritz) {
        axpy(*share, v, &mut f);
    }
    Some((f, EigenpairSummary { lambda: 1.0 / mu, residual, steps }))
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

pub(crate) fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += factor * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_pair_of_a_diagonal_problem_with_singular_b() {
        // A = diag(1, 2, …), B = diag(0, 1, 3, 0, 5, …): largest ratio 5 / 5 at index 4 and 11 / 8 at index 7.
        let a: Vec<f64> = (1..=30).map(f64::from).collect();
        let mut b: Vec<f64> = a.iter().map(|a| 0.5 * a).collect();
        (b[0], b[4], b[7]) = (0.0, 5.0, 11.0);
        let solve = |x: &[f64]| x.iter().zip(&a).map(|(x, a)| x / a).collect::<Vec<_>>();
        let apply = |x: &[f64]| x.iter().zip(&b).map(|(x, b)| x * b).collect::<Vec<_>>();
        let (f, summary) = smallest_eigenpair(solve, apply, vec![1.0; 30], 1e-10, 30).unwrap();
        // Four distinct ratios: exact after as many steps.
        assert!((summary.lambda - 8.0 / 11.0).abs() < 1e-13);
        assert!(summary.residual < 1e-10 && summary.steps <= 4);
        assert!((f[7].abs() - 1.0 / 8f64.sqrt()).abs() < 1e-10, "fᵀAf = 1");
    }

    #[test]
    fn a_start_without_gradients_is_told() {
        let identity = |x: &[f64]| x.to_vec();
        assert!(smallest_eigenpair(identity, |x| vec![0.0; x.len()], vec![1.0; 5], 1e-8, 10).is_none());
    }
}
