//! Which part of a curve or surface its points support.
//!
//! Between points a surface is an interpolation, beyond them an invention. At a place on it, take the mean of the samples
//! around, weighted by `exp(−d²/2σ²)` and by the area that each stands for. In the midst of samples it is the place itself.
//! At the distance t beyond a straight boundary of them it is `σ φ(t/σ)/Φ(−t/σ)` away (Mills' ratio): 0.8 σ on the boundary,
//! σ at t = 0.3 σ. There the surface ends. The mean depends smoothly on the place, so that the boundary is smooth where the
//! nearest sample alone would scallop it.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

use crate::points::kd_tree::tree_of;
use crate::points::spacing::Spacing;

/// σ, in spacings of the points around.
const WIDTH: f64 = 1.5;
/// No part farther from the nearest sample than so many of its spacings is supported, whatever lies around: the midst of a
/// hole. Gaps in random samples of even density hardly reach so far; those that do are small, and closed.
const FARTHEST: f64 = 1.5;
/// Samples that have a say: on a surface they reach to 2.1 σ in its midst, and to 3 σ at its boundary.
const AROUND: usize = 32;
/// Connected parts that are supported by no more than so many samples' share are specks,
pub const SPECK: f64 = 12.0;
/// and such holes are closed.
pub const HOLE: f64 = 6.0;

/// Samples of a curve or surface with the spacing around each.
pub struct Support<'a, const D: usize> {
    points: &'a [[f64; D]],
    tree: ImmutableKdTree<f64, D>,
    /// Mean of the neighbours' spacings, per point.
    local: Vec<f64>,
    /// Its own spacing, per point.
    own: &'a [f64],
}

/// The nearest sample of a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Its index.
    pub sample: usize,
    /// How far it is.
    pub distance: f64,
    /// The same over the farthest that is supported.
    pub remoteness: f64,
}

impl Nearest {
    /// How far it is, in the spacings around it.
    pub fn spacings(&self) -> f64 {
        FARTHEST * self.remoteness
    }
}

impl<'a, const D: usize> Support<'a, D> {
    /// The points must be distinct and finite, and at least two.
    pub fn new(points: &'a [[f64; D]], spacing: &'a Spacing) -> Self {
        let tree = tree_of(points);
        // Smoothed, for a boundary without steps.
        let local = spacing.smoothed_in(&tree, points);
        Self { points, tree, local, own: &spacing.local }
    }

    /// The area (length in 2D) that a sample stands for by the spacing around it.
    pub fn share(&self, sample: usize) -> f64 {
        self.local[sample].powi(D as i32 - 1)
    }

    /// Per place, at most 0 where it is supported, and continuous across the boundary. `nearest` has the nearest sample of each.
    pub fn lack(&self, places: &[[f64; D]], nearest: &[Nearest]) -> Vec<f64> {
        places.par_iter().zip(nearest).map(|(place, nearest)| self.lack_at(place, nearest.remoteness)).collect()
    }

    /// The nearest sample of each place.
    pub fn nearest(&self, places: &[[f64; D]]) -> Vec<Nearest> {
        places.par_iter().map(|place| self.nearest_to(place)).collect()
    }

    /// The nearest sample of a place.
    pub fn nearest_to(&self, place: &[f64; D]) -> Nearest {
        let nearest = self.tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute();
        let (distance, sample) = (nearest.distance.sqrt(), nearest.item as usize);
        Nearest { sample, distance, remoteness: distance / (FARTHEST * self.local[sample]) }
    }

    /// How far a place is from a sample around it over the farthest that this one supports, at the least: beside samples of a denser part, where
    /// the nearest one does not reach far, it may be among those of a sparser one. Of these the mean of the spacings knows little, for their
    /// neighbours are many of the denser ones.
    pub fn remoteness(&self, place: &[f64; D]) -> f64 {
        let around = self.around(place);
        let reach = |sample: usize| FARTHEST * self.local[sample].max(self.own[sample]);
        around.iter().map(|(sample, square)| square.sqrt() / reach(*sample)).fold(f64::INFINITY, f64::min)
    }

    /// How far each sample supports a surface at most.
    pub fn reaches(&self) -> impl Iterator<Item = f64> + '_ {
        self.local.iter().map(|local| FARTHEST * local)
    }

    /// The samples nearest to a place, with the squares of their distances.
    fn around(&self, place: &[f64; D]) -> Vec<(usize, f64)> {
        let Some(wanted) = NonZero::new(AROUND.min(self.points.len())) else { return vec![] };
        let found = self.tree.query(place).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        found.into_iter().map(|near| (near.item as usize, near.distance)).collect()
    }

    fn lack_at(&self, place: &[f64; D], remoteness: f64) -> f64 {
        // Far beyond the boundary only the sign matters.
        if remoteness > 2.0 {
            return remoteness - 1.0;
        }
        let around = self.around(place);
        let Some(&(first, least)) = around.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return remoteness };
        let sigma = WIDTH * self.local[first];
        let (mut spacing, mut offset) = (0.0, [0.0; D]);
        for (index, square) in around {
            let local = self.local[index];
            // The nearest has weight 1, however far it is.
            let weight = ((least - square) / (2.0 * sigma * sigma)).exp() * local.powi(D as i32 - 1);
            spacing += weight * local;
            (0..D).for_each(|axis| offset[axis] += weight * (self.points[index][axis] - place[axis]));
        }
        let offset = offset.iter().map(|x| x * x).sum::<f64>().sqrt();
        remoteness.max(offset / (WIDTH * spacing)) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random points of density 1 on a square of side 40, but for a disc around its centre.
    fn square(hole: f64) -> Vec<[f64; 3]> {
        (0..1600)
            .map(|i| [0.754_877_666, 0.569_840_291].map(|step| 40.0 * (f64::from(i) * step).fract()))
            .map(|[x, y]| [x, y, 0.0])
            .filter(|p| (p[0] - 20.0).hypot(p[1] - 20.0) >= hole)
            .collect()
    }

    #[test]
    fn the_boundary_follows_the_sampling() {
        let points = square(0.0);
        let spacing = Spacing::of(&points);
        let support = Support::new(&points, &spacing);
        let along = |x: f64| -> Vec<f64> {
            let places: Vec<[f64; 3]> = (50..350).map(|i| [x, 0.1 * f64::from(i), 0.0]).collect();
            support.lack(&places, &support.nearest(&places))
        };
        assert!(along(20.0).iter().all(|lack| *lack < -0.5), "the midst");
        assert!(along(40.0).iter().all(|lack| *lack < 0.0), "the edge is kept");
        assert!(along(42.0).iter().all(|lack| *lack > 0.0), "two spacings beyond it nothing is");
    }

    #[test]
    fn a_place_beside_a_denser_part_is_among_the_samples_of_the_sparser_one() {
        // Five times as far apart beyond x = 0.
        let dense = (0..400).map(|i| [-0.2 * f64::from(i / 20), 0.2 * f64::from(i % 20), 0.0]);
        let sparse = (0..16).map(|i| [1.0 + f64::from(i / 4), f64::from(i % 4), 0.0]);
        let points: Vec<[f64; 3]> = dense.chain(sparse).collect();
        let spacing = Spacing::of(&points);
        let support = Support::new(&points, &spacing);
        let beside = [0.5, 1.0, 0.0];
        let remoteness = |place| (support.nearest_to(&place).remoteness, support.remoteness(&place));
        let (nearest, least) = remoteness(beside);
        assert!(nearest > 1.0 && least < 0.6, "{nearest}, {least}");
        // In the midst of either it makes little difference, and far from both none.
        let (nearest, least) = remoteness([-2.1, 2.1, 0.0]);
        assert!(least <= nearest && least > 0.9 * nearest, "{nearest}, {least}");
        assert!(support.remoteness(&[-4.0, 2.0, 4.0]) > 5.0);
    }

    #[test]
    fn large_holes_are_open_and_small_ones_are_not() {
        for (hole, open) in [(1.5, false), (5.0, true)] {
            let points = square(hole);
            let spacing = Spacing::of(&points);
            let places: Vec<[f64; 3]> = (0..40).map(|i| [16.0 + 0.2 * f64::from(i), 20.0, 0.0]).collect();
            let support = Support::new(&points, &spacing);
            let lack = support.lack(&places, &support.nearest(&places));
            assert_eq!(lack.iter().any(|lack| *lack > 0.0), open, "{hole}: {lack:?}");
            assert_eq!(lack[20] > 0.0, open);
        }
    }
}
