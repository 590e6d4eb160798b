//! The data term `Σ ωᵢ qᵢ qᵢᵀ`, cell by cell.

use rayon::prelude::*;
use std::ops::Range;
use zeroset_bspline::{Basis, CollocationError, KnotVector};

use crate::cell_kernel::{CellTask, local_matrix};

/// Points of one cell share their coefficients.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// Flat index of the first coefficient, in the whole lattice.
    pub(crate) first: usize,
    /// Its points, as places in the sorted order.
    pub(crate) points: Range<usize>,
    /// Where its merged matrix begins, if it has one.
    pub(crate) merged: Option<usize>,
}

/// Weighted points sorted by cell.
///
/// Two dimensions are the case of three whose first axis has one basis function, the constant one.
#[derive(Debug, Clone)]
pub(crate) struct CellPoints {
    /// `degree + 1`.
    width: usize,
    /// Basis functions along the first of three axes: `width`, or 1 in 2D.
    depth: usize,
    /// Strides of the first and the second of three axes.
    strides: [usize; 2],
    cells: Vec<Cell>,
    /// Per point its basis values: `depth` of the first axis times √ω, then `width` of each other axis.
    values: Vec<f64>,
    /// `Σ ωᵢ qᵢ qᵢᵀ` of the cells that hold many points, row after row.
    merged: Vec<f64>,
    /// Coefficients from one slab's first to the next's.
    slab: usize,
    /// The cells of each slab.
    slabs: Vec<Range<usize>>,
}

/// Coefficient planes per slab: at least the degree, so that every second slab writes to coefficients of its own.
const SLAB: usize = 5;

/// Below this many points tasks are not worth their overhead.
const FEW: usize = 4096;

/// Cells of a task that writes nothing to coefficients.
const CELLS: usize = 1024;

impl CellPoints {
    /// Sorts the points. All knots have the same degree; `weights` are finite and not negative.
    ///
    /// # Errors
    /// If a point lies outside the domain or is not finite.
    pub(crate) fn new<const D: usize>(
        knots: &[KnotVector; D],
        points: &[[f64; D]],
        weights: &[f64],
    ) -> Result<Self, CollocationError> {
        let shape = knots.each_ref().map(KnotVector::basis_count);
        let width = knots[0].degree() + 1;
        let depth = if D == 3 { width } else { 1 };
        let first = |(index, point): (usize, &[f64; D])| {
            let mut flat = 0;
            for axis in 0..D {
                let span = knots[axis].span(point[axis]).ok_or(CollocationError::Outside { index, axis })?;
                flat = flat * shape[axis] + span + 1 - width;
            }
            Ok((flat, index))
        };
        let mut order: Vec<(usize, usize)> =
            points.par_iter().enumerate().with_min_len(FEW).map(first).collect::<Result<_, _>>()?;
        order.retain(|(_, index)| weights[*index] > 0.0);
        order.par_sort_unstable();

        let per_point = depth + 2 * width;
        let mut values = vec![0.0; order.len() * per_point];
        values.par_chunks_mut(per_point).zip(&order).with_min_len(FEW).for_each(|(out, &(_, index))| {
            let (leading, rest) = out.split_at_mut(depth);
            let place = |axis: usize, out: &mut [f64]| {
                if let Some(basis) = Basis::at(&knots[axis], points[index][axis], 0) {
                    out.copy_from_slice(basis.derivative(0));
                }
            };
            if D == 3 {
                place(0, leading);
            } else {
                leading[0] = 1.0;
            }
            leading.iter_mut().for_each(|v| *v *= weights[index].sqrt());
            for (axis, out) in (D - 2..D).zip(rest.chunks_exact_mut(width)) {
                place(axis, out);
            }
        });

        let (mut cells, mut merged, mut start) = (Vec::new(), Vec::new(), 0);
        let entries = depth * width * width;
        for group in order.chunk_by(|a, b| a.0 == b.0) {
            let points = start..start + group.len();
            let matrix = (group.len() >= merge_from(entries)).then_some(merged.len());
            if matrix.is_some() {
                let begin = merged.len();
                merged.resize(begin + entries * entries, 0.0);
                let values = &values[points.start * per_point..points.end * per_point];
                local_matrix((depth, width), values, &mut merged[begin..]);
            }
            start = points.end;
            cells.push(Cell { first: group[0].0, points, merged: matrix });
        }

        let plane: usize = shape[1..].iter().product();
        let slab = SLAB * plane;
        let slabs = (0..shape[0].div_ceil(SLAB))
            .map(|s| {
                cells.partition_point(|cell| cell.first < s * slab)
                    ..cells.partition_point(|cell| cell.first < (s + 1) * slab)
            })
            .collect();
        let strides = if D == 3 { [plane, shape[2]] } else { [0, plane] };
        Ok(Self { width, depth, strides, cells, values, merged, slab, slabs })
    }

    /// Coefficients of a point along three axes.
    pub(crate) fn extent(&self) -> [usize; 3] {
        [self.depth, self.width, self.width]
    }

    /// Strides of three axes.
    pub(crate) fn strides(&self) -> [usize; 3] {
        [self.strides[0], self.strides[1], 1]
    }

    /// The points with `ω qᵀ diag(c) q > least`, in the order of their first coefficients: that one, and the basis values along three
    /// axes, of which the first contain `√ω`.
    pub(crate) fn heavier(&self, c: &[f64], least: f64) -> Vec<(usize, &[f64])> {
        let of = |cells: &[Cell]| {
            let mut heavier = Vec::new();
            self.task(cells, 0).weigh(c, |point, cell, sum| {
                if sum > least {
                    heavier.push((cell.first, self.values_of(point..point + 1)));
                }
            });
            heavier
        };
        if self.is_small() { of(&self.cells) } else { self.cells.par_chunks(CELLS).flat_map_iter(of).collect() }
    }

    /// Basis values of points, one point after the other.
    fn values_of(&self, points: Range<usize>) -> &[f64] {
        let per_point = self.depth + 2 * self.width;
        &self.values[points.start * per_point..points.end * per_point]
    }

    /// Calls `visit` with every cell's first coefficient and its `Σ ωᵢ qᵢ qᵢᵀ`, row after row.
    pub(crate) fn for_each_matrix(&self, mut visit: impl FnMut(usize, &[f64])) {
        let entries = self.depth * self.width * self.width;
        let mut matrix = vec![0.0; entries * entries];
        for cell in &self.cells {
            match cell.merged {
                Some(begin) => visit(cell.first, &self.merged[begin..begin + entries * entries]),
                None => {
                    matrix.fill(0.0);
                    local_matrix((self.depth, self.width), self.values_of(cell.points.clone()), &mut matrix);
                    visit(cell.first, &matrix);
                }
            }
        }
    }

    /// Adds `Σ ωᵢ qᵢ (qᵢᵀ x)` to `out`.
    ///
    /// Slabs of even number come first, then those between; slabs of one kind write to different coefficients, so that
    /// the order of sums is the same for any number of threads.
    pub(crate) fn add_applied(&self, x: &[f64], out: &mut [f64]) {
        self.by_slabs(out, |cells, out, before| self.task(cells, before).apply(x, out));
    }

    /// Adds the diagonal of `Σ ωᵢ qᵢ qᵢᵀ` to `out`.
    pub(crate) fn add_diagonal(&self, out: &mut [f64]) {
        self.by_slabs(out, |cells, out, before| self.task(cells, before).add_diagonal(out));
    }

    /// Whether one thread does better alone.
    pub(crate) fn is_small(&self) -> bool {
        self.values.len() < FEW * (self.depth + 2 * self.width)
    }

    fn task<'p>(&'p self, cells: &'p [Cell], before: usize) -> CellTask<'p> {
        CellTask {
            shape: (self.depth, self.width),
            strides: self.strides,
            cells,
            values: &self.values,
            merged: &self.merged,
            before,
        }
    }

    /// Calls `add` with the cells of each slab, the coefficients they write to, and how many come before those.
    fn by_slabs(&self, out: &mut [f64], add: impl Fn(&[Cell], &mut [f64], usize) + Sync) {
        let two = 2 * self.slab;
        for parity in 0..2 {
            let start = (parity * self.slab).min(out.len());
            let visit = |(pair, out): (usize, &mut [f64])| {
                if let Some(cells) = self.slabs.get(2 * pair + parity) {
                    add(&self.cells[cells.clone()], out, start + pair * two);
                }
            };
            if self.is_small() {
                out[start..].chunks_mut(two).enumerate().for_each(visit);
            } else {
                out[start..].par_chunks_mut(two).enumerate().for_each(visit);
            }
        }
    }
}

/// From how many points on a cell's merged matrix is cheaper than its points one by one: measured for cubics in space,
/// where a matrix is 32 kB that come from further away than the points do.
fn merge_from(entries: usize) -> usize {
    (entries * entries / 32).max(2)
}
