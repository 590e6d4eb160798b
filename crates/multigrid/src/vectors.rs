//! Sums of vectors, and inner products that are the same for any number of threads.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Inner products are summed over pieces of this length, then from the first piece to the last.
pub(crate) const PIECE: usize = 1 << 12;

/// Below this length tasks are not worth their overhead.
const FEW: usize = 1 << 17;

/// `Σ aᵢ bᵢ`, the same for any number of threads: of each 4096 numbers first, then of these sums from the first to the last.
pub fn inner_product(a: &[f64], b: &[f64]) -> f64 {
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

/// `y ← 0`.
pub(crate) fn clear(y: &mut [f64]) {
    if y.len() < FEW {
        y.fill(0.0);
    } else {
        y.par_chunks_mut(PIECE).with_min_len(8).for_each(|y| y.fill(0.0));
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole numbers, so that sums are exact in any order; longer than what one task does, and no multiple of a piece.
    const LENGTH: usize = FEW + 4321;

    fn whole(length: usize, factor: usize) -> Vec<f64> {
        (0..length).map(|i| (i * factor % 101) as f64 - 50.0).collect()
    }

    #[test]
    fn long_products_are_the_same_for_any_number_of_threads() {
        let exact = (0..LENGTH as i64).map(|i| (i * 7 % 101 - 50) * (i * 13 % 101 - 50)).sum::<i64>();
        assert_eq!(inner_product(&whole(LENGTH, 7), &whole(LENGTH, 13)), exact as f64);
        // Now with rounding: the sums of pieces, from the first to the last.
        let (a, b): (Vec<f64>, Vec<f64>) = (0..LENGTH).map(|i| (1.0 / (i + 1) as f64, (i as f64).sin())).unzip();
        let pieces: f64 = a.chunks(PIECE).zip(b.chunks(PIECE)).map(|(a, b)| inner_product(a, b)).sum();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| inner_product(&a, &b)), pieces, "{threads} threads");
        }
    }

    #[test]
    fn long_vectors_are_updated_as_short_ones() {
        for length in [5, LENGTH] {
            let (x, before) = (whole(length, 7), whole(length, 13));
            let mut y = before.clone();
            add_scaled(&mut y, 3.0, &x);
            assert!((0..length).all(|i| y[i] == before[i] + 3.0 * x[i]));
            scale_and_add(&mut y, -2.0, &x);
            assert!((0..length).all(|i| y[i] == -2.0 * before[i] - 5.0 * x[i]));
        }
    }
}
