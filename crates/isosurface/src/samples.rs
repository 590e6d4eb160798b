//! Samples on a lattice, with one more layer of outside around them.

use ndarray::ArrayD;
use rayon::prelude::*;
use std::ops::Range;
use zeroset_bspline::{CrossedCells, HierarchicalSpline, IndexSet};

use crate::error::Error;
use crate::function::ImplicitFunction;
use crate::runs::{Run, Runs, union};

/// Values on the nodes of a lattice, whose axes have the coordinates `axes[0][i]`, `axes[1][j]`\[, `axes[2][k]`\]: on all of
/// them, or where the zero set may be.
#[derive(Debug, Clone, PartialEq)]
pub struct LatticeSamples<const D: usize> {
    axes: [Vec<f64>; D],
    /// Where they begin on the whole lattice's axes, of which they are a part that has all cells with their neighbours.
    origin: [usize; D],
    /// Nodes per axis of the whole lattice, the outer layer included.
    whole: [usize; D],
    /// Nodes per axis, the outer layer included.
    padded: [usize; D],
    /// The cells that may hold a part of the zero set. All others have corners of one sign.
    cells: Runs,
    /// Their corners.
    nodes: Runs,
    /// One per node.
    values: Vec<f64>,
    /// The value that stands for outside: positive, and as large as any sample.
    outside: f64,
}

impl<const D: usize> LatticeSamples<D> {
    /// Joins coordinates and values: entry `(i, j[, k])` belongs to `(axes[0][i], axes[1][j][, axes[2][k]])`.
    ///
    /// # Errors
    /// Shapes that do not fit, fewer than two coordinates on an axis, coordinates that do not increase or are too far apart,
    /// or values that are not finite.
    pub fn new(axes: [Vec<f64>; D], values: ArrayD<f64>) -> Result<Self, Error> {
        let lengths = axes.each_ref().map(Vec::len);
        if values.shape() != lengths || lengths.iter().any(|&n| n < 2) {
            return Err(Error::Shape { values: values.shape().to_vec(), axes: lengths.to_vec() });
        }
        let values = values.as_standard_layout();
        #[expect(clippy::expect_used, reason = "in standard layout by the line before")]
        let flat = values.as_slice().expect("standard layout");
        let whole = [Run { from: 0, to: lengths[D - 1] as u32 - 1, first: 0 }];
        let row = |node: &[usize; D]| {
            let first = (0..D).fold(0, |flat, axis| flat * lengths[axis] + node[axis]);
            move |k: usize| flat.get(first + k).copied()
        };
        let part = lengths.map(|n| 0..n as u32 - 1);
        Self::assemble(axes, part, |_| &whole, row)
    }

    /// Samples a function.
    ///
    /// # Errors
    /// As [`LatticeSamples::new`].
    pub fn of(axes: [Vec<f64>; D], function: &impl ImplicitFunction<D>) -> Result<Self, Error> {
        let shape = axes.each_ref().map(Vec::len);
        let count: usize = shape.iter().product();
        let values: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|mut flat| {
                let mut x = [0.0; D];
                for axis in (0..D).rev() {
                    x[axis] = axes[axis][flat % shape[axis]];
                    flat /= shape[axis];
                }
                function.value(&x)
            })
            .collect();
        #[expect(clippy::expect_used, reason = "one value was made per node")]
        let values = ArrayD::from_shape_vec(shape.to_vec(), values).expect("one value per node");
        Self::new(axes, values)
    }

    /// Samples a spline on its dense lattice, every cell halved as often as asked for (at least as often as there are
    /// levels), where its zero set may be: the cost grows with the zero set and not with the volume. An extraction finds what
    /// it would find with samples on the whole lattice.
    ///
    /// # Errors
    /// If cells become too small or too many along an axis, or values are not finite.
    pub fn crossed(spline: &HierarchicalSpline<D>, halvings: u32) -> Result<Self, Error> {
        Self::of_crossed_cells(spline.crossed_cells(halvings)?)
    }

    /// Takes over what a search among a spline's cells has found.
    pub(crate) fn of_crossed_cells(found: CrossedCells<D>) -> Result<Self, Error> {
        let CrossedCells { axes, cells, values } = found;
        let part = part_of(&cells);
        let cells = Runs::of(&cells, &part);
        let blocks = values.blocks();
        let set = values.set();
        let start = part.each_ref().map(|part| part.start as usize);
        let row = |node: &[usize; D]| {
            let mut block = (usize::MAX, None);
            let mut node: [i64; D] = std::array::from_fn(|axis| (node[axis] + start[axis]) as i64);
            // Place of the row in its blocks.
            let place = (0..D - 1).fold(0, |place, axis| place * 8 + node[axis] as usize % 8) * 8;
            move |k: usize| {
                let k = k + start[D - 1];
                if block.0 != k / 8 {
                    node[D - 1] = k as i64;
                    block = (k / 8, set.slot(node));
                }
                block.1.and_then(|slot| blocks.get(slot * IndexSet::<D>::BLOCK + place + k % 8).copied())
            }
        };
        Self::assemble(axes, part, |row| cells.row(row), row)
    }

    /// `part` says which cells of the lattice with these axes are looked at, `cell_rows` gives the runs of cells for each row of cells,
    /// `values` the values in the row that begins at a node.
    fn assemble<'a, V: FnMut(usize) -> Option<f64>>(
        axes: [Vec<f64>; D],
        part: [Range<u32>; D],
        cell_rows: impl Fn(usize) -> &'a [Run],
        values: impl Fn(&[usize; D]) -> V,
    ) -> Result<Self, Error> {
        for (axis, positions) in axes.iter().enumerate() {
            let fault = |i: usize| !positions[i].is_finite() || (i > 0 && positions[i] <= positions[i - 1]);
            if let Some(index) = (0..positions.len()).find(|&i| fault(i)) {
                return Err(Error::Axis { axis, index });
            }
            let length = positions[positions.len() - 1] - positions[0];
            if !(2.0 * length).is_finite() {
                return Err(Error::Extent { axis });
            }
        }
        let whole = axes.each_ref().map(|nodes| nodes.len() + 2);
        let origin = part.each_ref().map(|part| part.start as usize);
        let axes: [Vec<f64>; D] =
            std::array::from_fn(|a| axes[a][part[a].start as usize..=part[a].end as usize].to_vec());
        let padded = axes.each_ref().map(|nodes| nodes.len() + 2);
        // A cell of the outer layer belongs with its neighbour in the lattice.
        let last = padded[D - 1] as u32 - 3;
        let padded_cells = padded.map(|n| n - 1);
        let cells = Runs::new(rows_of(&padded_cells), |row| {
            let at = place_of_row(row, &padded_cells);
            let nearest = |axis: usize| at[axis].saturating_sub(1).min(padded_cells[axis] - 3);
            let row = (0..D - 1).fold(0, |row, axis| row * (padded_cells[axis] - 2) + nearest(axis));
            cell_rows(row).iter().map(move |&Run { from, to, .. }| {
                [if from == 0 { 0 } else { from + 1 }, if to == last { last + 2 } else { to + 1 }]
            })
        });
        let nodes = Runs::new(rows_of(&padded), |row| {
            let at = place_of_row(row, &padded);
            let mut corners = Vec::new();
            for corner in 0..1usize << (D - 1) {
                let mut row = Some(0);
                for axis in 0..D - 1 {
                    let cell = at[axis].checked_sub(corner >> axis & 1).filter(|cell| *cell < padded_cells[axis]);
                    row = row.zip(cell).map(|(row, cell)| row * padded_cells[axis] + cell);
                }
                corners.extend(row.into_iter().flat_map(|row| cells.row(row)).map(|run| [run.from, run.to + 1]));
            }
            union(corners)
        });
        let mut samples =
            Self { axes, origin, whole, padded, cells, nodes, values: vec![], outside: f64::MIN_POSITIVE };
        samples.sample(values)?;
        Ok(samples)
    }

    /// Takes over the values of all nodes.
    fn sample<V: FnMut(usize) -> Option<f64>>(&mut self, values: impl Fn(&[usize; D]) -> V) -> Result<(), Error> {
        let mut all = Vec::with_capacity(self.nodes.len());
        for row in 0..rows_of(&self.padded) {
            let mut node = place_of_row(row, &self.padded);
            let outer = self.is_outer_row(&node);
            // In the outer layer there is nothing to ask for.
            let mut value = (!outer).then(|| values(&std::array::from_fn(|a| node[a].saturating_sub(1))));
            for run in self.nodes.row(row) {
                for k in run.from as usize..run.to as usize {
                    let within = value.as_mut().filter(|_| k > 0 && k + 1 < self.padded[D - 1]);
                    let value = within.map(|value| value(k - 1).unwrap_or(f64::NAN));
                    if value.is_some_and(|v| !v.is_finite()) {
                        node[D - 1] = k;
                        return Err(Error::NotFinite(self.on_whole(&node).map(|k| k - 1).to_vec()));
                    }
                    self.outside = value.map_or(self.outside, |v| self.outside.max(v.abs()));
                    all.push(value.unwrap_or(f64::INFINITY));
                }
            }
        }
        all.iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = self.outside);
        self.values = all;
        Ok(())
    }

    /// Nodes per axis, the outer layer included.
    pub(crate) fn shape(&self) -> [usize; D] {
        self.padded
    }

    /// The cells that may hold a part of the zero set, the outer layer included.
    pub(crate) fn cells(&self) -> &Runs {
        &self.cells
    }

    /// The corners of the cells, the outer layer included.
    pub(crate) fn nodes(&self) -> &Runs {
        &self.nodes
    }

    /// One value per node.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value at a node of the padded lattice that is the corner of a cell.
    pub(crate) fn value(&self, node: &[usize; D]) -> f64 {
        let row = (0..D - 1).fold(0, |row, axis| row * self.padded[axis] + node[axis]);
        self.nodes.find(row, node[D - 1] as u32).map_or(self.outside, |index| self.values[index])
    }

    /// Nodes per axis of the whole lattice, the outer layer included.
    pub(crate) fn whole(&self) -> [usize; D] {
        self.whole
    }

    /// The place of a node or a cell of the padded lattice on the whole one.
    pub(crate) fn on_whole(&self, place: &[usize; D]) -> [usize; D] {
        std::array::from_fn(|axis| place[axis] + self.origin[axis])
    }

    /// The number of the node at a place of the whole lattice, if it is the corner of a cell.
    pub(crate) fn node_at(&self, place: &[usize; D]) -> Option<usize> {
        find(&self.nodes, place, &self.origin, &self.padded)
    }

    /// The value of the node at a place of the whole lattice, if it is the corner of a cell.
    pub(crate) fn value_at(&self, place: &[usize; D]) -> Option<f64> {
        self.node_at(place).map(|number| self.values[number])
    }

    /// The number of the cell at a place of the whole lattice, if it may hold a part of the zero set.
    pub(crate) fn cell_at(&self, place: &[usize; D]) -> Option<usize> {
        find(&self.cells, place, &self.origin, &self.padded.map(|n| n - 1))
    }

    /// Whether a node belongs to the layer around the lattice.
    pub(crate) fn is_outer(&self, node: &[usize; D]) -> bool {
        self.is_outer_row(node) || node[D - 1] == 0 || node[D - 1] + 1 == self.padded[D - 1]
    }

    fn is_outer_row(&self, node: &[usize; D]) -> bool {
        (0..D - 1).any(|axis| node[axis] == 0 || node[axis] + 1 == self.padded[axis])
    }

    /// The position of a node; the outer layer lies a thousandth of a cell outside, so that caps are nearly flush.
    pub(crate) fn position(&self, node: &[usize; D]) -> [f64; D] {
        std::array::from_fn(|axis| {
            let coordinates = &self.axes[axis];
            let last = coordinates.len() - 1;
            match node[axis] {
                0 => coordinates[0] - 2e-3 * (coordinates[1] - coordinates[0]),
                i if i > last + 1 => coordinates[last] + 2e-3 * (coordinates[last] - coordinates[last - 1]),
                i => coordinates[i - 1],
            }
        })
    }
}

/// The number of a member of a part of a lattice, given its place on the whole.
fn find<const D: usize>(members: &Runs, place: &[usize; D], origin: &[usize; D], shape: &[usize; D]) -> Option<usize> {
    let mut row = 0;
    for axis in 0..D - 1 {
        row = row * shape[axis] + place[axis].checked_sub(origin[axis]).filter(|k| *k < shape[axis])?;
    }
    members.find(row, place[D - 1].checked_sub(origin[D - 1])? as u32)
}

/// The part of a lattice that has all cells of a set, and one more around them unless the lattice ends there.
fn part_of<const D: usize>(cells: &IndexSet<D>) -> [Range<u32>; D] {
    let extent = cells.extent();
    let (mut first, mut last) = (extent.map(|n| n - 1), [0; D]);
    for start in (0..cells.block_count()).map(|slot| cells.block_start(slot)) {
        first = std::array::from_fn(|axis| first[axis].min(start[axis]));
        last = std::array::from_fn(|axis| last[axis].max(start[axis]));
    }
    // Blocks have eight cells along each axis. An empty set has a cell all the same.
    std::array::from_fn(|axis| first[axis].saturating_sub(1)..(last[axis].max(first[axis]) + 9).min(extent[axis]))
}

/// Rows of a lattice along its last axis.
fn rows_of<const D: usize>(shape: &[usize; D]) -> usize {
    shape[..D - 1].iter().product()
}

/// Where a row begins.
fn place_of_row<const D: usize>(mut row: usize, shape: &[usize; D]) -> [usize; D] {
    let mut place = [0; D];
    for axis in (0..D - 1).rev() {
        place[axis] = row % shape[axis];
        row /= shape[axis];
    }
    place
}
