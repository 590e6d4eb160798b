//! Patches of neighbouring points that lie off a zero set together.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::lanczos::dot;
use crate::noise::LEAST_NOISE;

/// Neighbours of a point, itself included: as many as a patch has at least.
const fn patch(dimension: usize) -> usize {
    if dimension == 2 { 8 } else { 16 }
}

/// Where half of a patch lies farther away than so many standard deviations on one side, that is no noise. (Of independent normal
/// distances the median of 8 gets there once in ten million times, that of 16 hardly ever; fits of noisy points that are right
/// came to 1.7.)
const OFF: f64 = 2.2;

/// Normals whose cosine is below this face each other.
const OPPOSED: f64 = -0.7;

/// Where a smooth shape has closed a hole or a gap, filled a valley or swallowed a limb, the points there lie on one side of it all
/// together. They may be too few for winding numbers to tell: the sides of all others are right.
#[derive(Debug, Clone)]
pub struct Patches {
    /// The nearest points of each, in turn.
    neighbours: Vec<u32>,
    patch: usize,
    spacing: f64,
}

impl Patches {
    /// Around all `points`, of which there should be more than a patch has, with their `spacing`.
    pub fn new<const D: usize>(points: &[[f64; D]], spacing: f64) -> Self {
        let patch = patch(D).min(points.len());
        let neighbours = match (ImmutableKdTree::<f64, D>::new_from_slice(points), NonZero::new(patch)) {
            (Ok(tree), Some(count)) => {
                let around = |point: &[f64; D]| tree.query(point).nearest_n::<SquaredEuclidean<f64>>(count).execute();
                let found = points.par_iter().with_min_len(64);
                found.flat_map_iter(|point| around(point).into_iter().map(|near| near.item)).collect()
            }
            _ => Vec::new(),
        };
        Self { neighbours, patch: patch.max(1), spacing }
    }

    /// Points amid a patch whose `distances` from a zero set, with their signs, are on one side and more than noise of this
    /// standard deviation makes them.
    pub fn off(&self, distances: &[f64], noise: f64) -> Vec<usize> {
        let most = OFF * noise.max(LEAST_NOISE * self.spacing);
        let beyond = |around: &[u32]| {
            let count = |wanted: &dyn Fn(f64) -> bool| {
                around.iter().filter(|index| distances.get(**index as usize).is_some_and(|d| wanted(*d))).count()
            };
            2 * count(&|d| d > most).max(count(&|d| d < -most)) > around.len()
        };
        let patches = self.neighbours.par_chunks(self.patch).with_min_len(64).enumerate();
        patches.filter(|(_, around)| beyond(around)).map(|(index, _)| index).collect()
    }

    /// The share of the distances' variance that a point has to itself: 1 less the correlation with the mean of the other points of
    /// its patch. Near 1 for noise, near 0 where a smooth shape passes the points by.
    pub fn own_share(&self, distances: &[f64]) -> f64 {
        let others = (self.patch - 1) as f64;
        let (mut shared, mut all) = (0.0, 0.0);
        for (around, d) in self.around().zip(distances) {
            let sum: f64 = around.iter().filter_map(|index| distances.get(*index as usize)).sum();
            let product = d * (sum - d);
            if product.is_finite() {
                shared += product / others;
                all += d * d;
            }
        }
        if shared > 0.0 { 1.0 - (shared / all).min(1.0) } else { 1.0 }
    }

    /// The share of the `points` that have another one in their patch, no farther away than `reach`, the normal of which is opposite.
    pub fn facing_share<const D: usize>(&self, points: &[[f64; D]], normals: &[[f64; D]], reach: f64) -> f64 {
        let lengths: Vec<f64> = normals.iter().map(|n| dot(n, n).sqrt()).collect();
        let faces = |index: usize, other: usize| {
            let between: [f64; D] = std::array::from_fn(|axis| points[other][axis] - points[index][axis]);
            let cosine = dot(&normals[index], &normals[other]) / (lengths[index] * lengths[other]);
            cosine < OPPOSED && dot(&between, &between) < reach * reach
        };
        let patches = self.neighbours.par_chunks(self.patch).with_min_len(64).enumerate();
        let faced = patches.filter(|(index, around)| around.iter().any(|other| faces(*index, *other as usize))).count();
        faced as f64 / points.len().max(1) as f64
    }

    /// The patch of each point, itself included.
    pub(crate) fn around(&self) -> impl Iterator<Item = &[u32]> {
        self.neighbours.chunks(self.patch)
    }

    /// How many of these are a patch.
    pub const fn least(&self) -> usize {
        self.patch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_on_one_side_are_off_and_noise_is_not() {
        let grid: Vec<[f64; 3]> = (0..2500).map(|i| [f64::from(i % 50), f64::from(i / 50), 0.0]).collect();
        let patches = Patches::new(&grid, 1.0);
        let uniform = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43_758.545_3).rem_euclid(1.0);
        let noise = |i: usize| (0..12).map(|k| uniform(i, f64::from(k))).sum::<f64>() - 6.0;
        let mut distances: Vec<f64> = (0..2500).map(noise).collect();
        assert!(patches.off(&distances, 1.0).is_empty());
        // Distances that the spacing does not let us tell from detail.
        assert!(patches.off(&distances.iter().map(|d| 0.1 * d).collect::<Vec<_>>(), 0.0).is_empty());
        let swallowed = |p: &[f64; 3]| (p[0] - 20.0).hypot(p[1] - 30.0);
        for (distance, point) in distances.iter_mut().zip(&grid) {
            *distance -= if swallowed(point) < 6.0 { 4.0 } else { 0.0 };
        }
        let off = patches.off(&distances, 1.0);
        // All but those at the rim, in whose patches the others are as many.
        assert!(off.len() > 60 && off.iter().all(|i| swallowed(&grid[*i]) < 7.5), "{}", off.len());
        assert!((0..2500).filter(|i| swallowed(&grid[*i]) < 4.0).all(|i| off.contains(&i)));
    }

    #[test]
    fn noise_is_each_points_own_and_a_misfit_is_not() {
        let grid: Vec<[f64; 3]> = (0..2500).map(|i| [f64::from(i % 50), f64::from(i / 50), 0.0]).collect();
        let patches = Patches::new(&grid, 1.0);
        let noise: Vec<f64> =
            (0..2500).map(|i| (f64::from(i) * 12.9898).sin() * 43_758.545_3).map(|x| x.rem_euclid(1.0) - 0.5).collect();
        // The mean of 2500 products, each of the spread of a mean of 15 values.
        assert!(patches.own_share(&noise) > 1.0 - 3.0 / f64::sqrt(15.0 * 2500.0));
        // Waves of 25 spacings, of which a patch, two spacings wide to each side, is a small part.
        let waves: Vec<f64> = grid.iter().map(|p| (p[0] * std::f64::consts::TAU / 25.0).sin()).collect();
        assert!(patches.own_share(&waves) < 0.15, "{}", patches.own_share(&waves));
        // Both have variances of 1/12 and 1/2.
        let both: Vec<f64> = noise.iter().zip(&waves).map(|(n, w)| n + w / f64::sqrt(6.0)).collect();
        assert!((patches.own_share(&both) - 0.5).abs() < 0.1, "{}", patches.own_share(&both));
        assert_eq!(patches.own_share(&[0.0; 2500]), 1.0);
        // Where f has no gradient.
        let mut some = waves.clone();
        some[7] = f64::INFINITY;
        assert!(patches.own_share(&some) < 0.2);
    }

    #[test]
    fn sides_of_walls_and_gaps_face_each_other() {
        // Two sheets 1.2 spacings apart over a half of one of them.
        let sheet = |z: f64, count: i32| (0..count).map(move |i| [f64::from(i % 30), f64::from(i / 30), z]);
        let points: Vec<[f64; 3]> = sheet(0.0, 900).chain(sheet(1.2, 450)).collect();
        let patches = Patches::new(&points, 1.0);
        let share = |up: [f64; 2], reach: f64| {
            let normals: Vec<[f64; 3]> = (0..1350).map(|i| [0.0, 0.0, up[usize::from(i >= 900)]]).collect();
            patches.facing_share(&points, &normals, reach)
        };
        // Those beyond the rim are sqrt(1 + 1.2²) away.
        assert_eq!(share([1.0, -3.0], 1.3), 900.0 / 1350.0);
        assert_eq!((share([1.0, -3.0], 1.1), share([1.0, 1.0], 1.3)), (0.0, 0.0));
        assert_eq!(share([0.0, 0.0], 1.3), 0.0, "without normals");
        assert_eq!(Patches::new::<3>(&[], 1.0).facing_share::<3>(&[], &[], 1.0), 0.0);
    }

    #[test]
    fn few_points_are_one_patch() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(Patches::new(&points, 1.0).off(&[1.0; 3], 0.1), [0, 1, 2]);
        assert!(Patches::new::<2>(&[], 1.0).off(&[], 0.1).is_empty());
    }
}
