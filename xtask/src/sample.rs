//! Random points of a triangle mesh: inputs of known shape, of any size.

mod lines;
mod surface;
#[cfg(test)]
mod tests;
mod triangles;
mod voxels;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;

use surface::Surface;
pub(crate) use zeroset_tests::Random;

/// More points than this would need gigabytes.
const MOST_POINTS: usize = 100_000_000;

/// What `sample` is told.
#[derive(Args)]
pub struct Arguments {
    /// The mesh: .ply, or .npz with the arrays verts (or vertices), n × 3, and faces, m × 3
    mesh: PathBuf,
    /// Number of points, 1 to 100 000 000
    #[arg(long, value_name = "N")]
    points: usize,
    /// The same seed gives the same points
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Standard deviation of Gaussian noise along the triangles' normals, in the mesh's unit
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0, allow_negative_numbers = true)]
    noise: f64,
    /// Number of points besides, strewn over the mesh's bounding box, a fifth larger
    #[arg(long, value_name = "N", default_value_t = 0)]
    strays: usize,
    /// Points in lines, on planes at right angles to a random direction, so many times farther from each other than the points in them
    #[arg(long, value_name = "RATIO", conflicts_with = "noise")]
    lines: Option<f64>,
    /// The centres of the voxels that the mesh passes through, of a size that makes about --points of them
    #[arg(long, conflicts_with_all = ["noise", "lines"])]
    voxels: bool,
    /// Where to write the points (.ply)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Samples and writes.
pub fn run(arguments: &Arguments) -> Result<()> {
    let &Arguments { points: count, seed, noise, strays, .. } = arguments;
    if !(1..=MOST_POINTS).contains(&count) {
        bail!("--points {count}: it must be between 1 and {MOST_POINTS}");
    }
    if !(noise.is_finite() && noise >= 0.0) {
        bail!("--noise {noise}: a length of zero or more is needed");
    }
    if arguments.lines.is_some_and(|ratio| !(ratio.is_finite() && ratio >= 1.0)) {
        bail!("--lines: a ratio of one or more is needed");
    }
    if strays > MOST_POINTS {
        bail!("--strays {strays}: it must be {MOST_POINTS} at most");
    }
    let (mesh, output) = (&arguments.mesh, &arguments.output);
    let surface = triangles::read(mesh).and_then(Surface::new).with_context(|| mesh.display().to_string())?;
    let mut random = Random(seed);
    let mut points: Vec<[f64; 3]> = match arguments.lines {
        Some(ratio) => lines::points(&surface, count, ratio, &mut random),
        None if arguments.voxels => voxels::points(&surface, count, &mut random),
        None => (0..count).map(|_| surface.point(&mut random, noise)).collect(),
    };
    points.extend(surface.strays(strays, &mut random));
    zeroset_io::write_points(output, &points)?;
    let triangles = surface.triangles().len();
    eprintln!(
        "wrote {}: {} points of {triangles} triangles of area {:.6}",
        output.display(),
        points.len(),
        surface.area()
    );
    Ok(())
}
