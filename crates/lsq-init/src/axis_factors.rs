//! The four one-dimensional matrices per axis of which the normal operator is made.

use zeroset_bspline::{AxisCollocation, DerivativeEnergy};

/// The entries of the four matrices at one row and column, in the order of [`DATA`], [`MASS`], [`STIFFNESS`], [`BENDING`].
pub(crate) type Factors = [f64; 4];
/// `CᵀC` of the collocation matrix C.
pub(crate) const DATA: usize = 0;
/// `∫ N_r N_s`.
pub(crate) const MASS: usize = 1;
/// `∫ N_r′ N_s′`.
pub(crate) const STIFFNESS: usize = 2;
/// `∫ N_r″ N_s″`.
pub(crate) const BENDING: usize = 3;

/// Four symmetric banded matrices of one size and bandwidth, interleaved.
#[derive(Debug, Clone)]
pub(crate) struct AxisFactors {
    size: usize,
    half_bandwidth: usize,
    /// Full rows of `2 · half_bandwidth + 1` entries, the diagonal in the middle.
    entries: Vec<Factors>,
}

impl AxisFactors {
    pub(crate) fn new<const D: usize>(
        collocation: &AxisCollocation,
        thin_plate: &DerivativeEnergy<D>,
        axis: usize,
    ) -> Self {
        let mass = thin_plate.gram(axis, 0);
        let (size, degree) = (mass.size(), mass.half_bandwidth());
        let width = 2 * degree + 1;
        let mut entries = vec![[0.0; 4]; size * width];
        for row in 0..size {
            for column in row.saturating_sub(degree)..(row + degree + 1).min(size) {
                let entry = &mut entries[row * width + degree + column - row];
                for derivative in 0..=2 {
                    entry[MASS + derivative] = thin_plate.gram(axis, derivative).get(row, column);
                }
            }
        }
        for node in 0..collocation.rows() {
            let (first, values) = collocation.row(node);
            for (r, a) in values.iter().enumerate() {
                for (s, b) in values.iter().enumerate() {
                    entries[(first + r) * width + degree + s - r][DATA] += a * b;
                }
            }
        }
        Self { size, half_bandwidth: degree, entries }
    }

    /// The axis that a plane lacks: one constant function of length one, met by one node.
    pub(crate) fn unit() -> Self {
        Self { size: 1, half_bandwidth: 0, entries: vec![[1.0, 1.0, 0.0, 0.0]] }
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    pub(crate) fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    /// The entries at a row and a column, zero outside the band.
    pub(crate) fn get(&self, row: usize, column: usize) -> Factors {
        if row.abs_diff(column) > self.half_bandwidth {
            return [0.0; 4];
        }
        self.entries[row * (2 * self.half_bandwidth + 1) + self.half_bandwidth + column - row]
    }

    /// The first column of a row's band inside the matrix, and the entries from there.
    pub(crate) fn row(&self, row: usize) -> (usize, &[Factors]) {
        let first = row.saturating_sub(self.half_bandwidth);
        let last = (row + self.half_bandwidth).min(self.size - 1);
        let diagonal = row * (2 * self.half_bandwidth + 1) + self.half_bandwidth;
        (first, &self.entries[diagonal + first - row..=diagonal + last - row])
    }

    /// The sum of the diagonal of one of the matrices.
    pub(crate) fn trace(&self, which: usize) -> f64 {
        (0..self.size).map(|i| self.get(i, i)[which]).sum()
    }
}
