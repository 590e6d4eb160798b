//! Functions whose zero set is wanted.

use zeroset_bspline::{HierarchicalSpline, Spline};

/// A continuous function with its gradient; NaN outside its domain.
pub trait ImplicitFunction<const D: usize>: Sync {
    /// `f(x)`.
    fn value(&self, x: &[f64; D]) -> f64 {
        self.value_and_gradient(x).0
    }

    /// `f(x)` and `∇f(x)`.
    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]);
}

impl<const D: usize> ImplicitFunction<D> for Spline<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        Spline::value(self, x)
    }

    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        Spline::value_and_gradient(self, x)
    }
}

impl<const D: usize> ImplicitFunction<D> for HierarchicalSpline<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        HierarchicalSpline::value(self, x)
    }

    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        HierarchicalSpline::value_and_gradient(self, x)
    }
}
