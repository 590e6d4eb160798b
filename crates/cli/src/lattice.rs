//! Lattices on which saved functions are sampled, and cells in which their zero sets are searched for.

use zeroset::bspline::HierarchicalSpline;

use crate::axis_by_axis::axis_by_axis;
use crate::failure::Failure;

/// Zero sets are extracted on at least so many cells along the longest side of the box: chords over larger ones would show.
pub const FINE_ENOUGH: usize = 96;

/// More nodes than this take more than 8 GiB.
const MOST_NODES: f64 = (1u64 << 30) as f64;

/// The longest side of a function's box.
pub fn longest_side<const D: usize>(spline: &HierarchicalSpline<D>) -> f64 {
    let (lower, upper) = spline.domain();
    axis_by_axis(upper, lower, |upper, lower| upper - lower).into_iter().fold(0.0, f64::max)
}

/// Cells of the function's own finest lattice along the longest side of its box, but at most 512: a dense lattice has no room for
/// the finest levels.
pub fn own_cells<const D: usize>(spline: &HierarchicalSpline<D>) -> usize {
    let cells = spline.root().knots().iter().map(|knots| knots.cells().count()).max().unwrap_or(1);
    (cells << spline.levels().len()).min(512)
}

/// The nodes of a lattice in the function's box, `spacing` apart along each axis from the box's lower corner.
pub fn nodes<const D: usize>(spline: &HierarchicalSpline<D>, spacing: f64) -> Result<[Vec<f64>; D], Failure> {
    let (lower, upper) = spline.domain();
    // A whole number of cells up to rounding is one.
    let cells = |lower: f64, upper: f64| ((upper - lower) / spacing + 1e-6).floor();
    let count: f64 = axis_by_axis(lower, upper, cells).iter().map(|n| n + 1.0).product();
    if count > MOST_NODES {
        return Err(Failure::usage(format!("a lattice of {count:.1e} nodes is too large: ask for fewer cells")));
    }
    Ok(axis_by_axis(lower, upper, |lower, upper| {
        (0..=cells(lower, upper) as usize).map(|i| (lower + i as f64 * spacing).min(upper)).collect()
    }))
}

/// How often the cells of the dense lattice must be halved to have at least this many along the longest side of the box. (The zero
/// set is never searched for on cells coarser than the function's finest.)
pub fn halvings<const D: usize>(spline: &HierarchicalSpline<D>, cells: usize) -> u32 {
    let (lower, upper) = spline.domain();
    let knots = spline.root().knots().iter().zip(axis_by_axis(upper, lower, |upper, lower| upper - lower));
    let longest = knots.max_by(|(_, a), (_, b)| a.total_cmp(b));
    let own = longest.map_or(1, |(knots, _)| knots.cells().count().max(1));
    cells.div_ceil(own).next_power_of_two().ilog2()
}

/// How often the cells of the dense lattice are halved for a search for the zero set on at least so many cells.
///
/// # Errors
/// If the search is too fine, or needs more `memory` than allowed.
pub fn search<const D: usize>(
    spline: &HierarchicalSpline<D>,
    cells: usize,
    memory: Option<u64>,
) -> Result<u32, Failure> {
    let halvings = halvings(spline, cells);
    check_search(spline, halvings)?;
    check_memory(spline, halvings, memory)?;
    Ok(halvings)
}

/// Refuses too fine a search where all parts of the dense lattice's crossed cells are looked at: in functions that are no uniform
/// cubics. In uniform cubics, with levels or without, parts far from the zero set are left out.
pub fn check_search<const D: usize>(spline: &HierarchicalSpline<D>, halvings: u32) -> Result<(), Failure> {
    if spline.next_extent().is_ok() {
        return Ok(());
    }
    let bounds = spline.root().cell_bounds();
    let crossed = bounds.lower.iter().zip(&bounds.upper).filter(|(lower, upper)| **lower < 0.0 && **upper >= 0.0);
    let count = crossed.count() as f64 * 2.0_f64.powi(D as i32 * halvings as i32);
    if count > MOST_NODES {
        return Err(Failure::usage(format!(
            "{count:.1e} cells, parts of those of a function that is no uniform cubic, are too many: ask for fewer"
        )));
    }
    Ok(())
}

/// Refuses a search that would need more memory than allowed, or than is sound.
fn check_memory<const D: usize>(
    spline: &HierarchicalSpline<D>,
    halvings: u32,
    memory: Option<u64>,
) -> Result<(), Failure> {
    let need = zeroset::extraction_need(spline, halvings);
    match zeroset::memory_limit(memory) {
        Some(limit) if need > limit => {
            let mebibytes = |bytes: u64| bytes >> 20;
            Err(Failure::usage(format!(
                "about {} MiB of memory are needed, but {} may be used: ask for fewer cells with --resolution, or allow more with \
                 --memory",
                mebibytes(need),
                mebibytes(limit)
            )))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use zeroset::bspline::{KnotVector, Spline};

    use super::*;

    fn function(degree: usize, cells: [usize; 3]) -> HierarchicalSpline<3> {
        let knots = cells.map(|cells| KnotVector::uniform(degree, 0.0, 0.5, cells).unwrap());
        let count: usize = knots.iter().map(KnotVector::basis_count).product();
        let coefficients = (0..count).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        HierarchicalSpline::new(Spline::from_flat(knots, coefficients).unwrap()).unwrap()
    }

    #[test]
    fn cells_are_halved_just_often_enough() {
        let f = function(3, [5, 12, 7]);
        let found = [1, 12, 13, 24, 25, 96, 97, 4096].map(|cells| halvings(&f, cells));
        assert_eq!(found, [0, 0, 1, 1, 2, 3, 4, 9]);
    }

    #[test]
    fn only_searches_by_volume_are_limited() {
        let (cubic, quadratic) = (function(3, [5, 12, 7]), function(2, [5, 12, 7]));
        assert!(check_search(&cubic, 12).is_ok() && check_search(&quadratic, 7).is_ok());
        // All 420 cells are crossed: 420 · 8^8 parts.
        assert!(check_search(&quadratic, 8).unwrap_err().to_string().contains("7.0e9 cells"));
    }
}
