//! The zero set of a reconstruction, in data coordinates.

use std::time::Instant;

use serde::Serialize;
use zeroset_isosurface::{self as isosurface, CurveTopology, Curves, Topology, TriMesh};

use crate::error::ReconstructError;
use crate::reconstruct::Reconstruction;
use crate::report::{ExtractionReport, StageFigures, StageReport};

/// Lattices coarser than this are halved once more for extraction: chords over a cell would show.
const FINE_ENOUGH: usize = 96;

/// A component with less than the area of so many points is a speck.
const SPECK: f64 = 50.0;

/// The surface of a reconstruction as a mesh in data coordinates, with its topology. The report gets a stage.
///
/// # Errors
/// If there is no zero set.
pub fn extract_surface(reconstruction: &mut Reconstruction<3>) -> Result<(TriMesh, Topology), ReconstructError> {
    let start = Instant::now();
    let halvings = marching_halvings(reconstruction);
    let (mut mesh, found) = isosurface::surface_of(&reconstruction.spline, halvings, &Default::default())?;
    let (frame, points) = (reconstruction.frame, &reconstruction.points);
    let stray = stray(reconstruction, points, &mesh.vertices);
    for vertex in &mut mesh.vertices {
        *vertex = frame.to_data(vertex);
    }
    let topology = mesh.topology();
    let figures = Figures::Surface {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        area: mesh.area(),
        volume: mesh.enclosed_volume(),
        topology,
    };
    let speck = SPECK * reconstruction.report.input.spacing.powi(2);
    let specks = mesh.component_areas().into_iter().filter(|area| *area < speck).count();
    if specks > 0 {
        reconstruction.report.warnings.push(format!(
            "{specks} of {} components are specks, no larger than a few points' share: they come from points off the \
             surface, or from noise",
            topology.components
        ));
    }
    finish(reconstruction, start, found, figures, stray);
    Ok((mesh, topology))
}

/// The curve of a reconstruction as closed polylines in data coordinates, with its topology. The report gets a stage.
///
/// # Errors
/// If there is no zero set.
pub fn extract_curve(reconstruction: &mut Reconstruction<2>) -> Result<(Curves, CurveTopology), ReconstructError> {
    let start = Instant::now();
    let halvings = marching_halvings(reconstruction);
    let (mut curves, found) = isosurface::curve_of(&reconstruction.spline, halvings, &Default::default())?;
    let all: Vec<[f64; 2]> = curves.loops.iter().flatten().copied().collect();
    let stray = stray(reconstruction, &reconstruction.points, &all);
    for vertex in curves.loops.iter_mut().flatten() {
        *vertex = reconstruction.frame.to_data(vertex);
    }
    let topology = curves.topology();
    finish(reconstruction, start, found, Figures::Curve { vertices: all.len(), topology }, stray);
    Ok((curves, topology))
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
        /// Enclosed volume.
        volume: f64,
        /// Components, genus, holes.
        topology: Topology,
    },
    /// Curves.
    Curve {
        /// Vertices of the polylines.
        vertices: usize,
        /// Loops, area, length.
        topology: CurveTopology,
    },
}

/// From the dense lattice's cells to those that the zero set is extracted on: the finest of the spline, or finer.
fn marching_halvings<const D: usize>(reconstruction: &Reconstruction<D>) -> u32 {
    let longest = reconstruction.domain.cells(reconstruction.halvings).into_iter().max().unwrap_or(0);
    (reconstruction.spline.levels().len() as u32).max(u32::from(longest < FINE_ENOUGH))
}

/// Share of the vertices that are farther than four spacings (or two cells, if those are larger) from every point.
fn stray<const D: usize>(reconstruction: &Reconstruction<D>, points: &[[f64; D]], vertices: &[[f64; D]]) -> f64 {
    let cell = reconstruction.domain.spacing(reconstruction.halvings);
    let spacing = reconstruction.report.input.spacing * reconstruction.frame.scale;
    let reach = (4.0 * spacing).max(2.0 * cell);
    let far = crate::spacing::distances_to(points, vertices).into_iter().filter(|&d| d > reach).count();
    far as f64 / vertices.len().max(1) as f64
}

/// Above this share of vertices away from all points, a warning is given. (Holes of a few percent are closed without one: the
/// share is in the report, and what is wrong there shows elsewhere.)
const STRAY_TOLERATED: f64 = 0.08;

fn finish<const D: usize>(
    reconstruction: &mut Reconstruction<D>,
    start: Instant,
    found: isosurface::Report,
    zero_set: Figures,
    unsupported: f64,
) {
    let report = &mut reconstruction.report;
    if found.capped > 0 {
        report.warnings.push(format!(
            "the zero set leaves the box and was closed there ({} vertices): the shape may be open",
            found.capped
        ));
    }
    if unsupported > STRAY_TOLERATED {
        report.warnings.push(format!(
            "{:.0} % of the result is far from all points: it closes holes, or is wrong there",
            100.0 * unsupported
        ));
    }
    let seconds = start.elapsed().as_secs_f64();
    tracing::info!(stage = "extraction", seconds, "done");
    let figures = StageFigures::Extraction(ExtractionReport { found, unsupported, zero_set });
    report.stages.push(StageReport { seconds, figures });
}
