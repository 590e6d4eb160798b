//! Godunov's upwind scheme at one node, eq. 12 for h = 1, several nodes at once.

use pulp::Simd;

/// The truncated power (x)⁺ of eq. 12, squared. NaN, which ∞ − ∞ gives where nothing is known yet, counts as 0.
#[inline(always)]
pub(crate) fn positive_square<S: Simd>(simd: S, x: S::f64s) -> S::f64s {
    let zero = simd.splat_f64s(0.0);
    let x = simd.select_f64s(simd.greater_than_f64s(x, zero), x, zero);
    simd.mul_f64s(x, x)
}

/// The unique solution x of [(x − a)⁺]² + [(x − b)⁺]² + [(x − c)⁺]² = h², the local equation of eq. 12, for h = 1.
///
/// With a ≤ b ≤ c after sorting, the paper's three cases:
///
/// * Case 1, b − a ≥ h: x = a + h;
/// * Case 2, b − a < h and (c − a)² + (c − b)² ≥ h²: the larger root of (x − a)² + (x − b)² = h²;
/// * Case 3, (c − a)² + (c − b)² < h²: the larger root of the whole sum.
///
/// The roots are the paper's formulas with a subtracted from b and c first, so that nothing cancels far from the
/// points. An infinite argument means "no neighbour" (eq. 13), and in the plane c is always infinite:
/// cases 1 and 2 remain. At least one argument must be finite.
#[inline(always)]
pub(crate) fn local_solution<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
    let (one, two, three) = (simd.splat_f64s(1.0), simd.splat_f64s(2.0), simd.splat_f64s(3.0));
    let (low, high) = (simd.min_f64s(a, b), simd.max_f64s(a, b));
    let a = simd.min_f64s(low, c);
    let to_b = simd.sub_f64s(simd.min_f64s(high, simd.max_f64s(low, c)), a);
    let to_c = simd.sub_f64s(simd.max_f64s(high, c), a);
    let (square_b, square_c, between) =
        (simd.mul_f64s(to_b, to_b), simd.mul_f64s(to_c, to_c), simd.sub_f64s(to_c, to_b));
    let is_case_3 = simd.less_than_f64s(simd.add_f64s(square_c, simd.mul_f64s(between, between)), one);
    let sum = simd.select_f64s(is_case_3, simd.add_f64s(to_b, to_c), to_b);
    let left = simd.sub_f64s(simd.sub_f64s(one, square_b), square_c);
    let of_case_3 = simd.add_f64s(simd.mul_f64s(three, left), simd.mul_f64s(sum, sum));
    let under_root = simd.select_f64s(is_case_3, of_case_3, simd.sub_f64s(two, square_b));
    let factor = simd.select_f64s(is_case_3, simd.splat_f64s(1.0 / 3.0), simd.splat_f64s(0.5));
    let root = simd.mul_f64s(factor, simd.add_f64s(sum, simd.sqrt_f64s(under_root)));
    let is_case_1 = simd.greater_than_or_equal_f64s(to_b, one);
    simd.add_f64s(a, simd.select_f64s(is_case_1, one, root))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn local_solution(a: f64, b: f64, c: f64) -> f64 {
        super::local_solution(pulp::Scalar, a, b, c)
    }

    fn left_hand_side(x: f64, neighbours: [f64; 3]) -> f64 {
        neighbours.map(|a| positive_square(pulp::Scalar, x - a)).iter().sum()
    }

    /// Checks the equation, and that the order of the arguments does not matter.
    fn solves(a: f64, b: f64, c: f64) -> Result<(), TestCaseError> {
        let x = local_solution(a, b, c);
        // x and its neighbours are rounded at their own size, and the square doubles a relative error.
        let tolerance = 16.0 * f64::EPSILON * (a.abs() + 4.0);
        prop_assert!((left_hand_side(x, [a, b, c]) - 1.0).abs() < tolerance);
        for other in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
            prop_assert_eq!(local_solution(other[0], other[1], other[2]), x);
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn case_1_solves_the_equation(a in 0.0..100.0, b in 1.0..9.0, c in 0.0..9.0) {
            let b = a + b;
            solves(a, b, b + c)?;
            // Not exactly a + h where b − a was rounded below h.
            prop_assert!((local_solution(a, b, f64::INFINITY) - (a + 1.0)).abs() <= 1e-12 * (a + 1.0));
        }

        #[test]
        fn case_2_solves_the_equation(a in 0.0..100.0, b in 0.0..1.0, c in 1.0..9.0) {
            // The condition of case 2 holds from c − a = h on.
            solves(a, a + b, a + c)?;
            solves(a, a + b, f64::INFINITY)?;
        }

        #[test]
        fn case_3_solves_the_equation(a in 0.0..100.0, b in 0.0..1.0, c in 0.0..1.0) {
            // b ≤ c < 0.7 h makes (c − a)² + (c − b)² < 0.98 h².
            let c = 0.7 * c;
            solves(a, a + b * c, a + c)?;
        }

        #[test]
        fn solution_is_continuous_where_the_cases_meet(a in 0.0..10.0, b in 0.0..1.0, c in 0.0..9.0) {
            // x changes no faster than its arguments, so a step of δ may change it by δ and rounding.
            let delta = 1e-9;
            let tolerance = delta + 1e-13;
            let before = local_solution(a, a + 1.0 - delta, a + 1.0 + c);
            let after = local_solution(a, a + 1.0, a + 1.0 + c);
            prop_assert!((before - after).abs() <= tolerance);
            // Cases 2 and 3 meet at (c − a)² + (c − b)² = h², that is c = x of case 2.
            let border = local_solution(a, a + b, f64::INFINITY);
            let before = local_solution(a, a + b, border - delta);
            let after = local_solution(a, a + b, border + delta);
            prop_assert!((before - after).abs() <= 2.0 * tolerance);
        }
    }

    #[test]
    fn local_solutions_known_in_closed_form() {
        let inf = f64::INFINITY;
        assert_eq!(local_solution(3.0, inf, inf), 4.0);
        assert_eq!(local_solution(0.0, 5.0, 0.0), 0.5 * 2.0_f64.sqrt());
        // A third is rounded.
        assert!((local_solution(1.0, 1.0, 1.0) - (1.0 + 3.0_f64.sqrt() / 3.0)).abs() < 1e-15);
    }
}
