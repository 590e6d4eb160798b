//! The cells that the zero set may pass through, about as fine as the function is around.

use rayon::prelude::*;
use std::ops::RangeInclusive;

use crate::block_mask::{Mask, SIDE};
use crate::cell_band::BandError;
use crate::crossed_cells::{CrossedCells, Descent, Found, Search};
use crate::hierarchical_spline::{HierarchicalSpline, Level};
use crate::index_set::{IndexSet, spread};

/// How often the dense lattice's cells are halved for the cells of a [`HierarchicalSpline::grading`] where the function has those of a level: as
/// often as for the smallest ones there are, which are halved `finest` times, but for cells half as large as the function's at the most.
pub fn graded_halving(level: usize, levels: usize, finest: usize) -> usize {
    finest.min(level + finest.saturating_sub(levels).max(1))
}

/// A division of the box into cells of several sizes, each half as large as the next. Cells that touch, if only at a corner, are of the same
/// size, or one is half as large as the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading<const D: usize> {
    /// How often the dense lattice's cells are halved for the largest ones.
    coarsest: usize,
    /// How often the cells of `divided` are halved for those of the division.
    halvings: usize,
    /// For every size but the smallest, the largest first, the parts of the box where the cells are smaller: as cells of lattices that are each
    /// half as fine as the next. Parts of a set lie within those of the one before.
    divided: Vec<IndexSet<D>>,
}

impl<const D: usize> Grading<D> {
    fn of(spline: &HierarchicalSpline<D>, halvings: &RangeInclusive<u32>) -> Self {
        let levels = spline.levels();
        let finest = (*halvings.end() as usize).max(levels.len());
        // Of the dense lattice's cells, and so of every level's whose cells are not the smallest.
        let halved = graded_halving(0, levels.len(), finest);
        let coarsest = finest.min(halved.max(*halvings.start() as usize));
        let divided = |finer: &Level<D>| {
            let members: Vec<[u32; D]> = finer.cells().iter().map(parent).collect();
            IndexSet::new(finer.cells().extent().map(|n| n / 2), &members)
        };
        let divided = levels[coarsest - halved..finest - halved].iter().map(divided).collect();
        let mut grading = Self { coarsest, halvings: halved, divided };
        grading.balance();
        grading
    }

    /// How often the dense lattice's cells are halved for the smallest ones.
    pub fn finest(&self) -> usize {
        self.coarsest + self.divided.len()
    }

    /// Has smaller cells in place of some of one size, and around them where that takes it. For their size the dense lattice's cells are halved
    /// `halving` times; the smallest ones stay.
    pub fn divide(&mut self, halving: usize, cells: &[[u32; D]]) {
        let Some(divided) = halving.checked_sub(self.coarsest).and_then(|level| self.divided.get_mut(level)) else {
            return;
        };
        let mut all: Vec<[u32; D]> = divided.iter().collect();
        all.extend(cells.iter().map(|cell| cell.map(|k| k >> self.halvings)));
        *divided = IndexSet::new(divided.extent(), &all);
        self.balance();
    }

    /// Divides larger cells where they would touch ones that are less than half as large.
    fn balance(&mut self) {
        for level in (1..self.divided.len()).rev() {
            let (coarser, finer) = self.divided.split_at_mut(level);
            let around = finer[0].dilated(-1..=1, finer[0].extent());
            let own = &mut coarser[level - 1];
            let members: Vec<[u32; D]> = own.iter().chain(around.iter().map(parent)).collect();
            *own = IndexSet::new(own.extent(), &members);
        }
    }

    /// Whether a cell, of the dense lattice's halved so often, is divided further.
    fn is_divided(&self, halving: usize, cell: [u32; D]) -> bool {
        match halving.checked_sub(self.coarsest) {
            None => true,
            Some(level) => {
                self.divided.get(level).is_some_and(|divided| divided.contains(cell.map(|k| k >> self.halvings)))
            }
        }
    }

    /// The cells of a block that are divided further.
    fn divided_mask(&self, halving: usize, start: [u32; D]) -> Mask {
        self.mask(halving, 0, start)
    }

    /// The cells of a block that are not within a larger cell of the division.
    fn present_mask(&self, halving: usize, start: [u32; D]) -> Mask {
        self.mask(halving, 1, start)
    }

    /// The cells of a block that lie in divided ones of the lattice with so many fewer halvings.
    fn mask(&self, halving: usize, fewer: usize, start: [u32; D]) -> Mask {
        match halving.checked_sub(self.coarsest + fewer) {
            None => [u64::MAX; SIDE],
            Some(level) => self.divided.get(level).map_or([0; SIDE], |set| refined(set, start, self.halvings + fewer)),
        }
    }
}

/// The cell with twice the side around a cell.
fn parent<const D: usize>(cell: [u32; D]) -> [u32; D] {
    cell.map(|k| k / 2)
}

/// The places of a block whose cells lie in one of a set's, halved so often.
fn refined<const D: usize>(set: &IndexSet<D>, start: [u32; D], halvings: usize) -> Mask {
    let mut mask = [0; SIDE];
    // A block holds few cells of the set, or a part of one.
    let side = (SIDE >> halvings).max(1);
    let width = SIDE / side;
    let sides = spread([side; D]).map(|n| n.max(1));
    for at in
        (0..sides.iter().product::<usize>()).map(|i| [i / sides[2] / sides[1], i / sides[2] % sides[1], i % sides[2]])
    {
        let cell = std::array::from_fn(|axis| (start[axis] + (at[3 - D + axis] * width) as u32) >> halvings);
        if !set.contains(cell) {
            continue;
        }
        let bits = |k: usize| (0xff >> (SIDE - width)) << (k * width);
        let row = (0..width).fold(0u64, |word, y| word | bits(at[2]) << (SIDE * (at[1] * width + y)));
        let depth = if D == 3 { width } else { 1 };
        mask[at[0] * width..at[0] * width + depth].iter_mut().for_each(|word| *word |= row);
    }
    mask
}

impl<const D: usize> HierarchicalSpline<D> {
    /// A division of the box whose smallest cells are those of the dense lattice halved as often as the range's end says, at least as often as
    /// there are levels. They are where the function has its finest level; where that is coarser they are larger by as much, but at most half as
    /// large as the function's own, and none is larger than the dense lattice's halved as often as the range's start says.
    pub fn grading(&self, halvings: RangeInclusive<u32>) -> Grading<D> {
        Grading::of(self, &halvings)
    }

    /// As [`HierarchicalSpline::crossed_cells`], of the cells of a division: for each size, the smallest first, those that the zero set may
    /// pass through, and those that touch a larger one of these. Where sizes share a node it has one value. `None` if the zero set
    /// leaves the box and there are several sizes.
    ///
    /// # Errors
    /// If cells become too small or too many along an axis ([`BandError::TooFine`]).
    pub fn graded_cells(&self, grading: &Grading<D>) -> Result<Option<Vec<CrossedCells<D>>>, BandError> {
        let finest = grading.finest();
        if grading.divided.is_empty() {
            return Ok(Some(vec![self.crossed_cells(finest as u32)?]));
        }
        let extent = self.nodes(finest)?.map(|nodes| nodes.len() as u32 - 1);
        let descent = Descent::new(self, finest, extent);
        let mut found = descent.run(&Leaves(grading));
        // The smallest come first.
        let halvings = || (grading.coarsest..=finest).rev();
        let cells =
            |halving| Found::cells_of(descent.extent_at(halving), found.iter().filter(|f| f.halving == halving));
        let mut sizes: Vec<IndexSet<D>> = halvings().map(cells).collect();
        if sizes[1..].iter().any(|cells| !cells.is_empty()) {
            for i in 0..sizes.len() - 1 {
                let touching = touching(grading, finest - i - 1, &sizes[i + 1]);
                let members: Vec<[u32; D]> = sizes[i].iter().chain(touching).collect();
                sizes[i] = IndexSet::new(sizes[i].extent(), &members);
            }
            found = descent.run(&Given::of(grading.coarsest, &sizes));
        }
        let mut all: Vec<CrossedCells<D>> = Vec::with_capacity(sizes.len());
        for halving in halvings() {
            let (own, rest) = found.into_iter().partition(|found| found.halving == halving);
            found = rest;
            let mut cells = CrossedCells::of(self.nodes(halving)?, &own);
            if let Some(finer) = all.last() {
                cells.take_over(finer);
            }
            all.push(cells);
        }
        let is_graded = all[1..].iter().any(|size| !size.cells.is_empty());
        Ok(Some(all).filter(|all| !(is_graded && all.iter().any(CrossedCells::leaves_box))))
    }
}

/// The smaller cells that touch some larger ones.
fn touching<const D: usize>(grading: &Grading<D>, halving: usize, larger: &IndexSet<D>) -> Vec<[u32; D]> {
    let extent = larger.extent();
    let members: Vec<[u32; D]> = larger.iter().collect();
    let of = |cell: &[u32; D]| {
        let mut found = vec![];
        for flat in 0..4usize.pow(D as u32) {
            // From one before the first child to one after the last.
            let steps: [u32; D] = std::array::from_fn(|axis| (flat >> (2 * axis) & 3) as u32);
            if steps.iter().all(|step| *step == 1 || *step == 2) {
                continue;
            }
            let child: [Option<u32>; D] = std::array::from_fn(|axis| (2 * cell[axis] + steps[axis]).checked_sub(1));
            if child.iter().zip(extent).any(|(k, n)| k.is_none_or(|k| k >= 2 * n)) {
                continue;
            }
            let child = child.map(Option::unwrap_or_default);
            if grading.is_divided(halving, parent(child)) {
                found.push(child);
            }
        }
        found
    };
    members.par_iter().flat_map_iter(of).collect()
}

/// The cells of a division that bounds do not rule out.
struct Leaves<'a, const D: usize>(&'a Grading<D>);

impl<const D: usize> Search<D> for Leaves<'_, D> {
    fn choose(&self, halving: usize, start: [u32; D], crossed: impl FnOnce() -> Mask) -> [Mask; 2] {
        let present = self.0.present_mask(halving, start);
        let divided = self.0.divided_mask(halving, start);
        let crossed = crossed();
        let of = |x: usize| crossed[x] & present[x];
        [std::array::from_fn(|x| of(x) & !divided[x]), std::array::from_fn(|x| of(x) & divided[x])]
    }

    fn enters(&self, halving: usize, start: [u32; D], is_halved: bool, has_finer: bool) -> bool {
        is_halved || (has_finer && self.0.present_mask(halving, start) != [0; SIDE])
    }
}

/// Cells that are known.
struct Given<'a, const D: usize> {
    /// Halvings of the largest.
    coarsest: usize,
    /// The smallest first.
    sizes: &'a [IndexSet<D>],
    /// The blocks on the way to them, for every halving from none.
    blocks: Vec<IndexSet<D>>,
}

impl<'a, const D: usize> Given<'a, D> {
    fn of(coarsest: usize, sizes: &'a [IndexSet<D>]) -> Self {
        let mut blocks: Vec<IndexSet<D>> = vec![];
        for halving in (0..coarsest + sizes.len()).rev() {
            let mut all: Vec<[u32; D]> = vec![];
            if let Some(finer) = blocks.last() {
                all.extend(finer.iter().map(parent));
            }
            if let Some(cells) = size_of(coarsest, sizes, halving) {
                all.extend((0..cells.block_count()).map(|slot| cells.block_start(slot).map(|k| k / SIDE as u32)));
            }
            let most = all.iter().fold([0; D], |most, block| std::array::from_fn(|a| block[a].max(most[a])));
            blocks.push(IndexSet::new(most.map(|b| b + 1), &all));
        }
        blocks.reverse();
        Self { coarsest, sizes, blocks }
    }
}

/// Of some sizes, the smallest first and the largest halved `coarsest` times, the one halved so often.
fn size_of<const D: usize>(coarsest: usize, sizes: &[IndexSet<D>], halving: usize) -> Option<&IndexSet<D>> {
    halving.checked_sub(coarsest).map(|level| &sizes[sizes.len() - 1 - level])
}

impl<const D: usize> Search<D> for Given<'_, D> {
    fn choose(&self, halving: usize, start: [u32; D], _: impl FnOnce() -> Mask) -> [Mask; 2] {
        let taken = size_of(self.coarsest, self.sizes, halving)
            .and_then(|cells| Some(cells.masks[cells.slot(start.map(i64::from))?]));
        [taken.unwrap_or([0; SIDE]), [0; SIDE]]
    }

    fn enters(&self, halving: usize, start: [u32; D], _: bool, _: bool) -> bool {
        self.blocks[halving].contains(start.map(|k| k / SIDE as u32))
    }
}
