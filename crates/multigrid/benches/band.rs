//! How fast the normal operator of a band level is: `cargo bench -p zeroset-multigrid --bench band [-- CELLS [POINTS]]`.
//!
//! A torus is sampled as finely as the finest cells, 256 along its longest side unless told otherwise; more points may be
//! asked for. Rates are per thread. The least that a kernel has to do is told beside its rate: what it has to bring from memory and
//! back if caches held everything else, and the multiplications of its formula.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::time::Instant;
use zeroset_bspline::{CellBand, HierarchicalSpline, KnotVector, Spline};
use zeroset_multigrid::{BandCollocation, BandEnergy, BandOperator, BandRows, Fairness, Truncation, solve_truncated};

/// Points in the frame whose longest side is 1, evenly spread.
fn torus(count: usize) -> Vec<[f64; 3]> {
    let (outer, inner) = (0.35, 0.15);
    // Golden-ratio lattice over both angles; the tube's angle is stretched so that areas are equal.
    let point = |i: usize| {
        let (u, v) = (TAU * (i as f64 * 0.618_033_988_749_895).fract(), TAU * (i as f64 + 0.5) / count as f64);
        let tube = (0..20).fold(v, |t, _| v - inner / outer * t.sin());
        let ring = outer + inner * tube.cos();
        [ring * u.cos(), ring * u.sin(), inner * tube.sin()]
    };
    (0..count).map(point).collect()
}

fn seconds(mut work: impl FnMut()) -> f64 {
    work();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64());
    }
    best
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let cells = numbers.first().copied().unwrap_or(256);
    let area = 4.0 * PI * PI * 0.35 * 0.15;
    let count = numbers.get(1).copied().unwrap_or((area * (cells * cells) as f64) as usize);
    let points = torus(count);
    let levels = (cells / 32).ilog2() as u8;
    let knots = [40, 40, 20].map(|n| KnotVector::uniform(3, -(n as f64) / 64.0, 1.0 / 32.0, n));
    let knots = knots.into_iter().collect::<Result<Vec<_>, _>>()?;
    let knots: [KnotVector; 3] = knots.try_into().map_err(|_| "three axes")?;
    let total = knots.iter().map(KnotVector::basis_count).product();
    let root = Spline::from_flat(knots.clone(), vec![1.0; total])?;

    let start = Instant::now();
    let band = CellBand::new(&knots, &points, &vec![levels; count], [3, 3])?;
    let mut spline = HierarchicalSpline::new(root)?;
    for active in band.active() {
        spline.push_level(Arc::clone(active))?;
    }
    println!("{count} points, {levels} levels down to {cells} cells, set up in {:.2} s", start.elapsed().as_secs_f64());
    let Some(level) = spline.levels().last() else { return Ok(()) };
    let active = level.active();
    let stored = level.total().blocks().len();
    println!(
        "{} active functions in {} blocks; {} cells; {stored} total coefficients stored, {:.2} per active function",
        active.len(),
        active.block_count(),
        level.cells().len(),
        stored as f64 / active.len() as f64
    );

    let threads = rayon::current_num_threads() as f64;
    let collocation = BandCollocation::new(level, &points);
    let energy = BandEnergy::new(Arc::clone(active), level.cell_sides(), Fairness::thin_plate(1e-6));
    let third = energy.with_fairness(Fairness::third_order(1e-10, 0.01));
    let say = |name: &str, unit: &str, units: usize, least: [f64; 2], time: f64| {
        let rate = units as f64 / time / threads / 1e6;
        let [bytes, multiplications] = least;
        println!(
            "{name:24} {:8.2} ms {rate:8.1} million {unit} per second and thread, at least {bytes:.0} bytes and {multiplications:.0} \
             multiplications each",
            1e3 * time
        );
    };
    let rate = |name: &str, least: [f64; 2], time: f64| say(name, "unknowns", active.len(), least, time);
    let x: Vec<f64> = (0..active.len()).map(|i| ((i * 37) % 101) as f64).collect();
    let mut y = vec![0.0; x.len()];
    let mut field = zeroset_bspline::BlockField::zeros(Arc::clone(active));
    // In and out.
    let bytes = 16.0;
    rate("into blocks", [bytes, 0.0], seconds(|| field.scatter(&x)));
    // Four entries, the lines being symmetric, for each term of E_k = Σ G_a E_{k−a}: k + 1 of them for every k along the axis between,
    // one for every k along the first and the last.
    let thin = 4.0 * (3 + 6 + 3) as f64;
    rate("thin-plate energy", [bytes, thin], seconds(|| energy.apply(&field, None, &mut y)));
    rate("third-order energy", [bytes, 4.0 * (4 + 10 + 4) as f64], seconds(|| third.apply(&field, None, &mut y)));
    let (alpha, beta) = (vec![1.0; points.len()], vec![[0.1, 0.2, 0.3]; points.len()]);
    // Per point: cubics and slopes along three axes, three products of two axes, two sums over the first axis and four over the
    // others; its place (32 bytes) and what comes of it.
    let (cubics, products) = (36, 3 * 16);
    let on_points =
        [32.0 + 32.0 + 8.0 * active.len() as f64 / count as f64, (cubics + products + 2 * 64 + 4 * 16) as f64];
    let time = seconds(|| drop(collocation.values_and_gradients(level.total())));
    say("values and gradients", "points", count, on_points, time);
    let time = seconds(|| drop(spline.evaluate(&points, zeroset_bspline::Derivatives::Gradient)));
    say("the same by the spline", "points", count, on_points, time);
    let rows = BandRows { collocation: Cow::Borrowed(&collocation), alpha, beta };
    let operator = BandOperator::new(vec![rows], energy);
    // Per point also its row's factors (32 bytes), their product with the coefficients, and its multiple added to the result.
    let per_point = [64.0, (cubics + products + 2 * 16 + 8 + 2 * 64 + 2 * 16 + 8 + 2 * 64) as f64];
    let points_each = count as f64 / active.len() as f64;
    let least = [bytes + points_each * per_point[0], thin + points_each * per_point[1]];
    rate("normal operator", least, seconds(|| operator.apply(&x, &mut y)));
    let truncation = Truncation { most_steps: 12, tolerance: 0.0, radius: f64::INFINITY };
    let time = seconds(|| drop(solve_truncated(&operator, &x, &truncation)));
    println!("{:24} {:8.2} ms", "twelve steps", 1e3 * time);
    Ok(())
}
