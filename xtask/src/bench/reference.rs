//! The machine's own rates, to which those of kernels are compared.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};

/// Each of the three arrays of the triad: larger than caches are.
const BYTES: usize = 64 << 20;
/// Vectors that are multiplied and added at the same time: enough to hide the latency, few enough to stay in registers.
const CHAINS: usize = 10;
/// Rounds of them.
const ROUNDS: usize = 10_000_000;
/// The best of so many.
const TRIES: usize = 5;

/// What one core can do.
#[derive(Debug, Clone, Copy)]
pub struct Core {
    /// Bytes per second to and from memory.
    pub bandwidth: f64,
    /// Multiply-adds per second.
    pub arithmetic: f64,
}

/// Memory bandwidth and arithmetic rate, on one thread and on all cores; and those of one.
pub fn section() -> (String, Core) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = String::from(
        "## The machine's own rates\n\n| threads | triad a = b + s c, GB/s | multiply-add, 10⁹ per second |\n|---|---|---|\n",
    );
    let mut counts = vec![1, cores];
    counts.dedup();
    let rates: Vec<Core> = counts.iter().map(|n| Core { bandwidth: triad(*n), arithmetic: multiply_add(*n) }).collect();
    for (threads, rate) in counts.iter().zip(&rates) {
        text.push_str(&format!("| {threads} | {:.1} | {:.1} |\n", rate.bandwidth / 1e9, rate.arithmetic / 1e9));
    }
    let [found, again] = super::ballast::first_touch();
    text.push_str(
        "\nArrays of 64 MB, 24 bytes per element (what is written is not counted twice); multiply-adds in registers.\n",
    );
    text.push_str(&format!(
        "\nThe first touch of 10⁹ bytes takes {found:.2} s as memory is found, {again:.2} s where it was given back just before. So that the \
         host's share does not count, as much memory as a run is going to take stays in use until the run takes it.\n"
    ));
    (text, rates[0])
}

/// Bytes per second of `a = b + s c`.
fn triad(threads: usize) -> f64 {
    let count = BYTES / 8;
    let (mut a, b, c) = (vec![0.0; count], vec![1.0; count], vec![2.0; count]);
    let part = count.div_ceil(threads);
    let mut best = f64::INFINITY;
    for _ in 0..TRIES {
        let scale = black_box(3.0);
        let start = Instant::now();
        std::thread::scope(|scope| {
            for ((a, b), c) in a.chunks_mut(part).zip(b.chunks(part)).zip(c.chunks(part)) {
                scope.spawn(move || Arch::new().dispatch(Triad { a, b, c, scale }));
            }
        });
        best = best.min(start.elapsed().as_secs_f64());
        black_box(&a);
    }
    (3 * BYTES) as f64 / best
}

/// Multiply-adds per second.
fn multiply_add(threads: usize) -> f64 {
    let mut rate: f64 = 0.0;
    for _ in 0..TRIES {
        let start = Instant::now();
        let lanes: usize = std::thread::scope(|scope| {
            let running: Vec<_> = (0..threads).map(|_| scope.spawn(|| Arch::new().dispatch(MultiplyAdd))).collect();
            running.into_iter().map(|thread| thread.join().unwrap_or(0)).sum()
        });
        rate = rate.max((lanes * CHAINS * ROUNDS) as f64 / start.elapsed().as_secs_f64());
    }
    rate
}

/// `a = b + s c`.
struct Triad<'a> {
    a: &'a mut [f64],
    b: &'a [f64],
    c: &'a [f64],
    scale: f64,
}

impl WithSimd for Triad<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let scale = simd.splat_f64s(self.scale);
        let (a, b, c) = (S::as_mut_simd_f64s(self.a), S::as_simd_f64s(self.b), S::as_simd_f64s(self.c));
        for ((a, b), c) in a.0.iter_mut().zip(b.0).zip(c.0) {
            *a = simd.mul_add_f64s(scale, *c, *b);
        }
        for ((a, b), c) in a.1.iter_mut().zip(b.1).zip(c.1) {
            *a = *b + self.scale * c;
        }
    }
}

/// Multiply-adds in registers. Tells how many numbers each is done with at once.
struct MultiplyAdd;

impl WithSimd for MultiplyAdd {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        let (factor, one) = (simd.splat_f64s(black_box(0.999)), simd.splat_f64s(1.0));
        let mut sums = [simd.splat_f64s(black_box(1.0)); CHAINS];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = simd.mul_add_f64s(*sum, factor, one);
            }
        }
        black_box(sums.map(|sum| simd.reduce_sum_f64s(sum)));
        S::F64_LANES
    }
}
