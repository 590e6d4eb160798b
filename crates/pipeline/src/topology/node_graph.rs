//! The nodes of a lattice as a graph.

/// Nodes, numbered in the order of a C-ordered array, and their neighbours.
pub(crate) struct NodeGraph {
    shape: Vec<usize>,
    strides: Vec<usize>,
}

impl NodeGraph {
    pub(crate) fn new(shape: &[usize]) -> Self {
        let mut strides = vec![1; shape.len()];
        for axis in (0..shape.len().saturating_sub(1)).rev() {
            strides[axis] = strides[axis + 1] * shape[axis + 1];
        }
        Self { shape: shape.to_vec(), strides }
    }

    /// The nodes next to one along the axes, of each axis the one before and the one after; `None` for each step that leaves the lattice.
    pub(crate) fn neighbours(&self, node: usize) -> impl Iterator<Item = Option<usize>> + '_ {
        (0..self.shape.len()).flat_map(move |axis| {
            let position = node / self.strides[axis] % self.shape[axis];
            let before = (position > 0).then(|| node - self.strides[axis]);
            let after = (position + 1 < self.shape[axis]).then(|| node + self.strides[axis]);
            [before, after]
        })
    }

    /// The nodes that can be reached from `start` through `next`, as far as `claim` takes each for the first time.
    pub(crate) fn flood<I: IntoIterator<Item = usize>>(
        start: usize,
        next: impl Fn(usize) -> I,
        mut claim: impl FnMut(usize) -> bool,
    ) -> Vec<usize> {
        let mut nodes: Vec<usize> = [start].into_iter().filter(|node| claim(*node)).collect();
        let mut done = 0;
        while done < nodes.len() {
            nodes.extend(next(nodes[done]).into_iter().filter(|node| claim(*node)));
            done += 1;
        }
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_end_at_the_faces() {
        let graph = NodeGraph::new(&[2, 3, 4]);
        // Node (1, 1, 0).
        let next: Vec<Option<usize>> = graph.neighbours(16).collect();
        assert_eq!(next, [Some(4), None, Some(12), Some(20), None, Some(17)]);
    }

    #[test]
    fn a_flood_stays_where_it_may_go() {
        let graph = NodeGraph::new(&[4, 4]);
        let wet = |node: usize| node / 4 != 2;
        let mut visited = [false; 16];
        let next = |node: usize| graph.neighbours(node).flatten().filter(|next| wet(*next)).collect::<Vec<_>>();
        let nodes = NodeGraph::flood(0, next, |node| !std::mem::replace(&mut visited[node], true));
        assert_eq!(nodes.len(), 8);
        assert!(visited[7] && !visited[8] && !visited[12]);
    }
}
