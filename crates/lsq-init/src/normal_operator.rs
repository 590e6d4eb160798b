//! The normal operator of equation (15), `⊗(CᵀC) + w H`.

use zeroset_bspline::{AxisCollocation, DerivativeEnergy, apply_along};

/// `CᵀC` of one axis: banded and symmetric.
pub(crate) struct AxisGram {
    half_bandwidth: usize,
    size: usize,
    entries: Vec<f64>,
}

impl AxisGram {
    pub(crate) fn new(collocation: &AxisCollocation, size: usize, degree: usize) -> Self {
        let width = 2 * degree + 1;
        let mut entries = vec![0.0; size * width];
        for node in 0..collocation.rows() {
            let (first, values) = collocation.row(node);
            for (r, a) in values.iter().enumerate() {
                for (s, b) in values.iter().enumerate() {
                    entries[(first + r) * width + degree + s - r] += a * b;
                }
            }
        }
        Self { half_bandwidth: degree, size, entries }
    }

    pub(crate) fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    pub(crate) fn get(&self, row: usize, column: usize) -> f64 {
        if row.abs_diff(column) > self.half_bandwidth {
            return 0.0;
        }
        self.entries[row * (2 * self.half_bandwidth + 1) + self.half_bandwidth + column - row]
    }

    fn row(&self, row: usize) -> (usize, &[f64]) {
        let first = row.saturating_sub(self.half_bandwidth);
        let last = (row + self.half_bandwidth).min(self.size - 1);
        let diagonal = row * (2 * self.half_bandwidth + 1) + self.half_bandwidth;
        (first, &self.entries[diagonal + first - row..=diagonal + last - row])
    }
}

pub(crate) struct NormalOperator<'a, const D: usize> {
    pub(crate) data: &'a [AxisGram; D],
    pub(crate) energy: &'a DerivativeEnergy<D>,
    pub(crate) weight: f64,
}

impl<const D: usize> NormalOperator<'_, D> {
    pub(crate) fn apply(&self, x: &[f64]) -> Vec<f64> {
        let shape = self.energy.shape();
        let mut y = x.to_vec();
        for axis in (0..D).rev() {
            y = apply_along(&y, &shape, axis, shape[axis], |i| self.data[axis].row(i));
        }
        if self.weight > 0.0 {
            y.iter_mut().zip(self.energy.apply(x)).for_each(|(y, h)| *y += self.weight * h);
        }
        y
    }
}

/// `Cᵀ` of one axis, by rows of varying length.
pub(crate) struct Transposed {
    first: Vec<usize>,
    start: Vec<usize>,
    entries: Vec<f64>,
}

impl Transposed {
    pub(crate) fn new(collocation: &AxisCollocation, size: usize) -> Self {
        let (mut first, mut start, mut entries) = (Vec::with_capacity(size), vec![0], Vec::new());
        for function in 0..size {
            // Positions ascend, so the nodes in the support of a basis function are consecutive.
            let inside = |node: &usize| {
                let (begin, values) = collocation.row(*node);
                (begin..begin + values.len()).contains(&function)
            };
            let nodes = (0..collocation.rows()).filter(inside);
            let before = entries.len();
            let mut lowest = None;
            for node in nodes {
                lowest.get_or_insert(node);
                let (begin, values) = collocation.row(node);
                entries.push(values[function - begin]);
            }
            debug_assert!(entries.len() - before <= collocation.rows());
            first.push(lowest.unwrap_or(0));
            start.push(entries.len());
        }
        Self { first, start, entries }
    }

    pub(crate) fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.entries[self.start[row]..self.start[row + 1]])
    }
}
