//! Fillings of holes that the surface around them does not call for.
//!
//! Third derivatives carry a surface on beyond its rim: across a gap in a tube to the other side, over the missing cap of a ball. Beyond the tip
//! of a thin part, of which the points show the two broad sides and hardly the edge between them, they carry those on until they meet
//! somewhere: a balloon. What tells it is its surface, which is many times that of the tip, and rests on that alone.

use std::cmp::Reverse;
use std::collections::HashSet;

use ndarray::ArrayD;

use crate::lattice::domain::multi_index;
use crate::topology::cell_sides::cells_around;
use crate::topology::node_graph::NodeGraph;

/// A filling may have so many times the surface that it takes the place of: a half ball over a flat end has twice, a finger as long as it is
/// wide four times.
const MOST: f64 = 4.0;
/// Unless it joins two pieces of that, each with at least this share of it, by no more than so many times the volume of a straight bridge between
/// them: one that turns by half a circle has 1.6 times, and where it is thicker than the tips that it joins it has more. What leaves the box is no bridge.
const LEAST: f64 = 0.1;
const WIDEST: f64 = 2.25;

/// The nodes of a lattice that such fillings have brought to the other side. `before` and `after` are negative inside, without and with what fills
/// holes, on a lattice of that shape. Connected nodes are judged together, by the number of the lattice's edges across either surface.
pub fn inventions<const D: usize>(before: &ArrayD<f64>, after: &ArrayD<f64>, shape: &[usize; D]) -> Vec<usize> {
    let graph = NodeGraph::new(shape);
    let signs = |values: &ArrayD<f64>| -> Vec<bool> { values.iter().map(|value| *value < 0.0).collect() };
    let (before, after) = (signs(before), signs(after));
    let changed = |node: usize| before[node] != after[node];
    let mut visited = vec![false; before.len()];
    let mut found = Vec::new();
    for start in 0..before.len() {
        if visited[start] || !changed(start) {
            continue;
        }
        let next =
            |node| graph.neighbours(node).flatten().filter(|next| changed(*next) && before[*next] == before[start]);
        let nodes = NodeGraph::flood(start, next, |node| !std::mem::replace(&mut visited[node], true));
        // What lies beyond the box is outside.
        let edges = |node: usize, signs: &[bool]| {
            let crosses =
                |next: Option<usize>| next.map_or(signs[node], |next| !changed(next) && signs[next] != signs[node]);
            graph.neighbours(node).filter(|next| crosses(*next)).count()
        };
        let old: Vec<usize> = nodes.iter().copied().filter(|node| edges(*node, &before) > 0).collect();
        let [was, is] = [&before, &after].map(|signs| nodes.iter().map(|node| edges(*node, signs)).sum::<usize>());
        let leaves_the_box = nodes.iter().any(|node| graph.neighbours(*node).any(|next| next.is_none()));
        if is as f64 > MOST * was as f64 && (leaves_the_box || !joins(nodes.len(), &old, shape)) {
            found.extend(nodes);
        }
    }
    found
}

/// Whether a filling of so many nodes runs from one piece of the surface that it takes the place of, `old`, to another.
fn joins<const D: usize>(filling: usize, old: &[usize], shape: &[usize; D]) -> bool {
    let mut pieces = pieces(old, shape);
    pieces.sort_by_key(|piece| Reverse(piece.len()));
    let [first, second, ..] = pieces.as_slice() else { return false };
    let centre = |piece: &[usize]| -> [f64; D] {
        let sum = |axis: usize| piece.iter().map(|node| multi_index(*node, shape)[axis] as f64).sum::<f64>();
        std::array::from_fn(|axis| sum(axis) / piece.len() as f64)
    };
    let apart = centre(first).iter().zip(centre(second)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let straight = 0.5 * (first.len() + second.len()) as f64 * apart;
    second.len() as f64 >= LEAST * old.len() as f64 && filling as f64 <= WIDEST * straight
}

/// The nodes in pieces that hang together, in cells that they share.
fn pieces<const D: usize>(nodes: &[usize], shape: &[usize; D]) -> Vec<Vec<usize>> {
    let mut left: HashSet<usize> = nodes.iter().copied().collect();
    let around = |node| cells_around(node, *shape, u32::MAX);
    let piece = |start: &usize| NodeGraph::flood(*start, around, |node| left.remove(&node));
    nodes.iter().map(piece).filter(|piece| !piece.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 32;

    /// A lattice with what is inside negative.
    fn lattice(inside: &dyn Fn([f64; 3]) -> bool) -> ArrayD<f64> {
        ArrayD::from_shape_fn(vec![SIDE; 3], |i| if inside([0, 1, 2].map(|axis| i[axis] as f64)) { -1.0 } else { 1.0 })
    }

    /// How many nodes a filling has brought to the other side, and how many of these are inventions.
    fn judged(before: impl Fn([f64; 3]) -> bool, filling: impl Fn([f64; 3]) -> bool) -> (usize, usize) {
        let (old, new) = (lattice(&before), lattice(&|x| before(x) || filling(x)));
        let changed = old.iter().zip(&new).filter(|(a, b)| a != b).count();
        (changed, inventions(&old, &new, &[SIDE; 3]).len())
    }

    fn from_axis(x: [f64; 3]) -> f64 {
        (x[0] - 15.5).hypot(x[1] - 15.5)
    }

    fn from_place(x: [f64; 3], place: [f64; 3]) -> f64 {
        (x[0] - place[0]).hypot(x[1] - place[1]).hypot(x[2] - place[2])
    }

    /// A blade, 3 wide and 8 broad, that ends at a height of 12.
    fn blade(x: [f64; 3]) -> bool {
        (x[0] - 15.5).abs() < 1.5 && (x[1] - 15.5).abs() < 4.0 && (3.0..12.0).contains(&x[2])
    }

    #[test]
    fn half_a_ball_stays_and_a_balloon_on_a_tip_goes() {
        let post = |x: [f64; 3]| from_axis(x) < 6.0 && (3.0..12.0).contains(&x[2]);
        let (changed, found) = judged(post, |x| x[2] >= 12.0 && from_place(x, [15.5, 15.5, 12.0]) < 6.0);
        assert!(changed > 300 && found == 0, "{found} of {changed}");
        let (changed, found) = judged(blade, |x| x[2] >= 12.0 && from_place(x, [15.5, 15.5, 17.0]) < 6.0);
        assert!(changed > 600 && found == changed, "{found} of {changed}");
    }

    #[test]
    fn a_long_gap_in_a_tube_is_closed_and_what_swallows_two_tips_is_not() {
        let tube = |x: [f64; 3]| from_axis(x) < 2.5;
        let ends = |x: [f64; 3]| tube(x) && (3.0..28.0).contains(&x[2]) && !(8.0..23.0).contains(&x[2]);
        let (changed, found) = judged(ends, |x| tube(x) && (8.0..23.0).contains(&x[2]));
        assert!(changed > 200 && found == 0, "{found} of {changed}");
        let blades = |x: [f64; 3]| blade([x[0] - 3.0, x[1], x[2]]) || blade([x[0] + 3.0, x[1], x[2]]);
        let (changed, found) = judged(blades, |x| x[2] >= 12.0 && from_place(x, [15.5, 15.5, 18.0]) < 8.0);
        assert!(changed > 1000 && found == changed, "{found} of {changed}");
    }

    #[test]
    fn what_touches_nothing_goes() {
        let (changed, found) = judged(blade, |x| from_place(x, [15.5, 15.5, 24.0]) < 3.0);
        assert!(changed > 50 && found == changed, "{found} of {changed}");
    }

    #[test]
    fn what_leaves_the_box_is_no_bridge() {
        let tube = |x: [f64; 3]| (x[0] - 15.5).hypot(x[1] - 1.0) < 2.5;
        let ends = |x: [f64; 3]| tube(x) && !(8.0..23.0).contains(&x[2]);
        let (changed, found) = judged(ends, tube);
        assert!(changed > 100 && found == changed, "{found} of {changed}");
        let within = |x: [f64; 3]| x[1] > 0.0 && tube(x);
        let (changed, found) = judged(|x| within(x) && ends(x), within);
        assert!(changed > 100 && found == 0, "{found} of {changed}");
    }

    #[test]
    fn what_takes_away_is_judged_like_what_adds() {
        let balloon = |x: [f64; 3]| x[2] >= 12.0 && from_place(x, [15.5, 15.5, 17.0]) < 6.0;
        let (old, new) = (lattice(&blade), lattice(&|x| blade(x) || balloon(x)));
        let found = inventions(&old, &new, &[SIDE; 3]);
        assert!(!found.is_empty());
        assert_eq!(inventions(&old.mapv(|v| -v), &new.mapv(|v| -v), &[SIDE; 3]), found);
    }
}
