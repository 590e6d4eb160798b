//! The sign of reconstructed functions against trimesh's signed distance to the true shape.

use std::path::Path;

use anyhow::Result;
use zeroset::{Options, reconstruct};

use super::Check;
use super::distances::{Grid, NAMES, points};

pub fn check(root: &Path) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for name in NAMES {
        let grid = Grid::read(root, name)?;
        // The initial shape is what sign synthesis makes; refinement would only hide its faults.
        let options = Options { refine: false, ..Options::default() };
        let result = reconstruct(&points(root, name)?, &options)?;
        let axes = grid.axes();
        let frame: [Vec<f64>; 3] = std::array::from_fn(|axis| {
            axes[axis].iter().map(|x| (x - result.frame.origin[axis]) * result.frame.scale).collect()
        });
        let f = result.spline.sample(&frame, [0; 3]);
        let (mut agree, mut counted) = (0usize, 0usize);
        for (f, golden) in f.iter().zip(&grid.signed) {
            // Farther than one cell from the surface, and inside the function's box.
            if golden.abs() > grid.spacing && !f.is_nan() {
                counted += 1;
                // Ours is negative inside, trimesh's positive.
                agree += usize::from((*f < 0.0) == (*golden > 0.0));
            }
        }
        let share = agree as f64 / counted as f64;
        checks.push(Check::at_least(
            format!("{name}: sign of the initial shape against trimesh, {counted} nodes"),
            share,
            0.995,
        ));
    }
    Ok(checks)
}
