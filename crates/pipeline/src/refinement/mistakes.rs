//! Which changes of the topology refinement has made by mistake.

use std::collections::BTreeSet;

use zeroset_bspline::{Derivatives, HierarchicalSpline, Implicit, Spline};

use crate::points::kd_tree::{tree_of, within};
use crate::refinement::{FEW, Refinement};
use crate::topology::topology_changes::TopologyChange;

/// A change is a mistake where f has not got this share of the initial shape's values across zero. Between walls that it joins, and in
/// walls that it pierces, f hardly leaves zero; where it does, the points have parted or filled what was joined or pierced in the initial
/// shape;
const CLEARLY: f64 = 0.25;
/// but deeper than so many spacings in the initial shape, where there is none of them, f has to get this share of them across: holes and
/// bars that the initial shape has filled or lost come out with as much on the other side;
const DEPTH: f64 = 2.0;
const CLEARLY_DEEP: f64 = 0.6;
/// and of clean points what differs in so many cells along each axis, or as many in all, has been moved by the points if f vanishes at
/// those around it, however little it gets across;
const WIDE: usize = 3;
/// or else f is at odds with them, and has to get more across.
const CLEARLY_WIDE: f64 = 0.5;
/// These are the points within so many spacings of such a cell, and none may be farther off than so many. In a gap they do not tell: there
/// have to be as many as a curve has around one place, 2 AROUND, and in space a sheet, π AROUND².
const AROUND: f64 = 1.5;
const OFF: f64 = 0.1;
const ENOUGH: [usize; 2] = [3, 7];

/// Places in which f is to keep to its side, with the initial shape's values.
type Places<const D: usize> = Vec<([f64; D], f64)>;

impl<const D: usize> Refinement<'_, D> {
    /// Where the refined function has another topology than the initial shape by mistake, with the latter's values: first where that is
    /// deep or points tell, then elsewhere. What joins and parts there does so between the points, of which f̂ knows the sides, while the
    /// refined function only has to vanish at them. Nothing of few points.
    pub(super) fn mistakes(&self, initial: &Spline<D>, refined: &HierarchicalSpline<D>) -> [Places<D>; 2] {
        let [mut sure, mut others] = [const { Vec::new() }; 2];
        if self.spacing.count() < FEW {
            return [sure, others];
        }
        let changes = self.topology_changes(initial, refined);
        let depth = DEPTH * self.spacing.typical;
        let is_deep = |change: &TopologyChange<D>| change.before.iter().any(|value| value.abs() > depth);
        let is_wide = |change: &TopologyChange<D>| change.places.len() >= WIDE.pow(D as u32);
        let judged_by_points = |change: &TopologyChange<D>| !self.is_noisy() && is_wide(change) && !is_deep(change);
        let tree = changes.iter().any(judged_by_points).then(|| tree_of(self.points));
        let is_off = |change: &TopologyChange<D>| {
            let tree = tree.as_ref().filter(|_| judged_by_points(change))?;
            let reach = AROUND * self.spacing.typical;
            let near: BTreeSet<usize> = change.places.iter().flat_map(|place| within(tree, place, reach)).collect();
            let near: Vec<[f64; D]> = near.into_iter().map(|i| self.points[i]).collect();
            let telling = near.len() >= ENOUGH[usize::from(D == 3)];
            telling.then(|| is_off_one(refined, &near, OFF * self.spacing.typical))
        };
        for change in changes {
            let (is_deep, is_off) = (is_deep(&change), is_off(&change));
            if is_mistake(&change, is_deep, is_off) {
                let places = if is_deep || is_off.is_some() { &mut sure } else { &mut others };
                places.extend(change.places.into_iter().zip(change.before));
            }
        }
        [sure, others]
    }
}

/// Whether the initial shape is to be kept to, given whether f is off the points around the change, where they tell.
fn is_mistake<const D: usize>(change: &TopologyChange<D>, is_deep: bool, is_off: Option<bool>) -> bool {
    match is_off {
        _ if is_deep => change.clearness() < CLEARLY_DEEP,
        Some(is_off) => is_off && change.clearness() < CLEARLY_WIDE,
        None => change.clearness() < CLEARLY,
    }
}

/// Whether one of the points is farther than this from the zero set, by its Sampson distance.
fn is_off_one<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]], least: f64) -> bool {
    f.evaluate(points, Derivatives::Gradient).sampson_distances().iter().any(|distance| distance.abs() > least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;

    #[test]
    fn points_tell_of_wide_changes_and_clearness_of_narrow_ones() {
        let change =
            |clearness: f64| TopologyChange { places: vec![[0.0; 3]], before: vec![-1.0], after: vec![clearness] };
        let of = |clearness, is_off| is_mistake(&change(clearness), false, is_off);
        assert!(of(0.24, None) && !of(0.26, None), "no points tell");
        assert!(!of(0.1, Some(false)), "they have moved it");
        assert!(of(0.49, Some(true)) && !of(0.51, Some(true)), "at odds with them");
        let deep = |clearness, is_off| is_mistake(&change(clearness), true, is_off);
        assert!(deep(0.59, Some(false)) && !deep(0.61, Some(true)), "no points there");
    }

    #[test]
    fn one_point_off_is_enough() {
        // Twice the distance from a line.
        let f = spline(&Domain::around(&[1.0, 1.0], 8), 2, |x| 2.0 * x[1]);
        assert!(is_off_one(&f, &[[0.1, 0.0], [0.2, -0.031]], 0.03));
        assert!(!is_off_one(&f, &[[0.1, 0.0], [0.2, -0.029]], 0.03));
        // No slope tells how far off it is.
        let flat = spline(&Domain::around(&[1.0, 1.0], 8), 2, |_| 0.01);
        assert!(is_off_one(&flat, &[[0.1, 0.0]], 0.03));
    }
}
