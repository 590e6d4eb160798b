//! How round the neighbourhoods of points are: flat on a surface, round where they fill a volume or noise is as deep as these are wide.

use std::cmp::Ordering;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::points::kd_tree::{tree_of, within};
use crate::points::spacing::roundness;

/// So many points are asked, at most.
const ASKED: usize = 500;

/// The roundness of the neighbourhoods of some points, in the median.
pub struct MedianRoundness<'a, const D: usize> {
    points: &'a [[f64; D]],
    tree: ImmutableKdTree<f64, D>,
    asked: Vec<&'a [f64; D]>,
}

impl<'a, const D: usize> MedianRoundness<'a, D> {
    pub fn of(points: &'a [[f64; D]]) -> Self {
        // Whatever the order of the points.
        let mut sorted: Vec<&[f64; D]> = points.iter().collect();
        sorted.par_sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
        let asked = sorted.into_iter().step_by(points.len().div_ceil(ASKED)).collect();
        Self { points, tree: tree_of(points), asked }
    }

    /// Among the nearest neighbours, so many.
    pub fn among(&self, count: usize) -> f64 {
        let wanted = NonZero::<usize>::MIN.saturating_add(count);
        self.median(|point| {
            let nearest = self.tree.query(point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
            nearest.iter().map(|n| n.item as usize).collect()
        })
    }

    /// Of what lies in balls.
    pub fn within(&self, radius: f64) -> f64 {
        self.median(|point| within(&self.tree, point, radius).collect())
    }

    fn median(&self, around: impl Fn(&[f64; D]) -> Vec<usize> + Sync) -> f64 {
        let of = |point: &&[f64; D]| roundness(self.points, &around(point));
        // Of a point alone there is none.
        let mut found: Vec<f64> = self.asked.par_iter().map(of).filter(|round| round.is_finite()).collect();
        found.sort_by(f64::total_cmp);
        found.get(found.len() / 2).copied().unwrap_or(0.0)
    }
}
