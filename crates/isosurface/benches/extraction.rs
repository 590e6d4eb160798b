//! Extraction on 128³ samples of an analytic field, with and without the function, and on noise, where every cell is cut; and
//! of a torus with three and four band levels from the cells of lattices of 256³ and 512³ that bounds do not rule out; and with four levels on
//! a hundredth of it and one elsewhere, from equal cells and from cells of several sizes.

#![allow(clippy::expect_used, reason = "a panic is how a bench fails")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ndarray::ArrayD;
use zeroset_bspline::{CellBand, HierarchicalSpline, KnotVector, Spline};
use zeroset_isosurface::{ImplicitFunction, LatticeSamples, Options, graded_surface_of, surface, surface_of};

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

/// The distance from a torus at the nodes of 32 cells per side as coefficients, and some levels around a part of its surface, the others' first one
/// around the rest.
fn torus(levels: u8, part: f64) -> HierarchicalSpline<3> {
    let (big, small, cell) = (0.62f64, 0.3f64, 1.0 / 16.0);
    let coefficients = (0..35 * 35 * 35).map(|flat| {
        let [x, y, z] = [flat / (35 * 35), flat / 35 % 35, flat % 35].map(|k| -1.0 + cell * (f64::from(k) - 1.0));
        (x.hypot(y) - big).hypot(z) - small
    });
    let knots = KnotVector::uniform(3, -1.0, cell, 32).expect("valid knots");
    let knots = [knots.clone(), knots.clone(), knots];
    let points: Vec<[f64; 3]> = (0..300 * 200)
        .map(|i| {
            let (u, v) = (f64::from(i / 200) / 300.0, f64::from(i % 200) / 200.0);
            let ((su, cu), (sv, cv)) = ((std::f64::consts::TAU * u).sin_cos(), (std::f64::consts::TAU * v).sin_cos());
            [(big + small * cv) * cu, (big + small * cv) * su, small * sv]
        })
        .collect();
    // In a square of the parameters.
    let is_fine = |i: usize| i / 200 < (300.0 * part.sqrt()) as usize && i % 200 < (200.0 * part.sqrt()) as usize;
    let wanted: Vec<u8> = (0..points.len()).map(|i| if is_fine(i) { levels } else { 1 }).collect();
    let band = CellBand::new(&knots, &points, &wanted, [3, 3]).expect("points in the box");
    let root = Spline::from_flat(knots, coefficients.collect()).expect("one coefficient per function");
    let level = |active: &Arc<_>| {
        let count = zeroset_bspline::IndexSet::<3>::len(active);
        // Small, so that the surface stays where it is.
        (Arc::clone(active), (0..count).map(|i| 1e-5 * ((i % 7) as f64 - 3.0)).collect())
    };
    HierarchicalSpline::with_levels(root, band.active().iter().map(level)).expect("levels that nest")
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
    for levels in [3, 4] {
        let (torus, halvings, name) = (torus(levels, 1.0), u32::from(levels), format!("torus {}³", 32 << levels));
        let cells = torus.crossed_cells(halvings).expect("a lattice that can be counted").cells.len();
        group.throughput(Throughput::Elements(cells as u64));
        group.bench_function(format!("{name}, crossed cells"), |b| b.iter(|| torus.crossed_cells(black_box(halvings))));
        group.bench_function(format!("{name}, from crossed cells"), |b| {
            b.iter(|| surface_of(black_box(&torus), halvings, &options));
        });
    }
    let torus = torus(4, 0.01);
    group.throughput(Throughput::Elements(1));
    group.bench_function("torus, 512³ on a hundredth, equal cells", |b| {
        b.iter(|| surface_of(black_box(&torus), 4, &options))
    });
    group.bench_function("torus, 512³ on a hundredth, of several sizes", |b| {
        b.iter(|| graded_surface_of(black_box(&torus), 0..=4, &options));
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
