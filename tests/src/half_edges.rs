//! Whether a mesh is closed and 2-manifold, by nothing but its triangles: what the extractor says of itself is not asked.

use std::collections::{HashMap, HashSet};

/// What is wrong with a surface or curves that should be closed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faults {
    /// Triangles with a corner twice, or loops of fewer than three vertices.
    pub degenerate: usize,
    /// Directed edges that occur twice.
    pub repeated: usize,
    /// Directed edges without their opposite: a boundary.
    pub unpaired: usize,
    /// Vertices whose triangles do not form exactly one ring.
    pub pinched: usize,
    /// Vertices that no triangle uses, or that several loops share.
    pub loose: usize,
    /// Vertices with a coordinate that is no finite number, and indices beyond the vertices.
    pub invalid: usize,
}

impl Faults {
    /// Whether there are none.
    pub fn none(&self) -> bool {
        *self == Self::default()
    }
}

/// Counts the faults of a triangle mesh that should be closed, oriented and 2-manifold: each directed edge once, its opposite once,
/// and the triangles around each vertex one ring.
pub fn faults_of_mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Faults {
    let mut faults = Faults { invalid: not_finite(vertices), ..Faults::default() };
    // Around a: from b to c.
    let mut around: Vec<HashMap<u32, u32>> = vec![HashMap::new(); vertices.len()];
    for &[a, b, c] in triangles {
        if [a, b, c].iter().any(|v| *v as usize >= vertices.len()) {
            faults.invalid += 1;
            continue;
        }
        faults.degenerate += usize::from(a == b || b == c || c == a);
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            faults.repeated += usize::from(around[a as usize].insert(b, c).is_some());
        }
    }
    for (a, ring) in around.iter().enumerate() {
        faults.unpaired += ring.keys().filter(|b| !around[**b as usize].contains_key(&(a as u32))).count();
        let Some(&start) = ring.keys().next() else {
            faults.loose += 1;
            continue;
        };
        let (mut at, mut steps) = (start, 0);
        while let Some(&next) = ring.get(&at) {
            (at, steps) = (next, steps + 1);
            if at == start || steps > ring.len() {
                break;
            }
        }
        faults.pinched += usize::from(at != start || steps != ring.len());
    }
    faults
}

/// Counts the faults of polylines that should be closed: at least three vertices each, all of them different.
pub fn faults_of_loops(loops: &[Vec<[f64; 2]>]) -> Faults {
    let mut faults = Faults::default();
    let mut seen = HashSet::new();
    for cycle in loops {
        faults.degenerate += usize::from(cycle.len() < 3);
        faults.invalid += not_finite(cycle);
        faults.loose += cycle.iter().filter(|p| !seen.insert(p.map(f64::to_bits))).count();
    }
    faults
}

fn not_finite<const D: usize>(vertices: &[[f64; D]]) -> usize {
    vertices.iter().filter(|vertex| vertex.iter().any(|x| !x.is_finite())).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn faults(count: usize, triangles: &[[u32; 3]]) -> Faults {
        faults_of_mesh(&vec![[0.5; 3]; count], triangles)
    }

    #[test]
    fn a_tetrahedron_has_none_and_every_fault_is_seen() {
        assert!(faults(4, &TETRAHEDRON).none());
        assert_eq!(faults(4, &TETRAHEDRON[1..]).unpaired, 3);
        assert_eq!(faults(5, &TETRAHEDRON).loose, 1);
        assert_eq!(faults(3, &TETRAHEDRON).invalid, 3);
        let mut turned = TETRAHEDRON;
        turned[0].swap(1, 2);
        assert_eq!(faults(4, &turned).repeated, 3);
        // Two tetrahedra that share vertex 0.
        let other = TETRAHEDRON.map(|t| t.map(|v| if v == 0 { 0 } else { v + 3 }));
        let both = [TETRAHEDRON, other].concat();
        assert_eq!(faults(7, &both), Faults { pinched: 1, ..Faults::default() });
        assert!(faults(4, &[[0, 0, 1], [0, 1, 0]]).degenerate == 2);
        assert_eq!(faults_of_mesh(&[[0.0, f64::NAN, 0.0]; 4], &TETRAHEDRON).invalid, 4);
    }

    #[test]
    fn loops_have_three_vertices_of_their_own() {
        let triangle = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert!(faults_of_loops(std::slice::from_ref(&triangle)).none());
        assert_eq!(faults_of_loops(&[triangle[..2].to_vec()]).degenerate, 1);
        assert_eq!(faults_of_loops(&[triangle.clone(), triangle]).loose, 3);
    }
}
