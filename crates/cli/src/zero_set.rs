//! Zero sets: what they are in words, and their files.

use std::path::Path;

use zeroset::isosurface::{CurveTopology, Curves, Topology, TriMesh};

use crate::carried::Carried;
use crate::failure::Failure;

pub fn describe_curve(topology: &CurveTopology) -> String {
    if topology.paths > 0 {
        let (loops, paths) = (count(topology.loops, "closed loop"), count(topology.paths, "open path"));
        return format!("curve: {paths} and {loops}, length {:.6}", topology.length);
    }
    format!(
        "curve: {} and {}, area {:.6}, length {:.6}",
        count(topology.parts, "part"),
        count(topology.holes, "hole"),
        topology.area,
        topology.length
    )
}

pub fn describe_surface(mesh: &TriMesh, topology: &Topology) -> String {
    if topology.boundary_loops > 0 && topology.non_manifold_edges == 0 {
        let (components, loops) =
            (count(topology.components, "component"), count(topology.boundary_loops, "boundary loop"));
        return format!(
            "surface: {components} of genus {}, open with {loops}, area {:.6}",
            topology.genus,
            mesh.area()
        );
    }
    format!(
        "surface: {} of genus {}, {}, volume {:.6}, area {:.6}",
        count(topology.components, "component"),
        topology.genus,
        if topology.closed { "closed" } else { "NOT closed" },
        mesh.enclosed_volume(),
        mesh.area()
    )
}

fn count(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

pub fn write_mesh(path: &Path, mesh: &TriMesh, carried: &Carried) -> Result<(), Failure> {
    let mesh = zeroset_io::TriMesh {
        vertices: &mesh.vertices,
        normals: &mesh.normals,
        triangles: &mesh.triangles,
        colours: &carried.colours,
        support: &carried.support,
        attributes: &carried.attributes,
    };
    zeroset_io::write_mesh(path, &mesh).map_err(Failure::writing)
}

pub fn write_curves(path: &Path, curves: &Curves, points: &[[f64; 2]]) -> Result<(), Failure> {
    zeroset_io::write_curves(path, &zeroset_io::Curves { curves: &curves.loops, paths: &curves.paths, points })
        .map_err(Failure::writing)
}
