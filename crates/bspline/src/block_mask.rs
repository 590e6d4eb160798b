//! Sets of places within one block of `8 × 8 [× 8]`, as bits.

use std::ops::RangeInclusive;

/// Places along each axis of a block.
pub(crate) const SIDE: usize = 8;

/// One bit per place: a word per place along the first of three axes, a byte per place along the second, a bit per place
/// along the third. In the plane only the first word is used.
pub(crate) type Mask = [u64; SIDE];

/// The same byte eight times.
const BYTES: u64 = 0x0101_0101_0101_0101;

/// What is to be known about several places at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantifier {
    /// At least one of them is a member.
    Any,
    /// All of them are members.
    All,
}

/// The places `k` of the middle of three blocks in a row along `axis` for which any or all of `k − s` are members, `s` in
/// `shifts`, which lie between −7 and 7.
pub(crate) fn windowed(
    blocks: [&Mask; 3],
    axis: usize,
    shifts: &RangeInclusive<i32>,
    quantifier: Quantifier,
    depth: usize,
) -> Mask {
    let mut out = match quantifier {
        Quantifier::Any => [0; SIDE],
        Quantifier::All => [u64::MAX; SIDE],
    };
    for shift in shifts.clone() {
        let moved = shifted(blocks, axis, shift, depth);
        for (out, moved) in out.iter_mut().zip(moved) {
            match quantifier {
                Quantifier::Any => *out |= moved,
                Quantifier::All => *out &= moved,
            }
        }
    }
    out[depth..].fill(0);
    out
}

/// The places `k` of the middle block for which `k − shift` is a member.
fn shifted([before, own, after]: [&Mask; 3], axis: usize, shift: i32, depth: usize) -> Mask {
    let by = shift.unsigned_abs() as usize;
    let mut out = [0; SIDE];
    if by == 0 {
        return *own;
    }
    for x in 0..depth {
        out[x] = match (axis, shift > 0) {
            (0, true) => {
                if x >= by {
                    own[x - by]
                } else {
                    before[x + SIDE - by]
                }
            }
            (0, false) => {
                if x + by < SIDE {
                    own[x + by]
                } else {
                    after[x + by - SIDE]
                }
            }
            (1, true) => own[x] << (8 * by) | before[x] >> (64 - 8 * by),
            (1, false) => own[x] >> (8 * by) | after[x] << (64 - 8 * by),
            (_, true) => {
                let high = BYTES * (0xff << by & 0xff);
                own[x] << by & high | before[x] >> (8 - by) & !high
            }
            (_, false) => {
                let low = BYTES * (0xff >> by);
                own[x] >> by & low | after[x] << (8 - by) & !low
            }
        };
    }
    out
}

/// The places of a block that lie within an extent, if `room` places are left of it along each of three axes.
pub(crate) fn within(room: [usize; 3]) -> Mask {
    let z = BYTES * (0xff >> (SIDE - room[2].min(SIDE)));
    let y = u64::MAX >> (64 - 8 * room[1].min(SIDE));
    std::array::from_fn(|x| if x < room[0] { y & z } else { 0 })
}

/// The places of a block on the lattice of half the spacing whose parents are members of the block `parent` of the coarse
/// one. `half` says for every axis whether the block covers the upper half of the parent.
pub(crate) fn children(parent: &Mask, half: [usize; 3], depth: usize) -> Mask {
    std::array::from_fn(|x| {
        if x >= depth {
            return 0;
        }
        let word = parent[if depth > 1 { 4 * half[0] + x / 2 } else { 0 }];
        (0..SIDE).fold(0, |out, y| {
            let nibble = word >> (8 * (4 * half[1] + y / 2) + 4 * half[2]) & 0xf;
            let byte = (0..4).filter(|z| nibble >> z & 1 == 1).fold(0u64, |byte, z| byte | 0b11 << (2 * z));
            out | byte << (8 * y)
        })
    })
}

/// Calls `visit` with the place of every member within its block, in C order.
pub(crate) fn for_each(mask: &Mask, mut visit: impl FnMut(usize)) {
    for (x, word) in mask.iter().enumerate() {
        let mut rest = *word;
        while rest != 0 {
            visit(64 * x + rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
    }
}

/// Number of members.
pub(crate) fn count(mask: &Mask) -> usize {
    mask.iter().map(|word| word.count_ones() as usize).sum()
}

/// Members before a place, in C order.
pub(crate) fn rank(mask: &Mask, place: usize) -> usize {
    let (word, bit) = (place / 64, place % 64);
    count_words(&mask[..word]) + (mask[word] & ((1 << bit) - 1)).count_ones() as usize
}

fn count_words(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}
