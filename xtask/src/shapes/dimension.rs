//! What differs between the plane and space.

use std::fmt;
use std::path::Path;

use zeroset::bspline::HierarchicalSpline;
use zeroset::isosurface::{self, Curves, LatticeSamples, TriMesh};
use zeroset::{Point, ReconstructError, Reconstruction, extract_curve, extract_surface};
use zeroset_io::WriteError;

use super::families::{FAMILIES, Family};
use super::outlines::OUTLINES;
use super::solid::distance;

/// Components and their genus, or loops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topology {
    /// Components, or loops.
    pub parts: usize,
    /// Sum of the components' genera; loops have none.
    pub genus: Option<i64>,
    /// Whether it has no boundary, and is manifold.
    pub closed: bool,
}

impl fmt::Display for Topology {
    /// As `2/3`, or `2` in the plane.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.parts)?;
        if let Some(genus) = self.genus {
            write!(f, "/{genus}")?;
        }
        f.write_str(if self.closed { "" } else { " open" })
    }
}

/// The plane, or space.
pub trait Dimension<const D: usize>: Point<D> {
    /// Curves, or a surface.
    type Boundary: Send;
    /// Cells along the longest side of the lattice on which the truth is found.
    const CELLS: usize;
    /// Fewest and most points of a run.
    const POINTS: [f64; 2];
    /// Fewest points of a part: another shape is drawn where one has fewer.
    const PART: f64;
    /// Of a picture, or a mesh.
    const EXTENSION: &'static str;
    /// Every family of shapes.
    const FAMILIES: &'static [Family<D>];

    /// The zero set of samples.
    fn march(samples: &LatticeSamples<D>) -> Result<Self::Boundary, isosurface::Error>;
    /// The zero set of a reconstruction.
    fn extract(result: &mut Reconstruction<D>) -> Result<Self::Boundary, ReconstructError>;
    /// What its parts are.
    fn topology(boundary: &Self::Boundary) -> Topology;
    /// Length or area of each part.
    fn extents(boundary: &Self::Boundary) -> Vec<f64>;
    /// Its vertices.
    fn vertices(boundary: &Self::Boundary) -> Vec<[f64; D]>;
    /// Its segments, or triangles.
    fn simplices(boundary: &Self::Boundary) -> Vec<[[f64; D]; D]>;
    /// Writes it in the format of [`Self::EXTENSION`], in the plane with points.
    fn write(path: &Path, boundary: &Self::Boundary, points: &[[f64; D]]) -> Result<(), WriteError>;
}

impl Dimension<2> for [f64; 2] {
    type Boundary = Curves;
    const CELLS: usize = 600;
    const POINTS: [f64; 2] = [100.0, 2500.0];
    const PART: f64 = 12.0;
    const EXTENSION: &'static str = "svg";
    const FAMILIES: &'static [Family<2>] = &OUTLINES;

    fn march(samples: &LatticeSamples<2>) -> Result<Curves, isosurface::Error> {
        let function = None::<&HierarchicalSpline<2>>;
        isosurface::curve(samples, function, &Default::default()).map(|(curves, _)| curves)
    }

    fn extract(result: &mut Reconstruction<2>) -> Result<Curves, ReconstructError> {
        extract_curve(result).map(|(curves, _)| curves)
    }

    fn topology(curves: &Curves) -> Topology {
        Topology { parts: curves.loops.len(), genus: None, closed: curves.paths.is_empty() }
    }

    fn extents(curves: &Curves) -> Vec<f64> {
        let length = |cycle: &Vec<[f64; 2]>| segments(cycle).map(|[a, b]| distance(&a, &b)).sum();
        curves.loops.iter().map(length).collect()
    }

    fn vertices(curves: &Curves) -> Vec<[f64; 2]> {
        curves.loops.concat()
    }

    fn simplices(curves: &Curves) -> Vec<[[f64; 2]; 2]> {
        curves.loops.iter().flat_map(|cycle| segments(cycle)).collect()
    }

    fn write(path: &Path, curves: &Curves, points: &[[f64; 2]]) -> Result<(), WriteError> {
        let curves = zeroset_io::Curves { curves: &curves.loops, points, ..zeroset_io::Curves::default() };
        zeroset_io::write_curves(path, &curves)
    }
}

/// Of a closed polyline.
fn segments(cycle: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    (0..cycle.len()).map(|i| [cycle[i], cycle[(i + 1) % cycle.len()]])
}

impl Dimension<3> for [f64; 3] {
    type Boundary = TriMesh;
    const CELLS: usize = 180;
    const POINTS: [f64; 2] = [1500.0, 15_000.0];
    const PART: f64 = 50.0;
    const EXTENSION: &'static str = "ply";
    const FAMILIES: &'static [Family<3>] = &FAMILIES;

    fn march(samples: &LatticeSamples<3>) -> Result<TriMesh, isosurface::Error> {
        let function = None::<&HierarchicalSpline<3>>;
        isosurface::surface(samples, function, &Default::default()).map(|(mesh, _)| mesh)
    }

    fn extract(result: &mut Reconstruction<3>) -> Result<TriMesh, ReconstructError> {
        extract_surface(result).map(|(mesh, _)| mesh)
    }

    fn topology(mesh: &TriMesh) -> Topology {
        let topology = mesh.topology();
        Topology { parts: topology.components, genus: Some(topology.genus), closed: topology.closed }
    }

    fn extents(mesh: &TriMesh) -> Vec<f64> {
        mesh.component_sums(&mesh.vertex_areas())
    }

    fn vertices(mesh: &TriMesh) -> Vec<[f64; 3]> {
        mesh.vertices.clone()
    }

    fn simplices(mesh: &TriMesh) -> Vec<[[f64; 3]; 3]> {
        mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.vertices[vertex as usize])).collect()
    }

    fn write(path: &Path, mesh: &TriMesh, _: &[[f64; 3]]) -> Result<(), WriteError> {
        let mesh = zeroset_io::TriMesh {
            vertices: &mesh.vertices,
            normals: &mesh.normals,
            triangles: &mesh.triangles,
            ..zeroset_io::TriMesh::default()
        };
        zeroset_io::write_mesh(path, &mesh)
    }
}
