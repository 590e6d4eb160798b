//! The largest eigenpair of a symmetric tridiagonal matrix.

/// Largest eigenvalue, by bisection on the number of negative pivots (Sturm), and its unit eigenvector, by inverse
/// iteration from just above, where the shifted matrix is definite and needs no pivoting.
///
/// `off[i]` couples rows `i` and `i + 1`; it has one entry less than `diagonal`, which is not empty.
pub(crate) fn largest_eigenpair(diagonal: &[f64], off: &[f64]) -> (f64, Vec<f64>) {
    let size = diagonal.len();
    let reach = |i: usize| {
        let before = if i > 0 { off[i - 1].abs() } else { 0.0 };
        before + off.get(i).map_or(0.0, |o| o.abs())
    };
    let mut lower = (0..size).map(|i| diagonal[i] - reach(i)).fold(f64::INFINITY, f64::min);
    let mut upper = (0..size).map(|i| diagonal[i] + reach(i)).fold(f64::NEG_INFINITY, f64::max);
    let scale = lower.abs().max(upper.abs()).max(f64::MIN_POSITIVE);
    while upper - lower > 2.0 * f64::EPSILON * scale {
        let middle = 0.5 * (lower + upper);
        if middle <= lower || middle >= upper {
            break;
        }
        if above_spectrum(diagonal, off, middle, scale) { upper = middle } else { lower = middle }
    }

    let shift = upper + 4.0 * f64::EPSILON * scale;
    let mut vector = vec![1.0; size];
    for _ in 0..3 {
        // Solve (shift − T) x = vector by elimination without pivoting: the matrix is positive definite.
        let mut pivots = vec![0.0; size];
        for i in 0..size {
            pivots[i] = shift - diagonal[i];
            if i > 0 {
                let factor = off[i - 1] / pivots[i - 1];
                pivots[i] -= off[i - 1] * factor;
                vector[i] += factor * vector[i - 1];
            }
            pivots[i] = pivots[i].max(f64::EPSILON * f64::EPSILON * scale);
        }
        for i in (0..size).rev() {
            if i + 1 < size {
                vector[i] += off[i] * vector[i + 1];
            }
            vector[i] /= pivots[i];
        }
        let largest = vector.iter().map(|v| v.abs()).fold(f64::MIN_POSITIVE, f64::max);
        vector.iter_mut().for_each(|v| *v /= largest);
        let norm = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|v| *v /= norm);
    }
    (0.5 * (lower + upper), vector)
}

/// Whether `shift − T` is positive definite.
fn above_spectrum(diagonal: &[f64], off: &[f64], shift: f64, scale: f64) -> bool {
    let mut pivot = 1.0;
    for i in 0..diagonal.len() {
        let coupled = if i > 0 { off[i - 1] * off[i - 1] / pivot } else { 0.0 };
        pivot = shift - diagonal[i] - coupled;
        if pivot <= f64::EPSILON * f64::EPSILON * scale {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn second_difference_matrix() {
        let n = 50;
        let (mu, v) = largest_eigenpair(&vec![2.0; n], &vec![-1.0; n - 1]);
        let angle = std::f64::consts::PI / (n as f64 + 1.0);
        // Bisection ends at rounding level of the matrix' size.
        assert!((mu - (2.0 + 2.0 * angle.cos())).abs() < 1e-14);
        let exact = (n as f64 * angle).sin() / angle.sin();
        assert!((v[n - 1] / v[0] - -exact).abs() < 1e-9 || (v[n - 1] / v[0] - exact).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn residual_is_small(entries in proptest::collection::vec((-1.0..1.0f64, 0.01..1.0f64), 1..40)) {
            let diagonal: Vec<f64> = entries.iter().map(|e| e.0).collect();
            let off: Vec<f64> = entries[1..].iter().map(|e| e.1).collect();
            let (mu, v) = largest_eigenpair(&diagonal, &off);
            for i in 0..diagonal.len() {
                let mut sum = (diagonal[i] - mu) * v[i];
                if i > 0 { sum += off[i - 1] * v[i - 1]; }
                if i + 1 < v.len() { sum += off[i] * v[i + 1]; }
                // Inverse iteration from within a few units in the last place of the eigenvalue.
                prop_assert!(sum.abs() < 1e-12);
            }
            // Largest: no unit vector's Rayleigh quotient exceeds it.
            prop_assert!(diagonal.iter().all(|d| *d <= mu + 1e-14));
        }
    }
}
