//! One number for every member of a sparse set, stored in dense blocks.

use rayon::prelude::*;
use std::sync::Arc;

use crate::block_mask::SIDE;
use crate::hierarchical_spline::WIDTH;
use crate::index_set::{IndexSet, spread};

/// Places after a block that rows are gathered with: functions that act on its last cell.
const AFTER: usize = WIDTH - 1;

/// Numbers on the members of an [`IndexSet`]: control coefficients of the basis functions that matter.
///
/// Every block of the set has its `8 × 8 [× 8]` numbers in C order, zero where it has no member. Blocks come in the order of
/// the set.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockField<const D: usize> {
    set: Arc<IndexSet<D>>,
    values: Vec<f64>,
}

impl<const D: usize> BlockField<D> {
    /// Zero everywhere.
    pub fn zeros(set: Arc<IndexSet<D>>) -> Self {
        let values = vec![0.0; set.block_count() * IndexSet::<D>::BLOCK];
        Self { set, values }
    }

    /// The set on which the numbers are given.
    pub fn set(&self) -> &Arc<IndexSet<D>> {
        &self.set
    }

    /// The blocks, one after the other.
    pub fn blocks(&self) -> &[f64] {
        &self.values
    }

    pub(crate) fn blocks_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Replaces every block by what `fill` writes into it; places without a member are set to zero afterwards.
    pub fn fill_blocks(&mut self, fill: impl Fn(usize, &mut [f64]) + Sync) {
        let set = &self.set;
        self.values.par_chunks_exact_mut(IndexSet::<D>::BLOCK).enumerate().for_each(|(slot, block)| {
            fill(slot, block);
            let mut from = 0;
            set.for_each_place(slot, |place| {
                block[from..place].fill(0.0);
                from = place + 1;
            });
            block[from..].fill(0.0);
        });
    }

    /// Replaces all numbers by the given ones of the set's members, in their order.
    ///
    /// # Panics
    /// If there is not one number per member.
    #[track_caller]
    pub fn scatter(&mut self, members: &[f64]) {
        assert_eq!(members.len(), self.set.len(), "one number per member");
        let set = &self.set;
        self.values.par_chunks_exact_mut(IndexSet::<D>::BLOCK).enumerate().with_min_len(16).for_each(
            |(slot, block)| {
                block.fill(0.0);
                let mut next = members[set.block_ranks(slot)].iter();
                set.for_each_place(slot, |place| {
                    if let Some(value) = next.next() {
                        block[place] = *value;
                    }
                });
            },
        );
    }

    /// The numbers of the set's members, in their order: the inverse of [`BlockField::scatter`].
    ///
    /// # Panics
    /// If `out` does not have one place per member.
    #[track_caller]
    pub fn members(&self, out: &mut [f64]) {
        assert_eq!(out.len(), self.set.len(), "one place per member");
        self.set.members_of_blocks(&self.values, out);
    }

    /// Takes over the numbers of another field on the same set.
    ///
    /// # Panics
    /// If the sets have different numbers of blocks.
    #[track_caller]
    pub fn assign(&mut self, other: &Self) {
        assert_eq!(self.values.len(), other.values.len(), "as many blocks");
        let blocks = self.values.par_chunks_exact_mut(IndexSet::<D>::BLOCK);
        let others = other.values.par_chunks_exact(IndexSet::<D>::BLOCK);
        blocks.zip(others).with_min_len(64).for_each(|(block, other)| block.copy_from_slice(other));
    }

    /// Adds numbers given on the members of a subset, in their order.
    ///
    /// # Panics
    /// If there is not one number per member of the subset.
    #[track_caller]
    pub fn add(&mut self, subset: &IndexSet<D>, members: &[f64]) {
        assert_eq!(members.len(), subset.len(), "one number per member");
        let set = &self.set;
        self.values.par_chunks_exact_mut(IndexSet::<D>::BLOCK).enumerate().with_min_len(16).for_each(
            |(slot, block)| {
                if let Some(from) = subset.slot(set.block_start(slot).map(i64::from)) {
                    let mut next = members[subset.block_ranks(from)].iter();
                    subset.for_each_place(from, |place| {
                        if let Some(value) = next.next() {
                            block[place] += value;
                        }
                    });
                }
            },
        );
    }

    /// Copies the numbers in a box of `side` places along each axis, in C order; zero where the field has no block.
    ///
    /// # Panics
    /// If `out` does not have `side^D` places.
    #[track_caller]
    pub fn gather(&self, first: [i64; D], side: usize, out: &mut [f64]) {
        assert_eq!(out.len(), side.pow(D as u32), "one place per number");
        let pieces = first.map(|first| Pieces::new(first, side));
        if pieces.iter().all(|p| p.count == 1) {
            return self.copy(first.map(|first| first & !7), pieces.map(|p| p.at(0)), side, out);
        }
        let total: usize = pieces.iter().map(|p| p.count).product();
        for flat in 0..total {
            let mut rest = flat;
            let mut start = [0; D];
            let mut piece = [(0, 0, 0); D];
            for axis in (0..D).rev() {
                let step = rest % pieces[axis].count;
                rest /= pieces[axis].count;
                start[axis] = (first[axis] & !7) + (step * SIDE) as i64;
                piece[axis] = pieces[axis].at(step);
            }
            self.copy(start, piece, side, out);
        }
    }

    /// Copies the numbers of the functions that act on a cell: `4^D` from `first` on, in C order; zero where the field has no
    /// block. As [`BlockField::gather`] does, only faster.
    ///
    /// # Panics
    /// If `out` does not have `4^D` places.
    #[track_caller]
    pub(crate) fn gather_cell(&self, first: [u32; D], out: &mut [f64]) {
        assert_eq!(out.len(), WIDTH.pow(D as u32), "one place per number");
        let first = spread(first).map(|k| k as usize);
        let blocks = [0, 1, 2].map(|axis| if first[axis] % SIDE + WIDTH > SIDE && axis + D >= 3 { 2 } else { 1 });
        let mut slots = [[[None; 2]; 2]; 2];
        for x in 0..blocks[0] {
            for y in 0..blocks[1] {
                for z in 0..blocks[2] {
                    let block = [first[0] / SIDE + x, first[1] / SIDE + y, first[2] / SIDE + z];
                    slots[x][y][z] = self.set.slot_of(block.map(|b| b as u32));
                }
            }
        }
        let own = (SIDE - first[2] % SIDE).min(WIDTH);
        for (row, out) in out.as_chunks_mut::<WIDTH>().0.iter_mut().enumerate() {
            let (x, y) = (first[0] % SIDE + row / WIDTH, first[1] % SIDE + row % WIDTH);
            let from = (x % SIDE * SIDE + y % SIDE) * SIDE;
            let [before, after] = slots[x / SIDE][y / SIDE];
            if own == WIDTH {
                *out = self.row_of_block(before, from + first[2] % SIDE);
            } else {
                let after: [f64; WIDTH] = self.row_of_block(after, from);
                let before: [f64; WIDTH] = self.row_of_block(before, from + SIDE - WIDTH);
                for k in 0..WIDTH {
                    out[k] = if k < own { before[WIDTH - own + k] } else { after[k - own] };
                }
            }
        }
    }

    /// `N` numbers of a block, or zeros without one.
    #[inline(always)]
    fn row_of_block<const N: usize>(&self, slot: Option<usize>, from: usize) -> [f64; N] {
        let row = slot.and_then(|slot| self.values[slot * IndexSet::<D>::BLOCK + from..].first_chunk());
        row.copied().unwrap_or([0.0; N])
    }

    /// Copies rows along the last axis of a block with `BEFORE` (0 or 3) places before it and 3 after it along each axis, in C
    /// order; zero where the field has no block. For every place along the first of three axes (in the plane only one) `rows`
    /// has a bit for each place along the second: the other rows keep what they have.
    ///
    /// `slots` are those of [`IndexSet::slots_around`] with `before` = 1 if `BEFORE` is not zero.
    ///
    /// # Panics
    /// If `out` does not have a place for every number, or `slots` not those of all blocks.
    #[track_caller]
    pub fn gather_rows<const BEFORE: usize>(&self, slots: &[u32], rows: &[u16], out: &mut [f64]) {
        let (side, blocks) = (BEFORE + SIDE + AFTER, if BEFORE == 0 { 2 } else { 3_usize });
        assert_eq!(out.len(), side.pow(D as u32), "one place per number");
        assert_eq!(slots.len(), blocks.pow(D as u32), "one slot per block");
        let offset = (SIDE - BEFORE) % SIDE;
        for (x, rows) in rows.iter().enumerate() {
            let x_of_block = if D == 3 { x + offset } else { 0 };
            let mut rest = *rows;
            while rest != 0 {
                let y = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let y_of_block = y + offset;
                let from = (x_of_block % SIDE * SIDE + y_of_block % SIDE) * SIDE;
                let slots = &slots[(x_of_block / SIDE * blocks + y_of_block / SIDE) * blocks..][..blocks];
                let out = &mut out[(x * side + y) * side..][..side];
                let (before, out) = out.split_at_mut(BEFORE);
                let (own, after) = out.split_at_mut(SIDE);
                if BEFORE > 0 {
                    self.copy_row::<BEFORE>(slots[0], from + offset, before);
                }
                self.copy_row::<SIDE>(slots[blocks - 2], from, own);
                self.copy_row::<AFTER>(slots[blocks - 1], from, after);
            }
        }
    }

    /// `N` numbers of a block.
    #[inline(always)]
    fn copy_row<const N: usize>(&self, slot: u32, from: usize, out: &mut [f64]) {
        let slot = (slot != IndexSet::<D>::NO_SLOT).then_some(slot as usize);
        if let Some(out) = out.first_chunk_mut::<N>() {
            *out = self.row_of_block(slot, from);
        }
    }

    /// Copies what one block has of a box: along each axis the place in the block, the place in the box, and the length.
    fn copy(&self, start: [i64; D], piece: [(usize, usize, usize); D], side: usize, out: &mut [f64]) {
        let block =
            self.set.slot(start).map(|slot| &self.values[slot * IndexSet::<D>::BLOCK..][..IndexSet::<D>::BLOCK]);
        let [x, y, z] = if D == 3 { [piece[0], piece[1], piece[2]] } else { [(0, 0, 1), piece[0], piece[1]] };
        let rows = Rows { from: [x.0, y.0, z.0], to: [x.1, y.1, z.1], count: [x.2, y.2], side };
        match (z.2, block) {
            (_, None) => rows.clear(z.2, out),
            // Known lengths: rows are too short for a call that copies memory.
            (8, Some(block)) => rows.copy::<8>(block, out),
            (4, Some(block)) => rows.copy::<4>(block, out),
            (3, Some(block)) => rows.copy::<3>(block, out),
            (2, Some(block)) => rows.copy::<2>(block, out),
            (length, Some(block)) => (0..length).for_each(|k| rows.moved(k).copy::<1>(block, out)),
        }
    }
}

/// Rows of a block, as far as they lie in a box.
#[derive(Clone, Copy)]
struct Rows {
    /// First place in the block.
    from: [usize; 3],
    /// First place in the box.
    to: [usize; 3],
    count: [usize; 2],
    /// Side of the box.
    side: usize,
}

impl Rows {
    /// The same, some places further along the rows.
    fn moved(mut self, places: usize) -> Self {
        self.from[2] += places;
        self.to[2] += places;
        self
    }

    fn copy<const N: usize>(self, block: &[f64], out: &mut [f64]) {
        for i in 0..self.count[0] {
            for j in 0..self.count[1] {
                let from = ((self.from[0] + i) * SIDE + self.from[1] + j) * SIDE + self.from[2];
                let to = ((self.to[0] + i) * self.side + self.to[1] + j) * self.side + self.to[2];
                if let (Some(from), Some(to)) = (block[from..].first_chunk::<N>(), out[to..].first_chunk_mut::<N>()) {
                    *to = *from;
                }
            }
        }
    }

    fn clear(self, length: usize, out: &mut [f64]) {
        for i in 0..self.count[0] {
            for j in 0..self.count[1] {
                let to = ((self.to[0] + i) * self.side + self.to[1] + j) * self.side + self.to[2];
                out[to..to + length].iter_mut().for_each(|to| *to = 0.0);
            }
        }
    }
}

/// How a range along one axis is cut by the blocks.
#[derive(Clone, Copy)]
struct Pieces {
    /// Place of the range's begin in the first block.
    offset: usize,
    side: usize,
    count: usize,
}

impl Pieces {
    fn new(first: i64, side: usize) -> Self {
        let offset = (first & 7) as usize;
        Self { offset, side, count: (offset + side).div_ceil(SIDE) }
    }

    /// Place in the block, place in the range, and length of a piece.
    fn at(&self, step: usize) -> (usize, usize, usize) {
        let begin = if step == 0 { self.offset } else { 0 };
        let before = step * SIDE + begin - self.offset;
        (begin, before, (SIDE - begin).min(self.side - before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_gathered_across_blocks_and_beyond_the_set() {
        let extent = [20, 30, 40];
        let members: Vec<[u32; 3]> = (0..900).map(|i| [i * 7 % 20, 5 + i * 11 % 20, 3 + i * 13 % 30]).collect();
        let set = Arc::new(IndexSet::new(extent, &members));
        let number = |k: [i64; 3]| (k[0] * 10_000 + k[1] * 100 + k[2]) as f64;
        let values: Vec<f64> = set.iter().map(|k| number(k.map(i64::from))).collect();
        let mut field = BlockField::zeros(Arc::clone(&set));
        field.scatter(&values);
        let mut back = vec![f64::NAN; values.len()];
        field.members(&mut back);
        assert_eq!(back, values);
        for first in [[13, 17, 30], [7, 9, 37], [4, 4, 4], [5, 21, 0], [0, 6, 7]] {
            let (mut all, mut cell) = ([f64::NAN; 64], [f64::NAN; 64]);
            field.gather(first.map(i64::from), 4, &mut all);
            field.gather_cell(first, &mut cell);
            assert_eq!(cell, all, "{first:?}");
        }
        for (first, side) in [([-3, 2, 5], 14), ([8, 8, 16], 8), ([13, 17, 30], 4), ([7, 9, 37], 6)] {
            let mut out = vec![f64::NAN; side * side * side];
            field.gather(first, side, &mut out);
            for (flat, value) in out.iter().enumerate() {
                let k = [flat / side / side, flat / side % side, flat % side];
                let k: [i64; 3] = std::array::from_fn(|axis| first[axis] + k[axis] as i64);
                let is_member = k.iter().all(|k| *k >= 0) && set.contains(k.map(|k| k as u32));
                assert_eq!(*value, if is_member { number(k) } else { 0.0 }, "{k:?}");
            }
        }
        rows_are_those_of_the_box::<3>(&field);
        rows_are_those_of_the_box::<0>(&field);
        let few = IndexSet::new(extent, &members[..50]);
        field.add(&few, &vec![0.5; few.len()]);
        let mut one = [0.0];
        for k in set.iter() {
            field.gather(k.map(i64::from), 1, &mut one);
            let more = if few.contains(k) { 0.5 } else { 0.0 };
            assert_eq!(one[0], number(k.map(i64::from)) + more);
        }
    }

    #[test]
    fn members_of_more_blocks_than_one_task_takes_keep_their_order() {
        let members: Vec<[u32; 2]> = (0..3000).map(|i| [i * 7 % 400, i * 11 % 300]).collect();
        let set = Arc::new(IndexSet::new([400, 300], &members));
        assert!(set.block_count() > 500, "{}", set.block_count());
        let values: Vec<f64> = (0..set.len()).map(|rank| rank as f64).collect();
        let (mut field, mut back) = (BlockField::zeros(Arc::clone(&set)), vec![f64::NAN; set.len()]);
        field.scatter(&values);
        field.members(&mut back);
        assert_eq!(back, values);
    }

    /// Every other row, of every block of the set.
    fn rows_are_those_of_the_box<const BEFORE: usize>(field: &BlockField<3>) {
        let (side, before) = (BEFORE + SIDE + AFTER, usize::from(BEFORE > 0));
        let mut slots = vec![0; (before + 2).pow(3)];
        for slot in 0..field.set().block_count() {
            let start = field.set().block_start(slot).map(i64::from);
            field.set().slots_around(start, before, &mut slots);
            let mut out = vec![f64::NAN; side.pow(3)];
            let rows: Vec<u16> =
                (0..side).map(|x| if x % 2 == 0 { 0x5555 } else { 0xaaaa } & ((1 << side) - 1)).collect();
            field.gather_rows::<BEFORE>(&slots, &rows, &mut out);
            let mut all = vec![f64::NAN; side.pow(3)];
            field.gather(start.map(|k| k - BEFORE as i64), side, &mut all);
            for (row, (out, all)) in out.chunks(side).zip(all.chunks(side)).enumerate() {
                if (row / side + row % side) % 2 == 0 {
                    assert_eq!(out, all);
                } else {
                    assert!(out.iter().all(|x| x.is_nan()));
                }
            }
        }
    }
}
