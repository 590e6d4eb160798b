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
