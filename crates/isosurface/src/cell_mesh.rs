//! The triangles of one cell.
//!
//! A mesh of cells is 2-manifold if no edge between two vertices on a common face is made by a cell, other than the
//! face's own contour: the cell on the other side might make the same. Such chords are avoided, or broken by a new vertex
//! inside the cell.

use crate::interior::Interior;

/// Vertices are numbered as the edges are whose zeros they are, and from their number on for new vertices inside the cell.
#[derive(Debug, Default)]
pub(crate) struct CellMesh {
    edges: usize,
    /// First guesses for the new vertices.
    pub(crate) inner: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u8; 3]>,
}

impl CellMesh {
    /// Fills loops that have f > 0 on their left seen from outside the cell, and nothing else. `positions` are those of the edges' zeros, and
    /// `faces` has the bits of the faces on which each edge lies.
    pub(crate) fn fill(&mut self, loops: &[Vec<usize>], interior: Interior, positions: &[[f64; 3]], faces: &[u8]) {
        self.inner.clear();
        self.triangles.clear();
        self.edges = positions.len();
        let in_tunnel = |index: usize| matches!(interior, Interior::Tunnel(a, b) if index == a || index == b);
        for (_, cycle) in loops.iter().enumerate().filter(|(index, _)| !in_tunnel(*index)) {
            self.disc(cycle, positions, faces);
        }
        if let Interior::Tunnel(a, b) = interior {
            self.annulus(&loops[a], &loops[b], positions);
        }
    }

    fn disc(&mut self, cycle: &[usize], positions: &[[f64; 3]], faces: &[u8]) {
        let count = cycle.len();
        // Fans without forbidden chords, the one with the shortest chords.
        let fan = (0..count)
            .filter_map(|apex| {
                let chords = (2..count - 1).map(|k| (cycle[apex], cycle[(apex + k) % count]));
                let mut length = 0.0;
                for (a, b) in chords {
                    if faces[a] & faces[b] != 0 {
                        return None;
                    }
                    length += distance(&positions[a], &positions[b]);
                }
                Some((apex, length))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match fan {
            Some((apex, _)) => {
                let vertex = |k: usize| cycle[(apex + k) % count] as u8;
                self.triangles.extend((1..count - 1).map(|k| [vertex(0), vertex(k), vertex(k + 1)]));
            }
            None => {
                let centre = self.add(mean(cycle.iter().map(|&e| positions[e])));
                let edge = |k: usize| cycle[k % count] as u8;
                self.triangles.extend((0..count).map(|k| [centre, edge(k), edge(k + 1)]));
            }
        }
    }

    /// A strip between two loops that run in opposite directions around it. Each chord across is broken by a new vertex.
    fn annulus(&mut self, a: &[usize], b: &[usize], positions: &[[f64; 3]]) {
        let (n, m) = (a.len(), b.len());
        let length = |i: usize, j: usize| distance(&positions[a[i % n]], &positions[b[j % m]]);
        let pairs = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let (first, last) = pairs.min_by(|p, q| length(p.0, p.1).total_cmp(&length(q.0, q.1))).unwrap_or_default();
        // From there, a forwards and b backwards; `m − 1` steps forwards are one step back.
        let (mut i, mut j, mut forward, mut backward) = (first, last, 0, 0);
        let centre = mean(a.iter().chain(b).map(|&e| positions[e]));
        let middle = |mesh: &mut Self, i: usize, j: usize| {
            let chord = mean([positions[a[i % n]], positions[b[j % m]]].into_iter());
            // Off the face on which a chord may lie.
            mesh.add(std::array::from_fn(|axis| 0.9 * chord[axis] + 0.1 * centre[axis]))
        };
        let start = middle(self, i, j);
        let mut from = start;
        while forward < n || backward < m {
            let along_a = backward == m || (forward < n && length(i + 1, j) <= length(i, j + m - 1));
            let (next_i, next_j) = if along_a { (i + 1, j) } else { (i, j + m - 1) };
            forward += usize::from(along_a);
            backward += usize::from(!along_a);
            let to = if forward == n && backward == m { start } else { middle(self, next_i, next_j) };
            let (ai, bj) = (a[i % n] as u8, b[j % m] as u8);
            if along_a {
                let next = a[next_i % n] as u8;
                self.triangles.extend([[ai, next, to], [ai, to, from], [from, to, bj]]);
            } else {
                let next = b[next_j % m] as u8;
                self.triangles.extend([[ai, to, from], [to, next, bj], [to, bj, from]]);
            }
            (i, j, from) = (next_i, next_j, to);
        }
    }

    fn add(&mut self, position: [f64; 3]) -> u8 {
        self.inner.push(position);
        (self.edges + self.inner.len() - 1) as u8
    }
}

fn mean(points: impl Iterator<Item = [f64; 3]>) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for point in points {
        (0..3).for_each(|axis| sum[axis] += point[axis]);
        count += 1.0;
    }
    sum.map(|s| s / count)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{contour, edge_corners, edge_faces, loops};
    use crate::interior::interior;
    use proptest::array::uniform8;
    use proptest::prelude::*;
    use std::collections::{BTreeMap, BTreeSet};

    fn mesh_of(values: &[f64; 8]) -> (CellMesh, Vec<Vec<usize>>, Interior) {
        let loops = loops(&contour(values));
        let decision = interior(values, &loops);
        let positions: [[f64; 3]; 12] = std::array::from_fn(|edge| {
            let [a, b] = edge_corners(edge);
            let t = values[a] / (values[a] - values[b]);
            std::array::from_fn(|axis| (a >> axis & 1) as f64 + if axis == edge / 4 { t } else { 0.0 })
        });
        let mut mesh = CellMesh::default();
        mesh.fill(&loops, decision, &positions, &std::array::from_fn::<_, 12, _>(edge_faces));
        (mesh, loops, decision)
    }

    /// What a cell owes its neighbours and itself.
    fn check(values: &[f64; 8]) -> Result<bool, TestCaseError> {
        let (mesh, loops, decision) = mesh_of(values);
        let mut directed: BTreeMap<(u8, u8), usize> = BTreeMap::new();
        for &[a, b, c] in &mesh.triangles {
            for edge in [(a, b), (b, c), (c, a)] {
                *directed.entry(edge).or_default() += 1;
            }
        }
        prop_assert!(directed.values().all(|&count| count == 1));
        // The rim is the contour, and nothing else.
        let rim: BTreeSet<(u8, u8)> =
            directed.keys().filter(|&&(a, b)| !directed.contains_key(&(b, a))).copied().collect();
        let steps = |cycle: &Vec<usize>| {
            let next: Vec<u8> = cycle.iter().cycle().skip(1).take(cycle.len()).map(|&e| e as u8).collect();
            cycle.iter().map(|&e| e as u8).zip(next).collect::<Vec<_>>()
        };
        prop_assert_eq!(&rim, &loops.iter().flat_map(steps).collect());
        // A chord on a face could be made by the neighbour too.
        for &(a, b) in directed.keys().filter(|edge| !rim.contains(edge) && !rim.contains(&(edge.1, edge.0))) {
            let on_face = a < 12 && b < 12 && edge_faces(usize::from(a)) & edge_faces(usize::from(b)) != 0;
            prop_assert!(!on_face, "{a} {b}");
        }
        // Discs have Euler number 1 each; a tunnel, 0 instead of 2.
        let vertices: BTreeSet<u8> = mesh.triangles.iter().flatten().copied().collect();
        let edges = (directed.len() + rim.len()) / 2;
        let tunnel = matches!(decision, Interior::Tunnel(..));
        let euler = vertices.len() as i64 - edges as i64 + mesh.triangles.len() as i64;
        prop_assert_eq!(euler, loops.len() as i64 - 2 * i64::from(tunnel));
        prop_assert!(mesh.inner.iter().flatten().all(|&x| x > 0.0 && x < 1.0), "new vertices are inside the cell");
        Ok(tunnel)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_sign_pattern_is_filled_to_its_contour(magnitudes in uniform8(0.001..1.0f64)) {
            for pattern in 1..255usize {
                check(&std::array::from_fn(|c| if pattern >> c & 1 == 1 { magnitudes[c] } else { -magnitudes[c] }))?;
            }
        }
    }

    #[test]
    fn tunnels_are_strips() {
        for values in [
            [2, -1, -1, -1, -1, -1, -1, 6],
            [-4, 3, 3, -1, 2, -1, -1, -3],
            [2, 2, -6, -1, -1, -5, 4, 4],
            [1, -4, -4, 3, -4, 3, 3, -2],
        ] {
            let values = values.map(f64::from);
            assert!(check(&values).unwrap() && check(&values.map(|v| -v)).unwrap(), "{values:?}");
        }
    }
}
