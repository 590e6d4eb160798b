//! How sure the sides are: what winding numbers say of them, place by place and region by region.
//!
//! Beside a flat sheet of points the winding number with regularisation ε is `½ − ½ d / √(d² + ε²)` at a signed distance `d` from
//! it: ½ on the sheet, 1 far inside, 0 far outside. What W differs by from that, with the distance from the nearest point and the
//! sign of f, is how far the points contradict f, or leave open what it is.

use ndarray::ArrayD;
use serde::Serialize;
use zeroset_bspline::Derivatives;
use zeroset_gefm::area_vectors;
use zeroset_winding::{Options, Tree};

use crate::error::ReconstructError;
use crate::lattice::domain::{Nodes, flat_index};
use crate::points::frame::Frame;
use crate::points::spacing::distances_to;
use crate::reconstruct::Reconstruction;

/// Up to this difference of W there is no doubt: its mean is 0.05 to 0.2 for right sides.
const USUAL: f64 = 0.2;
/// From this difference on a side is unsure: W is nearer to what it would be a full sheet away.
const UNSURE: f64 = 0.4;
/// Regions are boxes of this share of the points' longest side.
const REGION: f64 = 1.0 / 8.0;

/// Whether a point with this W could as well be on the other side.
pub(crate) fn is_unsure(winding: f64) -> bool {
    (winding - 0.5).abs() > UNSURE
}

/// What a difference of winding numbers leaves: 1 for no doubt, 0 for an unsure side.
fn confidence(difference: f64) -> f64 {
    ((UNSURE - difference.abs()) / (UNSURE - USUAL)).clamp(0.0, 1.0)
}

/// How sure the sides of the points in a part of space are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionReport {
    /// Mean of its points, data coordinates.
    pub centre: Vec<f64>,
    /// Points in it.
    pub points: usize,
    /// Their mean confidence, from 0 to 1.
    pub confidence: f64,
    /// Share of them whose side is unsure.
    pub unsure: f64,
}

/// The boxes of an eighth of the longest side that have points, the least sure first; `winding` is W at every point.
pub(crate) fn regions<const D: usize>(points: &[[f64; D]], winding: &[f64], frame: &Frame<D>) -> Vec<RegionReport> {
    let side = REGION * frame.sides.iter().copied().fold(0.0, f64::max);
    let box_of = |point: &[f64; D]| point.map(|x| (x / side).floor() as i64);
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|i| box_of(&points[*i]));
    let mut regions: Vec<RegionReport> = order
        .chunk_by(|a, b| box_of(&points[*a]) == box_of(&points[*b]))
        .map(|members| {
            let count = members.len() as f64;
            let mean = |of: &dyn Fn(usize) -> f64| members.iter().map(|i| of(*i)).sum::<f64>() / count;
            let centre = std::array::from_fn(|axis| mean(&|i| points[i][axis]));
            RegionReport {
                centre: frame.to_data(&centre).to_vec(),
                points: members.len(),
                confidence: mean(&|i| confidence(winding[i] - 0.5)),
                unsure: mean(&|i| f64::from(u8::from(is_unsure(winding[i])))),
            }
        })
        .collect();
    regions.sort_by(|a, b| a.confidence.total_cmp(&b.confidence));
    regions
}

impl<const D: usize> Reconstruction<D> {
    /// How sure the side of each place (`N × D`, data coordinates) is, from 0 to 1: 1 where the winding number of the fitted
    /// points, with the function's normals, agrees with the function's value, 0 where it is nearer to that of the other side. What
    /// closes a hole is less sure the farther it is from points. With [`Options::open`](crate::Options::open) there is no inside, and
    /// the confidence says little.
    ///
    /// # Errors
    /// Places that are not finite.
    pub fn confidence(&self, places: &[[f64; D]]) -> Result<Vec<f64>, ReconstructError> {
        self.confidence_in_frame(&places.iter().map(|place| self.frame.to_frame(place)).collect::<Vec<_>>())
    }

    /// As [`Reconstruction::confidence`], on the nodes of the final dense lattice: axis order x, y\[, z\].
    ///
    /// # Errors
    /// None that is known: nodes are finite.
    pub fn confidence_field(&self) -> Result<ArrayD<f64>, ReconstructError> {
        let nodes = Nodes::new(&self.domain, self.halvings);
        let values = self.confidence_in_frame(&nodes.places())?;
        Ok(ArrayD::from_shape_fn(&nodes.shape[..], |index| {
            values[flat_index(&std::array::from_fn(|axis| index[axis]), &nodes.shape)]
        }))
    }

    /// As [`Reconstruction::confidence`], for places in the frame.
    pub(crate) fn confidence_in_frame(&self, places: &[[f64; D]]) -> Result<Vec<f64>, ReconstructError> {
        let fitted = self.fitted();
        let spacing = &self.spacing;
        let gradients = self.evaluate_for_normals(&fitted).gradients;
        let area = 1.0 / (self.report.trust.judgement.calibration * spacing.density);
        let areas: Vec<f64> = spacing.areas.iter().map(|share| area * share).collect();
        let regularisation = spacing.typical;
        let tree = Tree::new(&fitted, Options { regularisation, ..Options::default() })?;
        let winding = tree.with_normals(&area_vectors(&gradients, &areas))?.evaluate(places)?;
        let values = self.spline.evaluate(places, Derivatives::Value).values;
        let difference = |((w, value), distance): ((f64, f64), f64)| {
            // Outside the box there is no value; all of it is outside the shape.
            let signed = if value < 0.0 { -distance } else { distance };
            w - (0.5 - 0.5 * signed / signed.hypot(regularisation))
        };
        let rows = winding.into_iter().zip(values).zip(distances_to(&fitted, places));
        Ok(rows.map(|row| confidence(difference(row))).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct;

    fn circle(from: f64, to: f64, count: u32) -> Vec<[f64; 2]> {
        let angle = |i: u32| from + (to - from) * f64::from(i) / f64::from(count);
        (0..count).map(|i| angle(i).sin_cos()).map(|(s, c)| [7.0 + 3.0 * c, 3.0 * s]).collect()
    }

    #[test]
    fn a_closed_curve_leaves_no_doubt_anywhere() {
        let result = reconstruct(&circle(0.0, std::f64::consts::TAU, 300), &crate::Options::default()).unwrap();
        let rays = (0..60).map(|i| [4.5 * f64::from(i) / 59.0, f64::from(i)]);
        let places: Vec<[f64; 2]> = rays.map(|[r, t]| [7.0 + r * t.cos(), r * t.sin()]).collect();
        let found = result.confidence(&places).unwrap();
        assert!(found.iter().all(|c| *c > 0.9), "{found:?}");
        let field = result.confidence_field().unwrap();
        assert_eq!(field.shape(), result.domain.nodes(result.halvings).map(|axis| axis.len()));
        let corner = result.frame.to_data(&result.domain.lower);
        assert_eq!(field[[0, 0]], result.confidence(&[corner]).unwrap()[0]);
        assert!(result.confidence(&[[f64::NAN, 0.0]]).is_err());
        let regions = &result.report.trust.regions;
        assert_eq!(regions.iter().map(|region| region.points).sum::<usize>(), 300);
        assert!(regions.iter().all(|region| region.confidence > 0.9 && region.unsure == 0.0), "{regions:?}");
        // Along the circle, through every box that it meets.
        let radius = |region: &RegionReport| (region.centre[0] - 7.0).hypot(region.centre[1]);
        assert!(regions.iter().all(|region| (2.7..3.0001).contains(&radius(region))) && regions.len() > 15);
    }

    #[test]
    fn sides_far_from_points_are_less_sure() {
        // A third of the circle is missing.
        let points = circle(0.0, std::f64::consts::TAU * 2.0 / 3.0, 200);
        let result = reconstruct(&points, &crate::Options::default()).unwrap();
        let towards = |angle: f64, r: f64| [7.0 + r * angle.cos(), r * angle.sin()];
        let (data, hole) = (std::f64::consts::TAU / 3.0, std::f64::consts::TAU * 5.0 / 6.0);
        let sure = result.confidence(&[towards(data, 2.5), towards(data, 3.0), towards(data, 3.5)]).unwrap();
        assert!(sure.iter().all(|c| *c > 0.9), "{sure:?}");
        // Where the curve crosses the gap, a radius and a half from its ends, winding numbers are near ½.
        let (_, f) = result.in_data_units().unwrap();
        let value = |r: f64| f.value(&std::array::from_fn(|k| towards(hole, r)[k] - result.frame.origin[k]));
        let crossing = (0..450).map(|i| 0.01 * f64::from(i)).find(|r| value(*r) > 0.0).unwrap();
        let unsure = result.confidence(&[towards(hole, crossing)]).unwrap();
        assert!(unsure[0] < 0.3, "{unsure:?} at {crossing}");
    }

    #[test]
    fn the_least_sure_region_comes_first() {
        let frame = Frame { origin: [100.0, 0.0], scale: 0.5, sides: [0.8, 0.4] };
        let points = [[0.01, 0.01], [0.03, 0.03], [0.31, 0.01], [-0.31, 0.01]];
        let regions = regions(&points, &[0.55, 0.95, 0.5, 0.2], &frame);
        let short: Vec<_> = regions.iter().map(|r| (r.points, r.unsure)).collect();
        // |W − ½| is 0.05 and 0.45, 0, and 0.3, halfway to an unsure side.
        assert_eq!(short, [(2, 0.5), (1, 0.0), (1, 0.0)]);
        assert!((regions[0].confidence - 0.5).abs() < 1e-12 && (regions[1].confidence - 0.5).abs() < 1e-12);
        assert_eq!(regions[0].centre, [100.04, 0.04]);
    }
}
