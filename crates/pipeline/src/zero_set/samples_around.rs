//! What the samples hand on to other places: their distance, their colours and other values.

use std::num::NonZero;

use kiddo::SquaredEuclidean;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::points::kd_tree::tree_of;

/// A mean is taken over so many of the nearest samples.
const NEAREST: usize = 6;

/// The samples nearest to each of some places.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplesAround {
    /// Per place: indices of samples with their distances, the nearest first.
    nearest: Vec<Vec<(usize, f64)>>,
}

impl SamplesAround {
    /// Of `points` (`N × D`, at least one, all finite), those nearest to each of `places` (`M × D`, the same unit). Of points
    /// that repeat, the first counts.
    ///
    /// Panics if there are no points, or if one is not finite.
    pub fn new<const D: usize>(points: &[[f64; D]], places: &[[f64; D]]) -> Self {
        Self::of(points, places, NEAREST + 1)
    }

    /// As [`SamplesAround::new`], with one sample per place: enough for distances, and less work; means are the nearest's values.
    ///
    /// Panics if there are no points, or if one is not finite.
    pub fn nearest_only<const D: usize>(points: &[[f64; D]], places: &[[f64; D]]) -> Self {
        Self::of(points, places, 1)
    }

    fn of<const D: usize>(points: &[[f64; D]], places: &[[f64; D]], wanted: usize) -> Self {
        // Zero has two bit patterns.
        let key = |p: &[f64; D]| p.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
        let mut seen = FxHashSet::with_capacity_and_hasher(points.len(), Default::default());
        let first: Vec<usize> = (0..points.len()).filter(|&i| seen.insert(key(&points[i]))).collect();
        let distinct: Vec<[f64; D]> = first.iter().map(|&i| points[i]).collect();
        let tree = tree_of(&distinct);
        #[expect(clippy::expect_used, reason = "a documented panic: whoever asks has points")]
        let wanted = NonZero::new(wanted.min(distinct.len())).expect("there are points");
        let nearest = places
            .par_iter()
            .map(|place| {
                if wanted == NonZero::<usize>::MIN {
                    let found = tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute();
                    return vec![(first[found.item as usize], found.distance.sqrt())];
                }
                let found = tree.query(place).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
                let mut found: Vec<(usize, f64)> =
                    found.iter().map(|n| (first[n.item as usize], n.distance.sqrt())).collect();
                // Of equally distant samples the first, whatever the tree looks like.
                found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
                found
            })
            .collect();
        Self { nearest }
    }

    /// Per place: the distance from the nearest sample.
    pub fn distances(&self) -> Vec<f64> {
        self.nearest.iter().map(|around| around[0].1).collect()
    }

    /// Per place: the value of the nearest sample. `values` has one per point.
    ///
    /// Panics if there are fewer.
    pub fn nearest(&self, values: &[f64]) -> Vec<f64> {
        self.nearest.iter().map(|around| values[around[0].0]).collect()
    }

    /// Per place: the mean of the nearest samples' values with the weights `((R − d) / (R d))²`, R the distance of the first
    /// sample that has no say (Franke and Nielson 1980): the sample's own value at a sample, and continuous in between.
    ///
    /// Panics if there are fewer values than points.
    pub fn mean(&self, values: &[f64]) -> Vec<f64> {
        self.nearest
            .par_iter()
            .map(|around| {
                let (nearest, reach) = (around[0], around[around.len() - 1].1);
                // Below this the weights overflow, or all samples are equally far.
                if nearest.1 <= 1e-12 * reach || nearest.1 >= reach {
                    return values[nearest.0];
                }
                let (mut sum, mut total) = (0.0, 0.0);
                for &(sample, distance) in around {
                    let weight = ((reach - distance) / distance * (nearest.1 / reach)).powi(2);
                    sum += weight * values[sample];
                    total += weight;
                }
                sum / total
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn samples_keep_their_values_and_repeated_ones_the_first() {
        let points: Vec<[f64; 2]> = (0..20).map(|i| [f64::from(i % 5), f64::from(i / 5 % 2)]).collect();
        let values: Vec<f64> = (0..20).map(|i| if i < 10 { f64::from(i) } else { 1e9 }).collect();
        let around = SamplesAround::new(&points, &points[..10]);
        assert_eq!(around.nearest(&values), values[..10]);
        assert_eq!(around.mean(&values), values[..10]);
        assert_eq!(around.distances(), [0.0; 10]);
        let one = SamplesAround::new(&points[..1], &[[3.0, 4.0]]);
        assert_eq!((one.distances(), one.mean(&[7.0])), (vec![5.0], vec![7.0]));
    }

    proptest! {
        #[test]
        fn means_lie_between_the_values(x in -1.0..6.0f64, y in -1.0..2.0f64) {
            let points: Vec<[f64; 2]> = (0..10).map(|i| [f64::from(i % 5), f64::from(i / 5)]).collect();
            let values: Vec<f64> = points.iter().map(|p| p[0]).collect();
            let mean = SamplesAround::new(&points, &[[x, y]]).mean(&values)[0];
            // Up to rounding.
            prop_assert!((-1e-12..=4.0 + 1e-12).contains(&mean));
            if (1.0..3.0).contains(&x) && (0.0..1.0).contains(&y) {
                prop_assert!((mean - x).abs() < 1.0, "near the samples' own: {mean} at {x}");
            }
        }
    }
}
