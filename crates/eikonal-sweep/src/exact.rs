//! The exact distance: one kd-tree query per node.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::distance::Error;

/// Squared distance to, and index of, the nearest point for each node in C order; all in lattice units.
///
/// Nodes are independent, so the threads cannot change the result. Of equal points the one with the
/// smallest index is reported.
pub(crate) fn exact<const D: usize>(shape: [usize; D], points: &[[f64; D]]) -> Result<(Vec<f64>, Vec<u32>), Error> {
    // Duplicates make the tree's leaves unsplittable and its queries slow.
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let by_position = |&a: &u32, &b: &u32| {
        let (a, b) = (&points[a as usize], &points[b as usize]);
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    // Stable, so of equal points the first given stays in front.
    order.sort_by(by_position);
    order.dedup_by_key(|index| points[*index as usize]);
    let distinct: Vec<[f64; D]> = order.iter().map(|&index| points[index as usize]).collect();
    let tree: ImmutableKdTree<f64, D> =
        ImmutableKdTree::new_from_slice(&distinct).map_err(|cause| Error::Tree(cause.to_string()))?;

    let n = shape[D - 1];
    let nodes = shape.iter().product();
    let mut squared = vec![0.0; nodes];
    let mut nearest = vec![0_u32; nodes];
    squared.par_chunks_mut(n).zip(nearest.par_chunks_mut(n)).enumerate().for_each(|(row, (squared, nearest))| {
        let mut at = [0.0; D];
        let mut rest = row;
        for axis in (0..D - 1).rev() {
            at[axis] = (rest % shape[axis]) as f64;
            rest /= shape[axis];
        }
        for k in 0..n {
            at[D - 1] = k as f64;
            let found = tree.query(&at).nearest_one::<SquaredEuclidean<f64>>().execute();
            squared[k] = found.distance;
            nearest[k] = order[found.item as usize];
        }
    });
    Ok((squared, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Coordinates in quarters: many equal coordinates, duplicates and ties.
        #[test]
        fn agrees_with_brute_force(
            points in prop::collection::vec((-8_i32..40, -8_i32..32, 0_i32..3), 1..300),
        ) {
            let points: Vec<[f64; 3]> =
                points.into_iter().map(|(x, y, z)| [x, y, z].map(|q| f64::from(q) * 0.25)).collect();
            let (squared, nearest) = exact([9, 7, 3], &points).unwrap();
            for node in 0..9 * 7 * 3 {
                let at = [node / 21, node / 3 % 7, node % 3].map(|coordinate| coordinate as f64);
                let to = |p: &[f64; 3]| (0..3).map(|axis| (at[axis] - p[axis]).powi(2)).sum::<f64>();
                // Quarters and their squares are exact in f64, whatever the order of summation.
                prop_assert_eq!(squared[node], points.iter().map(to).fold(f64::INFINITY, f64::min));
                prop_assert_eq!(to(&points[nearest[node] as usize]), squared[node]);
            }
        }
    }

    #[test]
    fn of_equal_points_the_first_is_reported() {
        let mut points = vec![[50.0, 50.0]];
        points.extend([[1.0, 1.0]; 1000]);
        let (squared, nearest) = exact([3, 3], &points).unwrap();
        assert_eq!(squared[4], 0.0);
        assert_eq!(nearest, [1; 9]);
    }
}
