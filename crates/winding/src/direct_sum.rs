//! The sum over all points, term by term.

use crate::multipole::Source;

/// Squared distances are kept from falling below this. At a point itself the flux is zero, so that without regularisation
/// it adds nothing there, instead of 0 · ∞.
pub(crate) const SMALLEST_SQUARE: f64 = 1e-200;

/// The area of the unit sphere, 4π, or the length of the unit circle, 2π.
pub(crate) fn sphere<const D: usize>() -> f64 {
    if D == 2 { std::f64::consts::TAU } else { 2.0 * std::f64::consts::TAU }
}

/// W at `x` times the area of the unit sphere; `regular` is ε².
pub(crate) fn direct_sum<const D: usize>(sources: &[Source<D>], regular: f64, x: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for [point, area] in sources {
        let (mut square, mut flux) = (regular, 0.0);
        for axis in 0..D {
            let away = point[axis] - x[axis];
            square += away * away;
            flux += area[axis] * away;
        }
        let square = square.max(SMALLEST_SQUARE);
        sum += flux / if D == 2 { square } else { square * square.sqrt() };
    }
    sum
}
