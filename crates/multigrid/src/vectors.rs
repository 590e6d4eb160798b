//! Sums of vectors, and inner products that are the same for any number of threads.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Inner products are summed over pieces of this length, then from the first piece to the last.
pub(crate) const PIECE: usize = 1 << 12;

/// Below this length tasks are not worth their overhead.
const FEW: usize = 1 << 17;

/// `Σ aᵢ bᵢ`.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let piece = |(a, b): (&[f64], &[f64])| Arch::new().dispatch(Dot(a, b));
    if a.len() < FEW {
        a.chunks(PIECE).zip(b.chunks(PIECE)).map(piece).sum()
    } else {
        let sums: Vec<f64> = a.par_chunks(PIECE).zip(b.par_chunks(PIECE)).with_min_len(8).map(piece).collect();
        sums.iter().sum()
    }
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl WithSimd for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        const LANES: usize = 16;
        let (a, a_rest) = self.0.as_chunks::<LANES>();
        let (b, b_rest) = self.1.as_chunks::<LANES>();
        let mut sums = [0.0; LANES];
        for (a, b) in a.iter().zip(b) {
            for l in 0..LANES {
                sums[l] += a[l] * b[l];
            }
        }
        sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
    }
}

/// `y ← y + a x`.
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    update(y, x, |y, x| y + a * x);
}

/// `y ← x + a y`.
pub(crate) fn scale_and_add(y: &mut [f64], a: f64, x: &[f64]) {
    update(y, x, |y, x| x + a * y);
}

#[inline(always)]
fn update(y: &mut [f64], x: &[f64], new: impl Fn(f64, f64) -> f64 + Sync) {
    let few = |(y, x): (&mut [f64], &[f64])| y.iter_mut().zip(x).for_each(|(y, x)| *y = new(*y, *x));
    if y.len() < FEW {
        few((y, x));
    } else {
        y.par_chunks_mut(PIECE).zip(x.par_chunks(PIECE)).with_min_len(8).for_each(few);
    }
}
