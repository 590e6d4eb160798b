//! Zeros of a function along a segment and near a point.

use crate::function::ImplicitFunction;

/// Vertices keep this distance from the nodes, in edge lengths: two vertices never fall together.
const MARGIN: f64 = 1e-6;

/// Where f vanishes between `inside` (f < 0) and `outside` (f ≥ 0): Newton's method along the segment, kept inside a
/// shrinking bracket. Without a function, by linear interpolation of the two values.
pub(crate) fn on_segment<const D: usize>(
    function: Option<&impl ImplicitFunction<D>>,
    inside: &[f64; D],
    outside: &[f64; D],
    values: [f64; 2],
    most_steps: usize,
) -> [f64; D] {
    let at = |t: f64| std::array::from_fn(|axis| inside[axis] + t * (outside[axis] - inside[axis]));
    let mut t = (values[0] / (values[0] - values[1])).clamp(MARGIN, 1.0 - MARGIN);
    let Some(function) = function else { return at(t) };
    let (mut lower, mut upper) = (0.0, 1.0);
    for _ in 0..most_steps {
        let (value, gradient) = function.value_and_gradient(&at(t));
        if value < 0.0 {
            lower = t
        } else {
            upper = t
        }
        let slope: f64 = (0..D).map(|axis| gradient[axis] * (outside[axis] - inside[axis])).sum();
        let mut next = t - value / slope;
        if !(next > lower && next < upper) {
            next = 0.5 * (lower + upper);
        }
        let step = (next - t).abs();
        t = next;
        if step < 1e-14 {
            break;
        }
    }
    at(t.clamp(MARGIN, 1.0 - MARGIN))
}

/// Moves a point onto f = 0 by Newton steps along the gradient, within a box; the start where no zero is found there.
pub(crate) fn near<const D: usize>(
    function: &impl ImplicitFunction<D>,
    start: [f64; D],
    lower: &[f64; D],
    upper: &[f64; D],
    most_steps: usize,
) -> [f64; D] {
    let mut x = start;
    for _ in 0..most_steps {
        let (value, gradient) = function.value_and_gradient(&x);
        let square: f64 = gradient.iter().map(|g| g * g).sum();
        let next: [f64; D] = std::array::from_fn(|axis| x[axis] - value / square * gradient[axis]);
        if !(0..D).all(|axis| next[axis] >= lower[axis] && next[axis] <= upper[axis]) {
            return start;
        }
        let step = (0..D).map(|axis| ((next[axis] - x[axis]) / (upper[axis] - lower[axis])).abs()).fold(0.0, f64::max);
        x = next;
        if step < 1e-14 {
            return x;
        }
    }
    x
}
