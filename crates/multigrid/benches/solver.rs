//! `cargo bench -p zeroset-multigrid`: iterations and times of the solver on the bunny of the fixtures (10 000 points), with
//! the right side of p-continuation for directions away from the centre, from zero to 1e-6.
//!
//! `-- --threads N` sets the number of threads (1), `-- --sparse N` takes every N-th point, `-- --copies N` puts N points, shifted
//! along the three axes by parts of the spacing, in the place of each, `-- --most-cells N` leaves out finer lattices.

#![allow(clippy::expect_used, reason = "a panic is how a bench fails")]

use std::time::Instant;
use zeroset_bspline::{Collocation, KnotVector};
use zeroset_multigrid::{Multigrid, NormalOperator, SolveOptions};

/// Distance between neighbouring samples of the 10 000 points, longest side 1.
const SPACING: f64 = 0.0117;

fn main() {
    let argument = |name: &str, default: usize| {
        let arguments: Vec<String> = std::env::args().collect();
        let place = arguments.iter().position(|a| a == name);
        place.and_then(|p| arguments.get(p + 1)?.parse().ok()).unwrap_or(default)
    };
    let (sparse, copies) = (argument("--sparse", 1), argument("--copies", 1));
    let points = points(sparse, copies);
    let s = SPACING * (sparse as f64 / copies as f64).sqrt();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(argument("--threads", 1)).build().expect("a pool");
    println!("{} points, s = {s:.4}, {} thread(s)", points.len(), pool.current_num_threads());
    println!(
        "| cells | ℓ/s | unknowns | set-up s | iterations | to 1e-2 | per iteration ms | unknowns/s per iteration | V-cycle ms | A x ms | \
         energy unknowns/s | points/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let threads = pool.current_num_threads() as f64;
    pool.install(|| {
        let most = argument("--most-cells", 128);
        let mut rates = Vec::new();
        for ratio in [0.5, 2.0, 0.25, 0.1] {
            for cells in [16, 32, 64, 128] {
                if cells <= most && (ratio == 0.5 || cells <= 64) {
                    let rate = row(&points, s, ratio, cells);
                    rates.extend((ratio == 0.5).then_some((cells, rate)));
                }
            }
        }
        // In and out; four entries, the lines being symmetric, for each of 3 + 6 + 3 terms along the three axes.
        for (cells, rate) in rates {
            println!(
                "dense energy, {cells} cells {:8.1} million unknowns per second and thread, at least 16 bytes and {} multiplications each",
                rate / threads / 1e6,
                4 * (3 + 6 + 3)
            );
        }
    });
}

/// One row of the table. Gives unknowns per second of the energy.
fn row(points: &[[f64; 3]], s: f64, ratio: f64, cells: usize) -> f64 {
    let weights = vec![1.0; points.len()];
    let energy_weight = s.powi(-2) * (ratio * s).powi(3);
    // A margin of 1.5 cells of the coarsest lattice, which has eight along the longest side.
    let (base, halvings) = (8, (cells / 8).ilog2());
    let knots = knots(points, base);
    let began = Instant::now();
    let solver = Multigrid::new(&knots, halvings, points, &weights, energy_weight).expect("a solver");
    let set_up = began.elapsed().as_secs_f64();

    let mut right = vec![0.0; solver.size()];
    let collocation = Collocation::new(solver.knots(), points).expect("points inside");
    collocation.add_gradients_transposed(points, &mut right);
    let mut x = vec![0.0; solver.size()];
    let began = Instant::now();
    let options = SolveOptions { tolerance: 1e-6, most_iterations: 200, ..SolveOptions::default() };
    let report = solver.solve(&right, &mut x, &options);
    let per_iteration = began.elapsed().as_secs_f64() / (report.iterations + 1) as f64;
    let loose = report.residuals.iter().position(|r| *r < 1e-2).unwrap_or(usize::MAX);

    let mut y = vec![0.0; solver.size()];
    let cycle = seconds(|| solver.precondition(&right, &mut y));
    let apply = seconds(|| solver.apply(&x, &mut y));
    let silent = vec![0.0; points.len()];
    let energy = NormalOperator::new(solver.knots(), points, &silent, energy_weight).expect("an operator");
    let energy = seconds(|| energy.apply(&x, &mut y));
    let unknowns = solver.size() as f64;
    // On the largest lattices the points are lost in the scatter of the times.
    let points_rate = match points.len() as f64 / (apply - energy) {
        rate if apply - energy > 0.1 * apply => format!("{rate:.2e}"),
        _ => "–".to_string(),
    };
    println!(
        "| {cells} | {ratio} | {unknowns} | {set_up:.3} | {}{} | {loose} | {:.2} | {:.2e} | {:.2} | {:.3} | {:.2e} | {points_rate} |",
        report.iterations,
        if report.converged { "" } else { " (not reached)" },
        1e3 * per_iteration,
        unknowns / per_iteration,
        1e3 * cycle,
        1e3 * apply,
        unknowns / energy,
    );
    unknowns / energy
}

/// Seconds per call, the best of a few rounds.
fn seconds(mut work: impl FnMut()) -> f64 {
    work();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let began = Instant::now();
        let mut calls = 0;
        while calls == 0 || began.elapsed().as_secs_f64() < 0.05 {
            work();
            calls += 1;
        }
        best = best.min(began.elapsed().as_secs_f64() / f64::from(calls));
    }
    best
}

/// Cubic knots around points whose bounding box is centred at zero.
fn knots(points: &[[f64; 3]], cells: usize) -> [KnotVector; 3] {
    let spacing = 1.0 / cells as f64;
    std::array::from_fn(|axis| {
        let side = 2.0 * points.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
        let count = (side / spacing + 3.0).ceil() as usize;
        KnotVector::uniform(3, -0.5 * spacing * count as f64, spacing, count).expect("a positive spacing")
    })
}

/// The points of the fixture, longest side 1, centred.
fn points(sparse: usize, copies: usize) -> Vec<[f64; 3]> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/points/bunny.ply");
    let bytes = std::fs::read(path).expect("the fixture");
    let header = b"end_header\n";
    let start = bytes.windows(header.len()).position(|w| w == header).expect("a header") + header.len();
    let (numbers, _) = bytes[start..].as_chunks::<4>();
    let numbers: Vec<f64> = numbers.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect();
    let (points, _) = numbers.as_chunks::<3>();
    let mut points: Vec<[f64; 3]> = points
        .iter()
        .step_by(sparse)
        .flat_map(|p| (0..copies).map(move |i| p.map(|x| x + SPACING * ((i as f64 * (7.3 + x)).fract() - 0.5))))
        .collect();
    let corner = |pick: fn(f64, f64) -> f64, axis: usize| points.iter().map(|p| p[axis]).fold(points[0][axis], pick);
    let (lower, upper) = ([0, 1, 2].map(|a| corner(f64::min, a)), [0, 1, 2].map(|a| corner(f64::max, a)));
    let longest = (0..3).map(|a| upper[a] - lower[a]).fold(0.0, f64::max);
    for p in &mut points {
        *p = std::array::from_fn(|a| (p[a] - 0.5 * (lower[a] + upper[a])) / longest);
    }
    points
}
