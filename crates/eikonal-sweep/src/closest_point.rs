//! Closest-point sweeping: the sweeps of the paper, carrying the index of the nearest sample.

use std::array::from_fn;

use rayon::prelude::*;

use crate::ghost::{Ghosted, Row};
use crate::near_field::NearField;
use crate::sweep::{Swept, sweep, sweep_order};
use crate::tiles::{Field, Parts, Tile};

/// `changed` of a node whose sample was replaced when it was last visited; halved at each visit after that.
const JUST_CHANGED: u8 = 2;

/// Replaced then or at the visit before.
const RECENTLY: u8 = JUST_CHANGED | JUST_CHANGED >> 1;

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
    fn relax(&mut self, lattice: &Ghosted<D>, first: [usize; D], sweep: usize) -> f64 {
        let Self { points, near: NearField { squared, nearest }, changed } = self;
        let forwards = sweep_order::<D>(sweep);
        let unseen: [Unseen; D] = unseen_changes(sweep);
        let n = lattice.row_len();
        let strides = lattice.strides();
        let mut ask = vec![0_u8; n];
        let mut largest = 0.0_f64;
        for number in 0..lattice.row_count() {
            let Row { start, node } = lattice.row(number, forwards);
            ask.fill(0);
            for (axis, unseen) in unseen.into_iter().enumerate() {
                let [earlier, later] = neighbours(start, strides[axis], forwards[axis]);
                // Those in the row are not visited yet: what changed at their last visit will have changed at the one before.
                let unseen_earlier = if axis == D - 1 { JUST_CHANGED } else { unseen.earlier };
                for (there, unseen) in [(earlier, unseen_earlier), (later, unseen.later)] {
                    for (ask, &changed) in ask.iter_mut().zip(&changed[there..][..n]) {
                        *ask |= changed & unseen;
                    }
                }
            }
            // Each has been visited once more; what changes is set anew below.
            changed[start..start + n].iter_mut().for_each(|changed| *changed >>= 1);
            let mut at: [f64; D] = from_fn(|axis| (first[axis] + node[axis]) as f64);
            let mut improved = false;
            for step in 0..n {
                let k = if forwards[D - 1] { step } else { n - 1 - step };
                if ask[k] == 0 && !std::mem::take(&mut improved) {
                    continue;
                }
                let here = start + k;
                at[D - 1] = k as f64;
                let before = squared[here];
                improved = false;
                for axis in 0..D {
                    let [earlier, later] = neighbours(here, strides[axis], forwards[axis]);
                    for (there, unseen) in [(earlier, unseen[axis].earlier), (later, unseen[axis].later)] {
                        let candidate = nearest[there];
                        if changed[there] & unseen == 0 || candidate == nearest[here] {
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
                    changed[here] = JUST_CHANGED;
                }
            }
        }
        largest
    }

    fn part(&self, tile: &Tile<'_, D>) -> Self {
        let near = NearField { squared: tile.part(&self.near.squared), nearest: tile.part(&self.near.nearest) };
        Self { points: self.points, near, changed: tile.part(&self.changed) }
    }

    fn put_back(&mut self, parts: &Parts<'_, '_, D, Self>) {
        let NearField { squared, nearest } = &mut self.near;
        let near = parts.slabs(squared).zip(parts.slabs(nearest));
        near.zip(parts.slabs(&mut self.changed)).zip(parts.par_iter()).for_each(
            |(((squared, nearest), changed), (tile, part))| {
                tile.put_back(squared, &part.near.squared);
                tile.put_back(nearest, &part.near.nearest);
                tile.put_back(changed, &part.changed);
            },
        );
    }
}

/// Which numbers in `changed` tell of samples that a node has not been offered, of its neighbours before and after it along an axis.
#[derive(Clone, Copy)]
struct Unseen {
    earlier: u8,
    later: u8,
}

/// By axis. A neighbour that comes before the node in this sweep as in the one before was seen after each of its visits; if it came
/// after the node then, its change of that sweep is new too. A neighbour that comes after the node was seen as it is now if it came
/// before it in the last sweep.
fn unseen_changes<const D: usize>(sweep: usize) -> [Unseen; D] {
    let order = sweep_order::<D>(sweep);
    let Some(former) = sweep.checked_sub(1).map(sweep_order::<D>) else {
        return [Unseen { earlier: RECENTLY, later: RECENTLY }; D];
    };
    from_fn(|axis| match former[axis] == order[axis] {
        true => Unseen { earlier: JUST_CHANGED, later: JUST_CHANGED },
        false => Unseen { earlier: RECENTLY, later: 0 },
    })
}

/// The neighbours visited before and after a node.
#[inline(always)]
fn neighbours(here: usize, stride: usize, forwards: bool) -> [usize; 2] {
    if forwards { [here - stride, here + stride] } else { [here + stride, here - stride] }
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

    /// Sweeps node after node, each offered every neighbour's sample.
    fn node_after_node<const D: usize>(shape: [usize; D], points: &[[f64; D]], sweeps: usize) -> NearField {
        let ghosted = Ghosted::new(shape);
        let mut near = near_field(&ghosted, points, 2);
        for forwards in (0..sweeps).map(sweep_order::<D>) {
            for number in 0..ghosted.row_count() {
                let Row { start, mut node } = ghosted.row(number, forwards);
                for step in 0..ghosted.row_len() {
                    node[D - 1] = if forwards[D - 1] { step } else { ghosted.row_len() - 1 - step };
                    let at = start + node[D - 1];
                    for axis in 0..D {
                        for there in neighbours(at, ghosted.strides()[axis], forwards[axis]) {
                            let Some(point) = points.get(near.nearest[there] as usize) else { continue };
                            let offered = squared_distance(&node.map(|i| i as f64), point);
                            if offered < near.squared[at] {
                                (near.squared[at], near.nearest[at]) = (offered, near.nearest[there]);
                            }
                        }
                    }
                }
            }
        }
        near
    }

    proptest! {
        #[test]
        fn what_was_seen_before_need_not_be_seen_again(
            points in prop::collection::vec((0.0..11.0_f64, 0.0..17.0_f64, 0.0..8.0_f64), 1..40),
            rounds in 1_usize..3,
        ) {
            let points: Vec<[f64; 3]> = points.into_iter().map(|(x, y, z)| [x, y, z]).collect();
            let shape = [12, 18, 9];
            let ghosted = Ghosted::new(shape);
            let (near, swept) = closest_point(&ghosted, &points, near_field(&ghosted, &points, 2), rounds);
            let expected = node_after_node(shape, &points, swept.sweeps);
            prop_assert!(near.nearest == expected.nearest && near.squared == expected.squared);
        }
    }
}
