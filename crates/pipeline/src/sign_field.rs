//! The sign: f̂ near the points, winding numbers away from them, where f̂ may have far sheets.
//!
//! `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (4π ‖Pᵢ − X‖³)` in 3D, `Σ aᵢ nᵢ·(Pᵢ − X) / (2π ‖Pᵢ − X‖²)` in 2D, with outward normals and the
//! areas (lengths) that the points stand for, is 1 inside and 0 outside by Gauss' theorem. Near the points the sum is rough.

use ndarray::ArrayD;
use zeroset_bspline::{Derivatives, Spline};
use zeroset_gefm::area_vectors;
use zeroset_winding::{Options, Tree};

use crate::domain::{Domain, multi_index};
use crate::error::ReconstructError;
use crate::spacing::Spacing;

/// Beyond so many coarse cells from all points the winding number speaks, nearer f̂ does. Then the coarse nodes between
/// which it is interpolated are not on the surface themselves.
const FAR: f64 = 2.0;

/// What the sign is taken from, on the nodes of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct SignField {
    /// f̂ near the points, `½ − W` away from them, where fairness alone has shaped f̂; negative inside.
    pub value: ArrayD<f64>,
    /// `½ − W` everywhere.
    pub winding: ArrayD<f64>,
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
    let coarse = domain.nodes(0);
    let shape: [usize; D] = std::array::from_fn(|axis| coarse[axis].len());
    let count: usize = shape.iter().product();
    let nodes: Vec<[f64; D]> = (0..count)
        .map(|flat| {
            let index = multi_index(flat, &shape);
            std::array::from_fn(|axis| coarse[axis][index[axis]])
        })
        .collect();
    let options = Options { regularisation: spacing.typical, ..Options::default() };
    let coarse_winding = Tree::new(points, options)?.with_normals(&vectors)?.evaluate(&nodes)?;
    let far = FAR * domain.spacing;
    let winding = ArrayD::from_shape_fn(value.raw_dim(), |index| {
        0.5 - interpolate(&coarse_winding, &shape, std::array::from_fn(|axis| index[axis]), halvings)
    });
    for ((value, winding), distance) in value.iter_mut().zip(&winding).zip(distance) {
        if *distance > far {
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
            let (mut flat, mut weight) = (0, 1.0);
            for axis in 0..D {
                let upper = corner >> axis & 1;
                let t = (node[axis] - cell[axis] * steps) as f64 / steps as f64;
                flat = flat * shape[axis] + cell[axis] + upper;
                weight *= if upper == 1 { t } else { 1.0 - t };
            }
            weight * values[flat]
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_is_exact_for_linear_values() {
        let values: Vec<f64> = (0..4 * 3).map(|f| 2.0 * f64::from(f / 3) - f64::from(f % 3)).collect();
        // Halved twice, node (5, 8) is (1.25, 2): dyadic, so exact.
        assert_eq!(interpolate(&values, &[4, 3], [5, 8], 2), 2.5 - 2.0);
        assert_eq!(interpolate(&values, &[4, 3], [12, 3], 2), 6.0 - 0.75);
    }
}
