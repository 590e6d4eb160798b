//! One number for every member of a sparse set, stored in dense blocks.

use rayon::prelude::*;
use std::sync::Arc;

use crate::block_mask::SIDE;
use crate::index_set::IndexSet;

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
        self.values.copy_from_slice(&other.values);
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
        let few = IndexSet::new(extent, &members[..50]);
        field.add(&few, &vec![0.5; few.len()]);
        let mut one = [0.0];
        for k in set.iter() {
            field.gather(k.map(i64::from), 1, &mut one);
            let more = if few.contains(k) { 0.5 } else { 0.0 };
            assert_eq!(one[0], number(k.map(i64::from)) + more);
        }
    }
}
