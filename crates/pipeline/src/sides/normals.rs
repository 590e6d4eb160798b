//! Normals that a function has at points.

use zeroset_bspline::{Derivatives, Implicit};

/// Unit normals of a function at points, zero where its gradient is not above this share of its mean.
pub fn normals<const D: usize>(f: &impl Implicit<D>, points: &[[f64; D]], share: f64) -> Vec<[f64; D]> {
    let gradients = f.evaluate(points, Derivatives::Gradient).gradients;
    let lengths: Vec<f64> = gradients.iter().map(|g| g.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    let least = share * lengths.iter().sum::<f64>() / lengths.len() as f64;
    let unit = |(g, length): (&[f64; D], &f64)| if *length > least { g.map(|x| x / length) } else { [0.0; D] };
    gradients.iter().zip(&lengths).map(unit).collect()
}
