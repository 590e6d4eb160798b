//! Unknowns and time per level on a torus: `cargo run --release -p zeroset-trust-region --example levels [-- CELLS [POINTS
//! [NOISE]]]`, down to 512 cells along the longest side with 160 000 points unless told otherwise. The error is the root mean
//! square Sampson distance of 50 000 other points of the torus.

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use zeroset_bspline::{CellBand, Derivatives, Implicit, KnotVector, Spline};
use zeroset_trust_region::{LevelOptions, refine_levels};

const OUTER: f64 = 0.35;
const INNER: f64 = 0.15;

/// Points of the torus, evenly spread by a golden-ratio lattice over both angles.
fn torus(count: usize, phase: f64) -> Vec<[f64; 3]> {
    let point = |i: usize| {
        let u = TAU * (i as f64 * 0.618_033_988_749_895 + phase).fract();
        let v = TAU * (i as f64 + 0.5) / count as f64;
        // Equal areas: v = t + (r / R) sin t.
        let t = (0..30).fold(v, |t, _| v - INNER / OUTER * t.sin());
        let ring = OUTER + INNER * t.cos();
        [ring * u.cos(), ring * u.sin(), INNER * t.sin()]
    };
    (0..count).map(point).collect()
}

fn signed_distance([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y) - OUTER).hypot(z) - INNER
}

/// Root mean square Sampson distance of other points of the torus.
fn error(f: &impl Implicit<3>) -> f64 {
    let at = f.evaluate(&torus(50_000, 0.3), Derivatives::Gradient);
    let square = |(v, g): (&f64, &[f64; 3])| v * v / g.iter().map(|g| g * g).sum::<f64>();
    (at.values.iter().zip(&at.gradients).map(square).sum::<f64>() / 50_000.0).sqrt()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let number =
        |place: usize, default: f64| std::env::args().nth(place).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (cells, count, noise) = (number(1, 512.0), number(2, 160_000.0) as usize, number(3, 0.0));
    let mut points = torus(count, 0.0);
    for (i, point) in points.iter_mut().enumerate() {
        for (axis, x) in point.iter_mut().enumerate() {
            // The sum of two numbers that look random: noise of the given standard deviation.
            let hash = |k: usize| ((i * 3 + axis) as f64 * 12.9898 + k as f64 * 78.233).sin() * 43_758.545_3;
            *x += noise * 6.0_f64.sqrt() * (hash(0).rem_euclid(1.0) + hash(1).rem_euclid(1.0) - 1.0);
        }
    }
    let spacing = (4.0 * PI * PI * OUTER * INNER / count as f64).sqrt();

    // The initial shape: 32 cells, coefficients are the distance at the knots' averages, which smooths it.
    let knots: [KnotVector; 3] = [
        KnotVector::uniform(3, -0.625, 1.0 / 32.0, 40)?,
        KnotVector::uniform(3, -0.625, 1.0 / 32.0, 40)?,
        KnotVector::uniform(3, -0.3125, 1.0 / 32.0, 20)?,
    ];
    let at = |axis: usize, k: usize| knots[axis].knots()[k + 2];
    let [_, m, n] = knots.each_ref().map(KnotVector::basis_count);
    let total = 43 * m * n;
    let coefficients =
        (0..total).map(|i| signed_distance([at(0, i / (m * n)), at(1, i / n % m), at(2, i % n)])).collect();
    let initial = Spline::from_flat(knots.clone(), coefficients)?;

    let levels = (cells / 32.0).log2().round() as u8;
    let band = CellBand::new(&knots, &points, &vec![levels; count], [3, 3])?;
    // Without noise nothing is held out, so that all levels are run.
    let holdout = if noise > 0.0 { 0.05 } else { 0.0 };
    let options = LevelOptions { holdout, ..LevelOptions::for_spacing::<3>(spacing) };
    let start = Instant::now();
    let (f, report) = refine_levels(&points, None, None, &initial, &band, &options)?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{count} points, spacing {spacing:.5}, noise {noise}, {seconds:.1} s in all");
    println!("| cells | active functions | growth | points | seconds | growth | rms | held out | energy | best step |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut before: Option<(usize, f64)> = None;
    for level in &report.levels {
        let growth =
            |now: f64, before: Option<f64>| before.map_or("–".into(), |before| format!("{:.2}", now / before));
        println!(
            "| {:.0} | {} | {} | {} | {:.2} | {} | {:.2e} | {:.2e} | {:.3} | {:?} |",
            1.0 / level.cell,
            level.active,
            growth(level.active as f64, before.map(|b| b.0 as f64)),
            level.points,
            level.seconds,
            growth(level.seconds, before.map(|b| b.1)),
            level.steps.last().map_or(f64::NAN, |s| s.errors.sampson_rms),
            level.steps.last().and_then(|s| s.errors.held_out).unwrap_or(f64::NAN),
            level.steps.last().map_or(f64::NAN, |s| s.errors.energy),
            level.best_step
        );
        before = Some((level.active, level.seconds));
    }
    println!("error {:.3e}, of the initial shape {:.3e}", error(&f), error(&initial));
    for level in &report.levels {
        for step in &level.steps {
            println!(
                "  {:.0} cells, ℓ = {:.2} s: gain {:.3}, {} steps, rms {:.2e}, held out {:.2e}",
                1.0 / level.cell,
                step.smoothing_length / spacing,
                step.gain_ratio,
                step.cg_steps,
                step.errors.sampson_rms,
                step.errors.held_out.unwrap_or(f64::NAN)
            );
        }
    }
    Ok(())
}
