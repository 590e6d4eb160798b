//! Zeros of a function along a segment and near a point.

use crate::function::ImplicitFunction;
use crate::options::Options;

/// Vertices keep this distance from the nodes, in edge lengths, so that two vertices never fall together.
const MARGIN: f64 = 1e-6;

/// New vertices inside a cell keep this distance from its faces, in sides: on a face they would touch the neighbour.
const INSET: f64 = 1e-3;

/// A vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zero<const D: usize> {
    pub(crate) position: [f64; D],
    /// Whether it is on f = 0 to the tolerance, or held off a node; always without a function.
    pub(crate) reached: bool,
    /// ∇f there, where finding it gave that too.
    pub(crate) gradient: Option<[f64; D]>,
}

impl<const D: usize> Zero<D> {
    /// A place that is as good as can be.
    pub(crate) fn held(position: [f64; D]) -> Self {
        Self { position, reached: true, gradient: None }
    }
}

/// Where f vanishes between `inside` (f < 0) and `outside` (f ≥ 0). Newton's method along the segment within a shrinking
/// bracket; a step that leaves the bracket, or is more than half as long as the one before, is replaced by bisection. Without
/// a function, by linear interpolation of the two values.
pub(crate) fn on_segment<const D: usize>(
    function: Option<&impl ImplicitFunction<D>>,
    inside: &[f64; D],
    outside: &[f64; D],
    values: [f64; 2],
    options: &Options,
) -> Zero<D> {
    let at = |t: f64| std::array::from_fn(|axis| inside[axis] + t * (outside[axis] - inside[axis]));
    let mut t = (values[0] / (values[0] - values[1])).clamp(MARGIN, 1.0 - MARGIN);
    let Some(function) = function else { return Zero::held(at(t)) };
    let cubic = function.along_edge(inside, outside);
    // The value at t, and the Newton step from there.
    let newton = |t: f64| {
        if let Some(cubic) = &cubic {
            let (value, slope) = cubic.value_and_slope(t);
            return (value, -value / slope);
        }
        let (value, gradient) = function.value_and_gradient(&at(t));
        (value, -value / (0..D).map(|axis| gradient[axis] * (outside[axis] - inside[axis])).sum::<f64>())
    };
    let (mut lower, mut upper, mut last) = (0.0, 1.0, 1.0);
    let mut reached = false;
    for _ in 0..options.newton_steps {
        let (value, mut step) = newton(t);
        if value < 0.0 {
            lower = t
        } else {
            upper = t
        }
        let within = t + step >= lower && t + step <= upper && step.abs() <= 0.5 * last;
        if !within {
            step = 0.5 * (lower + upper) - t;
        }
        t += step;
        last = step.abs();
        if last <= options.tolerance {
            reached = true;
            break;
        }
    }
    let held = t.clamp(MARGIN, 1.0 - MARGIN);
    if held != t {
        reached = newton(held).1.abs() <= 2.0 * MARGIN;
    }
    Zero { position: at(held), reached, gradient: cubic.map(|cubic| cubic.gradient(held)) }
}

/// Moves a point onto f = 0 by Newton steps along the gradient, kept within a box; the start where no zero is found there.
pub(crate) fn near<const D: usize>(
    function: &impl ImplicitFunction<D>,
    start: [f64; D],
    lower: &[f64; D],
    upper: &[f64; D],
    options: &Options,
) -> Zero<D> {
    let mut x = start;
    for _ in 0..options.newton_steps {
        let (value, gradient) = function.value_and_gradient(&x);
        let square: f64 = gradient.iter().map(|g| g * g).sum();
        let mut next = x;
        let mut step = 0.0f64;
        for axis in 0..D {
            let side = upper[axis] - lower[axis];
            let move_by = -value / square * gradient[axis];
            if !move_by.is_finite() {
                return Zero { position: start, reached: false, gradient: None };
            }
            step = step.max((move_by / side).abs());
            next[axis] = (x[axis] + move_by).clamp(lower[axis] + INSET * side, upper[axis] - INSET * side);
        }
        if step <= options.tolerance {
            return Zero::held(next);
        }
        if next == x {
            break;
        }
        x = next;
    }
    Zero { position: start, reached: false, gradient: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Line<F>(F);

    /// Value and slope.
    type Along = fn(f64) -> (f64, f64);

    impl<F: Fn(f64) -> (f64, f64) + Sync> ImplicitFunction<2> for Line<F> {
        fn value_and_gradient(&self, x: &[f64; 2]) -> (f64, [f64; 2]) {
            let (value, slope) = (self.0)(x[0]);
            (value, [slope, 0.0])
        }
    }

    fn solve(f: impl Fn(f64) -> (f64, f64) + Sync) -> Zero<2> {
        let values = [f(0.0).0, f(1.0).0];
        on_segment(Some(&Line(f)), &[0.0, 5.0], &[1.0, 5.0], values, &Options::default())
    }

    #[test]
    fn hard_zeros_are_found_along_an_edge() {
        // At a zero of order 9 a Newton step of the tolerance, 1e-9, is a ninth of the way; elsewhere it is nearly all.
        let close = |zero: Zero<2>, t: f64| zero.reached && (zero.position[0] - t).abs() < 1e-8;
        // Newton alone would need 9 ln(10⁹) ≈ 190 steps.
        assert!(close(solve(|x| ((x - 0.3).powi(9), 9.0 * (x - 0.3).powi(8))), 0.3));
        // Newton alone diverges from every start.
        assert!(close(solve(|x| ((x - 0.7).cbrt(), (x - 0.7).cbrt().powi(-2) / 3.0)), 0.7));
        assert!(close(solve(|x| ((60.0 * (x - 0.1)).tanh(), 60.0 / (60.0 * (x - 0.1)).cosh().powi(2))), 0.1));
        // No gradient at all.
        assert!(close(solve(|x| (x - 0.9, f64::NAN)), 0.9));
    }

    #[test]
    fn values_alone_are_joined_by_a_straight_line() {
        let zero = on_segment(None::<&Line<Along>>, &[0.0, 5.0], &[1.0, 7.0], [-1.0, 3.0], &Options::default());
        assert_eq!(zero, Zero::held([0.25, 5.5]));
    }

    #[test]
    fn vertices_keep_off_the_nodes_and_report_foreign_samples() {
        let at_node = solve(|x| (x - 1.0, 1.0));
        assert!(at_node.reached && at_node.position[0] == 1.0 - MARGIN);
        let foreign =
            on_segment(Some(&Line(|_| (0.5, 0.0))), &[0.0, 0.0], &[1.0, 0.0], [-1.0, 1.0], &Options::default());
        assert!(!foreign.reached);
    }

    #[test]
    fn points_stay_in_their_cell() {
        let options = Options::default();
        let to = |zero: f64| near(&Line(|x: f64| (x - zero, 1.0)), [0.5, 0.5], &[0.0; 2], &[1.0; 2], &options);
        assert_eq!(to(0.25), Zero::held([0.25, 0.5]));
        assert_eq!(to(2.0), Zero { position: [0.5, 0.5], reached: false, gradient: None });
    }
}
