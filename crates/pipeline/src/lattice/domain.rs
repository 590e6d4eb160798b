//! The box around the points and its nested lattices.

use std::ops::Range;

use zeroset_bspline::{KnotError, KnotVector};

/// A box of cubic cells around the points, in frame units. Halving its cells again and again gives lattices that nest.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain<const D: usize> {
    /// Lower corner.
    pub lower: [f64; D],
    /// Cells along each axis on the coarsest lattice.
    pub cells: [usize; D],
    /// Side of the coarsest lattice's cells.
    pub spacing: f64,
}

/// Cells between the points and the faces of the box, on the coarsest lattice.
const MARGIN: f64 = 1.5;

impl<const D: usize> Domain<D> {
    /// The box for points whose bounding box has these `sides` (frame units, centred at zero, the longest 1), with
    /// `cells` cells of the coarsest lattice along the longest side. The counts are even, for solvers that want a lattice
    /// that is coarser still: [`Domain::bottom`].
    pub fn around(sides: &[f64; D], cells: usize) -> Self {
        Self::with_margin(sides, cells, 0.0)
    }

    /// As [`Domain::around`], with at least a `margin` in frame units between the points and the faces of the box.
    pub fn with_margin(sides: &[f64; D], cells: usize, margin: f64) -> Self {
        let spacing = 1.0 / cells as f64;
        let margin = MARGIN.max(margin / spacing);
        let cells = sides.map(|side| 2 * (0.5 * side / spacing + margin).ceil() as usize);
        Self { lower: cells.map(|count| -0.5 * spacing * count as f64), cells, spacing }
    }

    /// The side of a cell after `halvings`.
    pub fn spacing(&self, halvings: u32) -> f64 {
        self.spacing / f64::from(1u32 << halvings)
    }

    /// Cells along each axis after `halvings`.
    pub fn cells(&self, halvings: u32) -> [usize; D] {
        self.cells.map(|count| count << halvings)
    }

    /// The middle of a cell after `halvings`, given its place in C order.
    pub(crate) fn centre(&self, halvings: u32, cell: usize) -> [f64; D] {
        let (index, side) = (multi_index(cell, &self.cells(halvings)), self.spacing(halvings));
        std::array::from_fn(|axis| self.lower[axis] + (index[axis] as f64 + 0.5) * side)
    }

    /// Coefficients of degree `degree` on the lattice after `halvings`. They are counted to refuse too many: these need not fit an integer.
    pub(crate) fn coefficients(&self, degree: usize, halvings: u32) -> f64 {
        self.cells(halvings).map(|cells| (cells + degree) as f64).iter().product()
    }

    /// Uniform knot vectors on the lattice after `halvings`.
    ///
    /// # Errors
    /// If the degree is not supported.
    pub fn knots(&self, degree: usize, halvings: u32) -> Result<[KnotVector; D], KnotError> {
        let cells = self.cells(halvings);
        let mut knots = Vec::with_capacity(D);
        for axis in 0..D {
            knots.push(KnotVector::uniform(degree, self.lower[axis], self.spacing(halvings), cells[axis])?);
        }
        #[expect(clippy::expect_used, reason = "one was pushed per axis")]
        let knots = knots.try_into().expect("one knot vector per axis");
        Ok(knots)
    }

    /// Uniform knot vectors on cells twice as wide as those of the coarsest lattice.
    ///
    /// # Errors
    /// If the degree is not supported.
    pub fn bottom(&self, degree: usize) -> Result<[KnotVector; D], KnotError> {
        Self { lower: self.lower, cells: self.cells.map(|count| count / 2), spacing: 2.0 * self.spacing }
            .knots(degree, 0)
    }

    /// The coordinates of the lattice's nodes along each axis, after `halvings`.
    pub fn nodes(&self, halvings: u32) -> [Vec<f64>; D] {
        let (cells, spacing) = (self.cells(halvings), self.spacing(halvings));
        std::array::from_fn(|axis| (0..=cells[axis]).map(|i| self.lower[axis] + i as f64 * spacing).collect())
    }
}

/// The nodes of a lattice in C order.
pub(crate) struct Nodes<const D: usize> {
    pub(crate) axes: [Vec<f64>; D],
    pub(crate) shape: [usize; D],
}

impl<const D: usize> Nodes<D> {
    /// Those of the lattice after `halvings`.
    pub(crate) fn new(domain: &Domain<D>, halvings: u32) -> Self {
        let axes = domain.nodes(halvings);
        Self { shape: std::array::from_fn(|axis| axes[axis].len()), axes }
    }

    /// Their numbers.
    pub(crate) fn all(&self) -> Range<usize> {
        0..self.shape.iter().product()
    }

    /// Where one of them is.
    pub(crate) fn at(&self, flat: usize) -> [f64; D] {
        let index = multi_index(flat, &self.shape);
        std::array::from_fn(|axis| self.axes[axis][index[axis]])
    }

    /// Where they are.
    pub(crate) fn places(&self) -> Vec<[f64; D]> {
        self.all().map(|flat| self.at(flat)).collect()
    }
}

/// The multi-index of an entry of a C-ordered array of `shape`: the last axis is the fastest.
pub(crate) fn multi_index<const D: usize>(mut flat: usize, shape: &[usize; D]) -> [usize; D] {
    let mut index = [0; D];
    for (i, size) in index.iter_mut().zip(shape).rev() {
        *i = flat % size;
        flat /= size;
    }
    index
}

/// The place of an entry in a C-ordered array of `shape`: the inverse of [`multi_index`].
pub(crate) fn flat_index<const D: usize>(index: &[usize; D], shape: &[usize; D]) -> usize {
    index.iter().zip(shape).fold(0, |flat, (i, size)| flat * size + i)
}

#[cfg(test)]
pub(crate) mod tests {
    use zeroset_bspline::Spline;

    use super::*;

    /// A cubic spline whose coefficients are a function's values at the centres of their supports.
    pub(crate) fn spline<const D: usize>(domain: &Domain<D>, halvings: u32, f: impl Fn([f64; D]) -> f64) -> Spline<D> {
        let knots = domain.knots(3, halvings).unwrap();
        let shape = knots.each_ref().map(KnotVector::basis_count);
        let at = |flat: usize| {
            let index = multi_index(flat, &shape);
            f(std::array::from_fn(|axis| knots[axis].knots()[index[axis] + 2]))
        };
        let coefficients = (0..shape.iter().product()).map(at).collect();
        Spline::from_flat(knots, coefficients).unwrap()
    }

    #[test]
    fn the_box_leaves_its_margin_and_nests() {
        let domain = Domain::around(&[1.0, 0.4], 16);
        assert_eq!(domain.cells, [20, 10]);
        assert!(domain.lower[0] <= -0.5 - 1.5 / 16.0 && domain.lower[1] <= -0.2 - 1.5 / 16.0);
        let (coarse, fine) = (domain.knots(3, 0).unwrap(), domain.knots(3, 2).unwrap());
        assert_eq!(coarse[0].halved().halved(), fine[0]);
        let wide = Domain::with_margin(&[1.0, 0.4], 16, 0.5);
        assert_eq!(wide.cells, [32, 24]);
        assert_eq!(Domain::with_margin(&[1.0, 0.4], 16, 0.01), domain);
        assert_eq!(domain.bottom(3).unwrap()[1].halved(), coarse[1]);
        assert_eq!(domain.nodes(1)[1].len(), 21);
        assert_eq!(fine[1].domain().1, *domain.nodes(2)[1].last().unwrap());
    }

    #[test]
    fn the_last_axis_is_the_fastest() {
        let shape = [3, 4, 5];
        for flat in 0..60 {
            let [i, j, k] = multi_index(flat, &shape);
            assert!(i < 3 && j < 4 && k < 5);
            assert_eq!((i * 4 + j) * 5 + k, flat);
            assert_eq!(flat_index(&[i, j, k], &shape), flat);
        }
    }
}
