//! The scale of f, and how good a signed distance it then is.
//!
//! The Sampson distance of a point does not change when f is multiplied, so that the fit leaves f's scale to fairness, for which
//! smaller is fairer: its gradient at the points becomes a few percent shorter than its slope a little way off. The scale is
//! therefore taken from the distance, which is known away from the points.

use ndarray::ArrayD;
use serde::Serialize;
use zeroset_bspline::{Derivatives, HierarchicalSpline, HierarchyError};

use crate::lattice::domain::{Domain, Nodes};

/// Nodes nearer to the points than so many spacings are not looked at: there the distance from the points is not that from the
/// surface between them.
const CLEAR: f64 = 2.0;
/// Fewer nodes say nothing.
const ENOUGH: usize = 64;
/// Every node is looked at up to about so many, then only some.
const MANY: usize = 1 << 15;

/// Slopes are looked at on the normals of the points, so many spacings from them.
const ASIDE: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// How far the function is its own signed distance.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct DistanceFigures {
    /// Mean of ‖∇f‖ within two spacings of the points.
    pub slope: f64,
    /// Mean of |‖∇f‖ − 1| there.
    pub slope_error: f64,
    /// Nodes of the dense lattice, farther than two spacings from all points, on which |f| was compared with the distance from them.
    pub nodes: usize,
    /// Mean of the difference, in cells of the dense lattice.
    pub error: f64,
    /// The largest.
    pub largest_error: f64,
}

/// |f| and the distance from the surface on nodes away from the points. `distance` is that from the points, on the nodes of the lattice after
/// `halvings`; `spacing` is theirs.
fn compared<const D: usize>(
    spline: &HierarchicalSpline<D>,
    domain: &Domain<D>,
    halvings: u32,
    distance: &ArrayD<f64>,
    spacing: f64,
) -> Vec<[f64; 2]> {
    let nodes = Nodes::new(domain, halvings);
    let far: Vec<(usize, f64)> = distance.iter().copied().enumerate().filter(|(_, d)| *d >= CLEAR * spacing).collect();
    let step = far.len().div_ceil(MANY).max(1);
    let pair = |&(flat, d): &(usize, f64)| [spline.value(&nodes.at(flat)).abs(), from_surface::<D>(d, spacing)];
    far.iter().step_by(step).map(pair).collect()
}

/// f, multiplied so that away from the points `|f|` is the distance from the surface in the median. `distance` is that from the points, on
/// the nodes of the lattice after `halvings`; `spacing` is theirs. Where the points leave too little room f stays as it is.
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
    let compared = compared(&spline, domain, halvings, distance, spacing);
    let mut ratios: Vec<f64> =
        compared.iter().map(|[value, d]| value / d).filter(|ratio| ratio.is_finite() && *ratio > 0.0).collect();
    if ratios.len() < ENOUGH {
        return Ok(spline);
    }
    ratios.sort_by(f64::total_cmp);
    spline.scaled(1.0 / ratios[ratios.len() / 2])
}

/// How much f differs from its own distance.
pub fn distance_figures<const D: usize>(
    spline: &HierarchicalSpline<D>,
    domain: &Domain<D>,
    halvings: u32,
    distance: &ArrayD<f64>,
    (points, spacing): (&[[f64; D]], f64),
) -> DistanceFigures {
    let compared = compared(spline, domain, halvings, distance, spacing);
    let cell = domain.spacing(halvings);
    let errors = compared.iter().map(|[value, d]| (value - d).abs() / cell);
    let [slope, slope_error] = slopes(spline, points, spacing);
    DistanceFigures {
        slope,
        slope_error,
        nodes: compared.len(),
        error: errors.clone().sum::<f64>() / compared.len().max(1) as f64,
        largest_error: errors.fold(0.0, f64::max),
    }
}

/// Means of ‖∇f‖, and of its difference from 1, near the points.
fn slopes<const D: usize>(spline: &HierarchicalSpline<D>, points: &[[f64; D]], spacing: f64) -> [f64; 2] {
    let length = |g: &[f64; D]| g.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at_points = spline.evaluate(points, Derivatives::Gradient).gradients;
    let aside = |(point, gradient): (&[f64; D], &[f64; D])| {
        let (point, gradient, unit) = (*point, *gradient, spacing / length(gradient));
        ASIDE.map(|steps| std::array::from_fn(|axis| point[axis] + steps * unit * gradient[axis]))
    };
    // Where the gradient vanishes there is no normal, and beyond the box no function.
    let places: Vec<[f64; D]> = points.iter().zip(&at_points).flat_map(aside).collect();
    let gradients = spline.evaluate(&places, Derivatives::Gradient).gradients;
    let lengths: Vec<f64> = gradients.iter().map(length).filter(|length| length.is_finite()).collect();
    let mean = |of: &dyn Fn(f64) -> f64| lengths.iter().map(|x| of(*x)).sum::<f64>() / lengths.len().max(1) as f64;
    [mean(&|x| x), mean(&|x| (x - 1.0).abs())]
}

/// The distance from a plane (a line in 2D) whose samples are a distance d away: beside the foot of the perpendicular the nearest of
/// random samples lies at a mean square of s²/π on a surface, s²/2 on a curve, s being the side of the square, or the length, that each has
/// to itself.
pub(crate) fn from_surface<const D: usize>(d: f64, spacing: f64) -> f64 {
    let beside = if D == 2 { 0.5 } else { std::f64::consts::FRAC_1_PI } * spacing * spacing;
    (d * d - beside).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::domain::tests::spline;

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
        let points = [[0.0, 0.1, 0.2], [0.0, -0.3, 0.0]];
        let figures_of = |f, spacing| distance_figures(f, &domain, 1, &distance, (&points, spacing));
        let found = calibrated(plane.clone(), &domain, 1, &distance, spacing).unwrap();
        let figures = figures_of(&found, spacing);
        assert!((found.value(&[0.25, 0.1, 0.0]) - 0.25).abs() < 1e-12, "{}", found.value(&[0.25, 0.1, 0.0]));
        assert!(figures.nodes > 64 && figures.largest_error < 1e-12, "rounding: {figures:?}");
        assert!((figures.slope - 1.0).abs() < 1e-12 && figures.slope_error < 1e-12, "rounding: {figures:?}");
        // Points everywhere leave nothing to measure on.
        let same = calibrated(plane.clone(), &domain, 1, &distance, 1.0).unwrap();
        let figures = figures_of(&same, 1.0);
        assert_eq!((same, figures.nodes), (plane, 0));
        assert!((figures.slope - 1.3).abs() < 1e-12 && (figures.slope_error - 0.3).abs() < 1e-12, "{figures:?}");
    }
}
