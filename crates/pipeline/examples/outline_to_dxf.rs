//! A scanned outline as polylines for a CAD program: `cargo run --release -p zeroset --example outline_to_dxf`.

use std::error::Error;

use zeroset::{Options, extract_curve, reconstruct};
use zeroset_io::{Points, read_points};

fn main() -> Result<(), Box<dyn Error>> {
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/annulus_offset.xy");
    let Points::Two(set) = read_points(fixture)? else { return Err("points in the plane are needed".into()) };

    let mut outline = reconstruct(&set.points, &Options::default())?;
    let (curves, topology) = extract_curve(&mut outline)?;
    println!("{} points: {} outer rim(s), {} hole(s)", set.points.len(), topology.parts, topology.holes);
    println!("area {:.5}, length {:.5}, in the unit of the points", topology.area, topology.length);

    let path = std::env::temp_dir().join("outline.dxf");
    zeroset_io::write_curves(&path, &zeroset_io::Curves { curves: &curves.loops, paths: &curves.paths, points: &[] })?;
    println!("wrote {}", path.display());
    Ok(())
}
