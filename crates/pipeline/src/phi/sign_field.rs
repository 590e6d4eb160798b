//! The sign: f̂ near the points, winding numbers away from them, where fairness alone has shaped f̂.
//!
//! `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (4π ‖Pᵢ − X‖³)` in 3D, `Σ aᵢ nᵢ·(Pᵢ − X) / (2π ‖Pᵢ − X‖²)` in 2D, with outward normals and the
//! areas (lengths) that the points stand for, is 1 inside and 0 outside by Gauss' theorem. Near the points the sum is rough.

use ndarray::ArrayD;
use rayon::prelude::*;
use zeroset_bspline::{Derivatives, Spline};
use zeroset_gefm::area_vectors;
use zeroset_winding::{Options, Tree};

use crate::error::ReconstructError;
use crate::lattice::domain::{Domain, Nodes, flat_index, multi_index};
use crate::points::spacing::Spacing;

/// Beyond so many coarse cells from all points the winding number speaks alone. Then the coarse nodes between which it is
/// interpolated are not on the surface themselves.
const FAR: f64 = 2.0;
/// Nearer, but beyond so many spacings (or a cell, if that is larger), it speaks where it is so far from ½: what f̂ makes around
/// single points off the surface, or beside the tip of a thin part, has W of 0 or 1 all around. Where it is not clear, in
/// holes of the data, f̂ is the smoother one.
const NEAR: f64 = 1.5;
const CLEAR: f64 = 0.3;

/// Of W, of which only signs and clear cases matter here.
const TOLERANCE: f64 = 1e-2;
/// Fewer nodes are not worth a task.
const FEW: usize = 4096;

/// What the sign is taken from, on the nodes of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct SignField {
    /// f̂ near the points, `½ − W` away from them; negative inside.
    pub value: ArrayD<f64>,
    /// `½ − W` everywhere, interpolated between coarse nodes.
    pub winding: ArrayD<f64>,
}

impl SignField {
    /// f̂ alone, everywhere, on the nodes of the lattice after `halvings`: where points are so few and uneven that winding numbers tell less.
    pub fn of<const D: usize>(f_hat: &Spline<D>, domain: &Domain<D>, halvings: u32) -> Self {
        let value = f_hat.sample(&domain.nodes(halvings), [0; D]);
        Self { winding: value.clone(), value }
    }
}

/// The field on the nodes of the lattice after `halvings`; `distance` is d on the same nodes. W is divided by
/// `calibration`, which the referee found: points along curves on the surface hide most of it from W.
///
/// # Errors
/// If the points or the gradients of f̂ are not finite.
pub fn sign_field<const D: usize>(
    f_hat: &Spline<D>,
    points: &[[f64; D]],
    spacing: &Spacing,
    domain: &Domain<D>,
    halvings: u32,
    distance: &ArrayD<f64>,
    calibration: f64,
) -> Result<SignField, ReconstructError> {
    let mut value = f_hat.sample(&domain.nodes(halvings), [0; D]);
    let gradients = f_hat.evaluate(points, Derivatives::Gradient).gradients;
    let area = 1.0 / (calibration * spacing.density);
    let areas: Vec<f64> = spacing.areas.iter().map(|share| area * share).collect();
    let vectors = area_vectors(&gradients, &areas);
    let options = Options { regularisation: spacing.typical, tolerance: TOLERANCE };
    let tree = Tree::new(points, options)?;
    let number = tree.with_normals(&vectors)?;
    let coarse = Nodes::new(domain, 0);
    let coarse_winding = number.evaluate(&coarse.places())?;
    let shape = coarse.shape;
    let fine = Nodes::new(domain, halvings);
    let (near, far) = ((NEAR * spacing.typical).max(domain.spacing(halvings)), FAR * domain.spacing);
    let between: Vec<usize> =
        fine.all().zip(distance).filter(|(_, d)| (near..far).contains(*d)).map(|(i, _)| i).collect();
    let found = number.evaluate(&between.iter().map(|flat| fine.at(*flat)).collect::<Vec<_>>())?;
    if let Some(values) = value.as_slice_mut() {
        for (flat, w) in between.into_iter().zip(found) {
            if (w - 0.5).abs() > CLEAR && (values[flat] < 0.0) != (w > 0.5) {
                values[flat] = 0.5 - w;
            }
        }
    }
    let mut winding = ArrayD::zeros(value.raw_dim());
    if let Some(values) = winding.as_slice_mut() {
        values.par_iter_mut().with_min_len(FEW).enumerate().for_each(|(flat, value)| {
            *value = 0.5 - interpolate(&coarse_winding, &shape, multi_index(flat, &fine.shape), halvings);
        });
    }
    for ((value, winding), distance) in value.iter_mut().zip(&winding).zip(distance) {
        if *distance >= far {
            *value = *winding;
        }
    }
    Ok(SignField { value, winding })
}

/// Multilinear interpolation of coarse nodes at a node of the lattice after `halvings`.
fn interpolate<const D: usize>(values: &[f64], shape: &[usize; D], node: [usize; D], halvings: u32) -> f64 {
    let steps = 1usize << halvings;
    let cell: [usize; D] = std::array::from_fn(|axis| (node[axis] / steps).min(shape[axis] - 2));
    (0..1usize << D)
        .map(|corner| {
            let upper: [usize; D] = std::array::from_fn(|axis| corner >> axis & 1);
            let weight: f64 = (0..D)
                .map(|axis| {
                    let t = (node[axis] - cell[axis] * steps) as f64 / steps as f64;
                    if upper[axis] == 1 { t } else { 1.0 - t }
                })
                .product();
            weight * values[flat_index(&std::array::from_fn(|axis| cell[axis] + upper[axis]), shape)]
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::tests::spline;

    #[test]
    fn a_bubble_of_f_hat_that_no_winding_number_confirms_goes() {
        let points: Vec<[f64; 2]> = (0..200)
            .map(|i| (f64::from(i) / 200.0 * std::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [0.5 * c, 0.5 * s])
            .collect();
        let domain = Domain::around(&[1.0, 1.0], 12);
        // A circle with a bubble beside it, nearer than two coarse cells.
        let circle = |x: [f64; 2]| x[0].hypot(x[1]) - 0.5;
        let bubble = |x: [f64; 2]| (x[0] - 0.6).hypot(x[1]) - 0.05;
        let f_hat = spline(&domain, 2, |x| circle(x).min(bubble(x)));
        let nodes = Nodes::new(&domain, 2);
        let exact = |i: usize| circle(nodes.at(i));
        let distance = nodes.all().map(|i| exact(i).abs()).collect();
        let distance = ArrayD::from_shape_vec(nodes.shape.to_vec(), distance).unwrap();
        let field = sign_field(&f_hat, &points, &Spacing::of(&points), &domain, 2, &distance, 1.0).unwrap();
        let wrong = |value: &ArrayD<f64>| {
            value.iter().enumerate().filter(|(i, v)| (**v < 0.0) != (exact(*i) < 0.0) && exact(*i).abs() > 0.01).count()
        };
        assert!(wrong(&f_hat.sample(&domain.nodes(2), [0; 2])) > 10);
        assert_eq!(wrong(&field.value), 0);
    }

    #[test]
    fn interpolation_is_exact_for_linear_values() {
        let values: Vec<f64> = (0..4 * 3).map(|f| 2.0 * f64::from(f / 3) - f64::from(f % 3)).collect();
        // Halved twice, node (5, 8) is (1.25, 2): dyadic, so exact.
        assert_eq!(interpolate(&values, &[4, 3], [5, 8], 2), 2.5 - 2.0);
        assert_eq!(interpolate(&values, &[4, 3], [12, 3], 2), 6.0 - 0.75);
    }
}
