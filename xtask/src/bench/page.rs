//! The page's tables.

use std::fmt::Write as _;

use super::meshlab::MeshLab;
use super::run::Level;
use super::sizes::{Row, Speedup, exponent};

/// Growth per halving that costs which follow the surface have, and how far off it may be.
const GROWTH: f64 = 4.0;
const TOLERANCE: f64 = 0.6;

fn known(value: Option<f64>, decimals: usize) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "–".into(), |value| format!("{value:.decimals$}"))
}

/// What whole runs took, beside MeshLab where that was timed.
fn costs(text: &mut String, what: &str, rows: &[Row]) {
    let compared = rows.iter().any(|row| row.meshlab.is_some());
    let _ = write!(text, "| {what} | wall s | CPU s | points per CPU second | MB |");
    text.push_str(if compared { " MeshLab wall s | CPU s | MB |\n" } else { "\n" });
    text.push_str("|---|---|---|---|---|");
    text.push_str(if compared { "---|---|---|\n" } else { "\n" });
    for row in rows {
        let usage = row.figures.usage;
        let rate = usage.cpu.map(|cpu| row.points as f64 / cpu);
        let _ = write!(text, "| {} | {:.2} |", row.name, usage.wall);
        let _ = write!(text, " {} | {} | {} |", known(usage.cpu, 2), known(rate, 0), known(usage.peak, 0));
        if compared {
            let usage = row.meshlab.unwrap_or_default();
            let wall = row.meshlab.map(|usage| usage.wall);
            let _ = write!(text, " {} | {} | {} |", known(wall, 2), known(usage.cpu, 2), known(usage.peak, 0));
        }
        text.push('\n');
    }
}

/// Cost of the fixture.
pub fn fixture(row: &Row) -> String {
    let mut text = format!(
        "## The fixture\n\n`fixtures/points/bunny.ply`, {} points, default settings, points file to mesh file.\n\n",
        row.points
    );
    costs(&mut text, "cloud", std::slice::from_ref(row));
    text
}

/// What more threads bring.
pub fn speedup(found: &Speedup) -> String {
    let Speedup { points, threads, one, more } = found;
    format!(
        "## Threads\n\n{points} points of the torus: {one:.2} s of wall time with one thread, {more:.2} s with {threads}, {:.2} times as fast.\n",
        one / more
    )
}

/// Cost against points, the stages, and the levels of every size.
pub fn sizes(rows: &[Row], meshlab: Option<&MeshLab>, plot: &str) -> String {
    let mut text = String::from(
        "## The whole road\n\nRandom points of a torus with bumps, default settings, points file to mesh file.\n\n",
    );
    costs(&mut text, "points", rows);
    let cpu = exponent(rows, |row| row.figures.usage.cpu.unwrap_or(f64::NAN));
    let peak = exponent(rows, |row| row.figures.usage.peak.unwrap_or(f64::NAN));
    let _ = writeln!(
        text,
        "\nFrom 10 000 points on CPU time grows with the power {} of their number, memory with the power {}.",
        known(cpu, 2),
        known(peak, 2)
    );
    if meshlab.is_some_and(|meshlab| meshlab.missing) {
        text.push_str("\nMeshLab was left out: the interpreter has no pymeshlab.\n");
    }
    let _ = writeln!(text, "\n![CPU time and memory against points]({plot})");
    text.push_str("\n## Stages\n\nSeconds of wall time.\n\n| points |");
    let names: Vec<&str> =
        rows.first().map_or(vec![], |row| row.figures.stages.iter().map(|stage| stage.0.as_str()).collect());
    names.iter().for_each(|name| text.push_str(&format!(" {name} |")));
    text.push_str("\n|---|");
    names.iter().for_each(|_| text.push_str("---|"));
    for row in rows {
        let _ = write!(text, "\n| {} |", row.points);
        for name in &names {
            let seconds = row.figures.stages.iter().find(|stage| stage.0 == *name).map(|stage| stage.1);
            let _ = write!(text, " {} |", known(seconds, 2));
        }
    }
    text.push_str("\n\nLevels: active functions and seconds, by cells along the longest side.\n\n| points | levels |\n|---|---|\n");
    for row in rows {
        let levels = row.figures.levels.iter().map(|level| {
            let left_out = if level.kept { "" } else { ", left out" };
            format!("{:.0}: {:.0}, {:.2} s{left_out}", level.cells, level.active, level.seconds)
        });
        let _ = writeln!(text, "| {} | {} |", row.points, levels.collect::<Vec<_>>().join("; "));
    }
    for row in rows {
        for warning in &row.figures.warnings {
            let _ = writeln!(text, "\n{} points: {warning}.", row.points);
        }
    }
    text
}

/// Growth from level to level.
pub fn levels(levels: &[Level], points: usize, plot: &str) -> String {
    let mut text = format!(
        "## Levels\n\nThe finest level of runs on the torus with half a cell between points ({points} of them for the last), \
         refined to the same smoothing length in cells; short runs are done up to eight times as often. Wanted growth: {GROWTH} ± {TOLERANCE}.\n\n| cells | active functions | growth | products with the operator | seconds | growth |\n|---|---|---|---|---|---|\n"
    );
    let growth = |now: f64, before: Option<f64>| {
        before.map_or_else(
            || "–".into(),
            |before| {
                let factor = now / before;
                let word = if (factor - GROWTH).abs() <= TOLERANCE { "" } else { " (off)" };
                format!("{factor:.2}{word}")
            },
        )
    };
    for (place, level) in levels.iter().enumerate() {
        let before = place.checked_sub(1).and_then(|place| levels.get(place));
        let _ = writeln!(
            text,
            "| {:.0} | {:.0} | {} | {:.0} | {:.3} | {} |",
            level.cells,
            level.active,
            growth(level.active, before.map(|level| level.active)),
            level.products,
            level.seconds,
            growth(level.seconds, before.map(|level| level.seconds))
        );
    }
    let fitted = |cost: fn(&Level) -> f64| known(super::levels::growth(levels, cost), 2);
    let _ = writeln!(
        text,
        "\nOver all levels: active functions × {} and time × {} per halving (least squares).",
        fitted(|level| level.active),
        fitted(|level| level.seconds)
    );
    let _ = writeln!(text, "\n![active functions and time per level]({plot})");
    text
}
