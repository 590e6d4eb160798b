//! Spline values and energies against SciPy.

use std::path::Path;

use anyhow::Result;
use ndarray::ArrayD;
use zeroset::bspline::{DerivativeEnergy, Derivatives, Spline};

use super::Check;
use super::archive::Archive;

pub fn check(golden: &Path) -> Result<Vec<Check>> {
    let mut checks = values::<2>(golden, "splines_2d.npz")?;
    checks.extend(values::<3>(golden, "splines_3d.npz")?);
    checks.extend(energies(golden)?);
    Ok(checks)
}

fn values<const D: usize>(golden: &Path, file: &str) -> Result<Vec<Check>> {
    let mut archive = Archive::open(&golden.join(file))?;
    let cases = archive.list::<i64>("cases")?[0] as usize;
    let mut worst = [0.0f64; 3];
    for k in 0..cases {
        let spline = Spline::<D>::new(archive.knots(k)?, archive.array(&format!("{k}_coefficients"))?)?;
        let flat: Vec<f64> = archive.list(&format!("{k}_points"))?;
        let points: Vec<[f64; D]> = flat.chunks(D).map(|p| std::array::from_fn(|axis| p[axis])).collect();
        let found = spline.evaluate(&points, Derivatives::Hessian);
        let lists = [
            found.values,
            found.gradients.into_iter().flatten().collect(),
            found.hessians.into_iter().flatten().flatten().collect(),
        ];
        for (kind, found) in lists.iter().enumerate() {
            let golden: ArrayD<f64> = archive.array(&format!("{k}_{}", ["values", "gradients", "hessians"][kind]))?;
            worst[kind] = worst[kind].max(relative(found, golden.iter().copied()));
        }
    }
    let name = |what: &str| format!("{D}D splines: {what}, {cases} cases of degree 1 to 5, against SciPy NdBSpline");
    // Different orders of the same sums: rounding, at the size of the largest value of the case.
    Ok((0..3).map(|k| Check::at_most(name(["values", "gradients", "Hessians"][k]), worst[k], 1e-10)).collect())
}

/// Largest difference relative to the largest value.
pub fn relative(found: &[f64], golden: impl Iterator<Item = f64> + Clone) -> f64 {
    let size = golden.clone().map(f64::abs).fold(f64::MIN_POSITIVE, f64::max);
    let worst = found.iter().zip(golden.clone()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    if found.len() == golden.count() { worst / size } else { f64::NAN }
}

fn energies(golden: &Path) -> Result<Vec<Check>> {
    let mut archive = Archive::open(&golden.join("thin_plate.npz"))?;
    let cases = archive.list::<i64>("cases")?[0] as usize;
    let mut worst = 0.0f64;
    for k in 0..cases {
        let energy = if archive.list::<i64>(&format!("{k}_degree"))?.len() == 2 {
            thin_plate::<2>(&mut archive, k)?
        } else {
            thin_plate::<3>(&mut archive, k)?
        };
        let golden = archive.number(&format!("{k}_energy"))?;
        worst = worst.max((energy / golden - 1.0).abs());
    }
    let knots: [_; 2] = archive.knots_named("matrix")?;
    let energy = DerivativeEnergy::thin_plate(&knots)?;
    let (rows, columns) = (energy.shape()[0], energy.shape()[1]);
    let index = |flat: usize| [flat / columns, flat % columns];
    let size = rows * columns;
    let entries: Vec<f64> = (0..size * size).map(|k| energy.entry(index(k / size), index(k % size))).collect();
    let matrix: Vec<f64> = archive.list("matrix_energy")?;
    let matrix = relative(&entries, matrix.iter().copied());
    let name = format!("thin-plate energy, {cases} cases of degree 2 to 5, against SciPy quadrature");
    // Both integrate exactly: rounding of sums that partly cancel.
    Ok(vec![
        Check::at_most(name, worst, 1e-10),
        Check::at_most(format!("thin-plate matrix H, {size} × {size}, against SciPy quadrature"), matrix, 1e-10),
    ])
}

fn thin_plate<const D: usize>(archive: &mut Archive, k: usize) -> Result<f64> {
    let energy = DerivativeEnergy::<D>::thin_plate(&archive.knots(k)?)?;
    Ok(energy.energy(&archive.list(&format!("{k}_coefficients"))?))
}
