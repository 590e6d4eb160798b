//! The cubic coefficients that act on one block of cells: halving, bounds, values at nodes.
//!
//! All passes are sums with weights that are not negative, in an order that does not depend on the block. So a coefficient or
//! a value that two blocks share has the same bits in both, and has the sign of what it was made of.

use crate::block_field::BlockField;
use crate::block_mask::SIDE as CELLS;
use crate::hierarchical_spline::{LOCAL, WIDTH};

/// Coefficients along each axis: those of 8 cells.
const SIDE: usize = CELLS + 3;

/// Coarse coefficients on which those of half of the block depend.
const HALF: usize = CELLS / 2 + 3;

/// The `11 × 11 [× 11]` coefficients that act on a block of `8 × 8 [× 8]` cells, in C order.
pub(crate) struct CoefficientWindow<const D: usize>(Vec<f64>);

impl<const D: usize> CoefficientWindow<D> {
    /// Coefficients along each axis.
    pub(crate) const SIDE: usize = SIDE;

    pub(crate) fn zeros() -> Self {
        Self(vec![0.0; SIDE.pow(D as u32)])
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.0
    }

    /// Those of a part of half the side, on knots halved along every axis.
    pub(crate) fn halved(&self, half: [usize; D]) -> Self {
        let mut part = Vec::with_capacity(SIDE.pow(D as u32));
        for row in 0..HALF.pow(D as u32 - 1) {
            let (mut rest, mut start, mut stride) = (row, half[D - 1] * CELLS / 2, SIDE);
            for axis in (0..D - 1).rev() {
                start += (rest % HALF + half[axis] * CELLS / 2) * stride;
                rest /= HALF;
                stride *= SIDE;
            }
            part.extend_from_slice(&self.0[start..start + HALF]);
        }
        for axis in (0..D).rev() {
            part = along::<HALF, SIDE, 3>(
                &part,
                SIDE.pow((D - 1 - axis) as u32),
                |k| k / 2,
                |c, k| {
                    if k % 2 == 0 { 0.5 * c[0] + 0.5 * c[1] } else { 0.125 * c[0] + 0.75 * c[1] + 0.125 * c[2] }
                },
            );
        }
        Self(part)
    }

    /// Adds a level's corrections; the first coefficient has index `first`.
    pub(crate) fn add(&mut self, corrections: &BlockField<D>, first: [i64; D]) {
        let mut more = vec![0.0; self.0.len()];
        corrections.gather(first, SIDE, &mut more);
        for (c, more) in self.0.iter_mut().zip(&more) {
            *c += more;
        }
    }

    /// Those that act on the cell at some places along the axes.
    pub(crate) fn local(&self, places: [usize; D]) -> [f64; LOCAL] {
        let mut local = [0.0; LOCAL];
        for (row, out) in local[..WIDTH.pow(D as u32)].chunks_exact_mut(WIDTH).enumerate() {
            let (mut rest, mut start, mut stride) = (row, places[D - 1], SIDE);
            for axis in (0..D - 1).rev() {
                start += (rest % WIDTH + places[axis]) * stride;
                rest /= WIDTH;
                stride *= SIDE;
            }
            out.copy_from_slice(&self.0[start..start + WIDTH]);
        }
        local
    }

    /// The smallest and the largest coefficient that act on each cell.
    pub(crate) fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        (self.extremes(|a, b| if b < a { b } else { a }), self.extremes(|a, b| if b > a { b } else { a }))
    }

    /// The smallest and the largest of all coefficients.
    pub(crate) fn range(&self) -> (f64, f64) {
        let extend =
            |(low, high): (f64, f64), c: &f64| (if *c < low { *c } else { low }, if *c > high { *c } else { high });
        self.0.iter().fold((f64::INFINITY, f64::NEG_INFINITY), extend)
    }

    fn extremes(&self, pick: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut values = None;
        for axis in (0..D).rev() {
            let input: &[f64] = values.as_deref().unwrap_or(&self.0);
            let inner = CELLS.pow((D - 1 - axis) as u32);
            let pick = |c: [f64; 4], _| pick(pick(c[0], c[1]), pick(c[2], c[3]));
            values = Some(along::<SIDE, CELLS, 4>(input, inner, |k| k, pick));
        }
        values.unwrap_or_default()
    }

    /// f at the `9 × 9 [× 9]` nodes.
    pub(crate) fn node_values(&self) -> Vec<f64> {
        let mut values = None;
        for axis in (0..D).rev() {
            let input: &[f64] = values.as_deref().unwrap_or(&self.0);
            let inner = (CELLS + 1).pow((D - 1 - axis) as u32);
            values = Some(along::<SIDE, { CELLS + 1 }, 3>(
                input,
                inner,
                |k| k,
                |c, _| c[0] * (1.0 / 6.0) + c[1] * (4.0 / 6.0) + c[2] * (1.0 / 6.0),
            ));
        }
        values.unwrap_or_default()
    }
}

/// Replaces lines of `FROM` numbers, `inner` apart, by lines of `TO`: entry `k` is made of `TAPS` numbers (as far as there are
/// so many) from `first(k)` on.
#[inline(always)]
fn along<const FROM: usize, const TO: usize, const TAPS: usize>(
    input: &[f64],
    inner: usize,
    first: impl Fn(usize) -> usize,
    entry: impl Fn([f64; TAPS], usize) -> f64,
) -> Vec<f64> {
    let mut output = vec![0.0; input.len() / FROM * TO];
    let tap = |k: usize, t: usize| (first(k) + t).min(FROM - 1);
    for (slab, out) in input.chunks_exact(FROM * inner).zip(output.chunks_exact_mut(TO * inner)) {
        if inner == 1 {
            for (k, out) in out.iter_mut().enumerate() {
                *out = entry(std::array::from_fn(|t| slab[tap(k, t)]), k);
            }
            continue;
        }
        for (k, out) in out.chunks_exact_mut(inner).enumerate() {
            let lines: [&[f64]; TAPS] = std::array::from_fn(|t| &slab[tap(k, t) * inner..][..inner]);
            for (i, out) in out.iter_mut().enumerate() {
                *out = entry(lines.map(|line| line[i]), k);
            }
        }
    }
    output
}
