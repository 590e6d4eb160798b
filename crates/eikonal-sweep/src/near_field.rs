//! Initialization (step 2 of the paper's fast sweeping): exact distances near the points.

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
pub(crate) fn near_field<const D: usize>(ghosted: &Ghosted<D>, points: &[[f64; D]], radius: usize) -> NearField {
    let mut squared = vec![f64::INFINITY; ghosted.len()];
    let mut nearest = vec![NONE; ghosted.len()];
    let shape = ghosted.shape();
    for (index, point) in points.iter().enumerate() {
        let cell: [usize; D] = std::array::from_fn(|axis| {
            // The clamp comes first: the cast saturates only far outside the box.
            point[axis].floor().clamp(0.0, (shape[axis] - 2) as f64) as usize
        });
        let low: [usize; D] = std::array::from_fn(|axis| (cell[axis] + 1).saturating_sub(radius));
        let high: [usize; D] = std::array::from_fn(|axis| cell[axis].saturating_add(radius).min(shape[axis] - 1));
        let mut node = low;
        'block: loop {
            let across: f64 = (0..D - 1).map(|axis| (node[axis] as f64 - point[axis]).powi(2)).sum();
            let start = ghosted.position(node);
            for (step, k) in (low[D - 1]..=high[D - 1]).enumerate() {
                let offered = across + (k as f64 - point[D - 1]).powi(2);
                if offered < squared[start + step] {
                    squared[start + step] = offered;
                    nearest[start + step] = index as u32;
                }
            }
            let mut axis = D - 1;
            loop {
                if axis == 0 {
                    break 'block;
                }
                axis -= 1;
                if node[axis] < high[axis] {
                    node[axis] += 1;
                    break;
                }
                node[axis] = low[axis];
            }
        }
    }
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
}
