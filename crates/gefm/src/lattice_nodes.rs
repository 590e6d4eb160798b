//! The nodes of a lattice: where its cells meet.

use zeroset_bspline::KnotVector;

/// The ends of all knot intervals along each axis.
pub(crate) fn lattice_nodes<const D: usize>(knots: &[KnotVector; D]) -> [Vec<f64>; D] {
    knots.each_ref().map(|knots| {
        let mut nodes: Vec<f64> = knots.cells().map(|(_, low, _)| low).collect();
        nodes.push(knots.domain().1);
        nodes
    })
}

/// A place on the lattice of these coordinates, by its flat index; the last axis runs fastest.
pub(crate) fn node<const D: usize>(axes: &[Vec<f64>; D], mut flat: usize) -> [f64; D] {
    let mut x = [0.0; D];
    for (x, axis) in x.iter_mut().zip(axes).rev() {
        *x = axis[flat % axis.len()];
        flat /= axis.len();
    }
    x
}
