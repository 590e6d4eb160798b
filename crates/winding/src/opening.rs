//! Which boxes of points are far enough from a box of queries.

use crate::direct_sum::sphere;
use crate::multi_index::ORDER;
use crate::multipole::Source;
use crate::partition::{Partition, bounds};

/// Centre and radius of a ball around the points of a box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball<const D: usize> {
    pub centre: [f64; D],
    pub radius: f64,
}

/// The balls of all boxes, in preorder: centres of bounding boxes, which do not depend on the order of the points.
pub(crate) fn balls<const D: usize>(partition: &Partition<D>) -> Vec<Ball<D>> {
    let ball = |points: &[[f64; D]]| {
        let [low, high] = bounds(points);
        let centre = std::array::from_fn(|k| low[k] + 0.5 * (high[k] - low[k]));
        let square = |p: &[f64; D]| (0..D).map(|k| (p[k] - centre[k]) * (p[k] - centre[k])).sum::<f64>();
        Ball { centre, radius: points.iter().map(square).fold(0.0, f64::max).sqrt() }
    };
    partition.parts.iter().map(|part| ball(&partition.points[part.run()])).collect()
}

/// Boxes are opened from nearer than radius / `STEEPEST`, whatever they weigh, for the bound on the error grows beyond all
/// measure towards 1.
const STEEPEST: f64 = 0.5;

/// Each far box may err by this part of the tolerance. Errors of different boxes mostly cancel: with hundreds of boxes
/// the worst sums that tests and benches found are a third of the tolerance.
const SHARE: f64 = 0.125;

/// When a box is far: `radius² ≤ STEEPEST² ρ²` and `weight ≤ ρ^{p+2}` (3D), `ρ^{p+1}` (2D), where `ρ² = d² + ε²` and d is the
/// distance of its centre from the queries.
///
/// For terms up to order p of the potential, with `θ = r/ρ` and `A = Σ ‖aᵢ nᵢ‖`, what is left out is at most
/// `A θ^p (p + 1 − pθ) / (1 − θ)² / (4π ρ²)` in 3D and `A θ^p / (1 − θ) / (2π ρ)` in 2D: along a line the potential is the
/// generating function of Legendre (Chebyshev) polynomials, ε being one more coordinate, and a symmetric multilinear form is
/// nowhere larger than on its diagonal. The factor with θ is taken at its largest, at `STEEPEST`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opening {
    pub radius_square: f64,
    pub weight: f64,
}

/// The criteria of all boxes, in preorder.
pub(crate) fn openings<const D: usize>(
    partition: &Partition<D>,
    balls: &[Ball<D>],
    sources: &[Source<D>],
    tolerance: f64,
) -> Vec<Opening> {
    let norm = |[_, area]: &Source<D>| area.iter().map(|x| x * x).sum::<f64>().sqrt();
    let parts = &partition.parts;
    let mut areas = vec![0.0; parts.len()];
    for (index, part) in parts.iter().enumerate().rev() {
        areas[index] = if part.is_leaf(index) {
            sources[part.run()].iter().map(norm).sum()
        } else {
            areas[index + 1] + areas[parts[index + 1].skip as usize]
        };
    }
    let p = ORDER as f64;
    let left_out =
        if D == 2 { 1.0 / (1.0 - STEEPEST) } else { (p + 1.0 - p * STEEPEST) / ((1.0 - STEEPEST) * (1.0 - STEEPEST)) };
    let factor = left_out / (sphere::<D>() * SHARE * tolerance);
    let opening = |(ball, area): (&Ball<D>, f64)| {
        let square = ball.radius * ball.radius;
        Opening { radius_square: square, weight: factor * area * square * square }
    };
    balls.iter().zip(areas).map(opening).collect()
}

impl Opening {
    /// Whether the box is far from queries at a squared distance of `square − ε²` and more from its centre.
    pub fn is_far<const D: usize>(&self, square: f64) -> bool {
        const { assert!(ORDER == 4) }
        let power = square * square * if D == 2 { square.sqrt() } else { square };
        self.radius_square <= STEEPEST * STEEPEST * square && self.weight <= power && square > 0.0
    }
}
