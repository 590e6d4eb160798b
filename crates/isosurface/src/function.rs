//! Functions whose zero set is wanted.

use zeroset_bspline::Spline;

/// A function with its gradient; NaN outside its domain.
pub trait ImplicitFunction<const D: usize>: Sync {
    /// `f(x)` and `∇f(x)`.
    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]);
}

impl<const D: usize> ImplicitFunction<D> for Spline<D> {
    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        Spline::value_and_gradient(self, x)
    }
}
