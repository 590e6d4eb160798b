//! Lattice arrays with a layer of ghost nodes around them.

use rayon::prelude::*;

/// Index arithmetic of a C-ordered array with one ghost node beyond each end of each axis.
///
/// Ghosts hold what "no neighbour" means (an infinite distance, no sample), which turns the interior scheme of eq. 12
/// into the one-sided scheme of eq. 13 without a case distinction.
pub(crate) struct Ghosted<const D: usize> {
    shape: [usize; D],
    strides: [usize; D],
    len: usize,
}

/// One line of nodes along the last axis.
#[derive(Clone, Copy)]
pub(crate) struct Row<const D: usize> {
    /// Position of the row's first node in the ghosted array.
    pub(crate) start: usize,
    /// Lattice coordinates of that node; the last one is 0.
    pub(crate) node: [usize; D],
}

impl<const D: usize> Ghosted<D> {
    pub(crate) fn new(shape: [usize; D]) -> Self {
        let mut strides = [1; D];
        for axis in (0..D - 1).rev() {
            strides[axis] = strides[axis + 1] * (shape[axis + 1] + 2);
        }
        Self { shape, strides, len: strides[0] * (shape[0] + 2) }
    }

    /// Length of an array with ghosts.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// Distance in the array between neighbours on each axis; 1 on the last.
    pub(crate) fn strides(&self) -> [usize; D] {
        self.strides
    }

    /// Number of nodes in a row.
    pub(crate) fn row_len(&self) -> usize {
        self.shape[D - 1]
    }

    pub(crate) fn row_count(&self) -> usize {
        self.shape[..D - 1].iter().product()
    }

    /// Position of a node in the ghosted array.
    pub(crate) fn position(&self, node: [usize; D]) -> usize {
        (0..D).map(|axis| (node[axis] + 1) * self.strides[axis]).sum()
    }

    /// The `number`-th row when every axis but the last runs forwards (`true`) or backwards, the first axis slowest.
    pub(crate) fn row(&self, number: usize, forwards: [bool; D]) -> Row<D> {
        let mut node = [0; D];
        let mut rest = number;
        for axis in (0..D - 1).rev() {
            let step = rest % self.shape[axis];
            rest /= self.shape[axis];
            node[axis] = if forwards[axis] { step } else { self.shape[axis] - 1 - step };
        }
        Row { start: self.position(node), node }
    }

    /// The values without the ghosts, each passed through `map`.
    pub(crate) fn strip<A: Copy + Sync, B: Clone + Default + Send>(
        &self,
        ghosted: &[A],
        map: impl Fn(A) -> B + Sync,
    ) -> Vec<B> {
        let mut values = vec![B::default(); self.shape.iter().product()];
        values.par_chunks_mut(self.row_len()).enumerate().with_min_len(64).for_each(|(number, row)| {
            let start = self.row(number, [true; D]).start;
            row.iter_mut().zip(&ghosted[start..]).for_each(|(value, ghosted)| *value = map(*ghosted));
        });
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strip_returns_the_nodes_in_c_order() {
        let ghosted = Ghosted::new([2, 3, 4]);
        let mut values = vec![usize::MAX; ghosted.len()];
        for i in 0..2 {
            for j in 0..3 {
                for k in 0..4 {
                    values[ghosted.position([i, j, k])] = (i * 3 + j) * 4 + k;
                }
            }
        }
        assert_eq!(ghosted.strip(&values, |v| v), (0..24).collect::<Vec<_>>());
    }

    #[test]
    fn rows_run_backwards_where_asked() {
        let ghosted = Ghosted::new([2, 3, 4]);
        let nodes: Vec<_> = (0..6).map(|number| ghosted.row(number, [false, true, true]).node).collect();
        assert_eq!(nodes, [[1, 0, 0], [1, 1, 0], [1, 2, 0], [0, 0, 0], [0, 1, 0], [0, 2, 0]]);
    }
}
