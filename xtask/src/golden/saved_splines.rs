//! SciPy evaluates what the program saves, and agrees with `zeroset eval`.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use anyhow::{Result, anyhow};
use ndarray::Array2;
use zeroset::bspline::{CellBand, IndexSet, KnotVector};
use zeroset_io::{Points, SplineFile, SplineLevel};

use super::run;

/// Checks splines of curves and a surface, at map coordinates too: as they are saved, and with levels.
pub fn check(root: &Path, python: &Path) -> Result<()> {
    std::fs::create_dir_all(root.join("target/golden-npz"))?;
    for (name, offset) in [("annulus_offset.xy", 0.0), ("annulus_offset.xy", 5e6), ("double_torus.ply", 0.0)] {
        println!("{name} at {offset:e}, saved and evaluated by SciPy:");
        match zeroset_io::read_points(root.join("fixtures/points").join(name))? {
            Points::Two(set) => {
                check_one(root, python, &set.points.iter().map(|p| p.map(|x| x + offset)).collect::<Vec<_>>())?
            }
            Points::Three(set) => {
                check_one(root, python, &set.points.iter().map(|p| p.map(|x| x + offset)).collect::<Vec<_>>())?
            }
        }
    }
    Ok(())
}

fn check_one<const D: usize>(root: &Path, python: &Path, points: &[[f64; D]]) -> Result<()> {
    let folder = root.join("target/golden-npz");
    let [text, queries, spline, values] =
        ["points.txt", "queries.npy", "spline.npz", "values.npy"].map(|name| folder.join(name));
    let line = |point: &[f64; D]| point.map(|x| x.to_string()).join(" ") + "\n";
    std::fs::write(&text, points.iter().map(line).collect::<String>())?;
    // Near the points, where the levels are, and inside, where they end.
    let middle: [f64; D] =
        std::array::from_fn(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64);
    let moved =
        |scale: f64| points.iter().flat_map(move |p| (0..D).map(move |a| middle[a] + scale * (p[a] - middle[a])));
    let rows = Array2::from_shape_vec((2 * points.len(), D), moved(1.0).chain(moved(0.93)).collect())?;
    ndarray_npy::write_npy(&queries, &rows)?;
    let zeroset = || {
        let mut command = Command::new("cargo");
        command.args(["run", "--quiet", "--release", "-p", "zeroset-cli", "--", "--quiet"]).current_dir(root);
        command
    };
    let agree = || {
        run(zeroset().arg("eval").arg(&spline).arg(&queries).arg("-o").arg(&values))?;
        run(Command::new(python).arg("-B").arg(root.join("fixtures/check_npz.py")).args([&spline, &queries, &values]))
    };
    run(zeroset().args(["reconstruct", "--resolution", "32"]).arg(&text).arg("-o").arg(&spline))?;
    agree()?;
    zeroset_io::write_spline(&spline, &with_levels(zeroset_io::read_spline(&spline)?, points)?)?;
    agree()
}

/// The same spline with one level around all points and another around every third, of coefficients that look random.
fn with_levels<const D: usize>(file: SplineFile, points: &[[f64; D]]) -> Result<SplineFile> {
    let mut knots = Vec::with_capacity(D);
    for axis in &file.knots {
        knots.push(KnotVector::new(file.degree, axis.clone())?);
    }
    let knots: [KnotVector; D] = knots.try_into().map_err(|_| anyhow!("not a function of {D} variables"))?;
    let points: Vec<[f64; D]> =
        points.iter().map(|p| std::array::from_fn(|axis| p[axis] - file.origin[axis])).collect();
    let wanted: Vec<u8> = (0..points.len()).map(|i| if i % 3 == 0 { 2 } else { 1 }).collect();
    let band = CellBand::new(&knots, &points, &wanted, [3, 3])?;
    let size = file.coefficients.iter().fold(0.0, |size: f64, c| size.max(c.abs()));
    let level = |active: &Arc<IndexSet<D>>| -> Result<SplineLevel> {
        let index = active.iter().flatten().map(|k| k as i32).collect();
        // The golden ratio's sequence.
        let coefficients =
            (1..=active.len()).map(|i| size * (2.0 * (i as f64 * 0.618_033_988_749_895).fract() - 1.0)).collect();
        Ok(SplineLevel { index: Array2::from_shape_vec((active.len(), D), index)?, coefficients })
    };
    let levels = band.active().iter().map(level).collect::<Result<_>>()?;
    Ok(file.with_levels(levels)?)
}
