//! Sparse sets of the cells or of the basis functions of a lattice.

use std::ops::Range;

use rayon::prelude::*;

use crate::block_mask::{self, Mask, SIDE};

/// Blocks per parallel task.
const PER_TASK: usize = 64;

/// A set of multi-indices `0 ≤ k < extent` along each axis: of cells, or of basis functions, of a lattice.
///
/// It is stored as blocks of `8 × 8 [× 8]` places with a bit for each, and needs memory only for blocks that have members.
/// Members are ordered: blocks lexicographically, then places within a block in C order. Vectors with one entry per member
/// use this order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IndexSet<const D: usize> {
    extent: [u32; D],
    /// In lexicographic order, with a leading zero in the plane.
    pub(crate) blocks: Vec<[u32; 3]>,
    /// For every pair of coordinates along the first two of three axes where its blocks begin; and the end.
    columns: Vec<u32>,
    pub(crate) masks: Vec<Mask>,
    /// Members before each block; and all.
    ranks: Vec<usize>,
}

impl<const D: usize> IndexSet<D> {
    /// Stands for a block that has no members.
    pub const NO_SLOT: u32 = u32::MAX;

    /// Places in a block.
    pub const BLOCK: usize = Self::DEPTH * SIDE * SIDE;

    /// Places of a block along the first of three axes.
    pub(crate) const DEPTH: usize = if D == 3 { SIDE } else { 1 };

    /// The largest extent along an axis, so that the table of block columns stays below 64 MB.
    pub const MAX_EXTENT: u32 = if D == 3 { 1 << 15 } else { 1 << 21 };

    /// The set of the given indices; those given several times count once.
    ///
    /// # Panics
    /// If an index does not lie below the extent, or an extent is above [`Self::MAX_EXTENT`].
    #[track_caller]
    pub fn new(extent: [u32; D], indices: &[[u32; D]]) -> Self {
        assert!(extent.iter().all(|n| *n <= Self::MAX_EXTENT), "extents of at most {}", Self::MAX_EXTENT);
        let outside = |k: &[u32; D]| (0..D).any(|axis| k[axis] >= extent[axis]);
        assert!(!indices.par_iter().with_min_len(1 << 12).any(outside), "indices below the extent {extent:?}");
        // Block and place as one number: three times 18 bits, and 9.
        let key = |k: &[u32; D]| {
            let k = spread(*k);
            let block = k.iter().fold(0u64, |key, k| key << 18 | u64::from(k / SIDE as u32));
            block << 9 | k.iter().fold(0, |place, k| place * SIDE as u64 + u64::from(k % SIDE as u32))
        };
        let mut keys: Vec<u64> = indices.par_iter().with_min_len(1 << 12).map(key).collect();
        keys.par_sort_unstable();
        let part = |block: u64, shift: u32| (block >> shift & 0x3ffff) as u32;
        let blocks = keys.chunk_by(|a, b| a >> 9 == b >> 9).map(|members| {
            let block = members[0] >> 9;
            let mut mask = [0; SIDE];
            members.iter().for_each(|key| mask[(key >> 6 & 7) as usize] |= 1 << (key & 63));
            ([part(block, 36), part(block, 18), part(block, 0)], mask)
        });
        Self::from_blocks(extent, blocks)
    }

    /// All indices below an extent.
    pub(crate) fn full(extent: [u32; D]) -> Self {
        let room = spread_extent(extent);
        let [nx, ny, nz] = block_counts(extent);
        let blocks = (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| [x, y, z])));
        let left = |block: &[u32; 3]| std::array::from_fn(|axis| (room[axis] - block[axis] * SIDE as u32) as usize);
        Self::from_blocks(extent, blocks.map(|block| (block, block_mask::within(left(&block)))))
    }

    /// `blocks` come in lexicographic order; those without members are left out.
    pub(crate) fn from_blocks(extent: [u32; D], blocks: impl Iterator<Item = ([u32; 3], Mask)>) -> Self {
        let (blocks, masks): (Vec<_>, Vec<_>) = blocks.filter(|(_, mask)| *mask != [0; SIDE]).unzip();
        let [across, along, _] = block_counts(extent);
        let mut columns = vec![0; (across * along) as usize + 1];
        blocks.iter().for_each(|b: &[u32; 3]| columns[(b[0] * along + b[1]) as usize + 1] += 1);
        let mut sum = 0;
        for column in &mut columns {
            sum += *column;
            *column = sum;
        }
        let mut ranks = vec![0];
        let mut members = 0;
        for mask in &masks {
            members += block_mask::count(mask);
            ranks.push(members);
        }
        Self { extent, blocks, columns, masks, ranks }
    }

    /// The numbers below which the indices lie.
    pub fn extent(&self) -> [u32; D] {
        self.extent
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.ranks[self.masks.len()]
    }

    /// Whether there are no members.
    pub fn is_empty(&self) -> bool {
        self.masks.is_empty()
    }

    /// Whether an index is a member. Indices beyond the extent are not.
    pub fn contains(&self, index: [u32; D]) -> bool {
        self.find(index).is_some_and(|(slot, place)| self.masks[slot][place / 64] >> (place % 64) & 1 == 1)
    }

    /// The place of a member in the order of members.
    pub fn rank(&self, index: [u32; D]) -> Option<usize> {
        let (slot, place) = self.find(index)?;
        let is_member = self.masks[slot][place / 64] >> (place % 64) & 1 == 1;
        is_member.then(|| self.ranks[slot] + block_mask::rank(&self.masks[slot], place))
    }

    /// The members, in order.
    pub fn iter(&self) -> impl Iterator<Item = [u32; D]> + '_ {
        self.blocks.iter().zip(&self.masks).flat_map(|(block, mask)| {
            let mut members = Vec::with_capacity(block_mask::count(mask));
            block_mask::for_each(mask, |place| members.push(index_at(block, place)));
            members
        })
    }

    /// Number of blocks that have members.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// The first index of a block.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn block_start(&self, slot: usize) -> [u32; D] {
        index_at(&self.blocks[slot], 0)
    }

    /// The ranks of a block's members.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn block_ranks(&self, slot: usize) -> Range<usize> {
        self.ranks[slot]..self.ranks[slot + 1]
    }

    /// Calls `visit` with the place of every member of a block, in C order within the block.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn for_each_place(&self, slot: usize, visit: impl FnMut(usize)) {
        block_mask::for_each(&self.masks[slot], visit);
    }

    /// Shares out one number per member, in their order, among consecutive blocks, so many at a time but for the last.
    ///
    /// ```
    /// let set = zeroset_bspline::IndexSet::<2>::new([40, 40], &[[0, 0], [3, 4], [9, 0], [30, 30]]);
    /// // The first two members belong to one block of 8 × 8 places.
    /// let mut numbers = [1.0, 2.0, 3.0, 4.0];
    /// assert_eq!(set.shared_out(&mut numbers, 2), [(0..2, &mut [1.0, 2.0, 3.0][..]), (2..3, &mut [4.0][..])]);
    /// ```
    ///
    /// # Panics
    /// If there is not one number per member, or `at_a_time` is zero.
    #[track_caller]
    pub fn shared_out<'a>(&self, members: &'a mut [f64], at_a_time: usize) -> Vec<(Range<usize>, &'a mut [f64])> {
        assert_eq!(members.len(), self.len(), "one number per member");
        let count = self.block_count();
        let mut rest = members;
        let shares = (0..count).step_by(at_a_time).map(|first| {
            let slots = first..(first + at_a_time).min(count);
            let (share, after) = std::mem::take(&mut rest).split_at_mut(self.ranks[slots.end] - self.ranks[first]);
            rest = after;
            (slots, share)
        });
        shares.collect()
    }

    /// Picks the members' numbers, in their order, out of blocks of numbers.
    ///
    /// # Panics
    /// If there is not one number per place of every block, or not one place per member in `out`.
    #[track_caller]
    pub fn members_of_blocks(&self, blocks: &[f64], out: &mut [f64]) {
        assert_eq!(blocks.len(), self.block_count() * Self::BLOCK, "one number per place of every block");
        self.shared_out(out, PER_TASK).into_par_iter().for_each(|(slots, out)| {
            let mut out = out.iter_mut();
            for slot in slots {
                let block = &blocks[slot * Self::BLOCK..][..Self::BLOCK];
                self.for_each_place(slot, |place| {
                    if let Some(out) = out.next() {
                        *out = block[place];
                    }
                });
            }
        });
    }

    /// The block that has a given index as its first, where it has members. `start` may lie outside the extent.
    pub fn slot(&self, start: [i64; D]) -> Option<usize> {
        let block = start.map(|k| k.div_euclid(SIDE as i64));
        if block.iter().any(|b| *b < 0) {
            return None;
        }
        self.slot_of(spread(block.map(|b| b as u32)))
    }

    /// The slots of the blocks in a cube of blocks, in C order: from `before` blocks before a given one to the next after it
    /// along each axis; [`Self::NO_SLOT`] for those without members. `start` is the given block's first index, and may lie
    /// outside the extent.
    ///
    /// # Panics
    /// If `slots` does not have one place per block.
    #[track_caller]
    pub fn slots_around(&self, start: [i64; D], before: usize, slots: &mut [u32]) {
        let side = before + 2;
        assert_eq!(slots.len(), side.pow(D as u32), "one place per block");
        for (flat, slot) in slots.iter_mut().enumerate() {
            let mut rest = flat;
            let mut at = start;
            for axis in (0..D).rev() {
                at[axis] += (rest % side) as i64 * SIDE as i64 - (before * SIDE) as i64;
                rest /= side;
            }
            *slot = self.slot(at).map_or(Self::NO_SLOT, |slot| slot as u32);
        }
    }

    /// Which rows along the last axis have members in a block: for every place along the first of three axes (in the plane
    /// only one) a bit per place along the second.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn rows_of_block(&self, slot: usize) -> [u8; SIDE] {
        let row = |word: u64, y: usize| u8::from(word >> (SIDE * y) & 0xff != 0) << y;
        self.masks[slot].map(|word| (0..SIDE).fold(0, |rows, y| rows | row(word, y)))
    }

    /// The blocks whose coordinate along the first axis lies in a range: a range of slots, for blocks are sorted by it.
    pub fn slab(&self, from: u32, to: u32) -> Range<usize> {
        let leading = 3 - D;
        let before = |bound: u32| self.blocks.partition_point(|b| b[leading] < bound.div_ceil(SIDE as u32));
        before(from)..before(to)
    }

    /// The block and the place in it of an index, if the block has members.
    fn find(&self, index: [u32; D]) -> Option<(usize, usize)> {
        let index = spread(index);
        let slot = self.slot_of(index.map(|k| k / SIDE as u32))?;
        Some((slot, index.iter().fold(0, |place, k| place * SIDE + *k as usize % SIDE)))
    }

    pub(crate) fn slot_of(&self, block: [u32; 3]) -> Option<usize> {
        let counts = block_counts(self.extent);
        if block[0] >= counts[0] || block[1] >= counts[1] {
            return None;
        }
        let column = (block[0] * counts[1] + block[1]) as usize;
        let (start, end) = (self.columns[column] as usize, self.columns[column + 1] as usize);
        self.blocks[start..end].binary_search_by_key(&block[2], |b| b[2]).ok().map(|at| start + at)
    }
}

/// Three coordinates, the first of them zero in the plane.
pub(crate) fn spread<T: Copy + Default, const D: usize>(index: [T; D]) -> [T; 3] {
    let mut out = [T::default(); 3];
    out[3 - D..].copy_from_slice(&index);
    out
}

pub(crate) fn spread_extent<const D: usize>(extent: [u32; D]) -> [u32; 3] {
    let mut out = [1; 3];
    out[3 - D..].copy_from_slice(&extent);
    out
}

/// Blocks along each of three axes.
pub(crate) fn block_counts<const D: usize>(extent: [u32; D]) -> [u32; 3] {
    spread_extent(extent).map(|n| n.div_ceil(SIDE as u32))
}

/// The index at a place of a block.
fn index_at<const D: usize>(block: &[u32; 3], place: usize) -> [u32; D] {
    let places = [place / 64, place / SIDE % SIDE, place % SIDE];
    let index: [u32; 3] = std::array::from_fn(|axis| block[axis] * SIDE as u32 + places[axis] as u32);
    std::array::from_fn(|axis| index[3 - D + axis])
}
