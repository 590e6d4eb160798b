//! A surface a little farther out and one a little farther in: `cargo run --release -p zeroset --example offset_surface`.
//!
//! Near the surface f is close to the distance, so that f = d is the surface moved outwards by d. It is so within a few spacings of
//! the points; farther away f is no distance any more. Inwards d must stay well below half the thinnest wall, which is 0.06 thick
//! here: f is flat in its middle, and the wall would open too early.

use std::error::Error;

use zeroset::{Options, isosurface, reconstruct};
use zeroset_io::{Points, read_points};

fn main() -> Result<(), Box<dyn Error>> {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/double_torus.ply");
    let Points::Three(set) = read_points(fixture)? else { return Err("points in space are needed".into()) };
    let shape = reconstruct(&set.points, &Options::default())?;
    let (origin, f) = shape.in_data_units()?;

    for distance in [-0.01, 0.0, 0.01] {
        let moved = f.plus_constant(-distance)?;
        // Cells of the dense lattice, halved once.
        let (mut mesh, _) = isosurface::surface_of(&moved, 1, &Default::default())?;
        mesh.vertices.iter_mut().for_each(|v| (0..3).for_each(|k| v[k] += origin[k]));
        let topology = mesh.topology();
        println!(
            "offset {distance:+}: volume {:.4}, area {:.4}, genus {}, closed: {}",
            mesh.enclosed_volume(),
            mesh.area(),
            topology.genus,
            topology.closed
        );
        let path = std::env::temp_dir().join(format!("offset{distance:+}.stl"));
        let file = zeroset_io::TriMesh { vertices: &mesh.vertices, triangles: &mesh.triangles, ..Default::default() };
        zeroset_io::write_mesh(&path, &file)?;
        println!("  wrote {}", path.display());
    }
    Ok(())
}
