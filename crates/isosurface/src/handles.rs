//! Handles that run through a part of a mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::mesh::TriMesh;
use crate::union_find::UnionFind;

impl TriMesh {
    /// Of each connected region of vertices with `g > 0` that has a handle or closes one of the rest, the vertex with the largest g. A region
    /// closes one if two of its boundaries hang together without it, as those of a tunnel's wall do, and those of a sphere's zone do not.
    /// For closed meshes.
    ///
    /// Panics if there are fewer values than vertices.
    pub fn handles_across(&self, g: &[f64]) -> Vec<usize> {
        let mut parts = Parts::of(self, g);
        // Of each region χ and the number of its boundaries: together 2, less 2 for each handle.
        let mut euler: BTreeMap<usize, i64> = BTreeMap::new();
        let mut highest: BTreeMap<usize, usize> = BTreeMap::new();
        for v in (0..self.vertices.len()).filter(|v| g[*v] > 0.0) {
            let region = parts.regions.find(v);
            *euler.entry(region).or_default() += 1 + parts.faces_less_edges[v];
            let best = highest.entry(region).or_insert(v);
            if g[v] > g[*best] {
                *best = v;
            }
        }
        for [high, _] in &parts.boundaries {
            *euler.entry(*high).or_default() += 1;
        }
        let cycles = cycles(&parts.boundaries);
        highest.retain(|region, _| euler[region] < 2 || is_on_a_cycle(*region, &cycles));
        highest.into_values().collect()
    }
}

/// A mesh in regions of one sign.
struct Parts {
    /// Of vertices.
    regions: UnionFind,
    /// Triangles less edges with all ends above, each counted at one of its vertices.
    faces_less_edges: Vec<i64>,
    /// The regions above and below each boundary.
    boundaries: Vec<[usize; 2]>,
}

impl Parts {
    fn of(mesh: &TriMesh, g: &[f64]) -> Self {
        let above = |v: u32| g[v as usize] > 0.0;
        let mut regions = UnionFind::new(mesh.vertices.len());
        let mut faces_less_edges = vec![0; mesh.vertices.len()];
        // Edges from one region to another, in the order in which they are met.
        let mut crossing: HashMap<[u32; 2], usize> = HashMap::new();
        let mut ends = Vec::new();
        // Those that a boundary passes one after the other share a triangle.
        let mut next_to_each_other = Vec::new();
        for triangle @ &[a, b, c] in &mesh.triangles {
            faces_less_edges[a as usize] += i64::from(triangle.iter().all(|v| above(*v)));
            let mut last = None;
            for (a, b) in [(a, b), (b, c), (c, a)] {
                if above(a) == above(b) {
                    regions.join(a as usize, b as usize);
                    // The triangle beyond has it the other way round.
                    faces_less_edges[a as usize] -= i64::from(above(a) && a < b);
                    continue;
                }
                let edge = *crossing.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    ends.push(if above(a) { [a, b] } else { [b, a] });
                    ends.len() - 1
                });
                next_to_each_other.extend(last.map(|last| (last, edge)));
                last = Some(edge);
            }
        }
        let mut loops = UnionFind::new(ends.len());
        next_to_each_other.iter().for_each(|(a, b)| _ = loops.join(*a, *b));
        let firsts = (0..ends.len()).filter(|edge| loops.find(*edge) == *edge);
        let boundaries = firsts.map(|edge| ends[edge].map(|v| regions.find(v as usize))).collect();
        Self { regions, faces_less_edges, boundaries }
    }
}

/// The boundaries that are left when regions with only one are taken away, again and again: those on cycles, and between cycles.
fn cycles(boundaries: &[[usize; 2]]) -> Vec<[usize; 2]> {
    let mut left = boundaries.to_vec();
    loop {
        let mut count: HashMap<usize, usize> = HashMap::new();
        left.iter().flatten().for_each(|region| *count.entry(*region).or_default() += 1);
        let before = left.len();
        left.retain(|both| both.iter().all(|region| count[region] > 1));
        if left.len() == before {
            return left;
        }
    }
}

/// Whether two boundaries of the region hang together without it.
fn is_on_a_cycle(region: usize, boundaries: &[[usize; 2]]) -> bool {
    let (own, others): (Vec<[usize; 2]>, Vec<[usize; 2]>) = boundaries.iter().partition(|[high, _]| *high == region);
    if own.len() < 2 {
        return false;
    }
    let known: BTreeSet<usize> = boundaries.iter().flatten().copied().collect();
    let numbers: HashMap<usize, usize> = known.into_iter().zip(0..).collect();
    let mut sets = UnionFind::new(numbers.len());
    others.iter().for_each(|[high, low]| _ = sets.join(numbers[high], numbers[low]));
    let mut found: Vec<usize> = own.iter().map(|[_, low]| sets.find(numbers[low])).collect();
    found.sort_unstable();
    found.windows(2).any(|pair| pair[0] == pair[1])
}

#[cfg(test)]
mod tests {
    use crate::{ImplicitFunction, LatticeSamples, Options, TriMesh, surface};

    /// A torus around the z axis.
    struct Torus;

    impl ImplicitFunction<3> for Torus {
        fn value_and_gradient(&self, [x, y, z]: &[f64; 3]) -> (f64, [f64; 3]) {
            let ring = x.hypot(*y);
            let r = (ring - 0.7).hypot(*z);
            (r - 0.3, [(ring - 0.7) / r * x / ring, (ring - 0.7) / r * y / ring, z / r])
        }
    }

    fn handles(g: impl Fn(&[f64; 3]) -> f64) -> (TriMesh, Vec<usize>) {
        let axis: Vec<f64> = (0..24).map(|i| -1.15 + 0.1 * f64::from(i)).collect();
        let samples = LatticeSamples::of([axis.clone(), axis.clone(), axis], &Torus).unwrap();
        let mesh = surface(&samples, Some(&Torus), &Options::default()).unwrap().0;
        let values: Vec<f64> = mesh.vertices.iter().map(g).collect();
        let found = mesh.handles_across(&values);
        (mesh, found)
    }

    #[test]
    fn a_part_all_round_a_tube_or_a_hole_closes_a_handle() {
        let (mesh, found) = handles(|x| x[0] - 0.2);
        assert_eq!(found.len(), 1);
        assert!(found.iter().all(|v| mesh.vertices[*v][0] > 0.9));
        let (mesh, found) = handles(|x| 0.6 - x[0].hypot(x[1]));
        assert_eq!(found.len(), 1);
        assert!(mesh.vertices[found[0]][0].hypot(mesh.vertices[found[0]][1]) < 0.45);
        // Twice round the tube: without one part the other still closes the handle.
        assert_eq!(handles(|x| x[0].abs() - 0.2).1.len(), 2);
    }

    #[test]
    fn caps_and_islands_close_none() {
        assert_eq!(handles(|x| x[0] - 0.9).1, [0; 0]);
        // A cap with an island in it.
        let around = |x: &[f64; 3]| (x[0] - 1.0).hypot(x[1]).hypot(x[2]);
        assert_eq!(handles(|x| (0.2 - (around(x) - 0.25).abs()).min(around(x) - 0.1)).1, [0; 0]);
        assert_eq!(handles(|_| -1.0).1, [0; 0]);
    }

    #[test]
    fn a_part_may_have_a_handle_of_its_own() {
        // All but a disc.
        let (mesh, found) = handles(|x| 0.9 - x[0]);
        assert_eq!(found.len(), 1);
        assert!(mesh.vertices[found[0]][0] < -0.9);
        assert_eq!(handles(|_| 1.0).1.len(), 1);
    }
}
