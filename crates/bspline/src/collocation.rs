//! The collocation matrix of scattered points: the vectors qᵢ, uᵢ, vᵢ, wᵢ of the paper.

use rayon::prelude::*;
use std::ops::Range;
use thiserror::Error;

use crate::basis::Basis;
use crate::knot_vector::{KnotVector, MAX_DEGREE};
use crate::local::{self, Place, Sum, contract, value_and_gradient, weights};
use crate::tensor::strides;

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
/// Only the `degree + 1` numbers per axis are stored; the rows, their tensor products, are formed when they are used. Points
/// are kept sorted by cell, so that what is used together lies together; callers see their own order.
#[derive(Debug, Clone)]
pub struct Collocation<const D: usize> {
    shape: [usize; D],
    strides: [usize; D],
    /// Sorted by cell.
    basis: Vec<[Basis; D]>,
    /// The point that each entry of `basis` belongs to.
    order: Vec<usize>,
    /// Where each point is in `basis`.
    rank: Vec<usize>,
    /// The entries of `basis` whose first coefficient lies in each slab of `SLAB` planes.
    slabs: Vec<Range<usize>>,
}

/// How many points one parallel task takes. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1024;

/// Planes of coefficients per slab: at least the degree, so that every second slab writes to coefficients of its own.
const SLAB: usize = MAX_DEGREE;

impl<const D: usize> Collocation<D> {
    /// Evaluates the basis at every point.
    ///
    /// # Errors
    /// If a point lies outside the domain or is not finite.
    pub fn new(knots: &[KnotVector; D], points: &[[f64; D]]) -> Result<Self, CollocationError> {
        let shape = knots.each_ref().map(KnotVector::basis_count);
        let strides = strides(&shape);
        let first = |(index, point): (usize, &[f64; D])| {
            let mut first = 0;
            for axis in 0..D {
                let span = knots[axis].span(point[axis]).ok_or(CollocationError::Outside { index, axis })?;
                first += (span - knots[axis].degree()) * strides[axis];
            }
            Ok((first, index))
        };
        let mut cells: Vec<(usize, usize)> =
            points.par_iter().enumerate().with_min_len(CHUNK).map(first).collect::<Result<_, _>>()?;
        cells.par_sort_unstable();
        #[expect(clippy::expect_used, reason = "every point had a span along every axis when its cell was found")]
        let basis = cells
            .par_iter()
            .with_min_len(CHUNK)
            .map(|&(_, index)| {
                std::array::from_fn(|axis| {
                    Basis::at(&knots[axis], points[index][axis], 1).expect("a span was found for every axis")
                })
            })
            .collect();
        let slabs = (0..shape[0].div_ceil(SLAB))
            .map(|slab| {
                let before = |slab: usize| cells.partition_point(|cell| cell.0 < slab * SLAB * strides[0]);
                before(slab)..before(slab + 1)
            })
            .collect();
        let mut rank = vec![0; points.len()];
        let order: Vec<usize> = cells.into_iter().map(|(_, index)| index).collect();
        for (place, &index) in order.iter().enumerate() {
            rank[index] = place;
        }
        Ok(Self { shape, strides, basis, order, rank, slabs })
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
        &self.basis[self.rank[point]]
    }

    /// `f(Pᵢ) = qᵢᵀ f` for all points.
    pub fn values(&self, coefficients: &[f64]) -> Vec<f64> {
        self.in_order(|row| {
            let place = Place::new(&self.strides, row);
            contract(coefficients, &place, &weights(row, [0; D]))
        })
    }

    /// `∇f(Pᵢ)` for all points.
    pub fn gradients(&self, coefficients: &[f64]) -> Vec<[f64; D]> {
        self.in_order(|row| value_and_gradient(coefficients, &Place::new(&self.strides, row), row).1)
    }

    /// Adds `Σᵢ weightsᵢ qᵢ`, the transpose of [`Collocation::values`], to `out`.
    ///
    /// # Panics
    /// If there is not one weight per point, or not one entry per coefficient in `out`.
    #[track_caller]
    pub fn add_values_transposed(&self, weights: &[f64], out: &mut [f64]) {
        assert_eq!(weights.len(), self.point_count(), "one weight per point");
        self.add_transposed(out, |sum, row, point| sum.add_value(&local::weights(row, [0; D]), weights[point]));
    }

    /// Adds `Σᵢ (uᵢ gᵢ₁ + vᵢ gᵢ₂ [+ wᵢ gᵢ₃])`, the transpose of [`Collocation::gradients`], to `out`.
    ///
    /// # Panics
    /// If there is not one vector per point, or not one entry per coefficient in `out`.
    #[track_caller]
    pub fn add_gradients_transposed(&self, vectors: &[[f64; D]], out: &mut [f64]) {
        assert_eq!(vectors.len(), self.point_count(), "one vector per point");
        self.add_transposed(out, |sum, row, point| sum.add_gradient(row, &vectors[point]));
    }

    /// Computes something for every point, in the caller's order.
    fn in_order<T: Copy + Send + Sync>(&self, of: impl Fn(&[Basis; D]) -> T + Send + Sync) -> Vec<T> {
        let sorted: Vec<T> = self.basis.par_iter().with_min_len(CHUNK).map(of).collect();
        self.rank.par_iter().with_min_len(8 * CHUNK).map(|&place| sorted[place]).collect()
    }

    /// Adds what `add` sums up for every point. Slabs of even number come first, then those between; slabs of one kind write
    /// to different coefficients, so that sums run in the same order for any number of threads.
    #[track_caller]
    fn add_transposed(&self, out: &mut [f64], add: impl Fn(&mut Sum, &[Basis; D], usize) + Sync) {
        assert_eq!(out.len(), self.coefficient_count(), "one entry per coefficient");
        let slab = SLAB * self.strides[0];
        for parity in 0..2 {
            let start = (parity * slab).min(out.len());
            let visit = |(pair, out): (usize, &mut [f64])| {
                let Some(points) = self.slabs.get(2 * pair + parity) else { return };
                let before = start + 2 * pair * slab;
                let mut current: Option<Sum> = None;
                for (row, &point) in self.basis[points.clone()].iter().zip(&self.order[points.clone()]) {
                    let place = Place::new(&self.strides, row);
                    if current.as_ref().is_none_or(|sum| !sum.is_at(&place)) {
                        current.iter().for_each(|sum| sum.flush(out, before));
                        current = Some(Sum::new(place));
                    }
                    current.iter_mut().for_each(|sum| add(sum, row, point));
                }
                current.iter().for_each(|sum| sum.flush(out, before));
            };
            if self.point_count() <= CHUNK {
                out[start..].chunks_mut(2 * slab).enumerate().for_each(visit);
            } else {
                out[start..].par_chunks_mut(2 * slab).enumerate().for_each(visit);
            }
        }
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

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    /// Values and gradients of the points against the spline's, and both transposes against them, on one thread and on
    /// several. `f` and `r` are repeated as often as needed.
    fn check<const D: usize>(
        knots: [KnotVector; D],
        points: &[[f64; D]],
        f: &[f64],
        r: &[[f64; 4]],
    ) -> Result<(), TestCaseError> {
        let collocation = Collocation::new(&knots, points).unwrap();
        let f: Vec<f64> = f.iter().cycle().take(collocation.coefficient_count()).copied().collect();
        let spline = Spline::from_flat(knots, f.clone()).unwrap();
        let (values, gradients) = (collocation.values(&f), collocation.gradients(&f));
        for (i, p) in points.iter().enumerate() {
            // The very same products in the same order.
            prop_assert_eq!((values[i], gradients[i]), spline.value_and_gradient(p));
            let jet = spline.jet(p);
            prop_assert_eq!((spline.value(p), jet.value, jet.gradient), (values[i], values[i], gradients[i]));
        }
        let residual: Vec<f64> = r.iter().map(|r| r[0]).cycle().take(points.len()).collect();
        let vectors: Vec<[f64; D]> =
            r.iter().cycle().take(points.len()).map(|r| std::array::from_fn(|axis| r[axis + 1])).collect();
        let transposed = || {
            let (mut q, mut g) = (vec![0.0; f.len()], vec![0.0; f.len()]);
            collocation.add_values_transposed(&residual, &mut q);
            collocation.add_gradients_transposed(&vectors, &mut g);
            (q, g)
        };
        let (q, g) = transposed();
        let count = points.len() as f64;
        // Sums of at most 64 products per point of size one (values) or 1/h = 10 (gradients).
        prop_assert!((dot(&values, &residual) - dot(&f, &q)).abs() < 1e-14 * count);
        let paired: f64 = gradients.iter().zip(&vectors).map(|(a, b)| dot(a, b)).sum();
        prop_assert!((paired - dot(&f, &g)).abs() < 2e-13 * count);
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        prop_assert_eq!((q, g), alone.install(transposed));
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn agrees_with_the_spline_and_with_its_transpose(
            points in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64], 1..60),
            crowd in 0usize..2000,
            f in proptest::collection::vec(-1.0..1.0f64, 211),
            r in proptest::collection::vec([-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64], 40),
        ) {
            // Some of the points again and again, as many as several tasks need.
            let space: Vec<[f64; 3]> = points.iter().cycle().take(points.len() + crowd).copied().collect();
            let plane: Vec<[f64; 2]> = space.iter().map(|p| [p[0], p[1]]).collect();
            let cubic = |cells: usize| KnotVector::uniform(3, 0.0, 1.0 / cells as f64, cells).unwrap();
            check(knots(), &plane, &f, &r)?;
            check([cubic(9), cubic(8)], &plane, &f, &r)?;
            check([cubic(13), cubic(8), cubic(5)], &space, &f, &r)?;
            let [a, b] = knots();
            check([a, b, KnotVector::uniform(5, 0.0, 0.125, 8).unwrap()], &space, &f, &r)?;
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
