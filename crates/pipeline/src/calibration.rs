//! The scale of f.
//!
//! The Sampson distance of a point does not change when f is multiplied, so that the fit leaves f's scale to fairness, for which
//! smaller is fairer: its gradient at the points becomes a few percent shorter than its slope a little way off. The scale is
//! therefore taken from the distance, which is known away from the points.

use ndarray::ArrayD;
use zeroset_bspline::{HierarchicalSpline, HierarchyError};

use crate::domain::{Domain, multi_index};

/// Nodes nearer to the points than so many spacings are not looked at: there the distance from the points is not that from the
/// surface between them.
const CLEAR: f64 = 2.0;
/// Fewer nodes say nothing.
const ENOUGH: usize = 64;
/// Every node is looked at up to about so many, then only some.
const MANY: usize = 1 << 15;

/// f, multiplied so that away from the points `|f|` is the distance from the surface in the median. `distance` is that from the
/// points, on the nodes of the lattice after `halvings`; `spacing` is theirs. Where the points leave too little room f stays as it is.
///
/// # Errors
/// None in practice: the factor is finite and positive.
pub fn calibrated<const D: usize>(
    spline: HierarchicalSpline<D>,
    domain: &Domain<D>,
    halvings: u32,
    distance: &ArrayD<f64>,
    spacing: f64,
) -> Result<HierarchicalSpline<D>, HierarchyError> {
    let nodes = domain.nodes(halvings);
    let shape = nodes.each_ref().map(Vec::len);
    let far: Vec<(usize, f64)> = distance.iter().copied().enumerate().filter(|(_, d)| *d >= CLEAR * spacing).collect();
    let step = far.len().div_ceil(MANY).max(1);
    let mut slopes: Vec<f64> = far
        .iter()
        .step_by(step)
        .map(|&(flat, d)| {
            let index = multi_index(flat, &shape);
            let x = std::array::from_fn(|axis| nodes[axis][index[axis]]);
            spline.value(&x).abs() / from_surface::<D>(d, spacing)
        })
        .filter(|slope| slope.is_finite() && *slope > 0.0)
        .collect();
    if slopes.len() < ENOUGH {
        return Ok(spline);
    }
    slopes.sort_by(f64::total_cmp);
    spline.scaled(1.0 / slopes[slopes.len() / 2])
}

/// The distance from a plane (a line in 2D) whose samples are a distance d away: beside the foot of the perpendicular the nearest of
/// random samples lies at a mean square of s²/π on a surface, s²/2 on a curve, s being the side of the square, or the length, that each has
/// to itself.
fn from_surface<const D: usize>(d: f64, spacing: f64) -> f64 {
    let beside = if D == 2 { 0.5 } else { std::f64::consts::FRAC_1_PI } * spacing * spacing;
    (d * d - beside).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::tests::spline;

    #[test]
    fn a_multiple_of_the_distance_becomes_the_distance() {
        let domain = Domain::<3>::around(&[1.0, 1.0, 1.0], 8);
        let plane = HierarchicalSpline::new(spline(&domain, 1, |[x, _, _]| 1.3 * x)).unwrap();
        let nodes = domain.nodes(1);
        let shape = nodes.each_ref().map(Vec::len);
        let spacing = 0.05;
        // As far as the nearest of random samples of the plane x = 0 is in the mean of squares.
        let distance = ArrayD::from_shape_fn(shape.to_vec(), |i| {
            (nodes[0][i[0]].powi(2) + spacing * spacing / std::f64::consts::PI).sqrt()
        });
        let found = calibrated(plane.clone(), &domain, 1, &distance, spacing).unwrap();
        assert!((found.value(&[0.25, 0.1, 0.0]) - 0.25).abs() < 1e-12, "{}", found.value(&[0.25, 0.1, 0.0]));
        // Points everywhere leave nothing to measure on.
        assert_eq!(calibrated(plane.clone(), &domain, 1, &distance, 1.0).unwrap(), plane);
    }
}
