//! How the cells around one hang together.

use crate::lattice::domain::multi_index;

/// How the 3^D cells around one and itself touch, a bit for each.
pub struct Neighbours {
    middle: usize,
    /// Those that touch each: through faces, edges and corners; and through faces only.
    touching: [Vec<u32>; 2],
    /// Those that belong to the neighbourhood: all for the inside, those that touch the middle one through edges or faces for the outside.
    of_middle: [u32; 2],
}

impl Neighbours {
    pub fn new<const D: usize>() -> Self {
        let count = 3usize.pow(D as u32);
        let middle = count / 2;
        // How many faces have to be crossed, and the most along one axis.
        let apart = |a: usize, b: usize| {
            let (a, b) = (multi_index(a, &[3; D]), multi_index(b, &[3; D]));
            let along: [usize; D] = std::array::from_fn(|axis| a[axis].abs_diff(b[axis]));
            (along.iter().sum::<usize>(), along.into_iter().max().unwrap_or(0))
        };
        let bits = |wanted: &dyn Fn(usize) -> bool| {
            (0..count).filter(|i| *i != middle && wanted(*i)).map(|i| 1u32 << i).sum::<u32>()
        };
        let all = (0..count).map(|a| bits(&|b| apart(a, b).1 == 1)).collect();
        let faces = (0..count).map(|a| bits(&|b| apart(a, b).0 == 1)).collect();
        Self { middle, touching: [all, faces], of_middle: [bits(&|_| true), bits(&|i| apart(i, middle).0 <= 2)] }
    }

    /// Whether the middle cell has a bit.
    pub fn is_middle(&self, bits: u32) -> bool {
        bits >> self.middle & 1 == 1
    }

    /// The bits of the cells that touch the middle one, on the inside (0) or the outside (1).
    pub fn beside(&self, side: usize) -> u32 {
        self.touching[side][self.middle]
    }

    /// Whether the middle cell has one piece of the inside, connected through faces, edges and corners, and one of the outside,
    /// connected through faces, beside it: then it can change sides without changing the topology of either.
    pub fn is_simple(&self, inside: u32) -> bool {
        self.pieces(0, inside) == 1 && self.pieces(1, !inside) == 1
    }

    /// The pieces beside the middle cell of the cells with a bit, for the inside (0) or the outside (1).
    pub fn pieces(&self, side: usize, cells: u32) -> usize {
        let touching = &self.touching[side];
        let cells = cells & self.of_middle[side];
        let mut starts = cells & touching[self.middle];
        let mut pieces = 0;
        while starts != 0 {
            pieces += 1;
            let mut piece = 1u32 << starts.trailing_zeros();
            let mut open = piece;
            while open != 0 {
                let found = touching[open.trailing_zeros() as usize] & cells & !piece;
                open = (open & (open - 1)) | found;
                piece |= found;
            }
            starts &= !piece;
        }
        pieces
    }
}

/// Corners, edges and faces of a cell, and which of the 3^D cells around it share each.
pub struct Euler {
    /// With 1 for those of even dimension, otherwise −1.
    shared: Vec<(u32, i32)>,
}

impl Euler {
    pub fn new<const D: usize>() -> Self {
        let count = 3usize.pow(D as u32);
        // Each cell around stands for what it shares with the middle one, and others share with both.
        let part = |i: usize| {
            let index = multi_index(i, &[3; D]);
            let shares = |other: &usize| {
                let other = multi_index(*other, &[3; D]);
                other != [1; D] && (0..D).all(|axis| other[axis] == 1 || other[axis] == index[axis])
            };
            let mask = (0..count).filter(shares).map(|other| 1 << other).sum();
            let dimension = index.iter().filter(|i| **i == 1).count();
            (mask, if dimension % 2 == 0 { 1 } else { -1 })
        };
        Self { shared: (0..count).filter(|i| *i != count / 2).map(part).collect() }
    }

    /// By how much the Euler characteristic of closed cells grows with the middle one, given those of the others that are among them.
    pub fn added(&self, others: u32) -> i32 {
        1 - self.shared.iter().filter(|(mask, _)| others & mask != 0).map(|(_, sign)| sign).sum::<i32>()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The Euler characteristic of closed cells among 3³, by counting their different corners, edges, faces and themselves: in doubled
    /// coordinates, an even one is fixed.
    fn characteristic(cells: u32) -> i32 {
        let mut parts = std::collections::BTreeSet::new();
        for cell in (0..27).filter(|cell| cells >> cell & 1 == 1) {
            let index = multi_index(cell, &[3; 3]);
            for part in 0..27 {
                let offset = multi_index(part, &[3; 3]);
                parts.insert([0, 1, 2].map(|axis| 2 * index[axis] + offset[axis]));
            }
        }
        parts.iter().map(|part| if part.iter().filter(|x| **x % 2 == 1).count() % 2 == 0 { 1 } else { -1 }).sum()
    }

    proptest! {
        #[test]
        fn the_euler_characteristic_grows_as_counted(cells in 0u32..1 << 27) {
            let (with, without) = (cells | 1 << 13, cells & !(1 << 13));
            let added = Euler::new::<3>().added(without);
            prop_assert_eq!(added, characteristic(with) - characteristic(without));
            // What is simple changes nothing.
            let neighbours = Neighbours::new::<3>();
            prop_assert!(!neighbours.is_simple(without) || added == 0);
        }
    }
}
