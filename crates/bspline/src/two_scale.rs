//! The two-scale relation of cubic cardinal B-splines, block by block.

use std::sync::Arc;

use crate::block_field::BlockField;
use crate::block_mask::SIDE;
use crate::index_set::IndexSet;

/// Coarse coefficients on which a block's fine ones depend, along each axis.
const PATCH: usize = SIDE / 2 + 2;

/// The coefficients, on knots halved along every axis, of the function whose coefficients `gather` copies: from a first
/// index a box of 6 along each axis.
///
/// With function `r` on the cells `r − 3 … r`, fine coefficient `2m` is the mean of the coarse `m` and `m + 1`, and `2m + 1`
/// has weights 1, 6, 1 over 8 on `m`, `m + 1`, `m + 2`.
pub(crate) fn prolonged<const D: usize>(
    needed: Arc<IndexSet<D>>,
    gather: impl Fn([i64; D], usize, &mut [f64]) + Sync,
) -> BlockField<D> {
    let mut field = BlockField::zeros(Arc::clone(&needed));
    field.fill_blocks(|slot, block| {
        let mut patch = [0.0; PATCH * PATCH * PATCH];
        let patch = &mut patch[..PATCH.pow(D as u32)];
        gather(needed.block_start(slot).map(|k| i64::from(k / 2)), PATCH, patch);
        up(patch, D, block);
    });
    field
}

/// From a box of 6 coarse coefficients along each axis to a block of 8 fine ones.
fn up(patch: &[f64], dimension: usize, block: &mut [f64]) {
    let (mut a, mut b) = ([0.0; SIDE * SIDE * SIDE], [0.0; SIDE * SIDE * SIDE]);
    a[..patch.len()].copy_from_slice(patch);
    // From the last axis to the first: lines of 6 become lines of 8 numbers, then of 8 lines, then of 8 planes.
    let (mut inner, mut outer) = (1, patch.len() / PATCH);
    for _ in 0..dimension {
        for slab in 0..outer {
            let input = &a[slab * PATCH * inner..][..PATCH * inner];
            let output = &mut b[slab * SIDE * inner..][..SIDE * inner];
            for m in 0..SIDE / 2 {
                for i in 0..inner {
                    let [low, middle, high] = [0, 1, 2].map(|k| input[(m + k) * inner + i]);
                    output[2 * m * inner + i] = 0.5 * (low + middle);
                    output[(2 * m + 1) * inner + i] = 0.125 * (low + high) + 0.75 * middle;
                }
            }
        }
        inner *= SIDE;
        outer /= PATCH;
        std::mem::swap(&mut a, &mut b);
    }
    block.copy_from_slice(&a[..block.len()]);
}
