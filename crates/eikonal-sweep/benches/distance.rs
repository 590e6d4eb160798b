//! Distance by all three methods on the paper's two sizes and on 128³ nodes.
//!
//! Clouds are analytic stand-ins with the paper's point counts: a flat double torus, and a sphere for the teapot.
//! Throughput counts nodes over the whole solve: initialization, 2^D sweeps and output.

#![allow(clippy::expect_used, reason = "a panic is how a bench fails")]

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use zeroset_eikonal_sweep::{Lattice, Method, Options, distance};

/// Fractions of n·golden ratio: evenly spread without randomness.
fn golden(n: usize) -> f64 {
    (n as f64 * 0.618_033_988_749_894_9).fract()
}

/// Two tori side by side in the plane z = 0, in the box [0, 70] × [0, 70] × [0, 12].
fn double_torus(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|n| {
            let (around, tube) = (TAU * golden(n), TAU * (n as f64 + 0.5) / count as f64 * 2.0);
            let centre = if n % 2 == 0 { 20.0 } else { 50.0 };
            let radius = 13.0 + 4.5 * tube.cos();
            [centre + radius * around.cos(), 35.0 + radius * around.sin(), 6.0 + 4.5 * tube.sin()]
        })
        .collect()
}

/// A Fibonacci sphere stretched into the middle of a box of the given sides.
fn ellipsoid(count: usize, sides: [f64; 3]) -> Vec<[f64; 3]> {
    (0..count)
        .map(|n| {
            let z = 1.0 - (2.0 * n as f64 + 1.0) / count as f64;
            let ring = (1.0 - z * z).sqrt();
            let angle = PI * (3.0 - 5.0_f64.sqrt()) * n as f64;
            let unit = [ring * angle.cos(), ring * angle.sin(), z];
            std::array::from_fn(|axis| sides[axis] * (0.5 + 0.4 * unit[axis]))
        })
        .collect()
}

fn bench(criterion: &mut Criterion) {
    let wide = double_torus(20_000).iter().map(|p| [p[0] * 1.8, p[1] * 1.8, p[2] * 10.0]).collect();
    let cases = [
        ("4352 points, 71x71x13", double_torus(4352), [71, 71, 13]),
        ("4255 points, 64x41x32", ellipsoid(4255, [63.0, 40.0, 31.0]), [64, 41, 32]),
        ("20000 points, 128x128x128", wide, [128, 128, 128]),
    ];
    let methods = [Method::Godunov, Method::ClosestPoint, Method::Exact];
    for (name, points, shape) in cases {
        let lattice = Lattice::new([0.0; 3], 1.0, shape).expect("a valid lattice");
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        group.throughput(Throughput::Elements(lattice.node_count() as u64));
        for method in methods {
            let options = Options { method, ..Options::default() };
            group.bench_function(BenchmarkId::from_parameter(format!("{method:?}")), |bencher| {
                bencher.iter(|| distance(black_box(&points), &lattice, &options));
            });
        }
        group.finish();
        // Eight sweeps that read and write every value, or the nearest point and its distance. Godunov's local solution has six
        // products and a root; how many points a node has to be asked for depends on them.
        println!("{name}/Godunov: at least {} bytes and {} multiplications each", 8 * 16, 8 * 7);
        println!("{name}/ClosestPoint: at least {} bytes and 0 multiplications each", 8 * 2 * 12);
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
