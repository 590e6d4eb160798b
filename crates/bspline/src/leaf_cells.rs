//! The cells of a hierarchical spline, each as fine as the function there, with bounds.

use rayon::prelude::*;

use crate::hierarchical_spline::{HierarchicalSpline, LOCAL, WIDTH};
use crate::spline::Spline;

/// A cell on which the function is one polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafCell<const D: usize> {
    /// Its level; level 0 is the dense lattice.
    pub level: usize,
    /// Its place among the cells of the level's whole lattice.
    pub index: [u32; D],
    /// No value in the cell is below.
    pub lower: f64,
    /// No value in the cell is above.
    pub upper: f64,
}

impl<const D: usize> HierarchicalSpline<D> {
    /// All leaf cells that `keep` wants, in the order of the dense lattice's cells and children in C order within each.
    ///
    /// Together the leaf cells fill the box. A cell is divided when one of its children belongs to the next level; then all
    /// its children are cells of their own. Bounds are the smallest and the largest of the coefficients that act on the
    /// cell, at the cell's own size.
    pub fn leaf_cells(&self, keep: impl Fn(&LeafCell<D>) -> bool + Sync) -> Vec<LeafCell<D>> {
        if self.levels().is_empty() {
            return dense_cells(self.root(), keep);
        }
        let cells = self.root().shape().map(|n| n as u32 - 3);
        self.leaves_in([0; D], cells, &keep)
    }

    /// Bounds of f over the part of the box between two corners: the values there lie between them. None where that part
    /// is empty.
    pub fn bounds(&self, lower: &[f64; D], upper: &[f64; D]) -> Option<(f64, f64)> {
        if self.levels().is_empty() {
            return self.root().bounds(lower, upper);
        }
        let (start, end) = self.domain();
        let finest = self.levels().len();
        let knots = self.knots_of(finest);
        let (mut first, mut last) = ([0; D], [0; D]);
        for axis in 0..D {
            let (from, to) = (lower[axis].max(start[axis]), upper[axis].min(end[axis]));
            if from > to {
                return None;
            }
            first[axis] = knots[axis].span(from)? as u32 - 3;
            // A corner on a face between cells belongs to both.
            last[axis] = knots[axis].span(to)? as u32 - 3;
        }
        let root = |k: u32| k >> finest;
        let overlaps = |leaf: &LeafCell<D>| {
            let shift = finest - leaf.level;
            (0..D).all(|a| leaf.index[a] << shift <= last[a] && (leaf.index[a] + 1) << shift > first[a])
        };
        let leaves = self.leaves_in(first.map(root), last.map(|k| root(k) + 1), &overlaps);
        let bounds = leaves.iter().map(|leaf| (leaf.lower, leaf.upper));
        bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    fn leaves_in(
        &self,
        from: [u32; D],
        to: [u32; D],
        keep: &(impl Fn(&LeafCell<D>) -> bool + Sync),
    ) -> Vec<LeafCell<D>> {
        let shape: [u32; D] = std::array::from_fn(|axis| to[axis] - from[axis]);
        let count: usize = shape.iter().map(|n| *n as usize).product();
        let parts: Vec<Vec<LeafCell<D>>> = (0..count)
            .into_par_iter()
            .with_min_len(16)
            .map(|flat| {
                let mut rest = flat;
                let mut index = from;
                for axis in (0..D).rev() {
                    index[axis] += (rest % shape[axis] as usize) as u32;
                    rest /= shape[axis] as usize;
                }
                let mut coefficients = [0.0; LOCAL];
                self.gather(0, index.map(i64::from), WIDTH, &mut coefficients[..WIDTH.pow(D as u32)]);
                let mut found = Vec::new();
                self.divide(0, index, &coefficients, &mut |leaf| {
                    if keep(&leaf) {
                        found.push(leaf);
                    }
                });
                found
            })
            .collect();
        parts.concat()
    }

    /// Visits the leaf cells of a cell, given the coefficients that act on it.
    fn divide(&self, level: usize, index: [u32; D], coefficients: &[f64; LOCAL], visit: &mut impl FnMut(LeafCell<D>)) {
        let finer = self.levels().get(level).map(|level| level.cells());
        let is_finer = |corner: usize| finer.is_some_and(|cells| cells.contains(child(index, corner)));
        if !(0..1 << D).any(is_finer) {
            let acting = &coefficients[..WIDTH.pow(D as u32)];
            let lower = acting.iter().copied().fold(f64::INFINITY, f64::min);
            let upper = acting.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            return visit(LeafCell { level, index, lower, upper });
        }
        for corner in 0..1 << D {
            let child = child(index, corner);
            let local = if is_finer(corner) {
                let mut local = [0.0; LOCAL];
                self.gather(level + 1, child.map(i64::from), WIDTH, &mut local[..WIDTH.pow(D as u32)]);
                local
            } else {
                of_child::<D>(coefficients, corner)
            };
            self.divide(level + 1, child, &local, visit);
        }
    }
}

/// The cells of a dense spline, which may have any degree.
fn dense_cells<const D: usize>(root: &Spline<D>, keep: impl Fn(&LeafCell<D>) -> bool) -> Vec<LeafCell<D>> {
    let bounds = root.cell_bounds();
    let cells = bounds.lower.indexed_iter().zip(&bounds.upper).map(|((index, lower), upper)| LeafCell {
        level: 0,
        index: std::array::from_fn(|axis| index[axis] as u32),
        lower: *lower,
        upper: *upper,
    });
    cells.filter(keep).collect()
}

/// Whether a corner of a cell, in C order, lies in the upper half along an axis: 0 or 1.
pub(crate) fn half<const D: usize>(corner: usize, axis: usize) -> usize {
    corner >> (D - 1 - axis) & 1
}

/// The child of a cell at a corner.
pub(crate) fn child<const D: usize>(index: [u32; D], corner: usize) -> [u32; D] {
    std::array::from_fn(|axis| 2 * index[axis] + half::<D>(corner, axis) as u32)
}

/// The coefficients that act on the child of a cell at a corner, given those that act on the cell.
pub(crate) fn of_child<const D: usize>(coefficients: &[f64; LOCAL], corner: usize) -> [f64; LOCAL] {
    (0..D).fold(*coefficients, |local, axis| of_half::<D>(&local, axis, half::<D>(corner, axis)))
}

/// The coefficients that act on the lower or the upper half of a cell along an axis, given those that act on the cell.
pub(crate) fn of_half<const D: usize>(coefficients: &[f64; LOCAL], axis: usize, half: usize) -> [f64; LOCAL] {
    match D - axis {
        1 => halved::<D, 1>(coefficients, half),
        2 => halved::<D, WIDTH>(coefficients, half),
        _ => halved::<D, { WIDTH * WIDTH }>(coefficients, half),
    }
}

/// Of the axis with that stride, by the two-scale relation.
fn halved<const D: usize, const STRIDE: usize>(coefficients: &[f64; LOCAL], half: usize) -> [f64; LOCAL] {
    let mut fine = [0.0; LOCAL];
    for block in (0..WIDTH.pow(D as u32)).step_by(STRIDE * WIDTH) {
        for start in block..block + STRIDE {
            let c: [f64; WIDTH] = std::array::from_fn(|k| coefficients[start + k * STRIDE]);
            let even = |m: usize| 0.5 * (c[m] + c[m + 1]);
            let odd = |m: usize| 0.125 * (c[m] + c[m + 2]) + 0.75 * c[m + 1];
            let own = if half == 0 { [even(0), odd(0), even(1), odd(1)] } else { [odd(0), even(1), odd(1), even(2)] };
            for k in 0..WIDTH {
                fine[start + k * STRIDE] = own[k];
            }
        }
    }
    fine
}
