//! Evaluation of hierarchical splines at points and on lattices.

use ndarray::ArrayD;
use rayon::prelude::*;

use crate::basis::MAX_DERIVATIVE;
use crate::hierarchical_spline::{HierarchicalSpline, local_strides};
use crate::local::{Place, contract, value_and_gradient, weights};
use crate::spline::{Jet, jet_at};

impl<const D: usize> HierarchicalSpline<D> {
    /// The box `(lower corner, upper corner)` on which the spline is defined.
    pub fn domain(&self) -> ([f64; D], [f64; D]) {
        self.root().domain()
    }

    /// Whether a point lies in the box, its faces included.
    pub fn contains(&self, x: &[f64; D]) -> bool {
        self.root().contains(x)
    }

    /// The level of the leaf cell that holds a point, 0 for the dense lattice; none outside the box.
    pub fn level_at(&self, x: &[f64; D]) -> Option<usize> {
        self.locate(x).map(|(level, _)| level)
    }

    /// `f(x)`; NaN outside the box.
    pub fn value(&self, x: &[f64; D]) -> f64 {
        match self.locate(x) {
            None => f64::NAN,
            Some((0, _)) => self.root().value(x),
            Some(cell) => self.partial(cell, x, [0; D]),
        }
    }

    /// `f(x)` and `∇f(x)`; all NaN outside the box.
    pub fn value_and_gradient(&self, x: &[f64; D]) -> (f64, [f64; D]) {
        match self.locate(x) {
            None => (f64::NAN, [f64::NAN; D]),
            Some((0, _)) => self.root().value_and_gradient(x),
            Some(cell) => {
                let (coefficients, basis) = self.local(cell, x, 1);
                value_and_gradient(&coefficients, &Place::new(&local_strides(), &basis), &basis)
            }
        }
    }

    /// `f(x)`, `∇f(x)` and `∇²f(x)`; all NaN outside the box.
    pub fn jet(&self, x: &[f64; D]) -> Jet<D> {
        match self.locate(x) {
            None => Jet { value: f64::NAN, gradient: [f64::NAN; D], hessian: [[f64::NAN; D]; D] },
            Some((0, _)) => self.root().jet(x),
            Some(cell) => {
                let (coefficients, basis) = self.local(cell, x, 2);
                jet_at(&coefficients, &local_strides(), &basis)
            }
        }
    }

    /// Samples a partial derivative on the lattice of all combinations of coordinates: entry `(i, j[, k])` belongs to
    /// `(axes[0][i], axes[1][j][, axes[2][k]])`. `order` counts the derivatives along each axis, all zero for values. Nodes
    /// outside the box are NaN.
    ///
    /// The dense part is sampled separably, nodes in finer cells one by one.
    ///
    /// # Panics
    /// If an order is above [`MAX_DERIVATIVE`].
    #[track_caller]
    pub fn sample(&self, axes: &[Vec<f64>; D], order: [usize; D]) -> ArrayD<f64> {
        let mut values = self.root().sample(axes, order);
        if self.levels().is_empty() {
            return values;
        }
        let line = axes[D - 1].len().max(1);
        if let Some(flat) = values.as_slice_mut() {
            flat.par_chunks_mut(line).enumerate().with_min_len(16).for_each(|(row, out)| {
                let mut x = [0.0; D];
                let mut rest = row;
                for axis in (0..D - 1).rev() {
                    x[axis] = axes[axis][rest % axes[axis].len()];
                    rest /= axes[axis].len();
                }
                for (value, z) in out.iter_mut().zip(&axes[D - 1]) {
                    x[D - 1] = *z;
                    if let Some(cell) = self.locate(&x).filter(|(level, _)| *level > 0) {
                        *value = self.partial(cell, &x, order);
                    }
                }
            });
        }
        values
    }

    /// A partial derivative in a cell of a level.
    fn partial(&self, cell: (usize, [u32; D]), x: &[f64; D], order: [usize; D]) -> f64 {
        let highest = order.iter().copied().max().unwrap_or(0).min(MAX_DERIVATIVE);
        let (coefficients, basis) = self.local(cell, x, highest);
        contract(&coefficients, &Place::new(&local_strides(), &basis), &weights(&basis, order))
    }
}
