//! Dilation and erosion of sparse sets by boxes, and the way from a level's cells to the next's.

use rayon::prelude::*;
use std::ops::RangeInclusive;

use crate::block_mask::{self, Mask, Quantifier, SIDE};
use crate::index_set::{IndexSet, block_counts, spread_extent};

/// How many blocks one parallel task takes at least.
const FEW: usize = 64;

impl<const D: usize> IndexSet<D> {
    /// `{k : k − s ∈ self for some s with every component in shifts}`, cut to an extent: the dilation by a box.
    ///
    /// # Panics
    /// If a shift is beyond 7.
    #[track_caller]
    pub fn dilated(&self, shifts: RangeInclusive<i32>, extent: [u32; D]) -> Self {
        self.windowed(shifts, extent, Quantifier::Any)
    }

    /// `{k : k − s ∈ self for all s with every component in shifts}`, cut to an extent: the erosion by a box.
    ///
    /// # Panics
    /// If a shift is beyond 7.
    #[track_caller]
    pub fn eroded(&self, shifts: RangeInclusive<i32>, extent: [u32; D]) -> Self {
        self.windowed(shifts, extent, Quantifier::All)
    }

    #[track_caller]
    fn windowed(&self, shifts: RangeInclusive<i32>, extent: [u32; D], quantifier: Quantifier) -> Self {
        assert!(*shifts.start() > -(SIDE as i32) && *shifts.end() < SIDE as i32, "shifts of at most 7");
        let mut set = self.along(3 - D, &shifts, extent, quantifier);
        for axis in 4 - D..3 {
            set = set.along(axis, &shifts, extent, quantifier);
        }
        set
    }

    /// One axis of [`Self::windowed`].
    fn along(&self, axis: usize, shifts: &RangeInclusive<i32>, extent: [u32; D], quantifier: Quantifier) -> Self {
        // An intermediate set may reach as far as either extent.
        let bounds = std::array::from_fn(|a| self.extent()[a].max(extent[a]));
        let room = if axis == 2 { extent } else { bounds };
        let counts = block_counts(room);
        let mut candidates = Vec::with_capacity(3 * self.blocks.len());
        for block in &self.blocks {
            for step in [-1, 0, 1] {
                let mut block = *block;
                if let Some(moved) = block[axis].checked_add_signed(step).filter(|b| *b < counts[axis]) {
                    block[axis] = moved;
                    candidates.push(block);
                }
            }
        }
        candidates.par_sort_unstable();
        candidates.dedup();
        let mask = |block: &[u32; 3]| {
            let neighbour = |step: i32| {
                let mut other = *block;
                other[axis] = other[axis].checked_add_signed(step)?;
                self.slot_of(other).map(|slot| &self.masks[slot])
            };
            let none = &[0; SIDE];
            let blocks = [-1, 0, 1].map(|step| neighbour(step).unwrap_or(none));
            let found = block_mask::windowed(blocks, axis, shifts, quantifier, Self::DEPTH);
            let left = spread_extent(room);
            let inside = block_mask::within(std::array::from_fn(|a| {
                (left[a] as usize).saturating_sub(block[a] as usize * SIDE)
            }));
            (*block, std::array::from_fn(|x| found[x] & inside[x]))
        };
        let blocks: Vec<_> = candidates.par_iter().with_min_len(FEW).map(mask).collect();
        Self::from_blocks(room, blocks.into_iter())
    }

    /// The lattice with its cells halved along every axis: all children `2k` and `2k + 1` of the members.
    pub(crate) fn children(&self) -> Self {
        let mut blocks = Vec::with_capacity(self.blocks.len() << D);
        for (block, mask) in self.blocks.iter().zip(&self.masks) {
            for corner in 0..1usize << D {
                let half = [corner >> 2, corner >> 1 & 1, corner & 1];
                let child = std::array::from_fn(|axis| 2 * block[axis] + half[axis] as u32);
                blocks.push((child, block_mask::children(mask, half, Self::DEPTH)));
            }
        }
        blocks.par_sort_unstable_by_key(|(block, _)| *block);
        Self::from_blocks(self.extent().map(|n| 2 * n), blocks.into_iter())
    }

    /// The members whose parents `k / 2` are members of `coarse`.
    pub fn with_parents_in(&self, coarse: &Self) -> Self {
        let keep = |(block, mask): (&[u32; 3], &Mask)| {
            let parent = coarse.slot_of(block.map(|b| b / 2)).map(|slot| &coarse.masks[slot]);
            let inside = parent
                .map_or([0; SIDE], |parent| block_mask::children(parent, block.map(|b| b as usize % 2), Self::DEPTH));
            (*block, std::array::from_fn(|x| mask[x] & inside[x]))
        };
        let blocks: Vec<_> = self.blocks.par_iter().zip(&self.masks).with_min_len(FEW).map(keep).collect();
        Self::from_blocks(self.extent(), blocks.into_iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Sets of both dimensions against plain sets of indices.
    fn check<const D: usize>(
        indices: &[[u32; D]],
        extent: [u32; D],
        shifts: RangeInclusive<i32>,
    ) -> Result<(), TestCaseError> {
        let set = IndexSet::new(extent, indices);
        let plain: BTreeSet<[u32; D]> = indices.iter().copied().collect();
        prop_assert_eq!(set.len(), plain.len());
        prop_assert_eq!(set.iter().collect::<BTreeSet<_>>(), plain.clone());
        for (rank, index) in set.iter().enumerate() {
            prop_assert_eq!(set.rank(index), Some(rank));
        }
        let further = extent.map(|n| n + 3);
        let (dilated, eroded) = (set.dilated(shifts.clone(), further), set.eroded(shifts.clone(), further));
        let mut counts = (0, 0);
        let total: u32 = further.iter().product();
        for flat in 0..total {
            let mut rest = flat;
            let mut k = [0; D];
            for axis in (0..D).rev() {
                k[axis] = rest % further[axis];
                rest /= further[axis];
            }
            let window = shifts.clone().count().pow(D as u32);
            let found = (0..window)
                .filter(|w| {
                    let mut rest = *w;
                    let moved: Option<Vec<u32>> = (0..D)
                        .map(|axis| {
                            let s = shifts.start() + (rest % shifts.clone().count()) as i32;
                            rest /= shifts.clone().count();
                            k[axis].checked_add_signed(-s)
                        })
                        .collect();
                    moved.is_some_and(|m| plain.contains(&std::array::from_fn(|axis| m[axis])))
                })
                .count();
            prop_assert_eq!(dilated.contains(k), found > 0, "dilation at {:?}", k);
            prop_assert_eq!(eroded.contains(k), found == window, "erosion at {:?}", k);
            counts.0 += usize::from(found > 0);
            counts.1 += usize::from(found == window);
            prop_assert_eq!(set.contains(k), plain.contains(&k));
        }
        prop_assert_eq!((dilated.len(), eroded.len()), counts);
        let parents = IndexSet::new(extent, &indices.iter().take(5).map(|k| k.map(|k| k / 2)).collect::<Vec<_>>());
        let kept: Vec<_> = plain.iter().copied().filter(|k| parents.contains(k.map(|k| k / 2))).collect();
        prop_assert_eq!(set.with_parents_in(&parents), IndexSet::new(extent, &kept));
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn agrees_with_plain_sets(
            corner in [0u32..6, 0u32..9, 0u32..12],
            holes in proptest::collection::vec([0u32..12, 0u32..12, 0u32..12], 0..6),
            more in proptest::collection::vec([0u32..12, 0u32..16, 0u32..19], 0..30),
            start in -3i32..=1,
            count in 0i32..=3,
        ) {
            // A solid box, so that erosions are not empty, with holes and scattered members.
            let mut space = more;
            for flat in 0..6 * 6 * 6 {
                let k = [corner[0] + flat / 36, corner[1] + flat / 6 % 6, corner[2] + flat % 6];
                if !holes.contains(&k) { space.push(k); }
            }
            let plane: Vec<[u32; 2]> = space.iter().map(|k| [k[1], k[2]]).collect();
            check(&space, [12, 16, 19], start..=start + count)?;
            check(&plane, [16, 19], start..=start + count)?;
        }
    }
}
