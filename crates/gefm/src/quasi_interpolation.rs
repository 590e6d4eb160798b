//! Functions as splines.

use rayon::prelude::*;
use zeroset_bspline::KnotVector;

use crate::lattice_nodes::node;

/// The coefficients of cubic B-splines on uniform knots whose sum is f to fourth order, exactly if f is a cubic polynomial (de Boor and Fix
/// 1973): `(−f(tᵢ − h) + 8 f(tᵢ) − f(tᵢ + h)) / 6` along each axis, tᵢ the middle knot of a function and h the knots' distance.
/// So f is sampled a cell beyond the domain.
pub(crate) fn quasi_interpolant<const D: usize>(
    f: impl Fn(&[f64; D]) -> f64 + Sync,
    knots: &[KnotVector; D],
) -> Vec<f64> {
    let axes = knots.each_ref().map(|knots| {
        let (first, step) = (knots.knots()[2], knots.knots()[3] - knots.knots()[2]);
        (0..knots.basis_count() + 2).map(|k| first + (k as f64 - 1.0) * step).collect::<Vec<_>>()
    });
    let mut shape = axes.each_ref().map(Vec::len);
    let count: usize = shape.iter().product();
    let mut values: Vec<f64> = (0..count).into_par_iter().map(|flat| f(&node(&axes, flat))).collect();
    for axis in 0..D {
        let after: usize = shape[axis + 1..].iter().product();
        let before: usize = shape[..axis].iter().product();
        let (from, to) = (shape[axis], shape[axis] - 2);
        let at = |i: usize, k: usize, j: usize| values[(i * from + k) * after + j];
        let coefficient = |i, k, j| (8.0 * at(i, k + 1, j) - at(i, k, j) - at(i, k + 2, j)) / 6.0;
        values = (0..before * to * after)
            .map(|flat| coefficient(flat / (to * after), flat / after % to, flat % after))
            .collect();
        shape[axis] = to;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::Spline;

    #[test]
    fn cubic_polynomials_are_repeated() {
        let knots = [(-0.6, 0.3, 4), (-0.5, 0.25, 3), (0.0, 0.1, 5)]
            .map(|(start, step, cells)| KnotVector::uniform(3, start, step, cells).unwrap());
        let f = |x: &[f64; 3]| (x[0].powi(3) - x[0]) * (1.0 + 2.0 * x[1].powi(2)) * (x[2].powi(3) + 0.5);
        let spline = Spline::from_flat(knots.clone(), quasi_interpolant(f, &knots)).unwrap();
        for x in [[0.1, -0.3, 0.25], [-0.59, 0.2, 0.0], [0.6, 0.25, 0.5]] {
            // Rounding only.
            assert!((spline.value(&x) - f(&x)).abs() < 1e-14, "{x:?}");
        }
    }
}
