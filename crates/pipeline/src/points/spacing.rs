//! How densely the points lie on the curve or surface.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

use crate::points::kd_tree::tree_of;
use crate::points::lines::Lines;

/// Local and typical distance between neighbouring samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Spacing {
    /// Per point, in the unit of the points.
    pub local: Vec<f64>,
    /// Their median s.
    pub typical: f64,
    /// Density ρ: points per unit length in 2D, per unit area in 3D, over all of the curve or surface. s^−(D−1) where they are spread
    /// evenly and not in lines.
    pub density: f64,
    /// Per point: the share of curve or surface that it stands for, in units of the mean share.
    pub areas: Vec<f64>,
    /// Per point, the distance to the nearest other one.
    pub nearest: Vec<f64>,
    /// Which points tell how far apart they are, if they lie in lines much closer than across.
    pub lines: Option<Lines>,
}

/// Points with more noise than so many of their spacings are noisy; less is detail that is finer than the spacing, or nothing.
pub const NOISY: f64 = 0.1;

/// Beyond so many spacings fairness is of second order, which overshoots less than third order.
pub const SECOND_ORDER: f64 = 4.0;

/// Points spread evenly have up to so many times the mean area by the square of their spacing, by its median 1: 1.06 where they are random,
/// for the sixth neighbour's distance errs, and more with noise.
const EVEN: f64 = 1.2;

/// How many neighbours an estimate looks at.
pub(crate) const NEIGHBOURS: usize = 6;

impl Spacing {
    /// Estimates the spacing from the distance `d_k` to the k-th neighbour, k = 6: around a point of a surface lie
    /// `k = ρ π d_k²` others, around one of a curve `k = 2 ρ d_k`. Of points in [`Lines`] those that are left when these are thinned
    /// tell it.
    ///
    /// The points must be distinct and finite, and at least two.
    pub fn of<const D: usize>(points: &[[f64; D]]) -> Self {
        let tree = tree_of(points);
        let (local, nearest) = from_neighbours(points, &tree);
        match Lines::of(points, &tree, &local) {
            Some(lines) => Self::in_lines(lines, points, nearest),
            None => Self::even::<D>(local, nearest),
        }
    }

    /// Of points that are not in lines.
    fn even<const D: usize>(local: Vec<f64>, nearest: Vec<f64>) -> Self {
        let mut sorted = local.clone();
        sorted.sort_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2];
        let (areas, mean) = areas::<D>(&local, typical, None);
        let density = typical.powi(1 - D as i32) / (mean / EVEN).max(1.0);
        Self { local, typical, density, areas, nearest, lines: None }
    }

    /// Of points in lines: that of those that are left when they are thinned, each with its share of what these stand for.
    fn in_lines<const D: usize>(lines: Lines, points: &[[f64; D]], nearest: Vec<f64>) -> Self {
        let left = lines.left(points);
        let (few, _) = from_neighbours(&left, &tree_of(&left));
        let Self { local, typical, density, .. } = Self::even::<D>(few, vec![]);
        let density = density * points.len() as f64 / left.len() as f64;
        let local: Vec<f64> = lines.nearest.iter().map(|&i| local[i]).collect();
        let (areas, _) = areas::<D>(&local, typical, Some(&lines));
        Self { local, typical, density, areas, nearest, lines: Some(lines) }
    }

    /// How many points are about as far apart as the spacing says: all, but for those between others of a line.
    pub fn count(&self) -> usize {
        self.lines.as_ref().map_or(self.local.len(), |lines| lines.between.iter().filter(|between| !**between).count())
    }

    /// The length of curve or area of surface that the points lie on.
    pub fn extent(&self) -> f64 {
        self.local.len() as f64 / self.density
    }

    /// The mean of the local spacing over each point's nearest neighbours, in the unit of the points: a single one errs by a fifth and
    /// more where samples are random.
    pub fn smoothed<const D: usize>(&self, points: &[[f64; D]]) -> Vec<f64> {
        let tree = tree_of(points);
        self.smoothed_in(&tree, points)
    }

    /// The areas by that spacing: a point that noise has taken far stands alone, and has a large one by its own.
    pub fn smoothed_areas<const D: usize>(&self, points: &[[f64; D]]) -> Vec<f64> {
        areas::<D>(&self.smoothed(points), self.typical, self.lines.as_ref()).0
    }

    /// As [`Spacing::smoothed`], with a tree of the points.
    pub(crate) fn smoothed_in<const D: usize>(&self, tree: &ImmutableKdTree<f64, D>, points: &[[f64; D]]) -> Vec<f64> {
        let Some(wanted) = NonZero::new(SMOOTH.min(points.len())) else { return vec![] };
        let mean = |point| {
            let nearest = tree.query(point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
            nearest.iter().map(|n| self.local[n.item as usize]).sum::<f64>() / nearest.len() as f64
        };
        points.par_iter().map(mean).collect()
    }
}

/// The spacing of points whose k-th neighbour is at a distance of 1.
pub(crate) fn per_distance<const D: usize>(k: usize) -> f64 {
    if D == 2 { 2.0 / k as f64 } else { (std::f64::consts::PI / k as f64).sqrt() }
}

/// The spacing at each point, from the distance to the sixth neighbour, and the distance to the first.
fn from_neighbours<const D: usize>(points: &[[f64; D]], tree: &ImmutableKdTree<f64, D>) -> (Vec<f64>, Vec<f64>) {
    let k = NEIGHBOURS.min(points.len() - 1);
    let factor = per_distance::<D>(k);
    // The point itself is among its own neighbours.
    let wanted = NonZero::<usize>::MIN.saturating_add(k);
    let of = |point| {
        let neighbours = tree.query(point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let mut distances: Vec<f64> = neighbours.iter().map(|n| n.distance.sqrt()).collect();
        distances.sort_by(f64::total_cmp);
        (factor * distances[k], distances[1])
    };
    points.par_iter().map(of).unzip()
}

/// What share of curve or surface each point stands for by its spacing, in units of the mean share; and that in units of the share that the
/// typical spacing says.
fn areas<const D: usize>(local: &[f64], typical: f64, lines: Option<&Lines>) -> (Vec<f64>, f64) {
    let mut areas: Vec<f64> = local.iter().map(|s| (s / typical).powi(D as i32 - 1)).collect();
    if let Some(lines) = lines {
        areas.iter_mut().zip(&lines.share).for_each(|(area, share)| *area *= share);
    }
    let mean = to_mean_one(&mut areas);
    (areas, mean)
}

/// Divides areas by their mean, and gives it.
pub(crate) fn to_mean_one(areas: &mut [f64]) -> f64 {
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    areas.iter_mut().for_each(|area| *area /= mean);
    mean
}

/// Over so many neighbours a point's spacing is averaged.
const SMOOTH: usize = 24;
/// Roundness above which a neighbourhood is no surface: that of points spread evenly through a ball is near 0.6, that of
/// a surface, flat within its neighbourhood, below 0.1.
pub(crate) const ROUND: f64 = 0.25;

/// The covariance of some points, times their number; zero beyond D.
pub(crate) fn covariance<const D: usize>(points: &[[f64; D]], indices: &[usize]) -> [[f64; 3]; 3] {
    let count = indices.len() as f64;
    let centre: [f64; D] = std::array::from_fn(|axis| indices.iter().map(|&i| points[i][axis]).sum::<f64>() / count);
    let mut c = [[0.0; 3]; 3];
    for &i in indices {
        for a in 0..D {
            for b in 0..D {
                c[a][b] += (points[i][a] - centre[a]) * (points[i][b] - centre[b]);
            }
        }
    }
    c
}

/// How evenly some points spread in all directions: `det C / (tr C / D)^D` of their covariance C, from 0 (flat) to 1.
pub(crate) fn roundness<const D: usize>(points: &[[f64; D]], indices: &[usize]) -> f64 {
    let c = covariance(points, indices);
    let trace: f64 = (0..D).map(|axis| c[axis][axis]).sum();
    let determinant = if D == 2 {
        c[0][0] * c[1][1] - c[0][1] * c[1][0]
    } else {
        c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1]) - c[0][1] * (c[1][0] * c[2][2] - c[1][2] * c[2][0])
            + c[0][2] * (c[1][0] * c[2][1] - c[1][1] * c[2][0])
    };
    determinant / (trace / D as f64).powi(D as i32)
}

/// The distance from each place to the nearest of the points, which must be distinct and finite.
pub(crate) fn distances_to<const D: usize>(points: &[[f64; D]], places: &[[f64; D]]) -> Vec<f64> {
    if places.is_empty() {
        return vec![];
    }
    let tree = tree_of(points);
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

    #[test]
    fn the_extent_is_that_of_the_sparse_part_too() {
        // Three of four points on a fiftieth of the line.
        let uneven = |i: u32| if i < 900 { 1e-4 * f64::from(i) } else { 0.09 + 0.015 * f64::from(i - 899) };
        let points: Vec<[f64; 2]> = (0..1200).map(|i| [uneven(i), 0.0]).collect();
        let spacing = Spacing::of(&points);
        assert!((spacing.typical - 1e-4).abs() < 1e-9);
        // Too small by the share that points of even density may have more.
        let share = spacing.extent() / uneven(1199);
        assert!((1.0 / EVEN - 0.02..1.0).contains(&share), "{share}");
        // Of even points it is as many spacings.
        let even: Vec<[f64; 2]> = (0..1200).map(|i| [0.01 * f64::from(i), 0.0]).collect();
        let spacing = Spacing::of(&even);
        assert_eq!(spacing.density, 1.0 / spacing.typical);
    }
}
