//! What dense and hierarchical splines have in common.

use ndarray::ArrayD;

use crate::edge_cubic::EdgeCubic;
use crate::evaluation::{Derivatives, Evaluation};
use crate::hierarchical_spline::{HierarchicalSpline, HierarchyError};
use crate::spline::{Jet, Spline, SplineError};

/// An implicit function on a box: negative inside, positive outside, not defined beyond its box.
pub trait Implicit<const D: usize>: Sync + Sized {
    /// Why a function could not be scaled or mapped.
    type Error: std::error::Error;

    /// The box `(lower corner, upper corner)` on which the function is defined.
    fn domain(&self) -> ([f64; D], [f64; D]);

    /// Whether a point lies in the box, its faces included.
    fn contains(&self, x: &[f64; D]) -> bool;

    /// `f(x)`; NaN outside the box.
    fn value(&self, x: &[f64; D]) -> f64;

    /// `f(x)` and `∇f(x)`; all NaN outside the box.
    fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]);

    /// f and ∇f on a segment parallel to an axis and within one cell, where the function can give them at once.
    fn along_edge(&self, _start: &[f64; D], _end: &[f64; D]) -> Option<EdgeCubic<D>> {
        None
    }

    /// `f(x)`, `∇f(x)` and `∇²f(x)`; all NaN outside the box.
    fn jet(&self, x: &[f64; D]) -> Jet<D>;

    /// Evaluates at many points in parallel.
    fn evaluate(&self, points: &[[f64; D]], derivatives: Derivatives) -> Evaluation<D>;

    /// Samples a partial derivative on the lattice of all combinations of coordinates; NaN outside the box.
    fn sample(&self, axes: &[Vec<f64>; D], order: [usize; D]) -> ArrayD<f64>;

    /// Numbers between which f lies over the part of its box between two corners; none where that part is empty.
    fn bounds(&self, lower: &[f64; D], upper: &[f64; D]) -> Option<(f64, f64)>;

    /// The same function times a factor.
    ///
    /// # Errors
    /// If numbers overflow.
    fn scaled(&self, factor: f64) -> Result<Self, Self::Error>;

    /// The function in other coordinates: `y = scale · x + shift`, and values times `scale`.
    ///
    /// # Errors
    /// If numbers overflow or knots coincide.
    fn mapped(&self, scale: f64, shift: [f64; D]) -> Result<Self, Self::Error>;
}

/// The methods that the types themselves have.
macro_rules! implicit {
    ($type:ident, $error:ty, $($more:item)*) => {
        impl<const D: usize> Implicit<D> for $type<D> {
            type Error = $error;

            fn domain(&self) -> ([f64; D], [f64; D]) {
                $type::domain(self)
            }

            fn contains(&self, x: &[f64; D]) -> bool {
                $type::contains(self, x)
            }

            fn value(&self, x: &[f64; D]) -> f64 {
                $type::value(self, x)
            }

            fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
                $type::value_and_gradient(self, x)
            }

            fn jet(&self, x: &[f64; D]) -> Jet<D> {
                $type::jet(self, x)
            }

            fn evaluate(&self, points: &[[f64; D]], derivatives: Derivatives) -> Evaluation<D> {
                $type::evaluate(self, points, derivatives)
            }

            fn sample(&self, axes: &[Vec<f64>; D], order: [usize; D]) -> ArrayD<f64> {
                $type::sample(self, axes, order)
            }

            fn bounds(&self, lower: &[f64; D], upper: &[f64; D]) -> Option<(f64, f64)> {
                $type::bounds(self, lower, upper)
            }

            fn scaled(&self, factor: f64) -> Result<Self, Self::Error> {
                $type::scaled(self, factor)
            }

            fn mapped(&self, scale: f64, shift: [f64; D]) -> Result<Self, Self::Error> {
                $type::mapped(self, scale, shift)
            }

            $($more)*
        }
    };
}

implicit!(Spline, SplineError,);
implicit!(
    HierarchicalSpline,
    HierarchyError,
    fn along_edge(&self, start: &[f64; D], end: &[f64; D]) -> Option<EdgeCubic<D>> {
        HierarchicalSpline::along_edge(self, start, end)
    }
);
