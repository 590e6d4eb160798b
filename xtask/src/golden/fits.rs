//! The eigenpair and the least-squares fit against dense linear algebra.

use std::path::Path;

use anyhow::Result;
use zeroset::bspline::{Collocation, DerivativeEnergy, KnotVector};
use zeroset::gefm::{EigenvectorOptions, NormalEquations, eigenvector_fit};
use zeroset::lsq_init::{Fairness, Options, fit};

use super::Check;
use super::archive::Archive;
use super::splines::relative;

pub fn check(golden: &Path) -> Result<Vec<Check>> {
    let mut archive = Archive::open(&golden.join("eigenpair.npz"))?;
    let flat: Vec<f64> = archive.list("points")?;
    let points: Vec<[f64; 2]> = flat.chunks(2).map(|p| [p[0], p[1]]).collect();
    let knots = KnotVector::new(3, archive.list("knots")?)?;
    let knots = [knots.clone(), knots];
    let collocation = Collocation::new(&knots, &points)?;
    let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots)?);
    let options = EigenvectorOptions { tolerance: 1e-12, most_iterations: 1, ..EigenvectorOptions::default() };
    let areas = vec![1.0; points.len()];
    let (mut f, _, report) = eigenvector_fit(&collocation, &equations, &areas, archive.number("weight")?, &options)?;
    let wanted: Vec<f64> = archive.list("coefficients")?;
    // Eigenvectors have no scale: both with a largest entry of 1, and the sign of the golden one.
    let peak = wanted.iter().position(|c| c.abs() == 1.0).unwrap_or(0);
    let scale = wanted[peak] / f[peak];
    f.iter_mut().for_each(|c| *c *= scale);
    let lambda = (report.iterations[0].lambda / archive.number("lambda")? - 1.0).abs();

    let mut archive = Archive::open(&golden.join("least_squares.npz"))?;
    let knots = [KnotVector::new(3, archive.list("knots_x")?)?, KnotVector::new(3, archive.list("knots_y")?)?];
    let fairness = Fairness::Weight(archive.number("weight")?);
    let options = Options { fairness, tolerance: 1e-13, ..Options::default() };
    let (spline, _) =
        fit(archive.array("values")?.view(), &[archive.list("x")?, archive.list("y")?], &knots, &options)?;
    let coefficients: Vec<f64> = archive.list("coefficients")?;
    Ok(vec![
        // Lanczos to 1e-12 in the energy norm: its square in λ, the gap (0.43) in the vector, and the dense solver's own
        // rounding times the condition of A.
        Check::at_most("eigenvalue λ of (10) against SciPy's dense eigh", lambda, 1e-9),
        Check::at_most("eigenvector of (10) against SciPy's dense eigh", relative(&f, wanted.iter().copied()), 1e-7),
        // Residual 1e-13 times the condition of the normal equations, about 1e4.
        Check::at_most(
            "coefficients of (15) against dense normal equations",
            relative(spline.as_flat(), coefficients.iter().copied()),
            1e-9,
        ),
    ])
}
