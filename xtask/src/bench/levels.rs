//! Unknowns and time per level, against the size of the cells.

use std::ffi::OsStr;

use anyhow::Result;

use super::plot::{Panel, Series};
use super::run::{Level, Program};
use super::torus;

/// Seed of the points.
const SEED: u64 = 2;
/// Every level is refined down to this smoothing length, in its cells: two Gauss–Newton steps each, the same work per unknown. (The first
/// level's steps begin at half a cell, those of the others below what the level before could hold.)
const LENGTH: f64 = 0.33;
/// Cells along the longest side of the coarsest level.
const COARSEST: u32 = 64;
/// Runs that are short are done more often, twice as often for every level that they lack but no more than for so many, as other
/// work on the machine changes their medians most.
const MORE_OFTEN: u32 = 3;

/// The finest level of runs down to 64 cells and twice as many each time, on clouds with half a cell between samples
/// each time; `points` are those of the last. A fixed smoothing length holds out no points, so that no level is left out for
/// bringing too little.
pub fn rows(program: &Program, points: usize, finest: u32) -> Result<Vec<Level>> {
    let mut rows = Vec::new();
    for cells in std::iter::successors(Some(COARSEST), |c| Some(2 * c)).take_while(|c| *c <= finest) {
        let halvings = (finest / cells).ilog2();
        let repeat = program.repeat * (1 << halvings.min(MORE_OFTEN));
        rows.extend(finest_level(&Program { repeat, ..program.clone() }, points >> (2 * halvings), cells)?);
    }
    Ok(rows)
}

/// What a run down to the given cells tells of its finest level.
fn finest_level(program: &Program, points: usize, cells: u32) -> Result<Option<Level>> {
    let input = program.work.join(format!("levels-{points}.ply"));
    let points = torus::points(points, SEED);
    zeroset_io::write_points(&input, &points)?;
    let side = (0..3).map(|axis| {
        let along = || points.iter().map(move |p| p[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    });
    let length = LENGTH * side.fold(0.0, f64::max) / f64::from(cells);
    let options = ["--resolution".to_owned(), cells.to_string(), "--smooth".to_owned(), length.to_string()];
    Ok(program.reconstruct(&input, &options.each_ref().map(OsStr::new))?.levels.pop())
}

/// By what a cost grows per halving of the cells, by least squares of the logarithms; `None` with fewer than two levels.
pub fn growth(levels: &[Level], cost: fn(&Level) -> f64) -> Option<f64> {
    let logs: Vec<_> = levels.iter().map(|level| (level.cells.log2(), cost(level).log2())).collect();
    super::sizes::slope(&logs).map(f64::exp2)
}

/// Unknowns and seconds against the cells along the longest side.
pub fn plot(levels: &[Level]) -> String {
    let panel = |title: &str, vertical: &str, cost: fn(&Level) -> f64| {
        let places: Vec<_> = levels.iter().map(|level| (level.cells, cost(level))).collect();
        let factor = growth(levels, cost).map_or_else(String::new, |factor| format!("× {factor:.2} per halving"));
        let series = vec![Series { name: factor, colour: "#1f4e9e", places }];
        Panel {
            title: title.into(),
            horizontal: "cells along the longest side".into(),
            vertical: vertical.into(),
            series,
        }
    };
    super::plot::panels(&[
        panel("active functions", "count", |level| level.active),
        panel("time on the level", "seconds", |level| level.seconds),
    ])
}
