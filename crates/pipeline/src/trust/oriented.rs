//! The input points with normals, and how far to trust each.

use kiddo::SquaredEuclidean;
use rayon::prelude::*;
use serde::Serialize;
use zeroset_bspline::{Derivatives, Evaluation};

use crate::points::kd_tree::tree_of;
use crate::reconstruct::Reconstruction;

/// A residual of a cell leaves no confidence, nor one of so many standard deviations of the noise if that is more.
const NOISES: f64 = 4.0;

/// A point of the input with the direction out of the shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OrientedPoint<const D: usize> {
    /// Data coordinates.
    #[serde(skip)]
    pub position: [f64; D],
    /// Outward unit normal; zero where the gradient vanishes, and outside the box.
    #[serde(skip)]
    pub normal: [f64; D],
    /// Between 0 and 1.
    pub confidence: f64,
    /// Whether it lies on no part of the surface, and was not fitted.
    pub outlier: bool,
}

impl<const D: usize> Reconstruction<D> {
    /// The points that were reconstructed (`N × D`, data coordinates, the same order) with their outward unit normals
    /// `∇f / ‖∇f‖` and a confidence between 0 and 1: 1 where the function passes through the point with a gradient of at least
    /// its usual length, and winding numbers agree with its side ([`Reconstruction::confidence`]; not with
    /// [`Options::open`](crate::Options::open)). The normals of noisy points are those of f̂. A repeated point is an outlier where
    /// the first of its place is one, and so is a point that was left out of the box, whose confidence is 0.
    pub fn oriented(&self, points: &[[f64; D]]) -> Vec<OrientedPoint<D>> {
        let places: Vec<[f64; D]> = points.iter().map(|point| self.frame.to_frame(point)).collect();
        let evaluation = self.evaluate_for_normals(&places);
        let farthest = self.domain.spacing(self.halvings).max(NOISES * self.report.input.noise * self.frame.scale);
        let length = |g: &[f64; D]| g.iter().map(|g| g * g).sum::<f64>().sqrt();
        let inside = || evaluation.gradients.iter().map(length).filter(|length| length.is_finite());
        let usual = inside().sum::<f64>() / inside().count().max(1) as f64;
        // Of an open surface winding numbers say nothing; what is no place has no side.
        let sides = match self.open {
            true => vec![1.0; places.len()],
            false => self.confidence_in_frame(&places).unwrap_or_else(|_| vec![0.0; places.len()]),
        };
        let tree = tree_of(&self.points);
        let first = |place| tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute().item as usize;
        points
            .par_iter()
            .zip(&places)
            .zip(evaluation.values.par_iter().zip(&evaluation.gradients).zip(&sides))
            .map(|((point, place), ((value, gradient), side))| {
                let norm = length(gradient);
                if !norm.is_finite() {
                    return OrientedPoint { position: *point, normal: [0.0; D], confidence: 0.0, outlier: true };
                }
                let normal = gradient.map(|g| if norm > 0.0 { g / norm } else { 0.0 });
                let confidence = side
                    * (norm / usual.max(f64::MIN_POSITIVE)).min(1.0)
                    * (1.0 - (value / norm.max(f64::MIN_POSITIVE) / farthest).abs()).max(0.0);
                OrientedPoint { position: *point, normal, confidence, outlier: self.outliers[first(place)] }
            })
            .collect()
    }

    /// The function whose gradients are the points' normals, with its gradients, at places in the frame: f̂ where the points are
    /// noisy.
    pub(crate) fn evaluate_for_normals(&self, places: &[[f64; D]]) -> Evaluation<D> {
        match &self.guide {
            Some(guide) => guide.evaluate(places, Derivatives::Gradient),
            None => self.spline.evaluate(places, Derivatives::Gradient),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Options, reconstruct};

    #[test]
    fn every_point_of_the_input_has_its_row() {
        let circle = (0..200).map(|i| (f64::from(i * 77 % 200) / 200.0 * std::f64::consts::TAU).sin_cos());
        let mut points: Vec<[f64; 2]> = circle.map(|(s, c)| [7.0 + 3.0 * c, 3.0 * s]).collect();
        points.extend_from_within(..5);
        points.push([400.0, 0.0]);
        let oriented = reconstruct(&points, &Options::default()).unwrap().oriented(&points);
        assert!(oriented.iter().map(|point| point.position).eq(points.iter().copied()));
        let (far, near) = oriented.split_last().unwrap();
        assert!(far.outlier && far.normal == [0.0; 2] && far.confidence == 0.0);
        for point in near {
            let radial = [(point.position[0] - 7.0) / 3.0, point.position[1] / 3.0];
            // 200 points leave the normals of a circle far less to be wrong by.
            assert!(point.normal[0] * radial[0] + point.normal[1] * radial[1] > 0.99, "{point:?}");
            assert!(!point.outlier && point.confidence > 0.9, "{point:?}");
        }
        assert_eq!(near[..5], near[200..]);
    }
}
