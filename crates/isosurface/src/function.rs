//! Functions whose zero set is wanted.

use zeroset_bspline::{EdgeCubic, Implicit};

/// A continuous function with its gradient; NaN outside its domain.
///
/// Splines, dense or with levels, are such functions.
pub trait ImplicitFunction<const D: usize>: Sync {
    /// `f(x)`.
    fn value(&self, x: &[f64; D]) -> f64 {
        self.value_and_gradient(x).0
    }

    /// `f(x)` and `∇f(x)`.
    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]);

    /// f and ∇f on an edge of the lattice, if they are cubics there.
    fn along_edge(&self, _start: &[f64; D], _end: &[f64; D]) -> Option<EdgeCubic<D>> {
        None
    }
}

impl<const D: usize, F: Implicit<D>> ImplicitFunction<D> for F {
    fn value(&self, x: &[f64; D]) -> f64 {
        Implicit::value(self, x)
    }

    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        Implicit::value_and_gradient(self, x)
    }

    fn along_edge(&self, start: &[f64; D], end: &[f64; D]) -> Option<EdgeCubic<D>> {
        Implicit::along_edge(self, start, end)
    }
}
