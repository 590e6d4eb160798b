//! The contour on the surface of a cell some of whose neighbours are half as large.
//!
//! A smaller neighbour's contour is the one that counts: on a face that is split into four the contour is theirs, and on an edge that is
//! split into two the zeros are on its halves. So both sides of every face draw the same contour, and the cell fills what it then has on its
//! surface like any other.

use rayon::prelude::*;

use crate::cell::{
    contour, edge_between, edge_corners, edge_faces, face_corners, face_segments, loops, positives_joined,
};
use crate::interior::{Interior, interior};
use crate::samples::LatticeSamples;

/// An edge that has a zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CutEdge {
    /// One of the cell's own twelve.
    Own(usize),
    /// One of the finer lattice, by its lower node and its axis.
    Finer([usize; 3], usize),
}

/// The contour on a cell's surface.
#[derive(Debug)]
pub(crate) struct Seam {
    /// The lower corner among the finer lattice's nodes, and the first half of the cell among its cells.
    base: [usize; 3],
    pub(crate) edges: Vec<CutEdge>,
    /// To which edge the contour goes on from each, with f > 0 on its left seen from outside the cell.
    next: Vec<usize>,
    /// Whether all faces that are not split show how the zeros on their rims belong together: not, where both halves of an edge have one.
    pub(crate) is_clear: bool,
}

impl Seam {
    /// The contour on a cell that has the given values at its corners, if any of its faces or edges is split. Cells, nodes and edges go by
    /// their places on the whole lattices.
    pub(crate) fn of(finer: &LatticeSamples<3>, cell: [usize; 3], values: &[f64; 8]) -> Option<Self> {
        // Outside is one layer, whatever the size.
        let last = finer.whole().map(|n| (n - 2) / 2);
        if (0..3).any(|axis| cell[axis] == 0 || cell[axis] > last[axis]) {
            return None;
        }
        let base = cell.map(|k| 2 * k - 1);
        if (0..8).all(|corner| finer.node_at(&corner_of(base, corner, 2)).is_none()) {
            return None;
        }
        let middles: [Option<f64>; 12] =
            std::array::from_fn(|edge| middle(finer, corner_of(base, edge_corners(edge)[0], 2), edge / 4));
        let is_split: [bool; 6] = std::array::from_fn(|face| {
            let mut across = base;
            across[face / 2] = if face % 2 == 1 { base[face / 2] + 2 } else { base[face / 2] - 1 };
            finer.cell_at(&across).is_some()
        });
        if middles.iter().all(Option::is_none) && is_split == [false; 6] {
            return None;
        }
        let mut seam = Self { base, edges: vec![], next: vec![], is_clear: true };
        for face in 0..6 {
            if is_split[face] {
                seam.draw_quarters(finer, face);
            } else {
                seam.draw_whole(face, values, &middles);
            }
        }
        Some(seam)
    }

    /// The contour on a face that is split.
    fn draw_quarters(&mut self, finer: &LatticeSamples<3>, face: usize) {
        for child in face_corners(face) {
            let start = corner_of(self.base, child, 1);
            let mut values = [0.0; 8];
            for corner in face_corners(face) {
                values[corner] = finer.value_at(&corner_of(start, corner, 1)).unwrap_or(0.0);
            }
            for step in face_segments(face, &values) {
                let [from, to] = step.map(|edge| CutEdge::Finer(corner_of(start, edge_corners(edge)[0], 1), edge / 4));
                self.step(from, to);
            }
        }
    }

    /// The contour on a face that is not split, though its edges may be.
    fn draw_whole(&mut self, face: usize, values: &[f64; 8], middles: &[Option<f64>; 12]) {
        let corners = face_corners(face);
        // Where the rim leaves f ≥ 0 or comes back, in its order.
        let mut cuts: Vec<(bool, CutEdge)> = vec![];
        for k in 0..4 {
            let (from, to) = (corners[k], corners[(k + 1) % 4]);
            let edge = edge_between(from, to);
            let before = cuts.len();
            let mut pass = |a: f64, b: f64, edge: CutEdge| {
                if (a < 0.0) != (b < 0.0) {
                    cuts.push((a >= 0.0, edge));
                }
            };
            match middles[edge] {
                None => pass(values[from], values[to], CutEdge::Own(edge)),
                Some(middle) => {
                    let [first, second] = self.halves(edge, from);
                    pass(values[from], middle, first);
                    pass(middle, values[to], second);
                }
            }
            self.is_clear &= cuts.len() < before + 2;
        }
        let ahead = cuts.len() == 4 && self.is_clear && positives_joined(corners.map(|c| values[c]));
        for (at, (leaves, from)) in cuts.iter().enumerate() {
            if *leaves {
                let other = if ahead { at + 1 } else { at + cuts.len() - 1 };
                self.step(*from, cuts[other % cuts.len()].1);
            }
        }
    }

    /// The halves of a split edge, the one at a given corner first.
    fn halves(&self, edge: usize, from: usize) -> [CutEdge; 2] {
        let (lower, axis) = (edge_corners(edge)[0], edge / 4);
        let start = corner_of(self.base, lower, 2);
        let mut middle = start;
        middle[axis] += 1;
        let halves = [CutEdge::Finer(start, axis), CutEdge::Finer(middle, axis)];
        if from == lower { halves } else { [halves[1], halves[0]] }
    }

    fn step(&mut self, from: CutEdge, to: CutEdge) {
        let [from, to] = [from, to].map(|edge| {
            self.edges.iter().position(|known| *known == edge).unwrap_or_else(|| {
                self.edges.push(edge);
                self.next.push(usize::MAX);
                self.edges.len() - 1
            })
        });
        self.next[from] = to;
    }

    /// The closed loops of the contour.
    pub(crate) fn loops(&self) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.edges.len()];
        let mut loops = Vec::new();
        for start in 0..self.edges.len() {
            let (mut cycle, mut edge) = (vec![], start);
            while seen.get(edge) == Some(&false) {
                seen[edge] = true;
                cycle.push(edge);
                edge = self.next[edge];
            }
            if !cycle.is_empty() {
                loops.push(cycle);
            }
        }
        loops
    }

    /// The faces of the cell on which each edge lies, as bits.
    pub(crate) fn faces(&self) -> Vec<u8> {
        let of = |edge: &CutEdge| match *edge {
            CutEdge::Own(edge) => edge_faces(edge),
            CutEdge::Finer(node, axis) => {
                let on = |a: usize| match node[a] - self.base[a] {
                    0 => 1u8 << (2 * a),
                    2 => 1 << (2 * a + 1),
                    _ => 0,
                };
                on((axis + 1) % 3) | on((axis + 2) % 3)
            }
        };
        self.edges.iter().map(of).collect()
    }

    /// What the cell's interior does to the loops: as its corners tell, if these show the same loops, and else each bounds a disc.
    pub(crate) fn interior(&self, values: &[f64; 8], cycles: &[Vec<usize>]) -> Interior {
        let whole = loops(&contour(values));
        if whole.len() < 2 || whole.len() != cycles.len() {
            return Interior::Discs;
        }
        let faces = self.faces();
        // The cell's own edge of which an edge is a part.
        let own = |edge: &usize| (0..12).find(|own| edge_faces(*own) == faces[*edge]);
        let place = |cycle: &Vec<usize>| {
            let mut edges: Vec<usize> = cycle.iter().filter_map(own).collect();
            let lowest = (0..edges.len()).min_by_key(|i| edges[*i])?;
            edges.rotate_left(lowest);
            whole.iter().position(|other| *other == edges)
        };
        let places: Vec<Option<usize>> = cycles.iter().map(place).collect();
        match interior(values, &whole) {
            Interior::Tunnel(a, b) if places.iter().all(Option::is_some) => {
                let of = |wanted: usize| places.iter().position(|place| *place == Some(wanted));
                of(a).zip(of(b)).map_or(Interior::Discs, |(a, b)| Interior::Tunnel(a, b))
            }
            Interior::Unclear => Interior::Unclear,
            _ => Interior::Discs,
        }
    }
}

/// The node at a corner of a cube with a given lower corner and side.
fn corner_of(start: [usize; 3], corner: usize, side: usize) -> [usize; 3] {
    std::array::from_fn(|axis| start[axis] + side * (corner >> axis & 1))
}

/// The value in the middle of an edge that begins at a node of the finer lattice, if the edge is split.
fn middle(finer: &LatticeSamples<3>, mut node: [usize; 3], axis: usize) -> Option<f64> {
    if node[axis] + 4 > finer.whole()[axis] {
        return None;
    }
    finer.node_at(&node)?;
    node[axis] += 1;
    let value = finer.value_at(&node)?;
    node[axis] += 1;
    finer.node_at(&node).map(|_| value)
}

/// Whether an edge is split, given its lower node's place on the whole lattice.
pub(crate) fn is_split(finer: &LatticeSamples<3>, node: [usize; 3], axis: usize) -> bool {
    !node.contains(&0) && middle(finer, node.map(|k| 2 * k - 1), axis).is_some()
}

/// The cells on whose surface smaller ones leave the contour unclear, by their place without the layer around the lattice.
pub(crate) fn unclear_cells(samples: &LatticeSamples<3>, finer: &LatticeSamples<3>) -> Vec<[u32; 3]> {
    let shape = samples.shape();
    let of = |i: usize| {
        let mut found = vec![];
        for j in 0..shape[1] - 1 {
            for run in samples.cells().row(i * (shape[1] - 1) + j) {
                for k in run.from..run.to {
                    let cell = [i, j, k as usize];
                    let values = std::array::from_fn(|corner| samples.value(&corner_of(cell, corner, 1)));
                    let cell = samples.on_whole(&cell);
                    if Seam::of(finer, cell, &values).is_some_and(|seam| !seam.is_clear) {
                        found.push(cell.map(|k| k as u32 - 1));
                    }
                }
            }
        }
        found
    };
    (0..shape[0] - 1).into_par_iter().flat_map_iter(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::ArrayD;
    use proptest::array::uniform8;
    use proptest::prelude::*;

    /// A cell with values at its corners, all of whose neighbours are half as large and have the trilinear interpolant's values.
    fn seam_of(values: &[f64; 8]) -> Seam {
        let at = |node: ndarray::IxDyn| {
            let t = [0, 1, 2].map(|axis| 0.5 * node[axis] as f64);
            let weight = |c: usize| (0..3).map(|a| if c >> a & 1 == 1 { t[a] } else { 1.0 - t[a] }).product::<f64>();
            (0..8).map(|c| weight(c) * values[c]).sum()
        };
        let axis = vec![0.0, 1.0, 2.0];
        let finer = LatticeSamples::new([axis.clone(), axis.clone(), axis], ArrayD::from_shape_fn(vec![3; 3], at));
        Seam::of(&finer.unwrap(), [1, 1, 1], values).unwrap()
    }

    fn check(values: &[f64; 8]) -> Result<Interior, TestCaseError> {
        let seam = seam_of(values);
        prop_assert!(seam.is_clear);
        let (cycles, whole) = (seam.loops(), loops(&contour(values)));
        prop_assert_eq!(cycles.len(), whole.len());
        prop_assert_eq!(cycles.iter().map(Vec::len).sum::<usize>(), seam.edges.len(), "every zero is on one loop");
        let (found, expected) = (seam.interior(values, &cycles), interior(values, &whole));
        prop_assert_eq!(matches!(found, Interior::Tunnel(..)), matches!(expected, Interior::Tunnel(..)));
        Ok(found)
    }

    proptest! {
        #[test]
        fn halves_of_the_neighbours_change_nothing_of_what_they_show(magnitudes in uniform8(0.05..1.0f64)) {
            for pattern in 1..255usize {
                check(&std::array::from_fn(|c| if pattern >> c & 1 == 1 { magnitudes[c] } else { -magnitudes[c] }))?;
            }
        }
    }

    #[test]
    fn tunnels_stay() {
        for values in [[2, -1, -1, -1, -1, -1, -1, 6], [-4, 3, 3, -1, 2, -1, -1, -3], [2, 2, -6, -1, -1, -5, 4, 4]] {
            let values = values.map(f64::from);
            for values in [values, values.map(|v| -v)] {
                assert!(matches!(check(&values).unwrap(), Interior::Tunnel(..)), "{values:?}");
            }
        }
    }
}
