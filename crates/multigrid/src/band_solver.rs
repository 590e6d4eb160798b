//! Truncated conjugate gradients on a band level, preconditioned by the diagonal.

use rayon::prelude::*;

use crate::band_operator::BandOperator;
use crate::step_norm::StepNorm;
use crate::vectors::{PIECE, add_scaled, inner_product};

/// When to end a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truncation {
    /// Most steps, each of one product with the operator.
    pub most_steps: usize,
    /// End when the residual's norm `√(rᵀD⁻¹r)`, with the operator's diagonal `D`, has fallen to this share. In `[0, 1)`.
    pub tolerance: f64,
    /// The step's length, in the norm of `D`, is at most this: infinite for no bound.
    pub radius: f64,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepEnd {
    /// The tolerance was reached.
    Converged,
    /// The steps were used up.
    Truncated,
    /// The bound on the length was reached.
    Boundary,
    /// No direction was left in which the model falls by more than rounding.
    Flat,
}

/// An approximate minimum of `½ xᵀAx − bᵀx`.
#[derive(Debug, Clone, PartialEq)]
pub struct BandStep {
    /// The minimum, in the order of the active functions.
    pub x: Vec<f64>,
    /// Its length in the norm of the operator's diagonal.
    pub norm: f64,
    /// By how much it lies below the model's value at zero.
    pub predicted_decrease: f64,
    /// Steps done.
    pub steps: usize,
    /// Why it ended.
    pub end: StepEnd,
}

/// Lowers `½ xᵀAx − bᵀx` from zero by conjugate gradients with the operator's diagonal `D` as preconditioner (Steihaug 1983): the
/// iterates grow in the norm of `D`, so that the first to leave the ball ends it on its boundary.
///
/// # Panics
/// If `b` does not have one entry per active function.
#[track_caller]
pub fn solve_truncated<const D: usize>(operator: &BandOperator<'_, D>, b: &[f64], truncation: &Truncation) -> BandStep {
    assert_eq!(b.len(), operator.size(), "one entry per active function");
    operator.with_vectors(|vectors| solve_with(operator, b, truncation, vectors))
}

fn solve_with<const D: usize>(
    operator: &BandOperator<'_, D>,
    b: &[f64],
    truncation: &Truncation,
    [residual, direction, applied]: &mut [Vec<f64>; 3],
) -> BandStep {
    let diagonal = operator.diagonal();
    let mut x = vec![0.0; b.len()];
    let mut square = begin(b, diagonal, residual, direction);
    let first = square;
    let mut norm = StepNorm::new(square);
    let (mut steps, mut end) = (0, StepEnd::Truncated);
    while steps < truncation.most_steps {
        if !(square.is_finite() && square > 0.0) {
            end = StepEnd::Flat;
            break;
        }
        operator.apply(direction, applied);
        steps += 1;
        let alpha = square / inner_product(direction, applied);
        if !(alpha.is_finite() && alpha > 0.0) {
            end = StepEnd::Flat;
            break;
        }
        if norm.reaches(alpha, truncation.radius) {
            let tau = norm.cut(truncation.radius);
            add_scaled(&mut x, tau, direction);
            add_scaled(residual, -tau, applied);
            end = StepEnd::Boundary;
            break;
        }
        let next = advance(alpha, direction, applied, &mut x, residual, diagonal);
        norm.advance(alpha);
        if next.sqrt() <= truncation.tolerance * first.sqrt() {
            end = StepEnd::Converged;
            break;
        }
        let beta = next / square;
        square = next;
        norm.turn(beta, square);
        turn(beta, residual, diagonal, direction);
    }
    // With r = b − Ax the decrease bᵀx − ½ xᵀAx is ½ xᵀ(b + r).
    let predicted_decrease = 0.5 * (inner_product(&x, b) + inner_product(&x, residual));
    BandStep { x, norm: norm.length(), predicted_decrease, steps, end }
}

/// `r ← b` and `p ← D⁻¹ b`; gives `bᵀD⁻¹b`.
fn begin(b: &[f64], diagonal: &[f64], r: &mut [f64], p: &mut [f64]) -> f64 {
    let vectors = r.par_chunks_mut(PIECE).zip(p.par_chunks_mut(PIECE));
    let others = b.par_chunks(PIECE).zip(diagonal.par_chunks(PIECE));
    let sums = vectors.zip(others).with_min_len(8).map(|((r, p), (b, diagonal))| {
        r.copy_from_slice(b);
        let mut sum = 0.0;
        for k in 0..b.len() {
            p[k] = b[k] / diagonal[k];
            sum += b[k] * b[k] / diagonal[k];
        }
        sum
    });
    let sums: Vec<f64> = sums.collect();
    sums.iter().sum()
}

/// `x ← x + α p` and `r ← r − α Ap`; gives `rᵀD⁻¹r`.
fn advance(alpha: f64, p: &[f64], applied: &[f64], x: &mut [f64], r: &mut [f64], diagonal: &[f64]) -> f64 {
    let vectors = x.par_chunks_mut(PIECE).zip(r.par_chunks_mut(PIECE));
    let others = p.par_chunks(PIECE).zip(applied.par_chunks(PIECE)).zip(diagonal.par_chunks(PIECE));
    let sums = vectors.zip(others).with_min_len(8).map(|((x, r), ((p, applied), diagonal))| {
        let mut sum = 0.0;
        for k in 0..x.len() {
            x[k] += alpha * p[k];
            r[k] -= alpha * applied[k];
            sum += r[k] * r[k] / diagonal[k];
        }
        sum
    });
    let sums: Vec<f64> = sums.collect();
    sums.iter().sum()
}

/// `p ← D⁻¹ r + β p`.
fn turn(beta: f64, r: &[f64], diagonal: &[f64], p: &mut [f64]) {
    let pieces = p.par_chunks_mut(PIECE).zip(r.par_chunks(PIECE)).zip(diagonal.par_chunks(PIECE));
    pieces.with_min_len(8).for_each(|((p, r), diagonal)| {
        for (p, (r, d)) in p.iter_mut().zip(r.iter().zip(diagonal)) {
            *p = r / d + beta * *p;
        }
    });
}
