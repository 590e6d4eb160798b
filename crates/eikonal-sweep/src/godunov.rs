//! The paper's fast sweeping: Godunov's upwind scheme, eqs. 12 and 13, solved by Gauss–Seidel sweeps.

use crate::ghost::{Ghosted, Row};
use crate::near_field::{EXACT_RADIUS_SQUARED, NearField};
use crate::sweep::{Swept, sweep};

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

/// Sweeps the near field outwards; returns distances in lattice units, with ghosts.
pub(crate) fn godunov<const D: usize>(ghosted: &Ghosted<D>, near: NearField, rounds: usize) -> (Vec<f64>, Swept) {
    let mut u = near.squared;
    let fixed: Vec<bool> = u.iter().map(|&squared| squared < EXACT_RADIUS_SQUARED).collect();
    for value in &mut u {
        *value = value.sqrt();
    }
    let n = ghosted.row_len();
    let strides = ghosted.strides();
    // u_xmin and u_ymin of eq. 12 along a row; the second stays infinite in the plane.
    let mut across = [vec![f64::INFINITY; n], vec![f64::INFINITY; n]];
    let swept = sweep(ghosted, rounds, |Row { start, .. }, forwards| {
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
        if forwards {
            relax_row::<true>(row, &across[0], &across[1], fixed)
        } else {
            relax_row::<false>(row, &across[0], &across[1], fixed)
        }
    });
    (u, swept)
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
