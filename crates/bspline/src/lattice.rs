//! Evaluation on whole lattices, separably.

use ndarray::ArrayD;

use crate::basis::{Basis, MAX_DERIVATIVE};
use crate::knot_vector::KnotVector;
use crate::spline::{Jet, Spline};
use crate::tensor::apply_along;

/// The basis functions of one axis at many positions: the one-dimensional collocation matrix whose Kronecker products are
/// the collocation matrix of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisCollocation {
    width: usize,
    first: Vec<usize>,
    entries: Vec<f64>,
}

impl AxisCollocation {
    /// The `order`-th derivatives of the basis functions at each position; NaN at positions outside the domain.
    ///
    /// # Panics
    /// If `order` is above [`MAX_DERIVATIVE`].
    #[track_caller]
    pub fn new(knots: &KnotVector, positions: &[f64], order: usize) -> Self {
        let width = knots.degree() + 1;
        let (mut first, mut entries) =
            (Vec::with_capacity(positions.len()), Vec::with_capacity(positions.len() * width));
        for &x in positions {
            match Basis::at(knots, x, order) {
                Some(basis) => {
                    first.push(basis.first);
                    entries.extend_from_slice(basis.derivative(order));
                }
                None => {
                    first.push(0);
                    entries.extend(std::iter::repeat_n(f64::NAN, width));
                }
            }
        }
        Self { width, first, entries }
    }

    /// Number of positions.
    pub fn rows(&self) -> usize {
        self.first.len()
    }

    /// The first basis function that does not vanish at a position, and the values from there.
    pub fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.entries[row * self.width..][..self.width])
    }
}

impl<const D: usize> Spline<D> {
    /// Samples a partial derivative on the lattice of all combinations of coordinates: entry `(i, j[, k])` belongs to
    /// `(axes[0][i], axes[1][j][, axes[2][k]])`. `order` counts the derivatives along each axis, all zero for values.
    ///
    /// One pass per axis, so that the cost per node hardly depends on the degree. Nodes outside the box are NaN.
    ///
    /// # Panics
    /// If an order is above [`MAX_DERIVATIVE`].
    #[track_caller]
    pub fn sample(&self, axes: &[Vec<f64>; D], order: [usize; D]) -> ArrayD<f64> {
        assert!(order.iter().all(|&k| k <= MAX_DERIVATIVE), "derivatives up to order {MAX_DERIVATIVE} along each axis");
        let mut shape = self.shape();
        let mut values = self.as_flat().to_vec();
        for axis in (0..D).rev() {
            let collocation = AxisCollocation::new(&self.knots()[axis], &axes[axis], order[axis]);
            values = apply_along(&values, &shape, axis, collocation.rows(), |i| collocation.row(i));
            shape[axis] = axes[axis].len();
        }
        #[expect(clippy::expect_used, reason = "the passes above fill exactly this shape")]
        let samples = ArrayD::from_shape_vec(shape.to_vec(), values).expect("one value per node");
        samples
    }

    /// Samples value, gradient and Hessian on a lattice, each by its own separable passes. See [`Spline::sample`].
    pub fn sample_jets(&self, axes: &[Vec<f64>; D]) -> ArrayD<Jet<D>> {
        let unit = |a: usize, b: Option<usize>| {
            std::array::from_fn(|axis| usize::from(axis == a) + usize::from(Some(axis) == b))
        };
        let value = self.sample(axes, [0; D]);
        let gradient: [_; D] = std::array::from_fn(|a| self.sample(axes, unit(a, None)));
        let hessian: [[_; D]; D] = std::array::from_fn(|a| {
            std::array::from_fn(|b| if b < a { ArrayD::zeros(vec![0; D]) } else { self.sample(axes, unit(a, Some(b))) })
        });
        ArrayD::from_shape_fn(value.raw_dim(), |i| Jet {
            value: value[&i],
            gradient: std::array::from_fn(|a| gradient[a][&i]),
            hessian: std::array::from_fn(|a| std::array::from_fn(|b| hessian[a.min(b)][a.max(b)][&i])),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Derivatives, KnotVector};

    #[test]
    fn lattice_and_point_evaluation_agree() {
        let knots = [
            KnotVector::uniform(3, 0.0, 0.5, 3).unwrap(),
            KnotVector::clamped(2, &[0.0, 1.0, 1.5]).unwrap(),
            KnotVector::new(4, vec![0., 0., 0.1, 0.3, 0.5, 1., 1., 2., 2.5, 3., 3.]).unwrap(),
        ];
        let shape = knots.each_ref().map(KnotVector::basis_count);
        let coefficients =
            ArrayD::from_shape_fn(shape.to_vec(), |i| ((i[0] * 7 + i[1] * 13 + i[2] * 29) % 17) as f64 - 8.0);
        let spline = Spline::new(knots, coefficients).unwrap();
        let axes = [vec![0.0, 0.2, 1.5], vec![0.3, 1.0, 1.5, 1.6], vec![0.5, 0.7, 0.9, 1.0, 2.0]];
        let jets = spline.sample_jets(&axes);
        for (index, jet) in jets.indexed_iter() {
            let x = [axes[0][index[0]], axes[1][index[1]], axes[2][index[2]]];
            let at = spline.evaluate(&[x], Derivatives::Hessian);
            if at.outside == 1 {
                assert!(jet.value.is_nan() && jet.hessian[0][1].is_nan());
                continue;
            }
            // The same products in another order: rounding at the size of coefficients (8) times 1/h² (100).
            assert!((jet.value - at.values[0]).abs() < 1e-13);
            for a in 0..3 {
                assert!((jet.gradient[a] - at.gradients[0][a]).abs() < 1e-11);
                for b in 0..3 {
                    assert!((jet.hessian[a][b] - at.hessians[0][a][b]).abs() < 1e-9);
                }
            }
        }
    }
}
