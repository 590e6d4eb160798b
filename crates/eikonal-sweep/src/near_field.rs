//! Initialization (step 2 of the paper's fast sweeping): exact distances near the points.

use std::array::from_fn;

use rayon::iter::repeat_n;
use rayon::prelude::*;

use crate::ghost::Ghosted;

/// Marks a node that no sample has reached yet.
pub(crate) const NONE: u32 = u32::MAX;

/// Starting values on a ghosted lattice: squared distances in lattice units (infinite where unknown) and the
/// index of the sample they belong to ([`NONE`] where unknown).
pub(crate) struct NearField {
    pub(crate) squared: Vec<f64>,
    pub(crate) nearest: Vec<u32>,
}

/// Offers each point (lattice units) to the nodes of its cell and of `radius − 1` rings of cells around it:
/// (2·radius)^D nodes.
///
/// A point less than `radius` cells from a node has that node in its block. So if the least distance a node was
/// offered is below `radius`, it is the distance to the nearest of all points; if not, it is an upper bound. A
/// point outside the box counts as being in the boundary cell closest to it.
///
/// Of samples at the same distance the first one is kept.
pub(crate) fn near_field<const D: usize>(ghosted: &Ghosted<D>, points: &[[f64; D]], radius: usize) -> NearField {
    // In parallel, for the first touch of memory takes as long as some sweeps.
    let mut squared: Vec<f64> = repeat_n(f64::INFINITY, ghosted.len()).collect();
    let mut nearest: Vec<u32> = repeat_n(NONE, ghosted.len()).collect();
    let shape = ghosted.shape();
    // The clamp comes first: the cast saturates only far outside the box.
    let cell = |point: &[f64; D], axis: usize| point[axis].floor().clamp(0.0, (shape[axis] - 2) as f64) as usize;
    let by_plane = |(index, point): (usize, &[f64; D])| (cell(point, 0), index as u32);
    let mut order: Vec<(usize, u32)> = points.par_iter().enumerate().map(by_plane).collect();
    order.par_sort_unstable();
    let from = |plane: usize| order.partition_point(|(cell, _)| *cell < plane);
    let plane = ghosted.strides()[0];
    let planes = squared.par_chunks_mut(plane).zip(nearest.par_chunks_mut(plane)).skip(1).take(shape[0]);
    planes.enumerate().for_each(|(i, (squared, nearest))| {
        for (_, index) in &order[from(i.saturating_sub(radius))..from(i.saturating_add(radius))] {
            let point = &points[*index as usize];
            let [low, high] = [0, 1].map(|side| -> [usize; D] {
                from_fn(|axis| match (axis, side) {
                    (0, _) => i,
                    (_, 0) => (cell(point, axis) + 1).saturating_sub(radius),
                    _ => cell(point, axis).saturating_add(radius).min(shape[axis] - 1),
                })
            });
            let rows = if D == 3 { low[1]..=high[1] } else { 0..=0 };
            for j in rows {
                let mut node = low;
                if D == 3 {
                    node[1] = j;
                }
                let across: f64 = (0..D - 1).map(|axis| (node[axis] as f64 - point[axis]).powi(2)).sum();
                let start = ghosted.position(node) - (i + 1) * plane;
                for (step, k) in (low[D - 1]..=high[D - 1]).enumerate() {
                    let offered = across + (k as f64 - point[D - 1]).powi(2);
                    let (squared, nearest) = (&mut squared[start + step], &mut nearest[start + step]);
                    if offered < *squared || (offered == *squared && *index < *nearest) {
                        (*squared, *nearest) = (offered, *index);
                    }
                }
            }
        }
    });
    NearField { squared, nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SHAPE: [usize; 2] = [9, 7];

    proptest! {
        /// The cloud reaches two cells beyond the box on each side.
        #[test]
        fn values_below_the_radius_are_the_distance_to_the_whole_cloud(
            points in prop::collection::vec((-2.0..10.0_f64, -2.0..8.0_f64), 1..30),
            radius in 1_usize..4,
        ) {
            let points: Vec<[f64; 2]> = points.into_iter().map(|(x, y)| [x, y]).collect();
            let ghosted = Ghosted::new(SHAPE);
            let near = near_field(&ghosted, &points, radius);
            for i in 0..SHAPE[0] {
                for j in 0..SHAPE[1] {
                    let squared_to = |p: &[f64; 2]| (i as f64 - p[0]).powi(2) + (j as f64 - p[1]).powi(2);
                    let nearest = points.iter().map(squared_to).fold(f64::INFINITY, f64::min);
                    let at = ghosted.position([i, j]);
                    if nearest < (radius * radius) as f64 {
                        prop_assert_eq!(near.squared[at], nearest);
                        prop_assert_eq!(squared_to(&points[near.nearest[at] as usize]), nearest);
                    } else {
                        prop_assert!(near.squared[at] >= nearest);
                    }
                }
            }
        }
    }

    #[test]
    fn ghosts_stay_unreached() {
        let ghosted = Ghosted::new(SHAPE);
        let points: Vec<[f64; 2]> = (0..64).map(|n| [(n % 9) as f64, (n / 9) as f64]).collect();
        let near = near_field(&ghosted, &points, 2);
        let reached = near.nearest.iter().filter(|&&index| index != NONE).count();
        assert_eq!(reached, SHAPE[0] * SHAPE[1]);
    }

    #[test]
    fn a_point_outside_starts_at_the_closest_boundary_nodes() {
        let ghosted = Ghosted::new(SHAPE);
        let near = near_field(&ghosted, &[[100.0, -1e100]], 2);
        let reached: Vec<usize> = (0..ghosted.len()).filter(|&at| near.nearest[at] == 0).collect();
        let expected: Vec<usize> =
            [6, 7, 8].iter().flat_map(|&i| [0, 1, 2].map(|j| ghosted.position([i, j]))).collect();
        assert_eq!(reached, expected);
    }

    #[test]
    fn of_samples_at_the_same_distance_the_first_is_kept() {
        let ghosted = Ghosted::new(SHAPE);
        // The second is in the cell before.
        let near = near_field(&ghosted, &[[3.5, 2.0], [2.5, 2.0]], 2);
        assert_eq!(near.nearest[ghosted.position([3, 2])], 0);
    }
}
