//! Solvers of `A f = b` as the iterations here use them.

use zeroset_multigrid::{Factor, Multigrid, SolveOptions};

use crate::lanczos::dot;

/// A solver of the normal equations `A f = b`, exact or not.
///
/// What [`continue_exponent`](crate::continue_exponent) needs for `J_p` never to fall: the result's `bᵀf / √(fᵀAf)` is not
/// below that of the start. An exact solution has the largest; conjugate gradients have it if they begin at the best
/// multiple of the start, for they then only lower the error in the norm of `A`.
pub trait NormalSolver {
    /// Replaces the start in `f` by the solution for the right side `b`; returns `fᵀ A f`.
    fn solve(&self, right: &[f64], f: &mut Vec<f64>) -> f64;
}

impl NormalSolver for Factor {
    fn solve(&self, right: &[f64], f: &mut Vec<f64>) -> f64 {
        *f = Factor::solve(self, right);
        dot(f, right)
    }
}

/// Conjugate gradients on nested lattices, stopped early.
#[derive(Debug)]
pub struct Iterative<'a, const D: usize> {
    /// The operator and its V-cycle.
    pub multigrid: &'a Multigrid<D>,
    /// Relative residual to stop at.
    pub tolerance: f64,
}

impl<const D: usize> NormalSolver for Iterative<'_, D> {
    fn solve(&self, right: &[f64], f: &mut Vec<f64>) -> f64 {
        let options = SolveOptions { tolerance: self.tolerance, scale_start: true, ..SolveOptions::default() };
        self.multigrid.solve(right, f, &options);
        let mut image = vec![0.0; f.len()];
        self.multigrid.apply(f, &mut image);
        dot(f, &image)
    }
}
