//! From a list of points to a mesh: `cargo run --release -p zeroset --example points_to_mesh`.
//!
//! The points need no normals, no order and no particular unit.

use std::error::Error;

use zeroset::{Options, extract_surface, reconstruct};

fn main() -> Result<(), Box<dyn Error>> {
    // Your own points go here. These lie on a torus with radii 2 and 1, spread by the golden angle.
    let points: Vec<[f64; 3]> = (0..2000)
        .map(|i| {
            let (u, v) = (f64::from(i) * 2.399_963, f64::from(i) / 2000.0 * std::f64::consts::TAU);
            let across = 2.0 + v.cos();
            [across * u.cos(), across * u.sin(), v.sin()]
        })
        .collect();

    let mut torus = reconstruct(&points, &Options::default())?;
    let (mesh, topology) = extract_surface(&mut torus)?;

    println!("{} vertices, {} triangles", mesh.vertices.len(), mesh.triangles.len());
    println!("closed: {}, components: {}, genus: {}", topology.closed, topology.components, topology.genus);
    println!("volume {:.3} (2 π² r² R = {:.3})", mesh.enclosed_volume(), 4.0 * std::f64::consts::PI.powi(2));

    // What to know before relying on it.
    for sentence in torus.report.warnings.iter().chain(&torus.report.doubt) {
        println!("warning: {sentence}");
    }

    let path = std::env::temp_dir().join("torus.ply");
    let file = zeroset_io::TriMesh {
        vertices: &mesh.vertices,
        normals: &mesh.normals,
        triangles: &mesh.triangles,
        ..Default::default()
    };
    zeroset_io::write_mesh(&path, &file)?;
    println!("wrote {}", path.display());
    Ok(())
}
