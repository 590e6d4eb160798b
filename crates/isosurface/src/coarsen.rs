//! Larger triangles where a mesh is finer than it need be.
//!
//! Edges are collapsed into one of their ends, so that the vertices that stay are where they were, and only where the link
//! condition holds (Dey, Edelsbrunner, Guha and Nekhayev 1999), so that the mesh remains what it is topologically.

use crate::mesh::TriMesh;

/// A new triangle's edges leave the surface by no more than this share of the length that is wanted there.
const FLATNESS: f64 = 0.02;
/// Cosine of the largest angle between a new triangle and the normals at its corners.
const LEAST_COSINE: f64 = 0.9;
/// A new triangle is no worse than this, or than the worst of those it replaces: 1 for an equilateral triangle, 0 for none.
const LEAST_QUALITY: f64 = 0.3;
/// Passes over all vertices end when one merges less than this share of those that may be merged, ...
const WORTHWHILE: f64 = 0.01;
/// ... or after so many: every pass lengthens edges by about a fifth, so that these are enough for edges a hundred times as long.
const MOST_PASSES: usize = 32;

impl TriMesh {
    /// Merges vertices of a mesh with normals into their neighbours until the edges are about as long as wanted: `longest` has
    /// the length that no new edge at a vertex exceeds, zero where nothing may change. Curved parts stay finer, as far as that
    /// takes to keep new edges within a fiftieth of that length of the surface. Triangles at a boundary stay, and so do
    /// the number of components, their genus, and the places of the remaining vertices, whose order is kept.
    ///
    /// Panics if there are fewer lengths or normals than vertices.
    pub fn coarsen(&mut self, longest: &[f64]) {
        let may_change = |v: u32| longest[v as usize] > 0.0;
        let free = (0..longest.len()).filter(|v| may_change(*v as u32)).count();
        if free == 0 {
            return;
        }
        let mut rings = Rings::new(self);
        let mut gone = vec![false; self.vertices.len()];
        // A vertex that cannot be merged is tried again when the triangles around it have changed.
        let mut waiting: Vec<bool> = (0..longest.len()).map(|v| may_change(v as u32)).collect();
        for _ in 0..MOST_PASSES {
            let mut merged = 0;
            let mut changed = Vec::new();
            for v in 0..longest.len() {
                if !std::mem::take(&mut waiting[v]) {
                    continue;
                }
                let Some(cycle) = rings.cycle(v as u32) else { continue };
                if !cycle.iter().all(|w| may_change(*w)) {
                    continue;
                }
                let Some(target) = self.best_target(v as u32, &cycle, &rings, longest) else { continue };
                rings.collapse(v as u32, target);
                gone[v] = true;
                merged += 1;
                // They wait for the next pass: so all parts coarsen alike.
                cycle.iter().for_each(|w| waiting[*w as usize] = false);
                changed.extend(cycle);
            }
            changed.into_iter().filter(|v| !gone[*v as usize]).for_each(|v| waiting[v as usize] = true);
            if merged as f64 <= WORTHWHILE * free as f64 {
                break;
            }
        }
        self.triangles = rings.triangles.into_iter().filter(|t| *t != GONE).collect();
        self.drop_vertices(&gone);
    }

    /// The neighbour that a vertex is best merged into, if any will do.
    fn best_target(&self, v: u32, cycle: &[u32], rings: &Rings, longest: &[f64]) -> Option<u32> {
        let n = cycle.len();
        let after = |i: usize| cycle[(i + 1) % n];
        let needed = (0..n).map(|i| self.quality(v, cycle[i], after(i))).fold(LEAST_QUALITY, f64::min);
        let mut best: Option<(u32, f64)> = None;
        for i in 0..n {
            let (u, before, next) = (cycle[i], cycle[(i + n - 1) % n], after(i));
            // The triangles that the collapse leaves have u and a side of the ring that it is not an end of.
            let mut sides = (1..n - 1).map(|k| [cycle[(i + k) % n], cycle[(i + k + 1) % n]]);
            let is_better = |quality: f64| quality >= needed && best.is_none_or(|(_, most)| quality > most);
            let worst = sides.try_fold(f64::INFINITY, |worst: f64, side| {
                let quality = self.merged_quality(v, u, side, longest);
                is_better(quality).then_some(worst.min(quality))
            });
            if let Some(worst) = worst.filter(|_| rings.keeps_topology(v, u, [before, next], cycle)) {
                best = Some((u, worst));
            }
        }
        best.map(|(u, _)| u)
    }

    /// The quality of the triangle of `u` and a side of the ring around `v`, when `v` is merged into `u`; −1 if it is too large,
    /// or leaves the surface.
    fn merged_quality(&self, v: u32, u: u32, side: [u32; 2], longest: &[f64]) -> f64 {
        let corners = [u, side[0], side[1]];
        let length = [v, u, side[0], side[1]].map(|w| longest[w as usize]).into_iter().fold(f64::INFINITY, f64::min);
        let flat = FLATNESS * length;
        for w in side {
            let chord = norm(&self.between(u, w));
            let [a, b] = [u, w].map(|w| self.normals[w as usize]);
            let turn = norm(&std::array::from_fn(|k| a[k] - b[k]));
            // A circle's arc of this turn rises by an eighth of its product with the chord.
            if chord > length || chord * turn > 8.0 * flat {
                return -1.0;
            }
        }
        let normal = self.across(&corners);
        let size = norm(&normal);
        let is_upright = |w: u32| dot(&normal, &self.normals[w as usize]) >= LEAST_COSINE * size;
        let is_near = dot(&normal, &self.between(u, v)).abs() <= flat * size;
        if size > 0.0 && corners.into_iter().all(is_upright) && is_near {
            self.quality(u, side[0], side[1])
        } else {
            -1.0
        }
    }

    /// Four times the square root of three, times the area, by the sum of the squared sides.
    fn quality(&self, a: u32, b: u32, c: u32) -> f64 {
        let sides = [self.between(a, b), self.between(a, c), self.between(b, c)];
        let squares: f64 = sides.iter().map(|side| dot(side, side)).sum();
        let quality = 4.0 * 3.0_f64.sqrt() * self.triangle_area(&[a, b, c]) / squares;
        if quality.is_finite() { quality } else { 0.0 }
    }

    fn between(&self, from: u32, to: u32) -> [f64; 3] {
        let (a, b) = (self.vertices[from as usize], self.vertices[to as usize]);
        std::array::from_fn(|k| b[k] - a[k])
    }

    /// Leaves out vertices that no triangle uses any more.
    fn drop_vertices(&mut self, gone: &[bool]) {
        let mut place = vec![0; gone.len()];
        let mut count = 0;
        for (v, place) in place.iter_mut().enumerate() {
            *place = count as u32;
            if !gone[v] {
                self.vertices[count] = self.vertices[v];
                self.normals[count] = self.normals[v];
                count += 1;
            }
        }
        self.vertices.truncate(count);
        self.normals.truncate(count);
        self.triangles.iter_mut().flatten().for_each(|v| *v = place[*v as usize]);
    }
}

/// A triangle that is no more.
const GONE: [u32; 3] = [u32::MAX; 3];

/// Triangles, and those around every vertex.
struct Rings {
    triangles: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
}

impl Rings {
    fn new(mesh: &TriMesh) -> Self {
        let mut counts = vec![0; mesh.vertices.len()];
        mesh.triangles.iter().flatten().for_each(|v| counts[*v as usize] += 1);
        let mut around: Vec<Vec<u32>> = counts.into_iter().map(Vec::with_capacity).collect();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| around[*v as usize].push(index as u32));
        }
        Self { triangles: mesh.triangles.clone(), around }
    }

    /// The neighbours of a vertex, counter-clockwise; none if its triangles do not form one ring.
    fn cycle(&self, v: u32) -> Option<Vec<u32>> {
        let around = &self.around[v as usize];
        let sides: Vec<[u32; 2]> = around.iter().map(|t| opposite(&self.triangles[*t as usize], v)).collect();
        let mut cycle = Vec::with_capacity(sides.len());
        let mut at = sides.first()?[0];
        for _ in 0..sides.len() {
            if cycle.contains(&at) {
                return None;
            }
            cycle.push(at);
            at = sides.iter().find(|side| side[0] == at)?[1];
        }
        (at == cycle[0]).then_some(cycle)
    }

    /// Whether the mesh stays a manifold of the same topology when `v` is merged into its neighbour `u`: the two share no
    /// neighbours but those across the edge's triangles, which keep three triangles at least.
    fn keeps_topology(&self, v: u32, u: u32, across: [u32; 2], cycle: &[u32]) -> bool {
        let shared = |w: &u32| *w != v && !across.contains(w) && cycle.contains(w);
        let ring = self.around[u as usize].iter().flat_map(|t| self.triangles[*t as usize]);
        let has_others = ring.filter(|w| *w != u).any(|w| shared(&w));
        !has_others && across.iter().all(|w| self.around[*w as usize].len() > 3)
    }

    fn collapse(&mut self, v: u32, u: u32) {
        for t in std::mem::take(&mut self.around[v as usize]) {
            let triangle = &mut self.triangles[t as usize];
            if triangle.contains(&u) {
                for w in std::mem::replace(triangle, GONE).into_iter().filter(|w| *w != v) {
                    self.around[w as usize].retain(|other| *other != t);
                }
            } else {
                triangle.iter_mut().filter(|w| **w == v).for_each(|w| *w = u);
                self.around[u as usize].push(t);
            }
        }
    }
}

/// The side of a triangle across from a corner, in the triangle's direction.
fn opposite(&[a, b, c]: &[u32; 3], v: u32) -> [u32; 2] {
    if v == a {
        [b, c]
    } else if v == b {
        [c, a]
    } else {
        [a, b]
    }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn norm(a: &[f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImplicitFunction, LatticeSamples, Options, surface};
    use proptest::prelude::*;

    /// A torus with waves.
    struct Wavy(f64);

    impl ImplicitFunction<3> for Wavy {
        fn value_and_gradient(&self, &[x, y, z]: &[f64; 3]) -> (f64, [f64; 3]) {
            let ring = x.hypot(y);
            let (dr, tube) = (ring - 0.6, (ring - 0.6).hypot(z));
            let (height, k) = (self.0, 9.0);
            let value = tube - 0.25 - height * (k * x).sin() * (k * y).sin();
            let dx = dr / tube * x / ring - height * k * (k * x).cos() * (k * y).sin();
            let dy = dr / tube * y / ring - height * k * (k * x).sin() * (k * y).cos();
            (value, [dx, dy, z / tube])
        }
    }

    fn mesh(function: &impl ImplicitFunction<3>, cells: usize) -> TriMesh {
        let axis = || (0..=cells).map(|i| 2.0 * i as f64 / cells as f64 - 1.0 + 1e-3).collect();
        let samples = LatticeSamples::of([axis(), axis(), axis()], function).unwrap();
        surface(&samples, Some(function), &Options::default()).unwrap().0
    }

    #[test]
    fn a_smooth_torus_gets_the_edges_that_are_wanted() {
        let cells = 128;
        let fine = mesh(&Wavy(0.0), cells);
        for factor in [2.0, 4.0] {
            let mut coarse = fine.clone();
            let longest = 1.5 * factor * 2.0 / cells as f64;
            coarse.coarsen(&vec![longest; coarse.vertices.len()]);
            let (before, after) = (fine.topology(), coarse.topology());
            assert!(after.closed && (after.components, after.genus) == (before.components, before.genus), "{after:?}");
            // Edges no longer than 1.5 times those of a lattice of such cells: about as many vertices as it would give.
            let ratio = fine.vertices.len() as f64 / coarse.vertices.len() as f64;
            assert!(ratio > 0.7 * factor * factor && ratio < 1.5 * factor * factor, "{factor}: {ratio}");
            // What an edge leaves the surface by, over the tube's radius, twice: volumes.
            let (a, b) = (fine.enclosed_volume(), coarse.enclosed_volume());
            assert!((a - b).abs() < 2.0 * FLATNESS * longest / 0.25 * a, "{a} {b}");
            let worst = coarse.triangles.iter().map(|&[a, b, c]| coarse.quality(a, b, c)).fold(1.0, f64::min);
            let worst_before = fine.triangles.iter().map(|&[a, b, c]| fine.quality(a, b, c)).fold(1.0, f64::min);
            assert!(worst >= worst_before, "{worst} {worst_before}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn what_stays_is_as_it_was(height in 0.0..0.12f64, cells in 16usize..40, half in -1.0..1.0f64, factor in 1.0..6.0f64) {
            let fine = mesh(&Wavy(height), cells);
            let mut coarse = fine.clone();
            let longest = 3.0 * factor / cells as f64;
            let wanted: Vec<f64> = fine.vertices.iter().map(|x| if x[0] < half { 0.0 } else { longest }).collect();
            coarse.coarsen(&wanted);
            let (before, after) = (fine.topology(), coarse.topology());
            prop_assert_eq!(after, before);
            // Vertices are a subsequence, with their normals; and where nothing may change there are all of them.
            let mut rest = fine.vertices.iter().zip(&fine.normals);
            for (x, n) in coarse.vertices.iter().zip(&coarse.normals) {
                prop_assert!(rest.any(|(y, m)| x == y && n == m));
            }
            let fixed = |mesh: &TriMesh| mesh.vertices.iter().filter(|x| x[0] < half).count();
            prop_assert_eq!(fixed(&fine), fixed(&coarse));
            let all = |mesh: &TriMesh| mesh.triangles.iter().flatten().map(|v| *v as usize).collect::<std::collections::HashSet<_>>();
            prop_assert_eq!(all(&coarse).len(), coarse.vertices.len());
        }
    }

    #[test]
    fn nothing_happens_where_nothing_may() {
        let fine = mesh(&Wavy(0.05), 24);
        let mut same = fine.clone();
        same.coarsen(&vec![0.0; fine.vertices.len()]);
        assert_eq!(same, fine);
        // A boundary stays: of a single triangle, everything.
        let mut open = TriMesh { triangles: vec![fine.triangles[0]], ..fine.clone() };
        open.coarsen(&vec![1.0; fine.vertices.len()]);
        assert_eq!(open.triangles, vec![fine.triangles[0]]);
    }
}
