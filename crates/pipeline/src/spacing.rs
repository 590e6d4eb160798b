//! How densely the points lie on the curve or surface.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

/// Local and typical distance between neighbouring samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Spacing {
    /// Per point, in the unit of the points.
    pub local: Vec<f64>,
    /// Their median s.
    pub typical: f64,
    /// Density ρ = s^−(D−1): points per unit length in 2D, per unit area in 3D.
    pub density: f64,
    /// Per point: the share of curve or surface that it stands for, in units of the mean share.
    pub areas: Vec<f64>,
}

/// How many neighbours an estimate looks at.
const NEIGHBOURS: usize = 6;

impl Spacing {
    /// Estimates the spacing from the distance `d_k` to the k-th neighbour, k = 6: around a point of a surface lie
    /// `k = ρ π d_k²` others, around one of a curve `k = 2 ρ d_k`.
    ///
    /// The points must be distinct and finite, and at least two.
    pub fn of<const D: usize>(points: &[[f64; D]]) -> Self {
        let k = NEIGHBOURS.min(points.len() - 1);
        let factor = if D == 2 { 2.0 / k as f64 } else { (std::f64::consts::PI / k as f64).sqrt() };
        // A tree cannot fail to build from distinct finite points.
        let tree = ImmutableKdTree::<f64, D>::new_from_slice(points).expect("points are distinct and finite");
        // The point itself is among its own neighbours.
        let wanted = NonZero::new(k + 1).expect("at least one");
        let local: Vec<f64> = points
            .par_iter()
            .map(|p| {
                let nearest = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
                factor * nearest.iter().map(|n| n.distance).fold(0.0, f64::max).sqrt()
            })
            .collect();
        let mut sorted = local.clone();
        sorted.sort_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2];
        let mut areas: Vec<f64> = local.iter().map(|s| (s / typical).powi(D as i32 - 1)).collect();
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        areas.iter_mut().for_each(|a| *a /= mean);
        Self { local, typical, density: typical.powi(1 - D as i32), areas }
    }
}

/// The distance from each place to the nearest of the points, which must be distinct and finite.
pub(crate) fn distances_to<const D: usize>(points: &[[f64; D]], places: &[[f64; D]]) -> Vec<f64> {
    let tree = ImmutableKdTree::<f64, D>::new_from_slice(points).expect("points are distinct and finite");
    let nearest = |place| tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute().distance;
    places.par_iter().map(|place: &[f64; D]| nearest(place).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_samples_have_their_own_distance() {
        let circle: Vec<[f64; 2]> =
            (0..100).map(|i| f64::from(i) * 0.02 * std::f64::consts::PI).map(|t| [t.cos(), t.sin()]).collect();
        let spacing = Spacing::of(&circle);
        // Chords instead of arcs: third order in 3 · 0.0628.
        assert!((spacing.typical - 0.0628).abs() < 0.001, "{}", spacing.typical);
        assert!(spacing.areas.iter().all(|a| (a - 1.0).abs() < 1e-6), "a regular polygon");
        let grid: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        // Inside a square grid the sixth neighbour is a diagonal one: √2 · √(π/6) = 1.02.
        assert!((Spacing::of(&grid).typical - 1.02).abs() < 0.01);
    }

    #[test]
    fn dense_parts_weigh_less_per_point() {
        let uneven: Vec<[f64; 2]> = (0..300)
            .map(|i| if i < 200 { 0.005 * f64::from(i) } else { 1.0 + 0.01 * f64::from(i - 200) })
            .map(|x| [x, 0.0])
            .collect();
        let areas = Spacing::of(&uneven).areas;
        assert!(
            (areas[250] / areas[100] - 2.0).abs() < 1e-9,
            "twice the distance, exactly representable up to rounding"
        );
    }
}
