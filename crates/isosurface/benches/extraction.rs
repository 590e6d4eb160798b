//! Extraction on 128³ samples of an analytic field, with and without the function, and on noise, where every cell is cut.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ndarray::ArrayD;
use zeroset_isosurface::{ImplicitFunction, LatticeSamples, Options, surface};

const NODES: usize = 128;

/// A gyroid with three periods along each side of [−1, 1]³, capped at its faces.
struct Gyroid;

impl ImplicitFunction<3> for Gyroid {
    fn value_and_gradient(&self, x: &[f64; 3]) -> (f64, [f64; 3]) {
        let k = 3.0 * std::f64::consts::PI;
        let (s, c) = (x.map(|x| (k * x).sin()), x.map(|x| (k * x).cos()));
        let value = s[0] * c[1] + s[1] * c[2] + s[2] * c[0];
        let slope = |a: usize| c[a] * c[(a + 1) % 3] - s[a] * s[(a + 2) % 3];
        (value, [0, 1, 2].map(|a| k * slope(a)))
    }
}

fn axes(nodes: usize) -> [Vec<f64>; 3] {
    let axis: Vec<f64> = (0..nodes).map(|i| -1.0 + 2.0 * i as f64 / (nodes - 1) as f64).collect();
    [axis.clone(), axis.clone(), axis]
}

fn bench(criterion: &mut Criterion) {
    let gyroid = LatticeSamples::of(axes(NODES), &Gyroid).expect("a valid lattice");
    let mut state = 1u64;
    let noise = ArrayD::from_shape_simple_fn(vec![NODES / 2; 3], || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    });
    let noise = LatticeSamples::new(axes(NODES / 2), noise).expect("a valid lattice");
    let options = Options::default();

    let mut group = criterion.benchmark_group("extraction");
    group.sample_size(10);
    group.throughput(Throughput::Elements((NODES * NODES * NODES) as u64));
    group.bench_function("gyroid 128³, on f = 0", |b| b.iter(|| surface(black_box(&gyroid), Some(&Gyroid), &options)));
    let none = None::<&Gyroid>;
    group.bench_function("gyroid 128³, linear", |b| b.iter(|| surface(black_box(&gyroid), none, &options)));
    group.throughput(Throughput::Elements((NODES * NODES * NODES / 8) as u64));
    group.bench_function("noise 64³, linear", |b| b.iter(|| surface(black_box(&noise), none, &options)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
