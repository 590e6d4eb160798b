//! The field of one oriented point, and its exact sum.

use std::f64::consts::{PI, TAU};

use crate::WindingError;
use crate::error::{check_points, check_sources};

/// `2π` in 2D, `4π` in 3D: the measure of the unit sphere.
pub(crate) const fn sphere<const D: usize>() -> f64 {
    if D == 2 { TAU } else { 4.0 * PI }
}

/// `s^(D/2)` of `s = r²`.
#[inline(always)]
pub(crate) fn power<const D: usize>(s: f64) -> f64 {
    if D == 2 { s } else { s * s.sqrt() }
}

/// `n·(p − x) / r^D` with `r² = ‖p − x‖² + ε²`; zero where `r^D` is zero or not a normal number.
#[inline(always)]
pub(crate) fn dipole<const D: usize>(p: [f64; D], n: [f64; D], x: &[f64; D], epsilon2: f64) -> f64 {
    let (mut s, mut normal) = (0.0, 0.0);
    for axis in 0..D {
        let d = p[axis] - x[axis];
        s += d * d;
        normal += n[axis] * d;
    }
    let r = power::<D>(s + epsilon2);
    if r >= f64::MIN_POSITIVE { normal / r } else { 0.0 }
}

/// The winding number at `x` by the plain sum over all points, in order: the reference, `O(N)` for each `x`.
///
/// `area_vectors` is `N × D`: the area (3D) or length (2D) of each point times its unit outward normal, in the units of the
/// points. `epsilon` regularises the kernel; with zero, a point at `x` itself counts nothing.
///
/// # Errors
/// Numbers that are not finite or beyond 1e40, a negative `epsilon`, or not one area vector per point.
pub fn direct<const D: usize>(
    points: &[[f64; D]],
    area_vectors: &[[f64; D]],
    epsilon: f64,
    x: &[f64; D],
) -> Result<f64, WindingError> {
    const { assert!(D == 2 || D == 3, "D is 2 or 3") };
    check_points(points)?;
    check_points(&[*x])?;
    check_sources(points.len(), area_vectors, epsilon)?;
    let sum: f64 = points.iter().zip(area_vectors).map(|(p, n)| dipole(*p, *n, x, epsilon * epsilon)).sum();
    Ok(sum / sphere::<D>())
}
