//! The cells that the zero set may pass through, found by bounds from coarse to fine, with f at their corners.

use rayon::prelude::*;
use std::sync::Arc;

use crate::block_field::BlockField;
use crate::block_mask::{self, Mask, SIDE};
use crate::cell_band::{BandError, check_uniform};
use crate::coefficient_window::CoefficientWindow;
use crate::hierarchical_spline::HierarchicalSpline;
use crate::index_set::{IndexSet, spread, spread_extent};

/// What is needed to find the zero set on one lattice: the dense lattice's cells halved some number of times.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossedCells<const D: usize> {
    /// Coordinates of the lattice's nodes along each axis.
    pub axes: [Vec<f64>; D],
    /// The cells that bounds do not rule out. In all others f has one sign, f < 0 or f ≥ 0; of cells at the box's faces only
    /// those with f ≥ 0 are left out.
    pub cells: IndexSet<D>,
    /// f at the corners of these cells, by their place among the lattice's nodes.
    pub values: BlockField<D>,
}

/// The cells of one block, and f at their corners.
pub(crate) struct Found {
    /// How often the dense lattice's cells were halved.
    pub(crate) halving: usize,
    /// As in [`IndexSet`].
    block: [u32; 3],
    cells: Mask,
    /// In C order of the block's `9 × 9 [× 9]` nodes, only the corners of `cells`.
    values: Vec<f64>,
}

/// Coefficients above this, and below zero, are too small for a mean of them to be known as negative: it might underflow.
const NEGATIVE: f64 = -1e-300;

/// The rows of a block's nodes: a bit for each along the last axis.
type NodeRows = [[u16; SIDE + 1]; SIDE + 1];

impl<const D: usize> HierarchicalSpline<D> {
    /// The cells that the zero set may pass through, of the dense lattice with its cells halved as often as asked for (at
    /// least as often as there are levels), and f at their corners. Time and memory grow with the zero set (and with the part
    /// of the box's faces where f < 0), not with the volume.
    ///
    /// A cell is left out when the coefficients that act on it, or on a coarser cell around it, have one sign. A corner's
    /// value is a sum of the same coefficients with weights that are not negative, so that a corner shared by several
    /// cells never contradicts the bounds of any of them, rounding included. A dense spline that is not a uniform cubic is
    /// bounded on its own cells only.
    ///
    /// # Errors
    /// If cells become too small or too many along an axis ([`BandError::TooFine`]).
    pub fn crossed_cells(&self, halvings: u32) -> Result<CrossedCells<D>, BandError> {
        let halvings = (halvings as usize).max(self.levels().len());
        let axes = self.nodes(halvings)?;
        let extent = axes.each_ref().map(|nodes| nodes.len() as u32 - 1);
        let found = if check_uniform(self.root().knots()).is_ok() {
            Descent::new(self, halvings, extent).run(&Finest { halvings })
        } else {
            self.in_crossed_root_cells(halvings, &axes)
        };
        Ok(CrossedCells::of(axes, &found))
    }

    /// Ends of the dense lattice's cells along each axis, halved some number of times.
    pub(crate) fn nodes(&self, halvings: usize) -> Result<[Vec<f64>; D], BandError> {
        let mut axes = self.root().knots().each_ref().map(|knots| {
            let mut nodes: Vec<f64> = knots.cells().map(|(_, start, _)| start).collect();
            nodes.push(knots.domain().1);
            nodes
        });
        for nodes in &mut axes {
            for level in 0..=halvings {
                if level > 0 {
                    let middle = |pair: &[f64]| [pair[0], pair[0] + 0.5 * (pair[1] - pair[0])];
                    let last = nodes.last().copied();
                    *nodes = nodes.windows(2).flat_map(middle).chain(last).collect();
                }
                let increase = nodes.windows(2).all(|pair| pair[0] < pair[1]);
                if !increase || nodes.len() > IndexSet::<D>::MAX_EXTENT as usize {
                    return Err(BandError::TooFine(level));
                }
            }
        }
        Ok(axes)
    }

    /// All parts of the dense spline's cells that its bounds do not rule out.
    fn in_crossed_root_cells(&self, halvings: usize, axes: &[Vec<f64>; D]) -> Vec<Found> {
        let bounds = self.root().cell_bounds();
        let extent: [u32; D] = std::array::from_fn(|axis| bounds.lower.shape()[axis] as u32);
        // Where f may jump, neighbours' bounds say nothing about the value at a node between them.
        let jumps = self.root().knots().iter().any(|knots| knots.interior_multiplicity() > knots.degree());
        let mut kept = Vec::new();
        for ((index, lower), upper) in bounds.lower.indexed_iter().zip(&bounds.upper) {
            let index: [u32; D] = std::array::from_fn(|axis| index[axis] as u32);
            if jumps || is_crossed(*lower, *upper, is_at_face(&index, &extent)) {
                kept.push(index);
            }
        }
        let mut cells = IndexSet::new(extent, &kept);
        for _ in 0..halvings {
            cells = cells.children();
        }
        (0..cells.block_count())
            .into_par_iter()
            .map(|slot| {
                let start = spread(cells.block_start(slot));
                let mut values = Vec::new();
                for_each_node(&node_rows::<D>(&cells.masks[slot]), |node| {
                    let place = |axis: usize| (start[3 - D + axis] as usize) + node[3 - D + axis];
                    values.push(self.root().value(&std::array::from_fn(|axis| axes[axis][place(axis)])));
                });
                Found { halving: halvings, block: cells.blocks[slot], cells: cells.masks[slot], values }
            })
            .collect()
    }
}

impl<const D: usize> CrossedCells<D> {
    /// Brings what was found on one lattice together.
    pub(crate) fn of(axes: [Vec<f64>; D], found: &[Found]) -> Self {
        let extent = axes.each_ref().map(|nodes| nodes.len() as u32 - 1);
        let cells = Found::cells_of(extent, found.iter());
        let nodes = Arc::new(cells.dilated(0..=1, extent.map(|n| n + 1)));
        let values = corners_to_field(found, nodes);
        Self { axes, cells, values }
    }

    /// Whether f < 0 anywhere on the box's faces.
    pub(crate) fn leaves_box(&self) -> bool {
        let (set, last) = (self.values.set(), self.cells.extent());
        let mut values = vec![0.0; set.len()];
        self.values.members(&mut values);
        let is_at_face = |node: &[u32; D]| (0..D).any(|axis| node[axis] == 0 || node[axis] == last[axis]);
        set.iter().zip(&values).any(|(node, value)| *value < 0.0 && is_at_face(&node))
    }

    /// Takes the values of all nodes that a lattice with half the spacing has too from there.
    pub(crate) fn take_over(&mut self, finer: &Self) {
        let set = Arc::clone(self.values.set());
        let blocks = self.values.blocks_mut();
        let mut value = [0.0];
        for slot in 0..set.block_count() {
            let start = set.block_start(slot);
            set.for_each_place(slot, |place| {
                let places = [place / 64, place / SIDE % SIDE, place % SIDE];
                let node: [u32; D] = std::array::from_fn(|axis| 2 * (start[axis] + places[3 - D + axis] as u32));
                if finer.values.set().contains(node) {
                    finer.values.gather(node.map(i64::from), 1, &mut value);
                    blocks[slot * IndexSet::<D>::BLOCK + place] = value[0];
                }
            });
        }
    }
}

impl Found {
    /// The cells that were found on one lattice.
    pub(crate) fn cells_of<'a, const D: usize>(extent: [u32; D], found: impl Iterator<Item = &'a Self>) -> IndexSet<D> {
        let mut blocks: Vec<([u32; 3], Mask)> = found.map(|found| (found.block, found.cells)).collect();
        blocks.par_sort_unstable();
        IndexSet::from_blocks(extent, blocks.into_iter())
    }
}

/// Which cells a descent takes, and where it goes on with halved ones.
pub(crate) trait Search<const D: usize>: Sync {
    /// The cells of a block to be taken, and those to be halved. `crossed` gives those that bounds do not rule out, as far as the levels
    /// up to this one say.
    fn choose(&self, halving: usize, start: [u32; D], crossed: impl FnOnce() -> Mask) -> [Mask; 2];

    /// Whether there is anything to look for in a block, given whether a block around it has cells to be halved there, and whether a finer
    /// level may change what bounds say.
    fn enters(&self, halving: usize, start: [u32; D], is_halved: bool, has_finer: bool) -> bool;
}

/// All cells of the finest lattice that bounds do not rule out.
struct Finest {
    halvings: usize,
}

impl<const D: usize> Search<D> for Finest {
    fn choose(&self, halving: usize, _: [u32; D], crossed: impl FnOnce() -> Mask) -> [Mask; 2] {
        if halving == self.halvings { [crossed(), [0; SIDE]] } else { [[0; SIDE], crossed()] }
    }

    fn enters(&self, _: usize, _: [u32; D], is_halved: bool, has_finer: bool) -> bool {
        is_halved || has_finer
    }
}

/// The search among the cells of a uniform cubic and its levels, from block to block of half the size.
pub(crate) struct Descent<'a, const D: usize> {
    spline: &'a HierarchicalSpline<D>,
    halvings: usize,
    /// Cells of the finest lattice along each axis.
    extent: [u32; D],
    /// δ of every level.
    corrections: Vec<BlockField<D>>,
}

impl<'a, const D: usize> Descent<'a, D> {
    pub(crate) fn new(spline: &'a HierarchicalSpline<D>, halvings: usize, extent: [u32; D]) -> Self {
        let field = |level: &crate::hierarchical_spline::Level<D>| {
            let mut field = BlockField::zeros(Arc::clone(level.active()));
            field.scatter(level.corrections());
            field
        };
        Self { spline, halvings, extent, corrections: spline.levels().iter().map(field).collect() }
    }

    pub(crate) fn run(&self, search: &impl Search<D>) -> Vec<Found> {
        let counts = self.extent_at(0).map(|n| n.div_ceil(SIDE as u32));
        let total: usize = counts.iter().map(|n| *n as usize).product();
        let parts: Vec<Vec<Found>> = (0..total)
            .into_par_iter()
            .map(|flat| {
                let mut rest = flat as u32;
                let mut start = [0; D];
                for axis in (0..D).rev() {
                    start[axis] = rest % counts[axis] * SIDE as u32;
                    rest /= counts[axis];
                }
                let mut window = CoefficientWindow::zeros();
                self.spline.gather(0, start.map(i64::from), CoefficientWindow::<D>::SIDE, window.as_mut_slice());
                self.visit(search, 0, start, &window)
            })
            .collect();
        parts.into_iter().flatten().collect()
    }

    pub(crate) fn extent_at(&self, halving: usize) -> [u32; D] {
        self.extent.map(|n| n >> (self.halvings - halving))
    }

    /// What is to be found in a block of cells, given the coefficients that act there without finer levels.
    fn visit(
        &self,
        search: &impl Search<D>,
        halving: usize,
        start: [u32; D],
        window: &CoefficientWindow<D>,
    ) -> Vec<Found> {
        let [taken, halved] = search.choose(halving, start, || self.crossed(halving, &start, window));
        let own = (taken != [0; SIDE]).then(|| {
            let nodes = window.node_values();
            let mut values = Vec::with_capacity(2 * block_mask::count(&taken));
            let side = SIDE + 1;
            for_each_node(&node_rows::<D>(&taken), |[x, y, z]| values.push(nodes[(x * side + y) * side + z]));
            values.shrink_to_fit();
            Found { halving, block: spread(start).map(|k| k / SIDE as u32), cells: taken, values }
        });
        if halving == self.halvings {
            return own.into_iter().collect();
        }
        let extent = self.extent_at(halving + 1);
        let child = |corner: usize| -> Vec<Found> {
            let half: [usize; D] = std::array::from_fn(|axis| corner >> (D - 1 - axis) & 1);
            let start = std::array::from_fn(|axis| 2 * start[axis] + (half[axis] * SIDE) as u32);
            if (0..D).any(|axis| start[axis] >= extent[axis]) {
                return vec![];
            }
            let finer = self.spline.levels().get(halving);
            let has_finer = finer.is_some_and(|level| level.cells().slot(start.map(i64::from)).is_some());
            let is_halved = block_mask::children(&halved, spread(half), IndexSet::<D>::DEPTH) != [0; SIDE];
            if !search.enters(halving + 1, start, is_halved, has_finer) {
                return vec![];
            }
            let mut window = window.halved(half);
            if has_finer {
                window.add(&self.corrections[halving], start.map(i64::from));
            }
            self.visit(search, halving + 1, start, &window)
        };
        let corners = 0..1usize << D;
        let parts: Vec<Vec<Found>> = if halving + 2 < self.halvings {
            corners.into_par_iter().map(child).collect()
        } else {
            corners.map(child).collect()
        };
        own.into_iter().chain(parts.into_iter().flatten()).collect()
    }

    /// The cells of a block that may be crossed, as far as the levels up to this one say.
    fn crossed(&self, halving: usize, start: &[u32; D], window: &CoefficientWindow<D>) -> Mask {
        let extent = self.extent_at(halving);
        let room = spread_extent::<D>(std::array::from_fn(|axis| extent[axis] - start[axis])).map(|n| n as usize);
        let inside_extent = block_mask::within(room);
        let at_face = (0..D).any(|axis| start[axis] == 0 || start[axis] + SIDE as u32 >= extent[axis]);
        let (lower, upper) = window.range();
        if !is_crossed(lower, upper, at_face) {
            return [0; SIDE];
        }
        let (lower, upper) = window.bounds();
        let mut mask = [0; SIDE];
        for place in 0..IndexSet::<D>::BLOCK {
            let places = [place / 64, place / SIDE % SIDE, place % SIDE];
            let index = std::array::from_fn(|axis| start[axis] + places[3 - D + axis] as u32);
            let face = at_face && is_at_face(&index, &extent);
            mask[place / 64] |= u64::from(is_crossed(lower[place], upper[place], face)) << (place % 64);
        }
        std::array::from_fn(|x| mask[x] & inside_extent[x])
    }
}

/// Whether coefficients between two numbers leave open which sign f has, or at a face whether it is negative.
fn is_crossed(lower: f64, upper: f64, at_face: bool) -> bool {
    lower < 0.0 && (at_face || upper > NEGATIVE)
}

fn is_at_face<const D: usize>(index: &[u32; D], extent: &[u32; D]) -> bool {
    (0..D).any(|axis| index[axis] == 0 || index[axis] + 1 == extent[axis])
}

/// The corners of cells.
fn node_rows<const D: usize>(cells: &Mask) -> NodeRows {
    let mut rows = [[0; SIDE + 1]; SIDE + 1];
    for x in 0..IndexSet::<D>::DEPTH {
        for y in 0..SIDE {
            let row = (cells[x] >> (8 * y) & 0xff) as u16;
            let corners = row | row << 1;
            for (dx, dy) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                // The plane has no nodes along the first of three axes but one.
                if D == 3 || dx == 0 {
                    rows[x + dx][y + dy] |= corners;
                }
            }
        }
    }
    rows
}

/// Visits nodes in C order.
fn for_each_node(rows: &NodeRows, mut visit: impl FnMut([usize; 3])) {
    for (x, plane) in rows.iter().enumerate() {
        for (y, row) in plane.iter().enumerate() {
            let mut rest = *row;
            while rest != 0 {
                visit([x, y, rest.trailing_zeros() as usize]);
                rest &= rest - 1;
            }
        }
    }
}

/// Brings the corners of all blocks together. Where blocks share a node they have the same number for it.
fn corners_to_field<const D: usize>(found: &[Found], nodes: Arc<IndexSet<D>>) -> BlockField<D> {
    let mut field = BlockField::zeros(Arc::clone(&nodes));
    let blocks = field.blocks_mut();
    for found in found {
        let slots: [Option<usize>; 8] = std::array::from_fn(|corner| {
            nodes.slot_of(std::array::from_fn(|axis| found.block[axis] + (corner >> (2 - axis) & 1) as u32))
        });
        let mut values = found.values.iter();
        for_each_node(&node_rows::<D>(&found.cells), |node| {
            let corner = node.iter().fold(0, |corner, k| 2 * corner + k / SIDE);
            let place = node.iter().fold(0, |place, k| place * SIDE + k % SIDE);
            if let (Some(slot), Some(value)) = (slots[corner], values.next()) {
                blocks[slot * IndexSet::<D>::BLOCK + place] = *value;
            }
        });
    }
    field
}
