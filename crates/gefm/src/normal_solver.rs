//! Solvers of `A f = b` as the iterations here use them.

use std::cell::Cell;

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

    /// The same with less work and a larger error, if that is possible.
    fn solve_roughly(&self, _right: &[f64], _f: &mut Vec<f64>) -> Option<f64> {
        None
    }
}

impl NormalSolver for Factor {
    fn solve(&self, right: &[f64], f: &mut Vec<f64>) -> f64 {
        *f = Factor::solve(self, right);
        dot(f, right)
    }
}

/// Relative residual of a rough solution.
const ROUGH: f64 = 3e-2;

/// Conjugate gradients on nested lattices, stopped early.
#[derive(Debug)]
pub struct Iterative<'a, const D: usize> {
    multigrid: &'a Multigrid<D>,
    tolerance: f64,
    /// The norm of the last right side: those of a continuation hardly differ.
    right_norm: Cell<Option<f64>>,
}

impl<'a, const D: usize> Iterative<'a, D> {
    /// A solver with an operator and its V-cycle, which stops at a relative residual of `tolerance`.
    pub fn new(multigrid: &'a Multigrid<D>, tolerance: f64) -> Self {
        Self { multigrid, tolerance, right_norm: Cell::new(None) }
    }

    /// The solution from zero.
    pub(crate) fn solve_from_zero(&self, right: &[f64], tolerance: f64) -> Vec<f64> {
        let mut f = vec![0.0; right.len()];
        self.multigrid.solve(right, &mut f, &SolveOptions { tolerance, ..SolveOptions::default() });
        f
    }

    fn solve_to(&self, right: &[f64], f: &mut [f64], tolerance: f64) -> f64 {
        let right_norm = self.right_norm.get();
        let options = SolveOptions { tolerance, scale_start: true, right_norm, ..SolveOptions::default() };
        let report = self.multigrid.solve(right, f, &options);
        self.right_norm.set(Some(report.right_norm));
        report.energy
    }
}

impl<const D: usize> NormalSolver for Iterative<'_, D> {
    fn solve(&self, right: &[f64], f: &mut Vec<f64>) -> f64 {
        self.solve_to(right, f, self.tolerance)
    }

    fn solve_roughly(&self, right: &[f64], f: &mut Vec<f64>) -> Option<f64> {
        (self.tolerance < ROUGH).then(|| self.solve_to(right, f, ROUGH))
    }
}
