//! Points that have normals: `cargo run --release -p zeroset --example given_normals`.
//!
//! A scanner knows on which side of a sheet it stood. Here two discs lie half as far apart as their points, which alone do not tell
//! which of them is whose: the result is doubted. As a hint the normals do not change that, for winding numbers cannot confirm them;
//! trusted they do.

use std::error::Error;
use std::f64::consts::TAU;

use ndarray::Array2;
use zeroset::{Normals, Options, Watch, extract_surface, reconstruct_with_normals, rows};

fn main() -> Result<(), Box<dyn Error>> {
    // A flat tin, 2 wide and 0.02 high, as rows x, y, z, nx, ny, nz.
    let disc = (0..4000).map(|i| {
        let (radius, angle) = ((f64::from(i) / 4000.0).sqrt(), f64::from(i) * 2.399_963);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        [radius * angle.cos(), radius * angle.sin(), 0.01 * side, 0.0, 0.0, side]
    });
    let rim = (0..600).map(|i| {
        let (angle, z) = (f64::from(i) / 200.0 * TAU, 0.006 * (f64::from(i / 200) - 1.0));
        [angle.cos(), angle.sin(), z, angle.cos(), angle.sin(), 0.0]
    });
    let table = Array2::from(disc.chain(rim).collect::<Vec<[f64; 6]>>());
    let (places, directions) = table.view().split_at(ndarray::Axis(1), 3);
    let (points, normals) = (rows::<3>(places)?, rows::<3>(directions)?);

    for choice in [Normals::Ignore, Normals::Hint, Normals::Trust] {
        let options = Options { normals: choice, ..Options::default() };
        let mut tin = reconstruct_with_normals(&points, &normals, &options, &Watch::default())?;
        let (mesh, topology) = extract_surface(&mut tin)?;
        let oriented = tin.oriented(&points);
        let outward = oriented.iter().zip(&normals).filter(|(found, given)| {
            let along: f64 = found.normal.iter().zip(*given).map(|(a, b)| a * b).sum();
            along > 0.0
        });
        println!(
            "{choice:?}: volume {:.4} (π · 0.02 = {:.4}), {} component(s) of genus {}, {:.1} % of the points as given",
            mesh.enclosed_volume(),
            TAU * 0.01,
            topology.components,
            topology.genus,
            100.0 * outward.count() as f64 / points.len() as f64
        );
        tin.report.warnings.iter().chain(&tin.report.doubt).for_each(|sentence| println!("  warning: {sentence}"));
    }
    Ok(())
}
