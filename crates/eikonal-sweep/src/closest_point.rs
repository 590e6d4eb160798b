//! Closest-point sweeping: the sweeps of the paper, carrying the index of the nearest sample.

use rayon::prelude::*;

use crate::ghost::{Ghosted, Row};
use crate::near_field::NearField;
use crate::sweep::{Swept, sweep};
use crate::tiles::{Field, Parts, Tile};

/// `changed` of a node whose sample was replaced when it was last visited; halved at each visit after that.
const JUST_CHANGED: u8 = 2;

/// Sweeps the near field outwards: each node takes over a neighbour's sample when that sample is nearer to
/// it than its own. `squared` stays the squared distance to `nearest`, in lattice units.
///
/// A node that was offered a sample once need not look at it again (its own distance only falls), so only
/// neighbours that changed since the node's last visit are asked: in this sweep, or in the one before.
pub(crate) fn closest_point<const D: usize>(
    ghosted: &Ghosted<D>,
    points: &[[f64; D]],
    near: NearField,
    rounds: usize,
) -> (NearField, Swept) {
    // Ghosts and unreached nodes never change, so nobody asks them.
    let at_start = |squared: &f64| if squared.is_finite() { JUST_CHANGED } else { 0 };
    let changed = near.squared.par_iter().with_min_len(1 << 14).map(at_start).collect();
    let mut samples = Samples { points, near, changed };
    let swept = sweep(ghosted, rounds, &mut samples);
    (samples.near, swept)
}

/// The nearest samples so far.
struct Samples<'p, const D: usize> {
    points: &'p [[f64; D]],
    near: NearField,
    changed: Vec<u8>,
}

impl<const D: usize> Field<D> for Samples<'_, D> {
    fn relax(&mut self, lattice: &Ghosted<D>, first: [usize; D], forwards: [bool; D]) -> f64 {
        let Self { points, near: NearField { squared, nearest }, changed } = self;
        let n = lattice.row_len();
        let strides = lattice.strides();
        let mut ask = vec![0_u8; n];
        let mut largest = 0.0_f64;
        for number in 0..lattice.row_count() {
            let Row { start, node } = lattice.row(number, forwards);
            ask.copy_from_slice(&changed[start - 1..][..n]);
            for offset in [start + 1]
                .into_iter()
                .chain((0..D - 1).flat_map(|axis| [start - strides[axis], start + strides[axis]]))
            {
                for (ask, &changed) in ask.iter_mut().zip(&changed[offset..][..n]) {
                    *ask |= changed;
                }
            }
            let mut at: [f64; D] = std::array::from_fn(|axis| (first[axis] + node[axis]) as f64);
            let mut previous_changed = false;
            for step in 0..n {
                let k = if forwards[D - 1] { step } else { n - 1 - step };
                let here = start + k;
                let mut improved = false;
                if ask[k] != 0 || previous_changed {
                    at[D - 1] = k as f64;
                    let before = squared[here];
                    for stride in strides {
                        for there in [here - stride, here + stride] {
                            let candidate = nearest[there];
                            if changed[there] == 0 || candidate == nearest[here] {
                                continue;
                            }
                            let offered = squared_distance(&at, &points[candidate as usize]);
                            if offered < squared[here] {
                                squared[here] = offered;
                                nearest[here] = candidate;
                                improved = true;
                            }
                        }
                    }
                    if improved {
                        largest = largest.max(before.sqrt() - squared[here].sqrt());
                    }
                }
                changed[here] = if improved { JUST_CHANGED } else { changed[here] >> 1 };
                previous_changed = improved;
            }
        }
        largest
    }

    fn part(&self, tile: &Tile<'_, D>) -> Self {
        let near = NearField { squared: tile.part(&self.near.squared), nearest: tile.part(&self.near.nearest) };
        Self { points: self.points, near, changed: tile.part(&self.changed) }
    }

    fn put_back(&mut self, parts: &Parts<'_, '_, D, Self>) {
        parts.copy_to(&mut self.near.squared, |part| &part.near.squared);
        parts.copy_to(&mut self.near.nearest, |part| &part.near.nearest);
        parts.copy_to(&mut self.changed, |part| &part.changed);
    }
}

#[inline(always)]
fn squared_distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::near_field::near_field;
    use proptest::prelude::*;

    proptest! {
        /// Asking only changed neighbours must not lose anything: at the fixed point no neighbour has a better sample.
        #[test]
        fn at_the_fixed_point_no_neighbour_knows_better(
            points in prop::collection::vec((-3.0..14.0_f64, -3.0..9.0_f64, -3.0..11.0_f64), 1..40),
        ) {
            let points: Vec<[f64; 3]> = points.into_iter().map(|(x, y, z)| [x, y, z]).collect();
            let ghosted = Ghosted::new([12, 7, 9]);
            let (near, swept) = closest_point(&ghosted, &points, near_field(&ghosted, &points, 2), 50);
            prop_assert_eq!(swept.last_change, 0.0);
            for number in 0..ghosted.row_count() {
                let row = ghosted.row(number, [true; 3]);
                for k in 0..ghosted.row_len() {
                    let node = [row.node[0] as f64, row.node[1] as f64, k as f64];
                    let here = row.start + k;
                    let own = near.squared[here];
                    prop_assert_eq!(own, squared_distance(&node, &points[near.nearest[here] as usize]));
                    for stride in ghosted.strides() {
                        for there in [here - stride, here + stride] {
                            if let Some(sample) = points.get(near.nearest[there] as usize) {
                                prop_assert!(squared_distance(&node, sample) >= own);
                            }
                        }
                    }
                }
            }
        }
    }
}
