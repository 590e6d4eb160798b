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

    pub(crate) fn dimension(&self) -> usize {
        self.shape.len()
    }

    /// The index of a node along an axis.
    pub(crate) fn position(&self, node: usize, axis: usize) -> usize {
        node / self.strides[axis] % self.shape[axis]
    }

    /// The nodes next to one along the axes; `None` for each step that leaves the lattice.
    pub(crate) fn neighbours(&self, node: usize) -> impl Iterator<Item = Option<usize>> + '_ {
        (0..self.shape.len()).flat_map(move |axis| {
            let position = self.position(node, axis);
            let before = (position > 0).then(|| node - self.strides[axis]);
            let after = (position + 1 < self.shape[axis]).then(|| node + self.strides[axis]);
            [before, after]
        })
    }

    /// The nodes that share a cell with one, and itself.
    pub(crate) fn around(&self, node: usize) -> Vec<usize> {
        let mut found = vec![node];
        for (axis, (stride, length)) in self.strides.iter().zip(&self.shape).enumerate() {
            let position = self.position(node, axis);
            for at in 0..found.len() {
                if position > 0 {
                    found.push(found[at] - stride);
                }
                if position + 1 < *length {
                    found.push(found[at] + stride);
                }
            }
        }
        found
    }

    /// The nodes that can be reached from `start` through `next`, which are marked as `visited`.
    pub(crate) fn flood<I: IntoIterator<Item = usize>>(
        start: usize,
        visited: &mut [bool],
        next: impl Fn(usize) -> I,
    ) -> Vec<usize> {
        let mut nodes = vec![start];
        visited[start] = true;
        let mut done = 0;
        while done < nodes.len() {
            for node in next(nodes[done]) {
                if !visited[node] {
                    visited[node] = true;
                    nodes.push(node);
                }
            }
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
        let mut around = graph.around(16);
        around.sort_unstable();
        assert_eq!(around, [0, 1, 4, 5, 8, 9, 12, 13, 16, 17, 20, 21]);
    }

    #[test]
    fn a_flood_stays_where_it_may_go() {
        let graph = NodeGraph::new(&[4, 4]);
        let wet = |node: usize| node / 4 != 2;
        let mut visited = vec![false; 16];
        let nodes = NodeGraph::flood(0, &mut visited, |node| {
            graph.neighbours(node).flatten().filter(|next| wet(*next)).collect::<Vec<_>>()
        });
        assert_eq!(nodes.len(), 8);
        assert!(visited[7] && !visited[8] && !visited[12]);
    }
}
