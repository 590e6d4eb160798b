//! Which nodes of a lattice hang together.

use zeroset_bspline::{Derivatives, HierarchicalSpline};

use crate::lattice::domain::{Domain, Nodes, flat_index};
use crate::topology::node_graph::NodeGraph;

/// f, about the distance near zero, is taken to be no steeper than this between nodes.
const STEEPEST: f64 = 1.5;
/// Ways between nodes that are looked at together.
const WAYS: usize = 100_000;

/// The nodes of a lattice where f is not near zero, in parts that hang together on their side of the zero set.
pub(crate) struct NodeParts<const D: usize> {
    nodes: Nodes<D>,
    /// None where f is near zero.
    inside: Vec<Option<bool>>,
    /// The part of each.
    labels: Vec<u32>,
    count: u32,
}

impl<const D: usize> NodeParts<D> {
    /// Of the lattice after so many halvings. What is no farther from zero than `shallow` joins nothing, and walls between nodes are seen if
    /// they are no thinner than the cells after `finer` halvings.
    pub(crate) fn new(
        f: &HierarchicalSpline<D>,
        domain: &Domain<D>,
        [halvings, finer]: [u32; 2],
        shallow: f64,
    ) -> Self {
        let nodes = Nodes::new(domain, halvings);
        let values: Vec<f64> = f.sample(&nodes.axes, [0; D]).into_iter().collect();
        let side = |value: f64| (value.abs() > shallow).then_some(value < 0.0);
        let inside: Vec<Option<bool>> = values.iter().map(|value| side(*value)).collect();
        let graph = NodeGraph::new(&nodes.shape);
        let on_a_side = |node: usize, next: usize| inside[node].is_some() && inside[node] == inside[next];

        // Where f is so near to zero that a wall may be between two nodes it is looked at on the way.
        let length = domain.spacing(halvings);
        let is_near = |node: usize, next: usize| values[node].abs() + values[next].abs() <= STEEPEST * length;
        let unsure_ways = |node: usize| {
            let after = graph.neighbours(node).skip(1).step_by(2).enumerate();
            let is_unsure = move |next: usize| on_a_side(node, next) && is_near(node, next);
            after.filter_map(move |(axis, next)| next.is_some_and(is_unsure).then_some((node, axis)))
        };
        let pieces = 1usize << finer.saturating_sub(halvings);
        let on_the_way = |(node, axis): &(usize, usize)| {
            let (start, axis) = (nodes.at(*node), *axis);
            (1..pieces).map(move |piece| {
                let mut place = start;
                place[axis] += length * piece as f64 / pieces as f64;
                place
            })
        };
        // A bit for each axis, of the way after the node.
        let mut walls = vec![0u8; inside.len()];
        let mut all_ways = nodes.all().flat_map(unsure_ways);
        loop {
            let ways: Vec<(usize, usize)> = all_ways.by_ref().take(WAYS).collect();
            if ways.is_empty() {
                break;
            }
            let between: Vec<[f64; D]> = ways.iter().flat_map(on_the_way).collect();
            let between = f.evaluate(&between, Derivatives::Value).values;
            for ((node, axis), between) in ways.iter().zip(between.chunks((pieces - 1).max(1))) {
                if between.iter().any(|value| side(*value) != inside[*node]) {
                    walls[*node] |= 1 << axis;
                }
            }
        }

        const NONE: u32 = u32::MAX;
        let walls = &walls;
        let (mut labels, mut count) = (vec![NONE; inside.len()], 0);
        for start in nodes.all() {
            if inside[start].is_none() || labels[start] != NONE {
                continue;
            }
            let next = |node: usize| {
                let is_open = move |step: usize, next: &usize| {
                    on_a_side(node, *next) && walls[node.min(*next)] & (1 << (step / 2)) == 0
                };
                let steps = graph.neighbours(node).enumerate();
                steps.filter_map(move |(step, next)| next.filter(|next| is_open(step, next)))
            };
            NodeGraph::flood(start, next, |node| std::mem::replace(&mut labels[node], count) == NONE);
            count += 1;
        }
        Self { nodes, inside, labels, count }
    }

    /// How many parts there are.
    pub(crate) fn count(&self) -> usize {
        self.count as usize
    }

    /// The part of a node that is on that side, and clearly so.
    pub(crate) fn of(&self, index: &[usize; D], inside: bool) -> Option<usize> {
        let flat = flat_index(index, &self.nodes.shape);
        (self.inside[flat] == Some(inside)).then(|| self.labels[flat] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::tests::spline;

    #[test]
    fn a_wall_thinner_than_a_cell_parts_the_nodes_beside_it() {
        let domain = Domain::<2>::around(&[1.0, 1.0], 8);
        // In the midst of a row of cells, of an eighth.
        let middle = domain.lower[0] + 4.5 * domain.spacing;
        let parts = |half: f64, finer: u32| {
            let f = spline(&domain, 4, |[x, _]| (x - middle).abs() - half);
            NodeParts::new(&HierarchicalSpline::new(f).unwrap(), &domain, [0, finer], 0.01)
        };
        let seen = parts(0.03, 2);
        assert_eq!(seen.count(), 2);
        let [left, right] = [[4, 3], [5, 3]].map(|index| seen.of(&index, false));
        assert!(left.is_some() && right.is_some() && left != right);
        assert_eq!([seen.of(&[4, 3], true), seen.of(&[0, 0], false)], [None, left]);
        // Where nothing is looked at on the way it is not seen; and there is none where f is only near zero.
        assert_eq!(parts(0.03, 0).count(), 1);
        assert_eq!(parts(-0.05, 2).count(), 1);
        assert_eq!(parts(-0.005, 2).count(), 2, "what is shallow joins nothing");
    }
}
