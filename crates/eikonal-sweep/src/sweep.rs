//! The 2^D sweep orders of section 4 of the paper (3.1 to 3.8) and the loop over them.

use crate::ghost::Ghosted;
use crate::tiles::{Field, Tiles};

/// Direction of each axis in sweep `number` (0-based): `true` is 1 : I, `false` is I : 1.
///
/// The last axis alternates fastest, the first axis is the outermost loop: for D = 3 the sweeps 0 to 7 are 3.1 to 3.8 of
/// the paper. Orders repeat after 2^D.
pub(crate) fn sweep_order<const D: usize>(number: usize) -> [bool; D] {
    std::array::from_fn(|axis| (number >> (D - 1 - axis)) & 1 == 0)
}

/// What the sweeps did, in lattice units.
pub(crate) struct Swept {
    pub(crate) sweeps: usize,
    pub(crate) last_change: f64,
}

/// Runs `rounds` rounds of 2^D sweeps, or fewer: both schemes look at the neighbours on all sides, whatever the
/// order, so a sweep that changes nothing proves a fixed point.
pub(crate) fn sweep<const D: usize>(lattice: &Ghosted<D>, rounds: usize, field: &mut impl Field<D>) -> Swept {
    let tiles = Tiles::new(lattice);
    let mut swept = Swept { sweeps: 0, last_change: 0.0 };
    for number in 0..rounds.saturating_mul(1 << D) {
        swept.sweeps += 1;
        swept.last_change = tiles.relax(field, number);
        if swept.last_change == 0.0 {
            break;
        }
    }
    swept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_the_papers_list() {
        const UP: bool = true;
        const DOWN: bool = false;
        let listed = [
            [UP, UP, UP],
            [UP, UP, DOWN],
            [UP, DOWN, UP],
            [UP, DOWN, DOWN],
            [DOWN, UP, UP],
            [DOWN, UP, DOWN],
            [DOWN, DOWN, UP],
            [DOWN, DOWN, DOWN],
        ];
        for (number, order) in listed.into_iter().enumerate() {
            assert_eq!(sweep_order::<3>(number), order);
            assert_eq!(sweep_order::<3>(number + 8), order);
        }
        let plane: Vec<[bool; 2]> = (0..4).map(sweep_order::<2>).collect();
        assert_eq!(plane, [[UP, UP], [UP, DOWN], [DOWN, UP], [DOWN, DOWN]]);
    }
}
