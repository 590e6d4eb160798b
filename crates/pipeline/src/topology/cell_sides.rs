//! On which side cells of a lattice are, in little memory.

use rustc_hash::FxHashMap;

use crate::lattice::domain::{flat_index, multi_index};

/// Which of some cells of a lattice are inside, two bits for each. Cells are given by their place in C order.
///
/// Blocks of 64 cells, 8 × 8 or 4 × 4 × 4, are looked up at once: with what is around a cell, one to 2^D of them.
#[derive(Clone)]
pub struct CellSides<const D: usize> {
    shape: [usize; D],
    blocks: FxHashMap<usize, Block>,
}

/// A bit for each cell, in C order.
#[derive(Clone, Copy, Default)]
struct Block {
    known: u64,
    inside: u64,
}

/// Of the 3^D cells around one and itself, in C order, a bit for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Around {
    /// Inside; those that are not known, and all beyond the lattice, count as outside.
    pub inside: u32,
    /// Not known, but on the lattice.
    pub unknown: u32,
}

impl<const D: usize> CellSides<D> {
    /// Binary digits of a place in a block along an axis.
    const DIGITS: usize = 6 / D;

    /// No side is known.
    pub fn new(shape: [usize; D]) -> Self {
        Self { shape, blocks: FxHashMap::default() }
    }

    /// Says on which side a cell is.
    pub fn insert(&mut self, key: usize, inside: bool) {
        let (block, bit) = self.place(&multi_index(key, &self.shape));
        let block = self.blocks.entry(block).or_default();
        block.known |= bit;
        block.inside = if inside { block.inside | bit } else { block.inside & !bit };
    }

    /// The sides around a cell.
    pub fn around(&self, key: usize) -> Around {
        let middle = multi_index(key, &self.shape);
        let first: [usize; D] = std::array::from_fn(|axis| middle[axis].saturating_sub(1) >> Self::DIGITS);
        // Blocks that begin at the first one or next to it along each axis; the same one twice where it reaches far enough.
        let mut blocks = [Block::default(); 8];
        for corner in 0..1usize << D {
            let at: [usize; D] = std::array::from_fn(|axis| first[axis] + (corner >> axis & 1));
            let reached = (0..D).all(|axis| at[axis] << Self::DIGITS <= (middle[axis] + 1).min(self.shape[axis] - 1));
            if reached && let Some(block) = self.blocks.get(&self.block(&at)) {
                blocks[corner] = *block;
            }
        }
        let mut around = Around { inside: 0, unknown: 0 };
        for offset in 0..3usize.pow(D as u32) {
            let step = multi_index(offset, &[3; D]);
            let moved: [usize; D] = std::array::from_fn(|axis| (middle[axis] + step[axis]).wrapping_sub(1));
            if (0..D).any(|axis| moved[axis] >= self.shape[axis]) {
                continue;
            }
            let corner: usize = (0..D).map(|axis| ((moved[axis] >> Self::DIGITS) - first[axis]) << axis).sum();
            let Block { known, inside } = blocks[corner];
            let bit = Self::bit(&moved);
            around.inside |= u32::from(inside & bit != 0) << offset;
            around.unknown |= u32::from(known & bit == 0) << offset;
        }
        around
    }

    /// The cells around one with a bit, each by its place on the lattice.
    pub fn keys_around(&self, key: usize, bits: u32) -> impl Iterator<Item = usize> + use<D> {
        cells_around(key, self.shape, bits)
    }

    fn place(&self, index: &[usize; D]) -> (usize, u64) {
        (self.block(&index.map(|i| i >> Self::DIGITS)), Self::bit(index))
    }

    fn block(&self, at: &[usize; D]) -> usize {
        flat_index(at, &self.shape.map(|n| (n >> Self::DIGITS) + 1))
    }

    fn bit(index: &[usize; D]) -> u64 {
        let side = 1 << Self::DIGITS;
        1 << flat_index(&index.map(|i| i % side), &[side; D])
    }
}

/// Those of the 3^D cells around one and itself, in C order, that have a bit and lie on the lattice.
pub fn cells_around<const D: usize>(key: usize, shape: [usize; D], bits: u32) -> impl Iterator<Item = usize> + use<D> {
    let index = multi_index(key, &shape);
    (0..3usize.pow(D as u32)).filter(move |offset| bits >> offset & 1 == 1).filter_map(move |offset| {
        let step = multi_index(offset, &[3; D]);
        let moved: [usize; D] = std::array::from_fn(|axis| (index[axis] + step[axis]).wrapping_sub(1));
        (0..D).all(|axis| moved[axis] < shape[axis]).then(|| flat_index(&moved, &shape))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    use super::*;

    /// Against a plain map, with what is around every cell of the lattice.
    fn check<const D: usize>(shape: [usize; D], told: &[(usize, bool)]) -> Result<(), TestCaseError> {
        let all: usize = shape.iter().product();
        let (mut sides, mut plain) = (CellSides::new(shape), BTreeMap::new());
        for (key, inside) in told {
            sides.insert(key % all, *inside);
            plain.insert(key % all, *inside);
        }
        for key in 0..all {
            let middle = multi_index(key, &shape);
            let (mut wanted, mut unknown) = (Around { inside: 0, unknown: 0 }, Vec::new());
            for offset in 0..3usize.pow(D as u32) {
                let step = multi_index(offset, &[3; D]);
                let moved: Option<Vec<usize>> = (0..D)
                    .map(|axis| (middle[axis] + step[axis]).checked_sub(1).filter(|i| *i < shape[axis]))
                    .collect();
                let Some(moved) = moved else { continue };
                let other = flat_index(&std::array::from_fn(|axis| moved[axis]), &shape);
                match plain.get(&other) {
                    Some(inside) => wanted.inside |= u32::from(*inside) << offset,
                    None => {
                        wanted.unknown |= 1 << offset;
                        unknown.push(other);
                    }
                }
            }
            let found = sides.around(key);
            prop_assert_eq!(found, wanted);
            prop_assert_eq!(sides.keys_around(key, found.unknown).collect::<Vec<_>>(), unknown);
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn agrees_with_a_plain_map(
            shape in [1usize..11, 1usize..11, 1usize..11],
            told in proptest::collection::vec((0usize..1000, any::<bool>()), 0..400),
        ) {
            check(shape, &told)?;
            check([shape[0] + 7, shape[1]], &told)?;
        }
    }
}
