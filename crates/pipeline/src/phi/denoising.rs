//! Noisy points, moved onto the zero set of f̂ before distances are taken from them.
//!
//! A distance that vanishes at every noisy point makes the initial shape as ragged as the noise, handles and all. f̂ is
//! smooth at the length that the ladder chose for these data; the final fit sees the points as they are.

use zeroset_bspline::{Derivatives, Spline};

/// Points are moved if half of them lie farther than so many spacings from the zero set of f̂.
const WORTHWHILE: f64 = 0.2;
/// No point moves farther than so many times the median distance: one that would does not belong to that sheet.
const FARTHEST: f64 = 5.0;

/// The points on the zero set of f̂, by one Newton step along its gradient; `None` if they hardly move.
pub fn denoised<const D: usize>(f_hat: &Spline<D>, points: &[[f64; D]], typical: f64) -> Option<Vec<[f64; D]>> {
    let found = f_hat.evaluate(points, Derivatives::Gradient);
    let steps: Vec<[f64; D]> = found
        .values
        .iter()
        .zip(&found.gradients)
        .map(|(value, gradient)| {
            let square: f64 = gradient.iter().map(|g| g * g).sum();
            gradient.map(|g| if square > 0.0 { value * g / square } else { 0.0 })
        })
        .collect();
    let lengths: Vec<f64> = steps.iter().map(|step| step.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    let mut sorted = lengths.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    if median <= WORTHWHILE * typical {
        return None;
    }
    let moved = points.iter().zip(steps.iter().zip(&lengths)).map(|(point, (step, &length))| {
        let share = if length <= FARTHEST * median { 1.0 } else { 0.0 };
        std::array::from_fn(|axis| point[axis] - share * step[axis])
    });
    Some(moved.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    #[test]
    fn noisy_points_go_to_the_zero_set_and_others_stay() {
        // f = x: Greville abscissae reproduce it.
        let knots = [KnotVector::uniform(2, -1.0, 0.5, 4).unwrap(), KnotVector::uniform(2, -1.0, 0.5, 4).unwrap()];
        let abscissae: Vec<f64> = (0..6).map(|i| -1.25 + 0.5 * f64::from(i)).collect();
        let f = Spline::from_flat(knots, abscissae.iter().flat_map(|&x| [x; 6]).collect()).unwrap();
        let points: Vec<[f64; 2]> = (0..40).map(|i| [0.1 * f64::from(i % 5 - 2), -0.9 + 0.04 * f64::from(i)]).collect();
        let moved = denoised(&f, &points, 0.04).unwrap();
        // One Newton step is exact for a linear function, up to rounding.
        assert!(moved.iter().zip(&points).all(|(m, p)| m[0].abs() < 1e-14 && (m[1] - p[1]).abs() < 1e-14));
        assert!(denoised(&f, &points, 1.0).is_none());
    }
}
