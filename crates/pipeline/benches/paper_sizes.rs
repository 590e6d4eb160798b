//! The paper's two examples: generalized eigenvector fitting (three iterations on 16 cells), distance by Godunov sweeping
//! on the paper's lattices, and the whole reconstruction of the double torus.

#![allow(clippy::expect_used, clippy::unreachable, reason = "a panic is how a bench fails")]

use criterion::{Criterion, criterion_group, criterion_main};
use zeroset::eikonal_sweep::{self, Lattice, Method};
use zeroset::{Domain, Frame, Options, Spacing, gefm, reconstruct};
use zeroset_io::Points;

const EXAMPLES: [(&str, [usize; 3]); 2] = [("double_torus", [71, 71, 13]), ("teapot", [64, 41, 32])];

fn points(name: &str) -> Vec<[f64; 3]> {
    let path = format!("{}/../../fixtures/points/{name}.ply", env!("CARGO_MANIFEST_DIR"));
    match zeroset_io::read_points(path).expect("a fixture") {
        Points::Three(set) => set.points,
        Points::Two(_) => unreachable!("both examples are surfaces"),
    }
}

fn paper_sizes(criterion: &mut Criterion) {
    for (name, nodes) in EXAMPLES {
        let (frame, points) = Frame::of(&points(name)).expect("a shape");
        let spacing = Spacing::of(&points);
        let domain = Domain::around(&frame.sides, 16);
        let knots = domain.knots(3, 0).expect("uniform knots");
        let smoothing_length = (0.4 * spacing.typical).max(0.1 * domain.spacing);
        let mut options = gefm::Options { smoothing_length, density: spacing.density, ..gefm::Options::paper() };
        options.eigenvector.most_iterations = 3;
        options.eigenvector.epsilon = 0.0;
        criterion.bench_function(&format!("gefm, three iterations: {name}"), |bencher| {
            bencher.iter(|| gefm::fit(&points, &spacing.areas, &knots, &options).expect("a fit"));
        });

        let cell = (0..3).map(|a| frame.sides[a] / (nodes[a] as f64 - 3.0)).fold(0.0, f64::max);
        let origin = nodes.map(|n| -0.5 * cell * (n as f64 - 1.0));
        let lattice = Lattice::new(origin, cell, nodes).expect("a lattice");
        let options = eikonal_sweep::Options { method: Method::Godunov, ..Default::default() };
        criterion.bench_function(&format!("distance, Godunov: {name}"), |bencher| {
            bencher.iter(|| eikonal_sweep::distance(&points, &lattice, &options).expect("a distance"));
        });
    }
    let torus = points("double_torus");
    criterion.bench_function("reconstruct: double_torus", |bencher| {
        bencher.iter(|| reconstruct(&torus, &Options::default()).expect("a surface"));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = paper_sizes
}
criterion_main!(benches);
