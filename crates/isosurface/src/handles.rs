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
        let above = |v: u32| g[v as usize] > 0.0;
        let mut regions = UnionFind::new(self.vertices.len());
        // Edges between regions: those that a boundary passes one after the other share a triangle.
        let mut crossing: HashMap<[u32; 2], usize> = HashMap::new();
        let mut neighbours = Vec::new();
        // Of what lies above as a whole: twice its Euler characteristic, each edge being counted from both sides.
        let mut twice_euler = vec![0; self.vertices.len()];
        for &[a, b, c] in &self.triangles {
            let mut last = None;
            if above(a) && above(b) && above(c) {
                twice_euler[a as usize] += 2;
            }
            for (a, b) in [(a, b), (b, c), (c, a)] {
                if above(a) == above(b) {
                    regions.join(a as usize, b as usize);
                    twice_euler[a as usize] -= i64::from(above(a));
                    continue;
                }
                let next = crossing.len();
                let edge = *crossing.entry([a.min(b), a.max(b)]).or_insert(next);
                neighbours.extend(last.map(|last| (last, edge)));
                last = Some(edge);
            }
        }
        let mut boundaries = UnionFind::new(crossing.len());
        neighbours.iter().for_each(|(a, b)| _ = boundaries.join(*a, *b));
        // Of each boundary the regions above and below.
        let mut sides = BTreeMap::new();
        for ([a, b], edge) in crossing {
            let (high, low) = if above(a) { (a, b) } else { (b, a) };
            // The same for all edges of a boundary.
            sides.entry(boundaries.find(edge)).or_insert((regions.find(high as usize), regions.find(low as usize)));
        }
        let names: BTreeSet<usize> = sides.values().flat_map(|(high, low)| [*high, *low]).collect();
        let number: HashMap<usize, usize> = names.into_iter().zip(0..).collect();
        let mut around: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        sides.values().for_each(|(high, low)| around.entry(*high).or_default().push(*low));
        let closes_a_handle = |region: usize, around: &[usize]| {
            let mut others = UnionFind::new(number.len());
            for (high, low) in sides.values().filter(|(high, _)| *high != region) {
                others.join(number[high], number[low]);
            }
            let mut hang_together: Vec<usize> = around.iter().map(|low| others.find(number[low])).collect();
            hang_together.sort_unstable();
            hang_together.windows(2).any(|pair| pair[0] == pair[1])
        };
        // χ = 2 − 2 handles − boundaries.
        let mut excess: BTreeMap<usize, i64> = BTreeMap::new();
        for v in (0..self.vertices.len()).filter(|v| g[*v] > 0.0) {
            *excess.entry(regions.find(v)).or_insert(-4) += 2 + twice_euler[v];
        }
        let has_handles = |(region, excess): (&usize, &i64)| {
            let boundaries = around.get(region).map_or(&[][..], |around| around);
            let handles = -(excess + 2 * boundaries.len() as i64) / 4;
            handles > 0 || boundaries.len() > 1 && closes_a_handle(*region, boundaries)
        };
        let found = excess.iter().filter(|region| has_handles(*region)).map(|(region, _)| *region);
        let mut highest: BTreeMap<usize, usize> = found.map(|region| (region, region)).collect();
        for v in (0..self.vertices.len()).filter(|v| g[*v] > 0.0) {
            if let Some(best) = highest.get_mut(&regions.find(v)).filter(|best| g[v] > g[**best]) {
                *best = v;
            }
        }
        highest.into_values().collect()
    }
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
