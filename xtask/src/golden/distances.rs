//! Distances to the points against trimesh's kd-tree.

use std::path::Path;

use anyhow::{Context, Result};
use ndarray::{ArrayD, Slice};
use zeroset::eikonal_sweep::{Lattice, Method, Options, distance};
use zeroset_io::Points;

use super::Check;
use super::archive::Archive;

/// The fixtures with golden grids.
pub const NAMES: [&str; 3] = ["double_torus", "teapot", "bunny"];

/// A golden lattice with the distances on it.
pub struct Grid {
    pub origin: [f64; 3],
    pub spacing: f64,
    pub unsigned: ArrayD<f64>,
    /// Positive inside, as trimesh has it.
    pub signed: ArrayD<f64>,
}

impl Grid {
    pub fn read(root: &Path, name: &str) -> Result<Self> {
        let mut archive = Archive::open(&root.join(format!("fixtures/golden/distances_{name}.npz")))?;
        let origin: Vec<f64> = archive.list("origin")?;
        Ok(Self {
            origin: origin.try_into().ok().context("origin has three coordinates")?,
            spacing: archive.number("spacing")?,
            unsigned: archive.array::<f32>("unsigned")?.mapv(f64::from),
            signed: archive.array::<f32>("signed")?.mapv(f64::from),
        })
    }

    pub fn axes(&self) -> [Vec<f64>; 3] {
        std::array::from_fn(|axis| {
            (0..self.unsigned.shape()[axis]).map(|i| self.origin[axis] + i as f64 * self.spacing).collect()
        })
    }
}

pub fn points(root: &Path, name: &str) -> Result<Vec<[f64; 3]>> {
    match zeroset_io::read_points(root.join(format!("fixtures/points/{name}.ply")))? {
        Points::Three(set) => Ok(set.points),
        Points::Two(_) => anyhow::bail!("{name} has no third coordinate"),
    }
}

pub fn check(root: &Path) -> Result<Vec<Check>> {
    let mut checks = Vec::new();
    for name in NAMES {
        let grid = Grid::read(root, name)?;
        let points = points(root, name)?;
        // Every second node makes the lattice of twice the spacing.
        let coarse = grid.unsigned.slice_each_axis(|_| Slice::new(0, None, 2)).to_owned();
        let error = |every: usize, golden: &ArrayD<f64>, options: Options| -> Result<f64> {
            let spacing = grid.spacing * every as f64;
            let shape: [usize; 3] = std::array::from_fn(|axis| golden.shape()[axis]);
            let found = distance(&points, &Lattice::new(grid.origin, spacing, shape)?, &options)?.values;
            Ok((&found - golden).mapv(f64::abs).mean().unwrap_or(f64::NAN) / spacing)
        };
        let method = |method| Options { method, ..Options::default() };
        // The golden values are rounded to 2^-16 of the longest side, a five-hundredth of a cell.
        let exact = error(1, &grid.unsigned, method(Method::Exact))?;
        checks.push(Check::at_most(
            format!("{name}: exact distance, mean error in cells, against trimesh"),
            exact,
            1e-3,
        ));
        let closest = error(1, &grid.unsigned, method(Method::ClosestPoint))?;
        checks.push(Check::at_most(format!("{name}: closest-point sweeping, mean error in cells"), closest, 0.05));
        // Exact values within the same distance of the points on both lattices: with a radius of so many cells the error
        // of point sources is of the order h log(1/h) only.
        let godunov = |radius| Options { method: Method::Godunov, exact_radius: radius, ..Options::default() };
        let (rough, fine) = (error(2, &coarse, godunov(2))?, error(1, &grid.unsigned, godunov(4))?);
        checks.push(Check::at_most(format!("{name}: Godunov sweeping, mean error in cells"), rough, 0.5));
        let ratio = 2.0 * rough / fine;
        checks.push(Check::at_least(format!("{name}: Godunov's mean error falls by, when h halves"), ratio, 1.7));
    }
    Ok(checks)
}
