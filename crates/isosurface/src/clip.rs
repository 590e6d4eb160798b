//! Cutting a mesh or curves along the zero set of a function that is known at their vertices.

use std::collections::BTreeMap;

use crate::mesh::TriMesh;
use crate::polylines::Curves;
use crate::union_find::UnionFind;

/// A cut keeps this distance from the ends of an edge, in lengths of the edge: so no piece of a triangle is a sliver that the
/// triangle was not, no two new vertices fall together, and the cut never runs through a vertex, where it could cross itself.
const MARGIN: f64 = 0.1;

/// Where the cut meets an edge on whose ends g has these values, one of them positive: from 0 to 1.
fn share(from: f64, to: f64) -> f64 {
    let t = from / (from - to);
    if t.is_finite() { t.clamp(MARGIN, 1.0 - MARGIN) } else { 0.5 }
}

fn between<const D: usize>(a: &[f64; D], b: &[f64; D], t: f64) -> [f64; D] {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

impl TriMesh {
    /// The part of the mesh where `g ≤ 0`, g given at the vertices and linear along the edges: triangles that it changes its
    /// sign on are cut. A manifold stays one, with a boundary. Returns how many of the vertices are old, too: the others, on
    /// the cut, come behind them; their normals are those of the mesh between its vertices.
    ///
    /// Panics if there are fewer values than vertices.
    pub fn clipped(&self, g: &[f64]) -> (Self, usize) {
        const NONE: u32 = u32::MAX;
        let inside = |v: u32| g[v as usize] <= 0.0;
        let mut place = vec![NONE; self.vertices.len()];
        let used = self.triangles.iter().flatten().filter(|v| inside(**v));
        used.for_each(|v| place[*v as usize] = 0);
        let mut mesh = Self::default();
        for (old, place) in place.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
            *place = mesh.vertices.len() as u32;
            mesh.vertices.push(self.vertices[old]);
            mesh.normals.extend(self.normals.get(old));
        }
        let kept = mesh.vertices.len();

        // Ordered by edges, so that the result does not depend on the order of the triangles around them.
        let mut cuts: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let sides = || self.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        for (a, b) in sides().filter(|&(a, b)| inside(a) != inside(b)) {
            cuts.insert((a.min(b), a.max(b)), NONE);
        }
        for (&(a, b), place) in &mut cuts {
            *place = mesh.vertices.len() as u32;
            let (a, b) = (a as usize, b as usize);
            let t = share(g[a], g[b]);
            mesh.vertices.push(between(&self.vertices[a], &self.vertices[b], t));
            if let (Some(m), Some(n)) = (self.normals.get(a), self.normals.get(b)) {
                let sum = between(m, n, t);
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                mesh.normals.push(if length > 0.0 { sum.map(|x| x / length) } else { *m });
            }
        }
        for &[a, b, c] in &self.triangles {
            let at = |v: u32| place[v as usize];
            let cut = |a: u32, b: u32| cuts[&(a.min(b), a.max(b))];
            // Turned so that the corner of its own kind comes first.
            let turned = [[a, b, c], [b, c, a], [c, a, b]];
            match [a, b, c].into_iter().filter(|v| inside(*v)).count() {
                0 => {}
                3 => mesh.triangles.push([at(a), at(b), at(c)]),
                1 => {
                    for [a, b, c] in turned.into_iter().filter(|t| inside(t[0])) {
                        mesh.triangles.push([at(a), cut(a, b), cut(c, a)]);
                    }
                }
                _ => {
                    for [a, b, c] in turned.into_iter().filter(|t| !inside(t[0])) {
                        let (first, last) = (cut(a, b), cut(c, a));
                        // The shorter diagonal of the four-sided rest.
                        let square = |p: u32, q: u32| -> f64 {
                            let (p, q) = (mesh.vertices[p as usize], mesh.vertices[q as usize]);
                            (0..3).map(|k| (p[k] - q[k]).powi(2)).sum()
                        };
                        if square(first, at(c)) <= square(at(b), last) {
                            mesh.triangles.extend([[first, at(b), at(c)], [first, at(c), last]]);
                        } else {
                            mesh.triangles.extend([[first, at(b), last], [at(b), at(c), last]]);
                        }
                    }
                }
            }
        }
        (mesh, kept)
    }

    /// Turns the sign of g where the vertices of a connected region of the mesh with `g ≤ 0` have shares of less than `speck` together, and then
    /// where those of one with `g > 0` have less than `hole`: so [`TriMesh::clipped`] leaves no specks, and no small holes. What the shares
    /// are of is for the caller to say, as of the area by [`TriMesh::vertex_areas`].
    ///
    /// Panics if there are fewer values or shares than vertices.
    pub fn settle(&self, g: &mut [f64], shares: &[f64], speck: f64, hole: f64) {
        for (kept, smallest) in [(true, speck), (false, hole)] {
            let mut sets = UnionFind::new(self.vertices.len());
            let alike = |a: u32, b: u32| (g[a as usize] <= 0.0) == kept && (g[b as usize] <= 0.0) == kept;
            for &[a, b, c] in &self.triangles {
                for (a, b) in [(a, b), (b, c), (c, a)] {
                    if alike(a, b) {
                        sets.join(a as usize, b as usize);
                    }
                }
            }
            let mut sums = vec![0.0; self.vertices.len()];
            shares.iter().enumerate().for_each(|(v, share)| sums[sets.find(v)] += share);
            for (v, g) in g.iter_mut().enumerate() {
                if (*g <= 0.0) == kept && sums[sets.find(v)] < smallest {
                    // Not zero, which would still count as kept.
                    *g = if kept { (-*g).max(f64::MIN_POSITIVE) } else { -*g };
                }
            }
        }
    }
}

impl Curves {
    /// The parts of the curves where `g ≤ 0`, g given at the vertices of the loops and linear between them. Loops that it
    /// changes its sign on become paths; of these, those shorter than `speck` are left out, and gaps shorter than `hole`
    /// closed before.
    ///
    /// Panics if there are fewer values than vertices.
    pub fn clipped(&self, g: &[Vec<f64>], speck: f64, hole: f64) -> Self {
        let mut clipped = Self { loops: Vec::new(), paths: self.paths.clone() };
        for (cycle, g) in self.loops.iter().zip(g) {
            let mut g = g.clone();
            close_gaps(cycle, &mut g, hole);
            let n = cycle.len();
            let Some(start) = (0..n).find(|&i| g[i] > 0.0 && g[(i + 1) % n] <= 0.0) else {
                if g.iter().all(|g| *g <= 0.0) {
                    clipped.loops.push(cycle.clone());
                }
                continue;
            };
            let mut path = Vec::new();
            for step in 0..n {
                let (i, j) = ((start + step) % n, (start + step + 1) % n);
                if (g[i] <= 0.0) != (g[j] <= 0.0) {
                    path.push(between(&cycle[i], &cycle[j], share(g[i], g[j])));
                }
                if g[j] <= 0.0 {
                    path.push(cycle[j]);
                } else if !path.is_empty() {
                    clipped.paths.push(std::mem::take(&mut path));
                }
            }
        }
        let length = |path: &Vec<[f64; 2]>| path.windows(2).map(|p| distance(&p[0], &p[1])).sum::<f64>();
        clipped.paths.retain(|path| length(path) >= speck);
        clipped
    }
}

fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Turns the sign of g along runs of positive values shorter than `hole`.
fn close_gaps(cycle: &[[f64; 2]], g: &mut [f64], hole: f64) {
    let n = cycle.len();
    let Some(start) = (0..n).find(|&i| g[i] <= 0.0) else { return };
    let (mut run, mut length) = (Vec::new(), 0.0);
    for step in 0..n {
        let (i, j) = ((start + step) % n, (start + step + 1) % n);
        length += distance(&cycle[i], &cycle[j]);
        if g[j] > 0.0 {
            run.push(j);
        } else {
            if length < hole {
                run.iter().for_each(|&k: &usize| g[k] = -g[k]);
            }
            run.clear();
            length = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LatticeSamples, Options, surface};
    use proptest::prelude::*;

    struct Ball;

    impl crate::ImplicitFunction<3> for Ball {
        fn value_and_gradient(&self, x: &[f64; 3]) -> (f64, [f64; 3]) {
            let r = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            (r - 1.0, x.map(|x| x / r))
        }
    }

    fn ball() -> TriMesh {
        let axis: Vec<f64> = (0..24).map(|i| -1.15 + 0.1 * f64::from(i)).collect();
        let samples = LatticeSamples::of([axis.clone(), axis.clone(), axis], &Ball).unwrap();
        surface(&samples, Some(&Ball), &Options::default()).unwrap().0
    }

    fn at(mesh: &TriMesh, g: impl Fn(&[f64; 3]) -> f64) -> Vec<f64> {
        mesh.vertices.iter().map(g).collect()
    }

    #[test]
    fn a_cap_and_a_zone_have_their_area_and_boundary() {
        let ball = ball();
        let (cap, kept) = ball.clipped(&at(&ball, |x| x[2] - 0.3));
        let topology = cap.topology();
        assert_eq!((topology.components, topology.boundary_loops, topology.genus), (1, 1, 0));
        assert_eq!((topology.non_manifold_edges, topology.non_manifold_vertices, topology.closed), (0, 0, false));
        assert!(cap.vertices[..kept].iter().all(|x| x[2] <= 0.3));
        // 2π (z + 1), up to chords of 0.1 on a radius of 1 (h²/8) and cuts held off by a tenth of an edge.
        assert!((cap.area() / (std::f64::consts::TAU * 1.3) - 1.0).abs() < 4e-3, "{}", cap.area());
        let (zone, _) = ball.clipped(&at(&ball, |x| x[2].abs() - 0.3));
        let topology = zone.topology();
        assert_eq!((topology.components, topology.boundary_loops, topology.genus), (1, 2, 0));
        assert!(zone.normals.iter().all(|n| (n.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12), "unit length");
        let (caps, _) = ball.clipped(&at(&ball, |x| 0.3 - x[2].abs()));
        assert_eq!((caps.topology().components, caps.topology().boundary_loops), (2, 2));
        assert_eq!(ball.clipped(&vec![-1.0; ball.vertices.len()]).0, ball);
        assert!(ball.clipped(&vec![1.0; ball.vertices.len()]).0.triangles.is_empty());
    }

    #[test]
    fn specks_and_small_holes_go() {
        let ball = ball();
        // Caps around the poles of radius 0.3: the upper one a speck on the cut side, the lower one a hole in the kept side.
        let pole = |x: &[f64; 3]| x[0].hypot(x[1]) - 0.3;
        let field = |x: &[f64; 3]| if x[2] > 0.0 { x[2].min(pole(x)) } else { x[2].max(-pole(x)) };
        let mut g = at(&ball, field);
        assert_eq!(ball.clipped(&g).0.topology().boundary_loops, 3);
        ball.settle(&mut g, &ball.vertex_areas(), 0.5, 0.5);
        let topology = ball.clipped(&g).0.topology();
        assert_eq!((topology.components, topology.boundary_loops), (1, 1));
    }

    #[test]
    fn a_circle_is_cut_into_arcs() {
        let circle: Vec<[f64; 2]> =
            (0..100).map(|i| (f64::from(i) * 0.02 * std::f64::consts::PI).sin_cos()).map(|(s, c)| [c, s]).collect();
        let curves = Curves { loops: vec![circle.clone()], paths: vec![] };
        let cut = |g: &dyn Fn(&[f64; 2]) -> f64| curves.clipped(&[circle.iter().map(g).collect()], 0.1, 0.2);
        let half = cut(&|x| x[0] - 0.01);
        assert_eq!((half.loops.len(), half.paths.len()), (0, 1));
        let topology = half.topology();
        // Half of the circle and 0.01 more on either side; chords of 0.063 on a radius of 1 lose h²/24.
        assert!((topology.length - std::f64::consts::PI - 0.02).abs() < 2e-3, "{topology:?}");
        assert_eq!((topology.paths, topology.loops, topology.area), (1, 0, 0.0));
        assert_eq!(cut(&|x| 0.5 - x[0].abs()).paths.len(), 2);
        assert_eq!(cut(&|x| x[0] - 0.9999), curves, "a gap of 0.03 is closed");
        assert_eq!(cut(&|x| 0.9999 - x[0]), Curves::default(), "and a path of that length is a speck");
    }

    proptest! {
        #[test]
        fn whatever_the_values_a_manifold_stays_one(seed in 0u64..1000) {
            let ball = ball();
            let value = |v: usize| ((v as f64 * 12.9898 + seed as f64).sin() * 43_758.545_3).rem_euclid(1.0) - 0.5;
            let g: Vec<f64> = (0..ball.vertices.len()).map(value).collect();
            let topology = ball.clipped(&g).0.topology();
            prop_assert_eq!((topology.non_manifold_edges, topology.non_manifold_vertices), (0, 0));
        }
    }
}
