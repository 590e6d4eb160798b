//! Initialization (step 2 of the paper's fast sweeping): exact distances near the points.

use crate::ghost::Ghosted;

/// Marks a node that no sample has reached yet.
pub(crate) const NONE: u32 = u32::MAX;

/// Square of the radius, in cells, within which the starting values are exact.
pub(crate) const EXACT_RADIUS_SQUARED: f64 = 4.0;

/// Starting values on a ghosted lattice: squared distances in lattice units (infinite where unknown) and the
/// index of the sample they belong to ([`NONE`] where unknown).
pub(crate) struct NearField {
    pub(crate) squared: Vec<f64>,
    pub(crate) nearest: Vec<u32>,
}

/// Offers each point (lattice units) to the nodes of its cell and of the ring of cells around it, 4^D nodes.
///
/// A point less than 2 cells from a node has that node in its block. So if the least distance a node was offered is below
/// 2, it is the distance to the nearest of all points; if not, it is an upper bound. A point outside the box counts
/// as being in the boundary cell closest to it.
pub(crate) fn near_field<const D: usize>(ghosted: &Ghosted<D>, points: &[[f64; D]]) -> NearField {
    let mut squared = vec![f64::INFINITY; ghosted.len()];
    let mut nearest = vec![NONE; ghosted.len()];
    let shape = ghosted.shape();
    for (index, point) in points.iter().enumerate() {
        let cell: [usize; D] = std::array::from_fn(|axis| {
            // The clamp comes first: the cast saturates only far outside the box.
            point[axis].floor().clamp(0.0, (shape[axis] - 2) as f64) as usize
        });
        let low: [usize; D] = std::array::from_fn(|axis| cell[axis].saturating_sub(1));
        let high: [usize; D] = std::array::from_fn(|axis| (cell[axis] + 2).min(shape[axis] - 1));
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
