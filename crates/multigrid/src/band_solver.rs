//! Truncated conjugate gradients on a band level, preconditioned by a Chebyshev polynomial.

use crate::band_operator::BandOperator;
use crate::spectrum::largest_eigenvalue;
use crate::vectors::{add_scaled, dot, scale_and_add};

/// Terms of the polynomial.
const DEGREE: usize = 3;

/// The polynomial approximates the inverse from the largest eigenvalue down to this share of it.
const LOWER: f64 = 1.0 / 30.0;

/// Steps to estimate the largest eigenvalue. An estimate that is too low does no harm: a polynomial of odd degree stays
/// positive beyond it.
const LANCZOS: usize = 5;

/// When to end a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truncation {
    /// Most steps, each of three products with the operator.
    pub most_steps: usize,
    /// End when the residual's norm `√(rᵀBr)`, with the preconditioner `B`, has fallen to this share. In `[0, 1)`.
    pub tolerance: f64,
    /// The step's length, in the norm of `B⁻¹`, is at most this: infinite for no bound.
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
    /// Its length in the norm of `B⁻¹`.
    pub norm: f64,
    /// By how much it lies below the model's value at zero.
    pub predicted_decrease: f64,
    /// Steps done.
    pub steps: usize,
    /// Why it ended.
    pub end: StepEnd,
}

/// An operator with its preconditioner: Chebyshev's polynomial of three terms in the operator over its diagonal.
#[derive(Debug)]
pub struct BandSolver<'a, 'o, const D: usize> {
    operator: &'o BandOperator<'a, D>,
    inverse_diagonal: Vec<f64>,
    largest: f64,
}

/// Vectors of the preconditioner.
struct Work {
    residual: Vec<f64>,
    direction: Vec<f64>,
    applied: Vec<f64>,
}

impl<'a, 'o, const D: usize> BandSolver<'a, 'o, D> {
    /// Estimates the largest eigenvalue, with five products.
    pub fn new(operator: &'o BandOperator<'a, D>) -> Self {
        let inverse_diagonal: Vec<f64> = operator.diagonal().iter().map(|d| 1.0 / d).collect();
        let jacobi = |r: &[f64], z: &mut [f64]| {
            z.iter_mut().zip(r.iter().zip(&inverse_diagonal)).for_each(|(z, (r, d))| *z = r * d);
        };
        let largest = largest_eigenvalue(LANCZOS, operator.diagonal(), |x, y| operator.apply(x, y), jacobi);
        Self { operator, inverse_diagonal, largest }
    }

    /// Lowers `½ xᵀAx − bᵀx` from zero by conjugate gradients (Steihaug 1983): the iterates grow in the norm of `B⁻¹`, so
    /// that the first to leave the ball ends it on its boundary.
    ///
    /// # Panics
    /// If `b` does not have one entry per active function.
    #[track_caller]
    pub fn solve(&self, b: &[f64], truncation: &Truncation) -> BandStep {
        let size = self.operator.size();
        assert_eq!(b.len(), size, "one entry per active function");
        let zeros = || vec![0.0; size];
        let mut work = Work { residual: zeros(), direction: zeros(), applied: zeros() };
        let (mut x, mut residual, mut z, mut applied) = (zeros(), b.to_vec(), zeros(), zeros());
        self.precondition(&residual, &mut z, &mut work);
        let mut square = dot(&residual, &z);
        let first = square;
        let mut direction = z.clone();
        // xᵀPx, xᵀPp and pᵀPp with P = B⁻¹, by recurrence.
        let (mut xx, mut xp, mut pp) = (0.0, 0.0, square);
        let (mut steps, mut end) = (0, StepEnd::Truncated);
        while steps < truncation.most_steps {
            if !(square.is_finite() && square > 0.0) {
                end = StepEnd::Flat;
                break;
            }
            self.operator.apply(&direction, &mut applied);
            steps += 1;
            let alpha = square / dot(&direction, &applied);
            if !(alpha.is_finite() && alpha > 0.0) {
                end = StepEnd::Flat;
                break;
            }
            let grown = xx + 2.0 * alpha * xp + alpha * alpha * pp;
            if grown >= truncation.radius.powi(2) {
                let tau = to_boundary(xx, xp, pp, truncation.radius);
                add_scaled(&mut x, tau, &direction);
                add_scaled(&mut residual, -tau, &applied);
                (xx, end) = (truncation.radius.powi(2), StepEnd::Boundary);
                break;
            }
            add_scaled(&mut x, alpha, &direction);
            add_scaled(&mut residual, -alpha, &applied);
            xx = grown;
            if steps == truncation.most_steps {
                break;
            }
            self.precondition(&residual, &mut z, &mut work);
            let next = dot(&residual, &z);
            if next.sqrt() <= truncation.tolerance * first.sqrt() {
                end = StepEnd::Converged;
                break;
            }
            let beta = next / square;
            square = next;
            xp = beta * (xp + alpha * pp);
            pp = square + beta * beta * pp;
            scale_and_add(&mut direction, beta, &z);
        }
        // With r = b − Ax the decrease bᵀx − ½ xᵀAx is ½ xᵀ(b + r).
        let predicted_decrease = 0.5 * (dot(&x, b) + dot(&x, &residual));
        BandStep { x, norm: xx.sqrt(), predicted_decrease, steps, end }
    }

    /// `z = B r`: Chebyshev's iteration from zero (Saad 2003, algorithm 12.1).
    fn precondition(&self, r: &[f64], z: &mut [f64], work: &mut Work) {
        let (upper, lower) = (self.largest, LOWER * self.largest);
        let (middle, half) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        let ratio = middle / half;
        let mut rho = 1.0 / ratio;
        let Work { residual, direction, applied } = work;
        residual.copy_from_slice(r);
        direction.fill(0.0);
        self.advance(0.0, 1.0 / middle, residual, direction);
        z.copy_from_slice(direction);
        for _ in 1..DEGREE {
            self.operator.apply(direction, applied);
            add_scaled(residual, -1.0, applied);
            let next = 1.0 / (2.0 * ratio - rho);
            self.advance(next * rho, 2.0 * next / half, residual, direction);
            add_scaled(z, 1.0, direction);
            rho = next;
        }
    }

    /// `d ← a d + c D⁻¹ r`.
    fn advance(&self, a: f64, c: f64, r: &[f64], d: &mut [f64]) {
        use rayon::prelude::*;
        const PIECE: usize = 1 << 14;
        let pieces = d.par_chunks_mut(PIECE).zip(r.par_chunks(PIECE)).zip(self.inverse_diagonal.par_chunks(PIECE));
        pieces.for_each(|((d, r), inverse)| {
            for (d, (r, inverse)) in d.iter_mut().zip(r.iter().zip(inverse)) {
                *d = a * *d + c * inverse * r;
            }
        });
    }
}

/// The positive root τ of `xx + 2τ xp + τ² pp = radius²`, without cancellation.
fn to_boundary(xx: f64, xp: f64, pp: f64, radius: f64) -> f64 {
    let gap = (radius * radius - xx).max(0.0);
    let root = (xp * xp + pp * gap).sqrt();
    if xp > 0.0 { gap / (xp + root) } else { (root - xp) / pp }
}
