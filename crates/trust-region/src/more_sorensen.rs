//! The exact solution of the sub-problem on small lattices.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{Mat, Par};

use crate::error::Error;
use crate::report::SubProblemEnd;
use crate::rows::dot;
use crate::steihaug::Step;

/// Most coefficients for which the exact sub-problem is solved.
pub const MOST_EXACT: usize = 1500;

/// The minimum of `bᵀg + ½ gᵀMg` over `normalᵀg = 0`, `‖g‖ ≤ radius`, by the conditions of Moré and Sorensen (1983):
/// `(M + λI) g = −b`, `λ ≥ 0`, `M + λI` semidefinite, `λ (radius − ‖g‖) = 0`.
///
/// Where they factor M + λI at every λ, one eigenvalue decomposition serves all of them here, and the hard case with it.
pub(crate) fn more_sorensen(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    gradient: &[f64],
    normal: &[f64],
    radius: f64,
) -> Result<Step, Error> {
    let size = gradient.len();
    if size > MOST_EXACT {
        return Err(Error::TooLargeForExact { found: size, most: MOST_EXACT });
    }
    // The reflection that takes the normal to the first axis takes the complement to the others.
    let reflection = Reflection::new(normal);
    let reduced = size - 1;
    let mut matrix = Mat::<f64>::zeros(reduced, reduced);
    for column in 0..reduced {
        let mut unit = vec![0.0; size];
        unit[column + 1] = 1.0;
        reflection.apply(&mut unit);
        let mut image = apply(&unit);
        reflection.apply(&mut image);
        for row in 0..reduced {
            matrix[(row, column)] = image[row + 1];
        }
    }
    let mut b = gradient.to_vec();
    reflection.apply(&mut b);

    let mut vectors = Mat::<f64>::zeros(reduced, reduced);
    let mut values = faer::diag::Diag::<f64>::zeros(reduced);
    let scratch = self_adjoint_evd_scratch::<f64>(reduced, ComputeEigenvectors::Yes, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    self_adjoint_evd(
        matrix.as_ref(),
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    )
    .map_err(|_| Error::Eigenvalues)?;
    let lambda: Vec<f64> = (0..reduced).map(|i| values.column_vector()[i]).collect();
    let beta: Vec<f64> = (0..reduced).map(|j| (0..reduced).map(|i| vectors[(i, j)] * b[i + 1]).sum()).collect();

    let (y, on_boundary) = in_eigenbasis(&lambda, &beta, radius);
    let mut g = vec![0.0; size];
    for i in 0..reduced {
        g[i + 1] = (0..reduced).map(|j| vectors[(i, j)] * y[j]).sum();
    }
    reflection.apply(&mut g);
    let predicted_decrease: f64 = -(0..reduced).map(|j| beta[j] * y[j] + 0.5 * lambda[j] * y[j] * y[j]).sum::<f64>();
    let negative = lambda.first().is_some_and(|&l| l < 0.0);
    let end = match (on_boundary, negative) {
        (false, _) => SubProblemEnd::Interior,
        (true, false) => SubProblemEnd::Boundary,
        (true, true) => SubProblemEnd::NegativeCurvature,
    };
    Ok(Step { norm: dot(&g, &g).sqrt(), g, predicted_decrease, cg_steps: 0, end })
}

/// Solves the sub-problem for a diagonal matrix with ascending entries; also whether the solution is on the boundary.
fn in_eigenbasis(lambda: &[f64], beta: &[f64], radius: f64) -> (Vec<f64>, bool) {
    let Some(&lowest) = lambda.first() else { return (Vec::new(), false) };
    // Entries of b below the rounding of its length are taken for zero: they decide nothing but the hard case.
    let negligible = 1e-14 * dot(beta, beta).sqrt();
    let step = |shift: f64| -> Vec<f64> {
        lambda.iter().zip(beta).map(|(l, b)| if b.abs() <= negligible { 0.0 } else { -b / (l + shift) }).collect()
    };
    let length = |y: &[f64]| dot(y, y).sqrt();
    if lowest > 0.0 {
        let y = step(0.0);
        if length(&y) <= radius {
            return (y, false);
        }
    }
    if !radius.is_finite() {
        return (step((-lowest).max(0.0) + f64::EPSILON * lambda[lambda.len() - 1].abs()), false);
    }
    // ‖g(λ)‖ falls from above the radius to below it on (lower, upper], except in the hard case.
    let mut lower = (-lowest).max(0.0);
    let mut upper = lower + dot(beta, beta).sqrt() / radius;
    let at_lower = step(lower * (1.0 + f64::EPSILON) + f64::MIN_POSITIVE);
    if at_lower.iter().all(|y| y.is_finite()) && length(&at_lower) < radius {
        // The hard case: the rest of the radius goes along the lowest eigenvector, in either direction.
        let mut y = at_lower;
        y[0] = 0.0;
        y[0] = (radius * radius - dot(&y, &y)).max(0.0).sqrt();
        return (y, true);
    }
    for _ in 0..200 {
        let middle = 0.5 * (lower + upper);
        if middle <= lower || middle >= upper {
            break;
        }
        if length(&step(middle)) > radius { lower = middle } else { upper = middle }
    }
    (step(upper), true)
}

/// A Householder reflection that exchanges the direction of a vector and the first axis.
struct Reflection {
    v: Vec<f64>,
}

impl Reflection {
    fn new(normal: &[f64]) -> Self {
        let norm = dot(normal, normal).sqrt();
        let mut v: Vec<f64> = normal.iter().map(|n| n / norm).collect();
        v[0] += if v[0] >= 0.0 { 1.0 } else { -1.0 };
        let length = dot(&v, &v).sqrt();
        v.iter_mut().for_each(|v| *v /= length);
        Self { v }
    }

    fn apply(&self, x: &mut [f64]) {
        let twice = 2.0 * dot(&self.v, x);
        x.iter_mut().zip(&self.v).for_each(|(x, v)| *x -= twice * v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadratic_model::Complement;
    use crate::steihaug::{Truncation, steihaug};
    use proptest::prelude::*;

    const SIZE: usize = 8;

    /// `F Fᵀ + shift I` applied to a vector.
    fn apply(factor: &[f64], shift: f64, x: &[f64]) -> Vec<f64> {
        let inner: Vec<f64> = (0..SIZE).map(|k| (0..SIZE).map(|i| factor[i * SIZE + k] * x[i]).sum::<f64>()).collect();
        (0..SIZE).map(|i| shift * x[i] + dot(&factor[i * SIZE..(i + 1) * SIZE], &inner)).collect()
    }

    fn decrease(factor: &[f64], shift: f64, b: &[f64], g: &[f64]) -> f64 {
        -dot(b, g) - 0.5 * dot(g, &apply(factor, shift, g))
    }

    fn vector() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(-1.0..1.0f64, SIZE)
    }

    proptest! {
        #[test]
        fn nothing_inside_the_ball_does_better(
            factor in proptest::collection::vec(-1.0..1.0f64, SIZE * SIZE),
            shift in -1.0..1.0f64,
            (b, normal, direction) in (vector(), vector(), vector()),
            radius in 0.01..10.0f64,
        ) {
            prop_assume!(dot(&normal, &normal) > 1e-4);
            let best = more_sorensen(|x| apply(&factor, shift, x), &b, &normal, radius).unwrap();
            prop_assert!(best.norm <= radius * (1.0 + 1e-9));
            prop_assert!(dot(&best.g, &normal).abs() < 1e-10 * (1.0 + best.norm));
            let own = decrease(&factor, shift, &b, &best.g);
            // Rounding of the eigenvalues, at the size of M g².
            let rounding = 1e-9 * (1.0 + radius * radius);
            prop_assert!((own - best.predicted_decrease).abs() < rounding);
            // Any other point of the complement: random ones, from small to the boundary, and near the solution.
            let mut other = direction;
            Complement::new(&normal, normal.clone()).project(&mut other);
            let length = dot(&other, &other).sqrt();
            for share in [-1.0, -0.3, 0.01, 0.5, 1.0] {
                let g: Vec<f64> = other.iter().map(|o| share * radius / length * o).collect();
                prop_assert!(decrease(&factor, shift, &b, &g) <= own + rounding);
                let mut near: Vec<f64> = best.g.iter().zip(&g).map(|(b, o)| b + 0.1 * o).collect();
                let long = (dot(&near, &near).sqrt() / radius).max(1.0);
                near.iter_mut().for_each(|n| *n /= long);
                prop_assert!(decrease(&factor, shift, &b, &near) <= own + rounding);
            }
        }

        #[test]
        fn steihaug_is_exact_inside_and_half_as_good_on_the_boundary(
            factor in proptest::collection::vec(-1.0..1.0f64, SIZE * SIZE),
            shift in 0.01..1.0f64,
            (b, normal) in (vector(), vector()),
            radius in 0.01..10.0f64,
        ) {
            prop_assume!(dot(&normal, &normal) > 1e-4);
            let operator = |x: &[f64]| apply(&factor, shift, x);
            let exact = more_sorensen(operator, &b, &normal, radius).unwrap();
            let truncation = Truncation { radius, most_steps: 10 * SIZE, tolerance: 1e-12 };
            let complement = Complement::new(&normal, normal.clone());
            let step = steihaug(operator, |r| r.to_vec(), &b, &complement, &truncation);
            prop_assert!(dot(&step.g, &normal).abs() < 1e-10 * (1.0 + step.norm));
            if step.end == SubProblemEnd::Interior {
                prop_assert_eq!(exact.end, SubProblemEnd::Interior);
                let gap: f64 = step.g.iter().zip(&exact.g).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                // Residual 1e-12 over the smallest eigenvalue, 0.01; and rounding times the condition, 1e4 at most.
                prop_assert!(gap < 1e-8 * (1.0 + exact.norm), "{gap}");
            } else {
                prop_assert!((dot(&step.g, &step.g).sqrt() - radius).abs() < 1e-9 * radius);
                // Yuan 2000, theorem 2: at least half of the best decrease, where M is positive definite.
                prop_assert!(step.predicted_decrease >= 0.5 * exact.predicted_decrease);
                prop_assert!(step.predicted_decrease <= exact.predicted_decrease * (1.0 + 1e-9));
            }
        }
    }

    #[test]
    fn the_hard_case_goes_along_the_lowest_eigenvector() {
        // b has no part along the lowest eigenvector of diag(·, −2, 1, 1, …), with the first axis cut off.
        let operator =
            |x: &[f64]| -> Vec<f64> { x.iter().enumerate().map(|(i, x)| if i == 1 { -2.0 * x } else { *x }).collect() };
        let (mut b, mut normal) = (vec![0.0; SIZE], vec![0.0; SIZE]);
        (b[2], normal[0]) = (1.0, 1.0);
        let step = more_sorensen(operator, &b, &normal, 1.0).unwrap();
        // λ = 2: g₂ = −1/3, and the rest of the radius along axis 1.
        assert!((step.g[2] + 1.0 / 3.0).abs() < 1e-9 && (step.g[1].abs() - (8.0f64 / 9.0).sqrt()).abs() < 1e-9);
        assert_eq!(step.end, SubProblemEnd::NegativeCurvature);
    }

    #[test]
    fn too_many_coefficients_are_refused() {
        let b = vec![1.0; MOST_EXACT + 1];
        let error = more_sorensen(|x| x.to_vec(), &b, &b, 1.0).unwrap_err();
        assert_eq!(error, Error::TooLargeForExact { found: MOST_EXACT + 1, most: MOST_EXACT });
    }
}
