//! Cost against the number of points.

use std::path::{Path, PathBuf};
use std::thread;

use anyhow::Result;

use super::meshlab::MeshLab;
use super::plot::{Panel, Series};
use super::run::{Figures, Program};
use super::torus;
use crate::compare::process::Usage;

/// Seed of the points.
const SEED: u64 = 1;
/// Exponents are fitted from so many points on: below, the dense lattice costs most.
const FITTED: usize = 10_000;

/// One cloud.
pub struct Row {
    pub points: usize,
    input: PathBuf,
    /// What the first column says.
    pub name: String,
    pub figures: Figures,
    /// MeshLab on the same points.
    pub meshlab: Option<Usage>,
}

/// Times all sizes with default settings.
pub fn rows(program: &Program, sizes: &[usize], meshlab: Option<&MeshLab>) -> Result<Vec<Row>> {
    let row = |points: &usize| {
        let input = program.work.join(format!("torus-{points}.ply"));
        zeroset_io::write_points(&input, &torus::points(*points, SEED))?;
        row(program, input, *points, points.to_string(), meshlab)
    };
    sizes.iter().map(row).collect()
}

/// Times the fixture of 10 000 points with default settings.
pub fn fixture(program: &Program, root: &Path, meshlab: Option<&MeshLab>) -> Result<Row> {
    row(program, root.join("fixtures/points/bunny.ply"), 10_000, "bunny".into(), meshlab)
}

fn row(program: &Program, input: PathBuf, points: usize, name: String, meshlab: Option<&MeshLab>) -> Result<Row> {
    let meshlab = meshlab.and_then(|meshlab| meshlab.time(program, &input));
    let figures = program.reconstruct(&input, &[])?;
    Ok(Row { points, input, name, figures, meshlab })
}

/// Wall time with one thread and with more.
pub struct Speedup {
    pub points: usize,
    pub threads: usize,
    pub one: f64,
    pub more: f64,
}

/// Times a cloud with one thread too; nothing where the program has one as well.
pub fn speedup(program: &Program, row: &Row) -> Result<Option<Speedup>> {
    let all = thread::available_parallelism().map_or(1, usize::from);
    let threads = program.threads.unwrap_or(all);
    if threads < 2 {
        return Ok(None);
    }
    let one = program.with_threads(1).reconstruct(&row.input, &[])?.usage.wall;
    Ok(Some(Speedup { points: row.points, threads, one, more: row.figures.usage.wall }))
}

/// The exponent of a cost against the number of points, by least squares of the logarithms; `None` with fewer than two sizes.
pub fn exponent(rows: &[Row], cost: impl Fn(&Row) -> f64) -> Option<f64> {
    let logs = rows.iter().filter(|row| row.points >= FITTED).map(|row| ((row.points as f64).ln(), cost(row).ln()));
    slope(&logs.collect::<Vec<_>>())
}

/// The slope of the line that fits points best.
pub fn slope(places: &[(f64, f64)]) -> Option<f64> {
    let count = places.len() as f64;
    let (x, y) = places.iter().fold((0.0, 0.0), |(x, y), place| (x + place.0 / count, y + place.1 / count));
    let (square, product) = places
        .iter()
        .fold((0.0, 0.0), |(square, product), p| (square + (p.0 - x).powi(2), product + (p.0 - x) * (p.1 - y)));
    (square > 0.0).then(|| product / square)
}

/// CPU time and memory against points.
pub fn plot(rows: &[Row]) -> String {
    let panel = |title: &str, vertical: &str, cost: &dyn Fn(&Row) -> f64| {
        let exponent = exponent(rows, cost).map_or_else(String::new, |e| format!(", exponent {e:.2}"));
        let mut series = vec![Series {
            name: format!("zeroset{exponent}"),
            colour: "#1f4e9e",
            places: rows.iter().map(|row| (row.points as f64, cost(row))).collect(),
        }];
        let other = |row: &Row| {
            let usage = row.meshlab?;
            Some((row.points as f64, if vertical == "seconds" { usage.cpu? } else { usage.peak? }))
        };
        let others: Vec<_> = rows.iter().filter_map(other).collect();
        if !others.is_empty() {
            series.push(Series { name: "MeshLab".into(), colour: "#c7261f", places: others });
        }
        Panel { title: title.into(), horizontal: "points".into(), vertical: vertical.into(), series }
    };
    super::plot::panels(&[
        panel("CPU time", "seconds", &|row| row.figures.usage.cpu.unwrap_or(f64::NAN)),
        panel("largest memory", "MB", &|row| row.figures.usage.peak.unwrap_or(f64::NAN)),
    ])
}

#[cfg(test)]
mod tests {
    use super::slope;

    #[test]
    fn slopes_of_lines() {
        let line: Vec<(f64, f64)> = (0..5).map(f64::from).map(|x| (x, 1.1 * x - 3.0)).collect();
        // Exact up to rounding.
        assert!((slope(&line).unwrap() - 1.1).abs() < 1e-12);
        assert!(slope(&line[..1]).is_none() && slope(&[]).is_none());
    }
}
