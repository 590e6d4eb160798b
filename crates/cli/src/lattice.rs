//! Lattices on which saved functions are sampled.

use zeroset::bspline::HierarchicalSpline;

use crate::failure::Failure;

/// More nodes than this take more than 8 GiB.
const MOST_NODES: f64 = (1u64 << 30) as f64;

/// The longest side of a function's box.
pub fn longest_side<const D: usize>(spline: &HierarchicalSpline<D>) -> f64 {
    let (lower, upper) = spline.domain();
    (0..D).map(|axis| upper[axis] - lower[axis]).fold(0.0, f64::max)
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
    let cells: [f64; D] = std::array::from_fn(|axis| ((upper[axis] - lower[axis]) / spacing + 1e-6).floor());
    let count: f64 = cells.iter().map(|n| n + 1.0).product();
    if count > MOST_NODES {
        return Err(Failure::usage(format!("a lattice of {count:.1e} nodes is too large: ask for fewer cells")));
    }
    Ok(std::array::from_fn(|axis| {
        (0..=cells[axis] as usize).map(|i| (lower[axis] + i as f64 * spacing).min(upper[axis])).collect()
    }))
}
