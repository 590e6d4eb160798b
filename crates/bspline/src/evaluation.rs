//! Evaluation at many points in parallel.

use rayon::prelude::*;

use crate::hierarchical_spline::HierarchicalSpline;
use crate::implicit::Implicit;
use crate::spline::Spline;

/// How much to evaluate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Derivatives {
    /// Values only.
    Value,
    /// Values and gradients.
    Gradient,
    /// Values, gradients and Hessians.
    Hessian,
}

/// What a spline is at many points, in the order of the points. Lists that were not asked for are empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluation<const D: usize> {
    /// `f(Pᵢ)`: length `N`.
    pub values: Vec<f64>,
    /// `∇f(Pᵢ)`: `N × D`.
    pub gradients: Vec<[f64; D]>,
    /// `∇²f(Pᵢ)`: `N × D × D`.
    pub hessians: Vec<[[f64; D]; D]>,
    /// How many points lie outside the box; everything about them is NaN.
    pub outside: usize,
}

impl<const D: usize> Evaluation<D> {
    /// Sampson distances `f(Pᵢ)/‖∇f(Pᵢ)‖` with the sign of f, equation (4), in the unit of the points; empty without gradients.
    ///
    /// NaN outside the box; infinite (or NaN on the zero set) where the gradient vanishes.
    pub fn sampson_distances(&self) -> Vec<f64> {
        let norms = self.gradients.iter().map(|g| g.iter().map(|g| g * g).sum::<f64>().sqrt());
        self.values.iter().zip(norms).map(|(value, norm)| value / norm).collect()
    }
}

/// Evaluates a function at many points in parallel, each independently of the others.
pub(crate) fn evaluate<const D: usize>(
    f: &impl Implicit<D>,
    points: &[[f64; D]],
    derivatives: Derivatives,
) -> Evaluation<D> {
    let mut result = Evaluation { outside: points.iter().filter(|p| !f.contains(p)).count(), ..Default::default() };
    match derivatives {
        Derivatives::Value => result.values = points.par_iter().map(|p| f.value(p)).collect(),
        Derivatives::Gradient => {
            (result.values, result.gradients) = points.par_iter().map(|p| f.value_and_gradient(p)).unzip();
        }
        Derivatives::Hessian => {
            let jets: Vec<_> = points.par_iter().map(|p| f.jet(p)).collect();
            result.values = jets.iter().map(|j| j.value).collect();
            result.gradients = jets.iter().map(|j| j.gradient).collect();
            result.hessians = jets.iter().map(|j| j.hessian).collect();
        }
    }
    result
}

impl<const D: usize> Spline<D> {
    /// Evaluates at many points in parallel, each independently of the others.
    pub fn evaluate(&self, points: &[[f64; D]], derivatives: Derivatives) -> Evaluation<D> {
        evaluate(self, points, derivatives)
    }
}

impl<const D: usize> HierarchicalSpline<D> {
    /// Evaluates at many points in parallel, each independently of the others.
    pub fn evaluate(&self, points: &[[f64; D]], derivatives: Derivatives) -> Evaluation<D> {
        evaluate(self, points, derivatives)
    }
}
