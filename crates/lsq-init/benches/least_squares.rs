//! 128³ values on 64³ coefficients (two nodes per cell) and on 127³ (one node per cell, as the pipeline fits), on all
//! threads and on one.

#![allow(clippy::expect_used, reason = "a panic is how a bench fails")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use ndarray::ArrayD;
use zeroset_bspline::KnotVector;
use zeroset_lsq_init::{Fairness, Options, fit};

const NODES: usize = 128;

fn bench(criterion: &mut Criterion) {
    let axis: Vec<f64> = (0..NODES).map(|i| -1.0 + 2.0 * i as f64 / NODES as f64).collect();
    let axes = [axis.clone(), axis.clone(), axis];
    // A torus.
    let phi = ArrayD::from_shape_fn(vec![NODES; 3], |i| {
        let [x, y, z] = [axes[0][i[0]], axes[1][i[1]], axes[2][i[2]]];
        (x.hypot(y) - 0.6).hypot(z) - 0.25
    });
    let options = Options { fairness: Fairness::Length(1.0 / NODES as f64), ..Options::default() };

    let mut group = criterion.benchmark_group("least squares");
    group.sample_size(10);
    for coefficients in [64, 127] {
        let cells = coefficients - 3;
        let knots: [KnotVector; 3] =
            std::array::from_fn(|_| KnotVector::uniform(3, -1.0, 2.0 / cells as f64, cells).expect("valid knots"));
        for (name, threads) in [("one thread", 1), ("all threads", 0)] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            group.bench_function(BenchmarkId::new(name, coefficients), |bencher| {
                bencher.iter(|| pool.install(|| fit(phi.view(), &axes, &knots, &options).expect("a fit")));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
