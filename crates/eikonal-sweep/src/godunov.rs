//! The paper's fast sweeping: Godunov's upwind scheme, eqs. 12 and 13, solved by Gauss–Seidel sweeps.

use rayon::prelude::*;

use crate::ghost::Ghosted;
use crate::near_field::NearField;
use crate::sweep::{Swept, sweep};
use crate::tiles::{Field, Parts, Tile};

/// Excess of the left-hand side of eq. 12 over h², relative, below which a node counts as solved.
///
/// A value that solves its equation leaves an excess of rounding size, about 4u·2⁻⁵² for a distance of u
/// cells; solving again would only move its last bits, at the price of a square root and a mispredicted
/// branch for every second node.
const SOLVED: f64 = 1e-12;

/// The truncated power (x)⁺ of eq. 12. NaN, which ∞ − ∞ gives where nothing is known yet, counts as 0.
#[inline(always)]
fn positive_part(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// The smaller number, as one instruction; no operand is NaN.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The unique solution x of [(x − a)⁺]² + [(x − b)⁺]² + [(x − c)⁺]² = h², the local equation of eq. 12.
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
pub(crate) fn local_solution(a: f64, b: f64, c: f64, h: f64) -> f64 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    let (a, middle) = if c < low { (c, low) } else { (low, c) };
    let (b, c) = if middle < high { (middle, high) } else { (high, middle) };
    let to_b = b - a;
    let to_c = c - a;
    if to_b >= h {
        a + h
    } else if to_c * to_c + (to_c - to_b) * (to_c - to_b) >= h * h {
        a + 0.5 * (to_b + (2.0 * h * h - to_b * to_b).sqrt())
    } else {
        let sum = to_b + to_c;
        let under_root = 3.0 * (h * h - to_b * to_b - to_c * to_c) + sum * sum;
        a + (sum + under_root.sqrt()) / 3.0
    }
}

/// Sweeps the near field outwards, nodes less than `radius` cells from a point staying as they are; returns distances in lattice units, with ghosts.
pub(crate) fn godunov<const D: usize>(
    ghosted: &Ghosted<D>,
    near: NearField,
    radius: usize,
    rounds: usize,
) -> (Vec<f64>, Swept) {
    let mut u = near.squared;
    let exact = (radius as f64).powi(2);
    let fixed: Vec<bool> = u.par_iter().with_min_len(1 << 14).map(|squared| *squared < exact).collect();
    u.par_iter_mut().with_min_len(1 << 14).for_each(|value| *value = value.sqrt());
    let mut distances = Distances { u, fixed };
    let swept = sweep(ghosted, rounds, &mut distances);
    (distances.u, swept)
}

/// Distances in lattice units, infinite where unknown, and which of them stay as they are.
struct Distances {
    u: Vec<f64>,
    fixed: Vec<bool>,
}

impl<const D: usize> Field<D> for Distances {
    fn relax(&mut self, lattice: &Ghosted<D>, _: [usize; D], forwards: [bool; D]) -> f64 {
        let Self { u, fixed } = self;
        let n = lattice.row_len();
        let strides = lattice.strides();
        // u_xmin and u_ymin of eq. 12 along a row; the second stays infinite in the plane.
        let mut across = [vec![f64::INFINITY; n], vec![f64::INFINITY; n]];
        let mut largest = 0.0_f64;
        for number in 0..lattice.row_count() {
            let start = lattice.row(number, forwards).start;
            for axis in 0..D - 1 {
                let below = &u[start - strides[axis]..][..n];
                let above = &u[start + strides[axis]..][..n];
                for ((least, &below), &above) in across[axis].iter_mut().zip(below).zip(above) {
                    *least = min(below, above);
                }
            }
            // With one ghost at each end.
            let row = &mut u[start - 1..][..n + 2];
            let fixed = &fixed[start..][..n];
            let decrease = if forwards[D - 1] {
                relax_row::<true>(row, &across[0], &across[1], fixed)
            } else {
                relax_row::<false>(row, &across[0], &across[1], fixed)
            };
            largest = largest.max(decrease);
        }
        largest
    }

    fn part(&self, tile: &Tile<'_, D>) -> Self {
        Self { u: tile.part(&self.u), fixed: tile.part(&self.fixed) }
    }

    fn put_back(&mut self, parts: &Parts<'_, '_, D, Self>) {
        parts.copy_to(&mut self.u, |part| &part.u);
    }
}

/// One Gauss–Seidel pass along a row, u ← min(u, ũ), h = 1; returns the largest decrease.
///
/// The left-hand side of eq. 12 grows with u, so ũ < u exactly where it exceeds h² at the present u: only
/// there is the equation solved.
#[inline(always)]
fn relax_row<const FORWARDS: bool>(row: &mut [f64], x_min: &[f64], y_min: &[f64], fixed: &[bool]) -> f64 {
    let n = fixed.len();
    assert!(row.len() == n + 2 && x_min.len() == n && y_min.len() == n);
    let mut largest = 0.0;
    for step in 0..n {
        let k = if FORWARDS { step } else { n - 1 - step };
        let u = row[k + 1];
        let a = x_min[k];
        let b = y_min[k];
        let c = min(row[k], row[k + 2]);
        let (da, db, dc) = (positive_part(u - a), positive_part(u - b), positive_part(u - c));
        if da * da + db * db + dc * dc > 1.0 + SOLVED && !fixed[k] {
            let solution = local_solution(a, b, c, 1.0);
            if solution < u {
                row[k + 1] = solution;
                if u - solution > largest {
                    largest = u - solution;
                }
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::near_field::near_field;
    use proptest::prelude::*;

    fn left_hand_side(x: f64, neighbours: [f64; 3]) -> f64 {
        neighbours.map(|a| positive_part(x - a).powi(2)).iter().sum()
    }

    /// Checks the equation, and that the order of the arguments does not matter.
    fn solves(a: f64, b: f64, c: f64, h: f64) -> Result<(), TestCaseError> {
        let x = local_solution(a, b, c, h);
        // x and its neighbours are rounded at their own size, and the square doubles a relative error.
        let tolerance = 16.0 * f64::EPSILON * (a.abs() / h + 4.0);
        prop_assert!((left_hand_side(x, [a, b, c]) / (h * h) - 1.0).abs() < tolerance);
        for other in [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
            prop_assert_eq!(local_solution(other[0], other[1], other[2], h), x);
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn case_1_solves_the_equation(a in 0.0..100.0, b in 1.0..9.0, c in 0.0..9.0, h in 0.01..10.0) {
            let b = a + b * h;
            solves(a, b, b + c * h, h)?;
            // Not exactly a + h where b − a was rounded below h.
            prop_assert!((local_solution(a, b, f64::INFINITY, h) - (a + h)).abs() <= 1e-12 * (a + h));
        }

        #[test]
        fn case_2_solves_the_equation(a in 0.0..100.0, b in 0.0..1.0, c in 1.0..9.0, h in 0.01..10.0) {
            // The condition of case 2 holds from c − a = h on.
            solves(a, a + b * h, a + c * h, h)?;
            solves(a, a + b * h, f64::INFINITY, h)?;
        }

        #[test]
        fn case_3_solves_the_equation(a in 0.0..100.0, b in 0.0..1.0, c in 0.0..1.0, h in 0.01..10.0) {
            // b ≤ c < 0.7 h makes (c − a)² + (c − b)² < 0.98 h².
            let c = 0.7 * c * h;
            solves(a, a + b * c, a + c, h)?;
        }

        #[test]
        fn solution_is_continuous_where_the_cases_meet(a in 0.0..10.0, b in 0.0..1.0, c in 0.0..9.0, h in 0.01..10.0) {
            // x changes no faster than its arguments, so a step of δ may change it by δ and rounding.
            let delta = 1e-9 * h;
            let tolerance = delta + 1e-13;
            let before = local_solution(a, a + h - delta, a + h + c * h, h);
            let after = local_solution(a, a + h, a + h + c * h, h);
            prop_assert!((before - after).abs() <= tolerance);
            // Cases 2 and 3 meet at (c − a)² + (c − b)² = h², that is c = x of case 2.
            let border = local_solution(a, a + b * h, f64::INFINITY, h);
            let before = local_solution(a, a + b * h, border - delta, h);
            let after = local_solution(a, a + b * h, border + delta, h);
            prop_assert!((before - after).abs() <= 2.0 * tolerance);
        }
    }

    #[test]
    fn local_solutions_known_in_closed_form() {
        let inf = f64::INFINITY;
        assert_eq!(local_solution(3.0, inf, inf, 0.5), 3.5);
        assert_eq!(local_solution(0.0, 5.0, 0.0, 1.0), 0.5 * 2.0_f64.sqrt());
        assert_eq!(local_solution(1.0, 1.0, 1.0, 3.0), 1.0 + 27.0_f64.sqrt() / 3.0);
    }

    /// Solves to the fixed point and checks eqs. 12 and 13 at each node that was free to change.
    fn fixed_point_satisfies_the_scheme<const D: usize>(shape: [usize; D], points: &[[f64; D]]) {
        let ghosted = Ghosted::new(shape);
        let near = near_field(&ghosted, points, 2);
        let start: Vec<f64> = near.squared.iter().map(|squared| squared.sqrt()).collect();
        let (u, swept) = godunov(&ghosted, near, 2, 50);
        assert_eq!(swept.last_change, 0.0, "50 rounds reach the fixed point");
        let mut free = 0;
        for number in 0..ghosted.row_count() {
            let first = ghosted.row(number, [true; D]).start;
            for at in first..first + ghosted.row_len() {
                if start[at] < 2.0 {
                    assert_eq!(u[at], start[at], "exact values stay");
                    continue;
                }
                let mut neighbours = [f64::INFINITY; 3];
                for (least, stride) in neighbours.iter_mut().zip(ghosted.strides()) {
                    *least = u[at - stride].min(u[at + stride]);
                }
                let side = left_hand_side(u[at], neighbours);
                assert!(side <= 1.0 + SOLVED);
                // Equality up to SOLVED and rounding, except where the start value was already lower.
                assert!(side >= 1.0 - 2.0 * SOLVED || u[at] == start[at]);
                free += usize::from(u[at] < start[at]);
            }
        }
        assert!(free > 100, "the test looked at free nodes");
    }

    #[test]
    fn fixed_points_satisfy_equations_12_and_13() {
        // Two points see the node (5, 5) at a right angle from 1.5 cells: there the scheme would undercut the
        // exact value, 0.5 + √½ < 1.5.
        let corner = [[3.5, 5.0], [5.0, 3.5]];
        fixed_point_satisfies_the_scheme([30, 21], &[[20.0, 11.1], [8.0, 18.7], corner[0], corner[1]]);
        fixed_point_satisfies_the_scheme([12, 9, 14], &[[3.2, 4.9, 0.3], [10.0, 1.1, 12.9]]);
    }
}
