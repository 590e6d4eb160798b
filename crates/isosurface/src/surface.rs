//! From samples to a triangle mesh.

use rayon::prelude::*;
use std::ops::{Range, RangeInclusive};
use zeroset_bspline::HierarchicalSpline;

use crate::cell::{contour, edge_corners, edge_faces, loops};
use crate::cell_mesh::CellMesh;
use crate::error::Error;
use crate::function::ImplicitFunction;
use crate::interior::{Interior, interior};
use crate::mesh::TriMesh;
use crate::options::{Options, Report};
use crate::root::{Zero, near, on_segment};
use crate::samples::LatticeSamples;
use crate::seam::{self, CutEdge, Seam};

/// Extracts the zero set. With a function its vertices are moved onto `f = 0` and get `∇f / ‖∇f‖` as normals; without, they
/// come from linear interpolation and the triangles. Where the zero set leaves the lattice it is closed by a cap a
/// thousandth of a cell outside.
///
/// # Errors
/// If no sample is negative, or there are too many vertices.
pub fn surface(
    samples: &LatticeSamples<3>,
    function: Option<&impl ImplicitFunction<3>>,
    options: &Options,
) -> Result<(TriMesh, Report), Error> {
    graded(std::slice::from_ref(samples), function, options)
}

/// As [`surface`], with cells of several sizes, each half as large as the next; the smallest come first.
pub(crate) fn graded(
    sizes: &[LatticeSamples<3>],
    function: Option<&impl ImplicitFunction<3>>,
    options: &Options,
) -> Result<(TriMesh, Report), Error> {
    // The layer around the lattice is outside.
    if sizes.iter().all(|samples| samples.values().par_iter().all(|value| *value >= 0.0)) {
        return Err(Error::Empty);
    }
    let mut vertices: Vec<Vertex> = vec![];
    let mut zeros: Vec<Zeros> = Vec::with_capacity(sizes.len());
    for samples in sizes {
        let grid = Grid { samples, shape: samples.shape(), finer: zeros.last() };
        let layers: Vec<Vec<(usize, Vertex)>> =
            (0..grid.shape[0]).into_par_iter().map(|i| grid.cut_edges(i, function, options)).collect();
        let first = vertices.len();
        let (keys, found): (Vec<usize>, Vec<Vertex>) = layers.into_iter().flatten().unzip();
        vertices.extend(found);
        zeros.push(Zeros { samples, keys, first });
    }
    let mut parts: Vec<Part> = vec![];
    for (size, samples) in sizes.iter().enumerate() {
        let finer = size.checked_sub(1).map(|finer| &zeros[finer]);
        let grid = Grid { samples, shape: samples.shape(), finer };
        let layers = (0..grid.shape[0] - 1).into_par_iter();
        parts.par_extend(layers.map(|i| grid.cells(i, &zeros[size], &vertices, function, options)));
    }
    let inner: usize = parts.iter().map(|part| part.inner.len()).sum();
    if vertices.len() + inner > INNER as usize {
        return Err(Error::TooLarge);
    }
    let mut report = Report::default();
    let mut triangles = Vec::with_capacity(parts.iter().map(|part| part.triangles.len()).sum());
    for part in parts {
        let base = vertices.len() as u32;
        vertices.extend(part.inner);
        let place = |vertex: u32| if vertex > INNER { base + (u32::MAX - vertex) } else { vertex };
        triangles.extend(part.triangles.iter().map(|triangle| triangle.map(place)));
        report.cells += part.report.cells;
        report.ambiguous += part.report.ambiguous;
        report.unclear += part.report.unclear;
    }
    report.capped = vertices.iter().filter(|vertex| vertex.capped).count();
    report.unreached = vertices.iter().filter(|vertex| !vertex.zero.reached).count();
    let normals = normals(&vertices, &triangles, function);
    let vertices = vertices.into_iter().map(|vertex| vertex.zero.position).collect();
    Ok((TriMesh { vertices, normals, triangles }, report))
}

/// Extracts the zero set of a spline from the cells of its dense lattice, halved as often as asked for (at least as often as
/// there are levels): [`surface`] of [`LatticeSamples::crossed`]. The mesh is that of samples on the whole lattice, at a cost
/// that grows with its area.
///
/// # Errors
/// If f is not negative at any node, cells become too small or too many along an axis, or there are too many vertices.
pub fn surface_of(
    spline: &HierarchicalSpline<3>,
    halvings: u32,
    options: &Options,
) -> Result<(TriMesh, Report), Error> {
    surface(&LatticeSamples::crossed(spline, halvings)?, Some(spline), options)
}

/// Extracts the zero set of a spline as [`surface_of`] does, on the cells of a [`HierarchicalSpline::grading`]: larger where the function's own
/// are, so that the cost grows with the number of these. Where the zero set may leave the box all cells are as small as the range's end says.
///
/// On a face between cells of two sizes the contour is the smaller ones'. Where these show two zeros on an edge, and larger ones beside it
/// have no smaller neighbour on the face between them that would say how to go on from there, the larger ones are halved too.
///
/// # Errors
/// As [`surface_of`].
pub fn graded_surface_of(
    spline: &HierarchicalSpline<3>,
    halvings: RangeInclusive<u32>,
    options: &Options,
) -> Result<(TriMesh, Report), Error> {
    let finest = *halvings.end();
    let mut grading = spline.grading(halvings);
    for _ in 0..MOST_DIVISIONS {
        let Some(sizes) = spline.graded_cells(&grading)? else { break };
        let sizes = sizes.into_iter().map(LatticeSamples::of_crossed_cells).collect::<Result<Vec<_>, _>>()?;
        let unclear: Vec<Vec<[u32; 3]>> =
            sizes.windows(2).map(|pair| seam::unclear_cells(&pair[1], &pair[0])).collect();
        if unclear.iter().all(Vec::is_empty) {
            return graded(&sizes, Some(spline), options);
        }
        for (size, cells) in unclear.iter().enumerate() {
            grading.divide(grading.finest() - 1 - size, cells);
        }
    }
    surface_of(spline, finest, options)
}

/// Larger cells are halved for what smaller ones show so often, before all are made as small: each time a few, of those that were halved before.
const MOST_DIVISIONS: usize = 8;

/// Numbers above this are inner vertices of a layer, counted down from `u32::MAX` until their place is known.
const INNER: u32 = u32::MAX / 2;

#[derive(Clone, Copy)]
struct Vertex {
    zero: Zero<3>,
    /// Whether it lies on a cap, where there is no f = 0.
    capped: bool,
}

/// One layer of cells.
#[derive(Default)]
struct Part {
    inner: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
    report: Report,
}

/// The zeros on the edges of one lattice, by numbers of edges: three times that of the lower node, plus the axis.
struct Zeros<'a> {
    samples: &'a LatticeSamples<3>,
    /// The edges' numbers, in ascending order.
    keys: Vec<usize>,
    /// The first one's vertex, which the others' follow.
    first: usize,
}

impl Zeros<'_> {
    /// The vertex on an edge, given its lower node's place on the whole lattice, and its axis.
    fn on(&self, node: &[usize; 3], axis: usize) -> Option<usize> {
        let key = 3 * self.samples.node_at(node)? + axis;
        self.keys.binary_search(&key).ok().map(|at| self.first + at)
    }

    /// The vertices on a range of edges, 0 where there is no zero.
    fn between(&self, edges: Range<usize>) -> Vec<u32> {
        let [first, last] = [edges.start, edges.end].map(|edge| self.keys.partition_point(|&key| key < edge));
        let mut vertices = vec![0; edges.len()];
        for at in first..last {
            vertices[self.keys[at] - edges.start] = (self.first + at) as u32;
        }
        vertices
    }
}

struct Grid<'a> {
    samples: &'a LatticeSamples<3>,
    shape: [usize; 3],
    /// Cells half as large, which may be beside this lattice's.
    finer: Option<&'a Zeros<'a>>,
}

impl Grid<'_> {
    /// A row of nodes along z.
    fn row(&self, i: usize, j: usize) -> usize {
        i * self.shape[1] + j
    }

    /// The zeros on the edges that begin in one layer of nodes, in ascending order of the edges' numbers.
    fn cut_edges(
        &self,
        i: usize,
        function: Option<&impl ImplicitFunction<3>>,
        options: &Options,
    ) -> Vec<(usize, Vertex)> {
        let (nodes, values) = (self.samples.nodes(), self.samples.values());
        let mut cut = Vec::new();
        for j in 0..self.shape[1] {
            let mut beside = [
                (i + 1 < self.shape[0]).then(|| nodes.cursor(self.row(i + 1, j))),
                (j + 1 < self.shape[1]).then(|| nodes.cursor(self.row(i, j + 1))),
            ];
            for run in nodes.row(self.row(i, j)) {
                for k in run.from..run.to {
                    let number = run.first + (k - run.from) as usize;
                    let inside = values[number] < 0.0;
                    for axis in 0..3 {
                        let other = match axis {
                            2 => (k + 1 < run.to).then_some(number + 1),
                            _ => beside[axis].as_mut().and_then(|row| row.find(k)),
                        };
                        let Some(other) = other.filter(|other| (values[*other] < 0.0) != inside) else { continue };
                        let node = [i, j, k as usize];
                        let on_whole = self.samples.on_whole(&node);
                        if self.finer.is_some_and(|finer| seam::is_split(finer.samples, on_whole, axis)) {
                            continue;
                        }
                        let vertex = self.zero(node, axis, [values[number], values[other]], function, options);
                        cut.push((3 * number + axis, vertex));
                    }
                }
            }
        }
        cut
    }

    /// The zero on an edge, given the values at its ends.
    fn zero(
        &self,
        node: [usize; 3],
        axis: usize,
        values: [f64; 2],
        function: Option<&impl ImplicitFunction<3>>,
        options: &Options,
    ) -> Vertex {
        let mut other = node;
        other[axis] += 1;
        let is_first = values[0] < 0.0;
        let (within, without) = if is_first { (node, other) } else { (other, node) };
        let ends = [within, without].map(|node| self.samples.position(&node));
        let capped = self.samples.is_outer(&without);
        let zero = if capped {
            // The middle of the short edge across the lattice's face.
            let position = std::array::from_fn(|axis| 0.5 * (ends[0][axis] + ends[1][axis]));
            Zero::held(position)
        } else {
            let values = if is_first { values } else { [values[1], values[0]] };
            on_segment(function, &ends[0], &ends[1], values, options)
        };
        Vertex { zero, capped }
    }

    /// The triangles of one layer of cells.
    fn cells(
        &self,
        i: usize,
        zeros: &Zeros,
        vertices: &[Vertex],
        function: Option<&impl ImplicitFunction<3>>,
        options: &Options,
    ) -> Part {
        let mut part = Part::default();
        let mut mesh = CellMesh::default();
        // The vertices on a cell's contour, and where they are.
        let (mut cut, mut positions): (Vec<u32>, Vec<[f64; 3]>) = (vec![], vec![]);
        let faces: [u8; 12] = std::array::from_fn(edge_faces);
        let (nodes, values_at) = (self.samples.nodes(), self.samples.values());
        // All edges of this layer's cells begin in these two layers of nodes.
        let lowest = 3 * nodes.before(self.row(i, 0));
        let vertex_on = zeros.between(lowest..3 * nodes.before(self.row(i + 2, 0)));
        for j in 0..self.shape[1] - 1 {
            for run in self.samples.cells().row(i * (self.shape[1] - 1) + j) {
                // The four rows of corners along the run.
                #[expect(clippy::expect_used, reason = "the corners of every cell of a run are nodes")]
                let rows = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
                    .map(|(i, j)| nodes.find(self.row(i, j), run.from).expect("corners of cells are nodes"));
                for k in run.from..run.to {
                    let step = (k - run.from) as usize;
                    let number = |c: usize| rows[c & 3] + step + (c >> 2);
                    let values: [f64; 8] = std::array::from_fn(|c| values_at[number(c)]);
                    let cell = self.samples.on_whole(&[i, j, k as usize]);
                    let seam = self.finer.and_then(|finer| Seam::of(finer.samples, cell, &values));
                    let inside = values[0] < 0.0;
                    if seam.is_none() && values.iter().all(|value| (*value < 0.0) == inside) {
                        continue;
                    }
                    let corner = |c: usize| [i + (c & 1), j + (c >> 1 & 1), k as usize + (c >> 2)];
                    let own = |edge: usize| vertex_on[3 * number(edge_corners(edge)[0]) + edge / 4 - lowest];
                    #[expect(
                        clippy::expect_used,
                        reason = "both lattices have a vertex on every edge with a change of sign"
                    )]
                    let on_seam = |edge: &CutEdge| match edge {
                        CutEdge::Own(edge) => own(*edge),
                        CutEdge::Finer(node, axis) => {
                            self.finer.and_then(|finer| finer.on(node, *axis)).expect("a zero") as u32
                        }
                    };
                    cut.clear();
                    let (cycles, decision) = match &seam {
                        None => {
                            cut.extend((0..12).map(own));
                            let cycles = loops(&contour(&values));
                            let decision = interior(&values, &cycles);
                            (cycles, decision)
                        }
                        Some(seam) => {
                            cut.extend(seam.edges.iter().map(on_seam));
                            let cycles = seam.loops();
                            let decision = seam.interior(&values, &cycles);
                            (cycles, decision)
                        }
                    };
                    positions.clear();
                    positions.extend(cut.iter().map(|vertex| vertices[*vertex as usize].zero.position));
                    match &seam {
                        None => mesh.fill(&cycles, decision, &positions, &faces),
                        Some(seam) => mesh.fill(&cycles, decision, &positions, &seam.faces()),
                    }
                    if cycles.is_empty() {
                        continue;
                    }
                    part.report.cells += 1;
                    part.report.ambiguous += usize::from(matches!(decision, Interior::Tunnel(..)));
                    part.report.unclear += usize::from(decision == Interior::Unclear);
                    let base = part.inner.len() as u32;
                    let ends = [corner(0), corner(7)].map(|node| self.samples.position(&node));
                    let capped = (0..8).any(|c| self.samples.is_outer(&corner(c)));
                    part.inner.extend(mesh.inner.iter().map(|&start| {
                        let zero = match function {
                            Some(function) if !capped => near(function, start, &ends[0], &ends[1], options),
                            _ => Zero::held(start),
                        };
                        Vertex { zero, capped }
                    }));
                    let vertex = |v: u8| match usize::from(v).checked_sub(cut.len()) {
                        None => cut[usize::from(v)],
                        Some(inner) => u32::MAX - (base + inner as u32),
                    };
                    part.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(vertex)));
                }
            }
        }
        part
    }
}

/// `∇f / ‖∇f‖`, or where that is not known (on caps, or without a function) the mean of the triangles around, weighted by
/// area.
fn normals(vertices: &[Vertex], triangles: &[[u32; 3]], function: Option<&impl ImplicitFunction<3>>) -> Vec<[f64; 3]> {
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length.is_finite() && length > 0.0).then(|| v.map(|x| x / length))
    };
    let of_function = |vertex: &Vertex| {
        let function = function.filter(|_| !vertex.capped)?;
        let position = &vertex.zero.position;
        unit(vertex.zero.gradient.unwrap_or_else(|| function.value_and_gradient(position).1))
    };
    let found: Vec<Option<[f64; 3]>> = vertices.par_iter().map(of_function).collect();
    // What only triangles can tell.
    let complete = found.iter().all(Option::is_some);
    let mut sums = vec![[0.0; 3]; if complete { 0 } else { vertices.len() }];
    for triangle in if complete { &[] } else { triangles } {
        let [a, b, c] = triangle.map(|v| vertices[v as usize].zero.position);
        let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
        for vertex in triangle {
            for k in 0..3 {
                sums[*vertex as usize][k] += u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
            }
        }
    }
    let normal = |(index, normal): (usize, Option<[f64; 3]>)| {
        normal.or_else(|| unit(*sums.get(index)?)).unwrap_or([0.0, 0.0, 1.0])
    };
    found.into_iter().enumerate().map(normal).collect()
}
