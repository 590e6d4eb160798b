//! The collocation matrix of scattered points: the vectors qᵢ, uᵢ, vᵢ, wᵢ of the paper.

use rayon::prelude::*;
use thiserror::Error;

use crate::basis::Basis;
use crate::knot_vector::KnotVector;
use crate::tensor::{contract, scatter, strides};

/// Why points could not be collocated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CollocationError {
    /// A point has no basis functions.
    #[error("point {index} lies outside the domain of the knot vector along axis {axis}, or is not finite")]
    Outside {
        /// Index of the point.
        index: usize,
        /// First axis along which it sticks out.
        axis: usize,
    },
}

/// The basis functions and their first derivatives at scattered points: `f(Pᵢ) = qᵢᵀ f` and
/// `∇f(Pᵢ) = (uᵢᵀ f, vᵢᵀ f[, wᵢᵀ f])`, section 2.1 of the paper.
///
/// Only the `degree + 1` numbers per axis are stored; the rows, their tensor products, are formed when they are used.
#[derive(Debug, Clone)]
pub struct Collocation<const D: usize> {
    shape: [usize; D],
    strides: [usize; D],
    basis: Vec<[Basis; D]>,
}

/// How many points one parallel task takes. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1024;

impl<const D: usize> Collocation<D> {
    /// Evaluates the basis at every point.
    ///
    /// # Errors
    /// If a point lies outside the domain or is not finite.
    pub fn new(knots: &[KnotVector; D], points: &[[f64; D]]) -> Result<Self, CollocationError> {
        let shape = knots.each_ref().map(KnotVector::basis_count);
        let basis = points
            .par_iter()
            .enumerate()
            .with_min_len(CHUNK)
            .map(|(index, point)| {
                let mut row = [None; D];
                for axis in 0..D {
                    row[axis] = Basis::at(&knots[axis], point[axis], 1);
                    if row[axis].is_none() {
                        return Err(CollocationError::Outside { index, axis });
                    }
                }
                Ok(row.map(|b| b.expect("checked for every axis")))
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { shape, strides: strides(&shape), basis })
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.basis.len()
    }

    /// Number of control coefficients along each axis.
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// Number of control coefficients.
    pub fn coefficient_count(&self) -> usize {
        self.shape.iter().product()
    }

    /// The basis functions of each axis at a point.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn basis(&self, point: usize) -> &[Basis; D] {
        &self.basis[point]
    }

    /// `f(Pᵢ) = qᵢᵀ f` for all points.
    pub fn values(&self, coefficients: &[f64]) -> Vec<f64> {
        self.basis.par_iter().with_min_len(CHUNK).map(|row| self.contract(row, coefficients, None)).collect()
    }

    /// `∇f(Pᵢ)` for all points.
    pub fn gradients(&self, coefficients: &[f64]) -> Vec<[f64; D]> {
        self.basis
            .par_iter()
            .with_min_len(CHUNK)
            .map(|row| std::array::from_fn(|axis| self.contract(row, coefficients, Some(axis))))
            .collect()
    }

    /// Adds `Σᵢ weightsᵢ qᵢ`, the transpose of [`Collocation::values`], to `out`.
    pub fn add_values_transposed(&self, weights: &[f64], out: &mut [f64]) {
        for (row, &weight) in self.basis.iter().zip(weights) {
            self.scatter(row, out, None, weight);
        }
    }

    /// Adds `Σᵢ (uᵢ gᵢ₁ + vᵢ gᵢ₂ [+ wᵢ gᵢ₃])`, the transpose of [`Collocation::gradients`], to `out`.
    pub fn add_gradients_transposed(&self, vectors: &[[f64; D]], out: &mut [f64]) {
        for (row, vector) in self.basis.iter().zip(vectors) {
            for (axis, &component) in vector.iter().enumerate() {
                self.scatter(row, out, Some(axis), component);
            }
        }
    }

    fn contract(&self, row: &[Basis; D], coefficients: &[f64], derivative: Option<usize>) -> f64 {
        let first = row.each_ref().map(|b| b.first);
        let weights = std::array::from_fn(|axis| row[axis].derivative(usize::from(Some(axis) == derivative)));
        contract(coefficients, &self.strides, &first, &weights)
    }

    fn scatter(&self, row: &[Basis; D], out: &mut [f64], derivative: Option<usize>, factor: f64) {
        let first = row.each_ref().map(|b| b.first);
        let weights = std::array::from_fn(|axis| row[axis].derivative(usize::from(Some(axis) == derivative)));
        scatter(out, &self.strides, &first, &weights, factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spline;
    use proptest::prelude::*;

    fn knots() -> [KnotVector; 2] {
        [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::clamped(2, &[0.0, 0.3, 0.5, 1.0]).unwrap()]
    }

    proptest! {
        #[test]
        fn agrees_with_the_spline_and_with_its_transpose(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64], 1..40),
            f in proptest::collection::vec(-1.0..1.0f64, 35),
            r in proptest::collection::vec([-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64], 40),
        ) {
            let collocation = Collocation::new(&knots(), &points).unwrap();
            let spline = Spline::from_flat(knots(), f.clone()).unwrap();
            let (values, gradients) = (collocation.values(&f), collocation.gradients(&f));
            for (i, p) in points.iter().enumerate() {
                // The very same products in the same order.
                prop_assert_eq!((values[i], gradients[i]), spline.value_and_gradient(p));
            }
            let residual: Vec<f64> = r.iter().map(|r| r[0]).take(points.len()).collect();
            let vectors: Vec<[f64; 2]> = r.iter().map(|r| [r[1], r[2]]).take(points.len()).collect();
            let (mut q, mut g) = (vec![0.0; 35], vec![0.0; 35]);
            collocation.add_values_transposed(&residual, &mut q);
            collocation.add_gradients_transposed(&vectors, &mut g);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            // Sums of at most 40 · 12 products of size one (values) or 1/h = 10 (gradients).
            prop_assert!((dot(&values, &residual) - dot(&f, &q)).abs() < 1e-12);
            let paired: f64 = gradients.iter().zip(&vectors).map(|(a, b)| dot(a, b)).sum();
            prop_assert!((paired - dot(&f, &g)).abs() < 1e-11);
        }
    }

    #[test]
    fn a_point_outside_is_named() {
        let points = [[0.5, 0.5], [0.5, 1.5]];
        assert_eq!(Collocation::new(&knots(), &points).unwrap_err(), CollocationError::Outside { index: 1, axis: 1 });
        assert_eq!(
            Collocation::new(&knots(), &[[f64::NAN, 0.0]]).unwrap_err(),
            CollocationError::Outside { index: 0, axis: 0 }
        );
    }
}
