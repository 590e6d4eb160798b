//! The zero set of a reconstruction, in data coordinates.

use std::time::Instant;

use serde::Serialize;
use zeroset_bspline::{Derivatives, HierarchicalSpline};
use zeroset_isosurface::{self as isosurface, CurveTopology, Curves, Topology, TriMesh};

use crate::error::ReconstructError;
use crate::points::spacing::distances_to;
use crate::points::support::{self, Nearest, Support};
use crate::reconstruct::Reconstruction;
use crate::report::{ExtractionReport, StageFigures, StageReport};
use crate::topology::fragile;
use crate::trust::gaps::{curve, surface};
use crate::trust::shape_name;
use crate::zero_set::marching::marching_halvings;

/// A component with less area than so many of the points around it stand for is a speck.
const SPECK: f64 = 50.0;

/// Newton steps that take the vertices of a boundary from the chords between their neighbours to f = 0.
const NEWTON_STEPS: usize = 4;

/// The surface of a reconstruction as a mesh in data coordinates, with its topology: closed, or, if [`Reconstruction::open`],
/// the part that the points support, which is empty where they support none. The report gets a stage.
///
/// # Errors
/// If there is no zero set.
pub fn extract_surface(reconstruction: &mut Reconstruction<3>) -> Result<(TriMesh, Topology), ReconstructError> {
    let start = Instant::now();
    let halvings = marching_halvings(reconstruction);
    let (mut mesh, found) = isosurface::graded_surface_of(&reconstruction.spline, halvings, &Default::default())?;
    let points = reconstruction.fitted();
    let support = Support::new(&points, &reconstruction.spacing);
    if reconstruction.open {
        let nearest = support.nearest(&mesh.vertices);
        let mut lack = support.lack(&mesh.vertices, &nearest);
        let shares = shares(&mesh, &support, &nearest);
        mesh.settle(&mut lack, &shares, support::SPECK, support::HOLE);
        let (part, kept) = mesh.clipped(&lack);
        mesh = part;
        onto_zero_set(reconstruction, &mut mesh, kept);
    }
    let nearest = support.nearest(&mesh.vertices);
    let closes = Closes::of(reconstruction, &mesh.vertices, &nearest, || {
        let of = |triangle: &[u32; 3]| triangle.map(|v| nearest[v as usize].remoteness).iter().sum::<f64>() > 3.0;
        let part: Vec<[u32; 3]> = mesh.triangles.iter().copied().filter(of).collect();
        let remote = TriMesh { vertices: mesh.vertices.clone(), normals: Vec::new(), triangles: part }.area();
        [remote, mesh.area()]
    });
    let shares = shares(&mesh, &support, &nearest);
    if !reconstruction.open {
        let warnings = surface::gap_warnings(&mesh, &points, (&support, &nearest), &shares, &reconstruction.frame);
        reconstruction.report.warnings.extend(warnings);
    }
    let uncovered = uncovered(&points, &mesh.vertices, &nearest, 2.0 * reconstruction.spacing.typical);
    let frame = reconstruction.frame;
    for vertex in &mut mesh.vertices {
        *vertex = frame.to_data(vertex);
    }
    let (topology, (area, volume)) = rayon::join(|| mesh.topology(), || (mesh.area(), mesh.enclosed_volume()));
    if let Some(initial) = reconstruction.initial.as_ref().filter(|_| !reconstruction.open) {
        let before =
            isosurface::surface_of(&HierarchicalSpline::new(initial.clone())?, 0, &Default::default())?.0.topology();
        if (before.components, before.genus) != (topology.components, topology.genus) && is_doubtful(reconstruction) {
            reconstruction.report.warnings.push(format!(
                "refinement has joined or pierced parts: {} component(s) of genus {} before it, {} of genus {} after; the \
                 points do not tell which is right, a denser scan of narrow gaps and thin walls would",
                before.components, before.genus, topology.components, topology.genus
            ));
        }
    }
    let figures = Figures::Surface {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        area,
        volume,
        unsupported_area: closes.extent / frame.scale.powi(2),
        unsupported_share: closes.share,
        topology,
    };
    let parts = if topology.components > 1 { mesh.component_sums(&shares) } else { vec![] };
    let specks = parts.iter().filter(|shares| **shares < SPECK).count();
    // Where all are as small the shape is, of few points.
    if specks > 0 && specks < topology.components {
        reconstruction.report.warnings.push(format!(
            "{specks} of {} components are specks, no larger than a few points' share: they come from points off the \
             surface, or from noise",
            topology.components
        ));
    }
    finish(reconstruction, start, found, figures, closes, uncovered);
    Ok((mesh, topology))
}

/// The curve of a reconstruction as polylines in data coordinates, with its topology: closed, or, if [`Reconstruction::open`],
/// the parts that the points support. The report gets a stage.
///
/// # Errors
/// If there is no zero set.
pub fn extract_curve(reconstruction: &mut Reconstruction<2>) -> Result<(Curves, CurveTopology), ReconstructError> {
    let start = Instant::now();
    let halvings = marching_halvings(reconstruction);
    let (mut curves, found) = isosurface::curve_of(&reconstruction.spline, *halvings.end(), &Default::default())?;
    let points = reconstruction.fitted();
    let support = Support::new(&points, &reconstruction.spacing);
    if reconstruction.open {
        let lack = |cycle: &Vec<[f64; 2]>| support.lack(cycle, &support.nearest(cycle));
        let lack: Vec<Vec<f64>> = curves.loops.iter().map(lack).collect();
        // Lengths, in the typical spacing.
        let [speck, hole] = [support::SPECK, support::HOLE].map(|shares| shares * reconstruction.spacing.typical);
        curves = curves.clipped(&lack, speck, hole);
    }
    let all: Vec<[f64; 2]> = curves.loops.iter().chain(&curves.paths).flatten().copied().collect();
    let nearest = support.nearest(&all);
    let closes = Closes::of(reconstruction, &all, &nearest, || {
        let mut sums = [0.0; 2];
        let mut first = 0;
        for (line, closed) in curves.loops.iter().map(|l| (l, true)).chain(curves.paths.iter().map(|p| (p, false))) {
            let n = line.len();
            for i in 0..if closed { n } else { n - 1 } {
                let (a, b) = (line[i], line[(i + 1) % n]);
                let length = (b[0] - a[0]).hypot(b[1] - a[1]);
                sums[1] += length;
                if nearest[first + i].remoteness + nearest[first + (i + 1) % n].remoteness > 2.0 {
                    sums[0] += length;
                }
            }
            first += n;
        }
        sums
    });
    if !reconstruction.open {
        let warning = curve::gap_warning(&curves, (&support, &nearest), &reconstruction.frame);
        reconstruction.report.warnings.extend(warning);
    }
    let uncovered = uncovered(&points, &all, &nearest, 2.0 * reconstruction.spacing.typical);
    for vertex in curves.loops.iter_mut().chain(&mut curves.paths).flatten() {
        *vertex = reconstruction.frame.to_data(vertex);
    }
    curves.loops.iter_mut().for_each(|cycle| told_once(cycle, true));
    curves.paths.iter_mut().for_each(|path| told_once(path, false));
    let topology = curves.topology();
    if let Some(initial) = reconstruction.initial.as_ref().filter(|_| !reconstruction.open) {
        let before =
            isosurface::curve_of(&HierarchicalSpline::new(initial.clone())?, 0, &Default::default())?.0.topology();
        if before.loops != topology.loops && is_doubtful(reconstruction) {
            reconstruction.report.warnings.push(format!(
                "refinement has joined or split parts: {} loop(s) before it, {} after; the points do not tell which is \
                 right, a denser sampling of narrow gaps would",
                before.loops, topology.loops
            ));
        }
    }
    let figures = Figures::Curve {
        vertices: curves.loops.iter().chain(&curves.paths).map(Vec::len).sum(),
        unsupported_length: closes.extent / reconstruction.frame.scale,
        unsupported_share: closes.share,
        topology,
    };
    finish(reconstruction, start, found, figures, closes, uncovered);
    Ok((curves, topology))
}

/// Leaves out vertices that are where the one before is: far from the origin, numbers of 64 bits do not tell all of them apart. A line
/// of which too few vertices would be left stays as it is.
fn told_once(line: &mut Vec<[f64; 2]>, closed: bool) {
    let mut different = line.clone();
    different.dedup();
    if closed && different.len() > 1 && different.first() == different.last() {
        different.pop();
    }
    if different.len() >= if closed { 3 } else { 2 } {
        *line = different;
    }
}

/// What the zero set is, in the data's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Figures {
    /// A surface.
    Surface {
        /// Vertices of the mesh.
        vertices: usize,
        /// Triangles of the mesh.
        triangles: usize,
        /// Area.
        area: f64,
        /// Enclosed volume; of an open surface that of the cone over it, seen from its first vertex.
        volume: f64,
        /// Area of the triangles that are farther from every point than 1.5 spacings of the points there: what closes holes.
        unsupported_area: f64,
        /// The same as a share of the area.
        unsupported_share: f64,
        /// Components, genus, holes.
        topology: Topology,
    },
    /// Curves.
    Curve {
        /// Vertices of the polylines.
        vertices: usize,
        /// Length of the chords that are farther from every point than 1.5 spacings of the points there: what closes gaps.
        unsupported_length: f64,
        /// The same as a share of the length.
        unsupported_share: f64,
        /// Loops, area, length.
        topology: CurveTopology,
    },
}

/// How many points stand for the area around every vertex, by the spacing of those around it.
fn shares(mesh: &TriMesh, support: &Support<'_, 3>, nearest: &[Nearest]) -> Vec<f64> {
    mesh.vertex_areas().iter().zip(nearest).map(|(area, near)| area / support.share(near.sample)).collect()
}

/// Whether a topology that the initial shape did not have hangs on little.
fn is_doubtful<const D: usize>(reconstruction: &Reconstruction<D>) -> bool {
    fragile::is_doubtful(&reconstruction.spline, reconstruction.noise, reconstruction.spacing.typical)
}

/// Moves the vertices from the first one on to f = 0 and gives them their normals, in the frame.
fn onto_zero_set(reconstruction: &Reconstruction<3>, mesh: &mut TriMesh, first: usize) {
    let vertices = &mut mesh.vertices[first..];
    // Chords are off the surface by much less than a cell; a longer step leads elsewhere.
    let longest = 0.25 * reconstruction.domain.spacing(reconstruction.halvings);
    for step in 0..=NEWTON_STEPS {
        let at = reconstruction.spline.evaluate(vertices, Derivatives::Gradient);
        for (i, (value, gradient)) in at.values.iter().zip(&at.gradients).enumerate() {
            let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            if !(norm > 0.0 && (value / norm).abs() < longest) {
                continue;
            }
            if step < NEWTON_STEPS {
                (0..3).for_each(|axis| vertices[i][axis] -= value / norm * gradient[axis] / norm);
            } else {
                mesh.normals[first + i] = gradient.map(|g| g / norm);
            }
        }
    }
}

/// The part of the zero set that no points support.
struct Closes {
    /// Area, or length, in the frame.
    extent: f64,
    /// The same as a share of all.
    share: f64,
    /// Share of the vertices that are farther than four spacings (or two cells, if those are larger) from every point, and than
    /// four of those around the nearest one.
    stray: f64,
}

impl Closes {
    /// `nearest` has the nearest fitted point of every vertex; `measure` gives the extent of the part where their mean
    /// remoteness is above 1, and of all.
    fn of<const D: usize>(
        reconstruction: &Reconstruction<D>,
        vertices: &[[f64; D]],
        nearest: &[Nearest],
        measure: impl FnOnce() -> [f64; 2],
    ) -> Self {
        let [extent, all] = measure();
        let cell = reconstruction.domain.spacing(reconstruction.halvings);
        let reach = (FAR * reconstruction.spacing.typical).max(2.0 * cell);
        let is_far = |near: &Nearest| near.distance > reach && near.spacings() > FAR;
        // A point that was not fitted may be nearer.
        let candidates: Vec<[f64; D]> =
            vertices.iter().zip(nearest).filter(|(_, near)| is_far(near)).map(|(vertex, _)| *vertex).collect();
        let far = distances_to(&reconstruction.points, &candidates).into_iter().filter(|&d| d > reach).count();
        let share = if all > 0.0 { extent / all } else { 0.0 };
        Self { extent, share, stray: far as f64 / vertices.len().max(1) as f64 }
    }
}

/// Share of the points that are farther than `reach` from every vertex, each of which has its `nearest` point.
fn uncovered<const D: usize>(points: &[[f64; D]], vertices: &[[f64; D]], nearest: &[Nearest], reach: f64) -> f64 {
    if vertices.is_empty() {
        return 1.0;
    }
    let mut covered = vec![false; points.len()];
    nearest.iter().filter(|near| near.distance <= reach).for_each(|near| covered[near.sample] = true);
    // A vertex may cover points beside the one that is nearest to it.
    let rest: Vec<[f64; D]> = points.iter().zip(&covered).filter(|(_, c)| !**c).map(|(point, _)| *point).collect();
    if rest.is_empty() {
        return 0.0;
    }
    let far = distances_to(vertices, &rest).into_iter().filter(|&d| d > reach).count();
    far as f64 / points.len() as f64
}

/// A vertex is away from all points if it is farther from them than so many spacings.
const FAR: f64 = 4.0;
/// Above this share of vertices away from all points, a warning is given. (Holes of a few percent are closed without one: the
/// share is in the report, and what is wrong there shows elsewhere.)
const STRAY_TOLERATED: f64 = 0.08;
/// An open surface that leaves out more than this share of the points is not to be trusted.
const UNCOVERED_TOLERATED: f64 = 0.1;

fn finish<const D: usize>(
    reconstruction: &mut Reconstruction<D>,
    start: Instant,
    found: isosurface::Report,
    zero_set: Figures,
    closes: Closes,
    uncovered: f64,
) {
    let open = reconstruction.open;
    let report = &mut reconstruction.report;
    if found.capped > 0 && !open {
        report.warnings.push(format!(
            "the zero set leaves the box and was closed there ({} vertices): the shape may be open (--open)",
            found.capped
        ));
    }
    if closes.stray > STRAY_TOLERATED {
        let (measure, extent) = match zero_set {
            Figures::Surface { unsupported_area, .. } => ("area", unsupported_area),
            Figures::Curve { unsupported_length, .. } => ("length", unsupported_length),
        };
        report.warnings.push(format!(
            "{:.0} % of the result ({measure} {extent:.4}) is far from all points: it closes holes, or is wrong there; --open \
             leaves it out",
            100.0 * closes.share
        ));
    }
    if open && uncovered > UNCOVERED_TOLERATED {
        report.doubt.get_or_insert(format!(
            "no trustworthy open {} was found: {:.0} % of the points are away from it; try --smooth with a length above \
             the noise, or a denser or cleaner scan",
            shape_name(D),
            100.0 * uncovered
        ));
    }
    let seconds = start.elapsed().as_secs_f64();
    let figures = StageFigures::Extraction(ExtractionReport { found, unsupported: closes.stray, uncovered, zero_set });
    report.stages.push(StageReport { seconds, figures });
}

#[cfg(test)]
mod tests {
    use super::told_once;

    fn told(line: &[[f64; 2]], closed: bool) -> Vec<[f64; 2]> {
        let mut line = line.to_vec();
        told_once(&mut line, closed);
        line
    }

    #[test]
    fn vertices_in_one_place_are_told_once() {
        let [a, b, c] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(told(&[a, a, b, c, c, a], true), [a, b, c]);
        assert_eq!(told(&[a, b, b, c, a], false), [a, b, c, a], "a path may end where it begins");
        assert_eq!(told(&[a, b, b], true), [a, b, b], "a loop of two vertices would be none");
        assert_eq!(told(&[a, a], false), [a, a]);
    }
}
