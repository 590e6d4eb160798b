//! Triangle meshes and what can be said about them.

use serde::Serialize;

use crate::union_find::UnionFind;

/// A triangle mesh with shared vertices, counter-clockwise seen from outside.
///
/// Its methods panic if a triangle names a vertex that is not there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Positions, `V × 3`.
    pub vertices: Vec<[f64; 3]>,
    /// Outward unit normals, `V × 3`.
    pub normals: Vec<[f64; 3]>,
    /// Indices of vertices, `T × 3`.
    pub triangles: Vec<[u32; 3]>,
}

/// The topology of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Topology {
    /// Connected components.
    pub components: usize,
    /// V − E + T, with V the vertices that triangles use.
    pub euler_characteristic: i64,
    /// Sum of the components' genera, as if each loop of the boundary were closed by a disc.
    pub genus: i64,
    /// Whether every edge has exactly two triangles, one on each side, and every vertex one ring of triangles.
    pub closed: bool,
    /// Directed edges without their opposite: holes.
    pub boundary_edges: usize,
    /// Loops that these edges make; loops that share a vertex count as one.
    pub boundary_loops: usize,
    /// Directed edges that stand in more than one triangle: branches, or triangles turned over.
    pub non_manifold_edges: usize,
    /// Vertices where several rings of triangles meet.
    pub non_manifold_vertices: usize,
}

impl TriMesh {
    /// Volume inside, positive for an outward mesh: Gauss' theorem.
    pub fn enclosed_volume(&self) -> f64 {
        let Some(&origin) = self.vertices.first() else { return 0.0 };
        let corner = |v: u32| -> [f64; 3] { std::array::from_fn(|k| self.vertices[v as usize][k] - origin[k]) };
        let volume = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(corner);
            (0..3).map(|k| a[k] * (b[(k + 1) % 3] * c[(k + 2) % 3] - b[(k + 2) % 3] * c[(k + 1) % 3])).sum::<f64>()
                / 6.0
        };
        self.triangles.iter().map(volume).sum()
    }

    /// Sum of the triangles' areas.
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|triangle| self.triangle_area(triangle)).sum()
    }

    pub(crate) fn triangle_area(&self, triangle: &[u32; 3]) -> f64 {
        0.5 * self.across(triangle).iter().map(|x| x.powi(2)).sum::<f64>().sqrt()
    }

    /// The outward vector across a triangle that is as long as twice its area.
    pub(crate) fn across(&self, triangle: &[u32; 3]) -> [f64; 3] {
        let [a, b, c] = triangle.map(|v| self.vertices[v as usize]);
        std::array::from_fn(|k| {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            (b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l])
        })
    }

    /// The area around every vertex: a third of its triangles'.
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.vertices.len()];
        for triangle in &self.triangles {
            let area = self.triangle_area(triangle);
            triangle.iter().for_each(|v| areas[*v as usize] += area / 3.0);
        }
        areas
    }

    /// What the vertices of every connected component have together, given what each has.
    ///
    /// Panics if there are fewer values than vertices.
    pub fn component_sums(&self, values: &[f64]) -> Vec<f64> {
        let mut sets = UnionFind::new(self.vertices.len());
        for &[a, b, c] in &self.triangles {
            sets.join(a as usize, b as usize);
            sets.join(b as usize, c as usize);
        }
        let mut sums = vec![0.0; self.vertices.len()];
        let mut is_component = vec![false; self.vertices.len()];
        (0..self.vertices.len()).for_each(|v| sums[sets.find(v)] += values[v]);
        self.triangles.iter().for_each(|triangle| is_component[sets.find(triangle[0] as usize)] = true);
        sums.into_iter().zip(is_component).filter(|(_, is_component)| *is_component).map(|(sum, _)| sum).collect()
    }

    /// Counts components, genus, holes and branches.
    pub fn topology(&self) -> Topology {
        let links = Links::new(self.vertices.len(), &self.triangles);
        let (mut edges, mut used, mut non_manifold_edges, mut non_manifold_vertices) = (0, 0, 0, 0);
        let mut sets = UnionFind::new(self.vertices.len());
        let mut joined = 0;
        let mut boundary = Vec::new();
        for (a, ring) in links.rings() {
            used += 1;
            non_manifold_vertices += usize::from(!is_one_ring(ring));
            for edge in ring.chunk_by(|x, y| x[0] == y[0]) {
                let b = edge[0][0];
                let opposite = find(links.of(b), a).is_some();
                non_manifold_edges += edge.len() - 1;
                // From its lower end, if both ends have it.
                edges += usize::from(a <= b || !opposite);
                joined += usize::from(sets.join(a as usize, b as usize));
                if !opposite {
                    boundary.extend(edge.iter().map(|_| (a, b)));
                }
            }
        }
        let components = used - joined;
        let boundary_edges = boundary.len();
        let boundary_loops = self.rings(&boundary);
        let euler_characteristic = used as i64 - edges as i64 + self.triangles.len() as i64;
        let closed =
            boundary_edges == 0 && non_manifold_edges == 0 && non_manifold_vertices == 0 && !self.triangles.is_empty();
        Topology {
            components,
            euler_characteristic,
            genus: components as i64 - (euler_characteristic + boundary_loops as i64).div_euclid(2),
            closed,
            boundary_edges,
            boundary_loops,
            non_manifold_edges,
            non_manifold_vertices,
        }
    }

    /// Connected sets of edges.
    fn rings(&self, edges: &[(u32, u32)]) -> usize {
        let mut sets = UnionFind::new(self.vertices.len());
        let mut used: Vec<u32> = edges.iter().flat_map(|&(a, b)| [a, b]).collect();
        used.sort_unstable();
        used.dedup();
        used.len() - edges.iter().filter(|&&(a, b)| sets.join(a as usize, b as usize)).count()
    }
}

/// Around every vertex a, sorted: each triangle (a, b, c) leads from b to c.
struct Links {
    /// Where those of each vertex begin, and the end.
    starts: Vec<usize>,
    links: Vec<[u32; 2]>,
}

impl Links {
    fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0; vertices + 1];
        triangles.iter().flatten().for_each(|v| starts[*v as usize + 1] += 1);
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut links = vec![[0; 2]; 3 * triangles.len()];
        for &[a, b, c] in triangles {
            for (v, link) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                links[next[v as usize]] = link;
                next[v as usize] += 1;
            }
        }
        for v in 0..vertices {
            links[starts[v]..starts[v + 1]].sort_unstable();
        }
        Self { starts, links }
    }

    fn of(&self, vertex: u32) -> &[[u32; 2]] {
        &self.links[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }

    /// The vertices that triangles use, with their links.
    fn rings(&self) -> impl Iterator<Item = (u32, &[[u32; 2]])> {
        (0..self.starts.len() as u32 - 1).map(|v| (v, self.of(v))).filter(|(_, ring)| !ring.is_empty())
    }
}

/// Where a vertex's triangle leads to from b.
fn find(links: &[[u32; 2]], b: u32) -> Option<u32> {
    links.binary_search_by_key(&b, |link| link[0]).ok().map(|at| links[at][1])
}

/// Whether the triangles around a vertex form one ring, or one fan.
fn is_one_ring(links: &[[u32; 2]]) -> bool {
    // A fan begins at the one that nothing leads to; a ring anywhere.
    let is_target = |b: u32| links.iter().any(|link| link[1] == b);
    let start = links.iter().map(|link| link[0]).find(|b| !is_target(*b)).unwrap_or(links[0][0]);
    let (mut at, mut steps) = (start, 0);
    while let Some(next) = find(links, at) {
        steps += 1;
        at = next;
        if at == start || steps > links.len() {
            break;
        }
    }
    steps == links.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron(at: f64, first: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let vertices = vec![[at, 0.0, 0.0], [at + 1.0, 0.0, 0.0], [at, 1.0, 0.0], [at, 0.0, 1.0]];
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].map(|t| t.map(|v| v + first)).to_vec();
        (vertices, triangles)
    }

    #[test]
    fn two_tetrahedra() {
        let ((mut vertices, mut triangles), (v, t)) = (tetrahedron(0.0, 0), tetrahedron(5.0, 4));
        vertices.extend(v);
        triangles.extend(t);
        let mesh = TriMesh { vertices, normals: vec![], triangles };
        let topology = mesh.topology();
        assert!(topology.closed);
        assert_eq!((topology.components, topology.euler_characteristic, topology.genus), (2, 4, 0));
        // Three halves of a unit square and a triangle with sides √2: rounding.
        let area = 1.5 + 0.75_f64.sqrt();
        let areas = mesh.component_sums(&mesh.vertex_areas());
        assert!(areas.len() == 2 && areas.iter().all(|found| (found - area).abs() < 1e-14), "{areas:?}");
        // A vertex that no triangle uses is no component.
        let mut loose = mesh.clone();
        loose.vertices.push([9.0; 3]);
        assert_eq!(loose.topology(), topology);
        assert_eq!(loose.component_sums(&[1.0; 9]), [4.0, 4.0]);
        // Two volumes of 1/6: rounding.
        assert!((mesh.enclosed_volume() - 1.0 / 3.0).abs() < 1e-14);
    }

    #[test]
    fn faults_are_seen() {
        let (vertices, mut triangles) = tetrahedron(0.0, 0);
        let mesh = |triangles: &[[u32; 3]]| TriMesh {
            vertices: vertices.clone(),
            normals: vec![],
            triangles: triangles.to_vec(),
        };
        let open = mesh(&triangles[1..]).topology();
        assert_eq!((open.boundary_edges, open.boundary_loops, open.genus), (3, 1, 0));
        triangles[0].swap(0, 1);
        assert_eq!(mesh(&triangles).topology().non_manifold_edges, 3);
        // Two tetrahedra that share a vertex only.
        let (v, t) = tetrahedron(5.0, 4);
        let (mut both, mut all) = tetrahedron(0.0, 0);
        both.extend(v);
        all.extend(t.iter().map(|t| t.map(|v| if v == 4 { 0 } else { v })));
        let pinched = TriMesh { vertices: both, normals: vec![], triangles: all }.topology();
        assert_eq!(pinched.non_manifold_vertices, 1);
        assert!(!pinched.closed);
    }
}
