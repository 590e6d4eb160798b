//! 256³ values on 128³ coefficients (two nodes per cell), and 128³ on 127³ (one node per cell, as the pipeline fits), on all threads
//! and on one.

#![allow(clippy::expect_used, reason = "a panic is how a bench fails")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ndarray::ArrayD;
use zeroset_bspline::KnotVector;
use zeroset_lsq_init::{Fairness, Options, fit};

fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("least squares");
    group.sample_size(10);
    for (nodes, coefficients) in [(128, 127), (256, 128)] {
        let axis: Vec<f64> = (0..nodes).map(|i| -1.0 + 2.0 * i as f64 / nodes as f64).collect();
        let axes = [axis.clone(), axis.clone(), axis];
        // A torus.
        let phi = ArrayD::from_shape_fn(vec![nodes; 3], |i| {
            let [x, y, z] = [axes[0][i[0]], axes[1][i[1]], axes[2][i[2]]];
            (x.hypot(y) - 0.6).hypot(z) - 0.25
        });
        let options = Options { fairness: Fairness::Length(1.0 / nodes as f64), ..Options::default() };
        let cells = coefficients - 3;
        let knots: [KnotVector; 3] =
            std::array::from_fn(|_| KnotVector::uniform(3, -1.0, 2.0 / cells as f64, cells).expect("valid knots"));
        group.throughput(Throughput::Elements(phi.len() as u64));
        for (name, threads) in [("one thread", 1), ("all threads", 0)] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            group.bench_function(BenchmarkId::new(name, format!("{nodes} to {coefficients}")), |bencher| {
                bencher.iter(|| pool.install(|| fit(phi.view(), &axes, &knots, &options).expect("a fit")));
            });
        }
        // The values once, each in 4 + 2 + 1 products on the way to the coefficients' lattice; in every iteration one vector in and out,
        // and the change to the eigenbasis along three axes and back.
        let (_, report) = fit(phi.view(), &axes, &knots, &options).expect("a fit");
        let unknowns = coefficients.pow(3) as f64 / phi.len() as f64;
        let multiplications = 7.0 + report.iterations as f64 * unknowns * (6 * coefficients) as f64;
        let bytes = 8.0 + report.iterations as f64 * unknowns * 16.0;
        println!(
            "least squares/one thread/{nodes} to {coefficients}: at least {bytes:.0} bytes and {multiplications:.0} multiplications each"
        );
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
