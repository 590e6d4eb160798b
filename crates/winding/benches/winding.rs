//! Winding numbers of 160 000 points on a bumpy sphere at as many places beside it: `cargo bench -p zeroset-winding`.

use std::time::Instant;

use zeroset_winding::{Options, Tree, WindingError};

/// Points of the sphere of radius 1 + 0.1 cos 5z cos 4φ, evenly spread, with their area vectors.
fn bumpy_sphere(count: u32) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let at = |z: f64, phi: f64| {
        let (r, w) = (1.0 + 0.1 * (5.0 * z).cos() * (4.0 * phi).cos(), (1.0 - z * z).sqrt());
        [r * w * phi.cos(), r * w * phi.sin(), r * z]
    };
    let (mut points, mut areas) = (Vec::new(), Vec::new());
    for i in 0..count {
        let (z, phi) = ((2.0 * f64::from(i) + 1.0) / f64::from(count) - 1.0, golden * f64::from(i));
        // (z, φ) preserves areas on the unit sphere: the area vector is the cross product of the tangents.
        let h = 1e-7 * (1.0 - z * z);
        let difference =
            |a: [f64; 3], b: [f64; 3], h: f64| std::array::from_fn::<_, 3, _>(|k| (a[k] - b[k]) / (2.0 * h));
        let u = difference(at(z + h, phi), at(z - h, phi), h);
        let v = difference(at(z, phi + 1e-7), at(z, phi - 1e-7), 1e-7);
        let cell = 2.0 * std::f64::consts::TAU / f64::from(count);
        points.push(at(z, phi));
        areas.push(std::array::from_fn(|k| cell * (v[(k + 1) % 3] * u[(k + 2) % 3] - v[(k + 2) % 3] * u[(k + 1) % 3])));
    }
    (points, areas)
}

/// User and system time of this process, seconds: the machine may be shared.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = |n: usize| stat.rsplit(')').next().and_then(|s| s.split_whitespace().nth(n)?.parse::<f64>().ok());
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / 100.0
}

fn main() -> Result<(), WindingError> {
    let count = 160_000;
    let (points, areas) = bumpy_sphere(count);
    let spacing = (4.0 * std::f64::consts::PI / f64::from(count)).sqrt();
    // Every second point from both sides: as many queries as points.
    let queries: Vec<[f64; 3]> = (0..points.len())
        .map(|i| {
            let (p, a) = (&points[i & !1], &areas[i & !1]);
            let norm = a.iter().map(|x| x * x).sum::<f64>().sqrt();
            let side = if i & 1 == 0 { spacing } else { -spacing };
            std::array::from_fn(|k| p[k] + side * a[k] / norm)
        })
        .collect();
    for epsilon in [0.0, spacing] {
        let (cpu, start) = (cpu_seconds(), Instant::now());
        let tree = Tree::new(&points, Options { regularisation: epsilon, ..Options::default() })?;
        let built = start.elapsed();
        let winding = tree.with_normals(&areas)?;
        let moments = start.elapsed() - built;
        let values = winding.evaluate(&queries)?;
        let (cpu, wall) = (cpu_seconds() - cpu, start.elapsed());
        let sample: Vec<usize> = (0..queries.len()).step_by(79).collect();
        let places: Vec<[f64; 3]> = sample.iter().map(|&i| queries[i]).collect();
        let direct = winding.evaluate_direct(&places)?;
        let errors = sample.iter().zip(&direct).map(|(&i, d)| (values[i] - d).abs());
        let (worst, mean) = errors.fold((0.0, 0.0), |(w, m): (f64, f64), e| (w.max(e), m + e / direct.len() as f64));
        println!(
            "{count} points, as many queries, ε = {epsilon:.4}: {cpu:.2} s CPU, {wall:.2?} wall (tree {built:.2?}, moments \
             {moments:.2?}); error of W: mean {mean:.1e}, worst {worst:.1e}"
        );
    }
    Ok(())
}
