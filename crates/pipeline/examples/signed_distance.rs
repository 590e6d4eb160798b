//! A signed distance oracle: `cargo run --release -p zeroset --example signed_distance`.
//!
//! f itself has the right sign everywhere in its box, and near the surface it is close to the distance. Where the distance must be
//! right farther away too, or outside the box, ask `SignedDistance`, which looks for the nearest place of the surface.

use std::error::Error;

use zeroset::{Options, SignedDistance, extract_surface, reconstruct};
use zeroset_io::{Points, read_points};

fn main() -> Result<(), Box<dyn Error>> {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/double_torus.ply");
    let Points::Three(set) = read_points(fixture)? else { return Err("points in space are needed".into()) };
    let mut shape = reconstruct(&set.points, &Options::default())?;
    let (mesh, _) = extract_surface(&mut shape)?;

    // The function's coordinates are relative to an origin, so that large ones lose no digits.
    let (origin, f) = shape.in_data_units()?;
    let relative = |x: &[f64; 3]| std::array::from_fn(|axis| x[axis] - origin[axis]);
    let oracle = SignedDistance::new(&f, mesh.vertices.iter().map(relative).collect()).ok_or("there is no surface")?;

    for x in [[0.0, 0.0, 0.0], [0.45, 0.45, 0.0], [1.2, 0.0, 0.0], [0.0, 0.0, 5.0]] {
        println!("{x:?}: {:+.5}", oracle.at(&relative(&x)));
    }
    // The points themselves lie on the surface.
    let places: Vec<[f64; 3]> = set.points.iter().map(relative).collect();
    let worst = oracle.at_all(&places).into_iter().map(f64::abs).fold(0.0, f64::max);
    println!("farthest of the {} points: {worst:.5}", set.points.len());
    Ok(())
}
