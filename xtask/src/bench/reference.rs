//! The machine's own rates, to which those of kernels are compared.

use std::hint::black_box;
use std::time::Instant;

use pulp::Arch;

/// Each of the three arrays of the triad: larger than caches are.
const BYTES: usize = 64 << 20;
/// Numbers that are multiplied and added at the same time: enough to hide the latency, few enough to stay in registers.
const LANES: usize = 40;
/// Rounds of them.
const ROUNDS: usize = 2_000_000;
/// The best of so many.
const TRIES: usize = 5;

/// Memory bandwidth and arithmetic rate, on one thread and on all cores.
pub fn section() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = String::from(
        "## The machine's own rates\n\n| threads | triad a = b + s c, GB/s | multiply-add, 10⁹ per second |\n|---|---|---|\n",
    );
    let mut counts = vec![1, cores];
    counts.dedup();
    for threads in counts {
        text.push_str(&format!("| {threads} | {:.1} | {:.1} |\n", triad(threads) / 1e9, multiply_add(threads) / 1e9));
    }
    text.push_str(
        "\nArrays of 64 MB, 24 bytes per element (what is written is not counted twice); multiply-adds in registers.\n",
    );
    text
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
                scope.spawn(move || {
                    Arch::new().dispatch(
                        #[inline(always)]
                        || a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + scale * c),
                    );
                });
            }
        });
        best = best.min(start.elapsed().as_secs_f64());
        black_box(&a);
    }
    (3 * BYTES) as f64 / best
}

/// Multiply-adds per second.
fn multiply_add(threads: usize) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..TRIES {
        let start = Instant::now();
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    let (factor, mut sums) = (black_box(0.999), [black_box(1.0); LANES]);
                    Arch::new().dispatch(
                        #[inline(always)]
                        || {
                            for _ in 0..ROUNDS {
                                sums.iter_mut().for_each(|sum| *sum = f64::mul_add(*sum, factor, 1.0));
                            }
                        },
                    );
                    black_box(sums);
                });
            }
        });
        best = best.min(start.elapsed().as_secs_f64());
    }
    (threads * LANES * ROUNDS) as f64 / best
}
