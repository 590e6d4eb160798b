//! The unit frame.

use crate::error::InputError;
use crate::points::kd_tree::MOST_POINTS;
use crate::points::repetitions::without_repetitions;

/// The similarity that takes data coordinates to the frame in which all tolerances and weights live: the bounding box is
/// centred at zero and its longest side is 1.
///
/// `frame = (data − origin) · scale`: the origin is subtracted before anything is rounded, so that coordinates of
/// 5 000 000 keep their last digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<const D: usize> {
    /// Centre of the bounding box, data units.
    pub origin: [f64; D],
    /// Frame units per data unit: 1 / longest side.
    pub scale: f64,
    /// Sides of the bounding box, frame units; the longest is 1.
    pub sides: [f64; D],
}

impl<const D: usize> Frame<D> {
    /// The frame of a point set, and the points in it. Points that repeat others, to a
    /// millionth of the frame or as far as repeated measurements of a place differ, are taken once, the first in each place; the
    /// others are put into an order of their own, in which neighbours in space are near each other.
    ///
    /// # Errors
    /// Too few points or too many, a coordinate that is not finite, all points equal, or all on one line (plane in 3D).
    pub fn of(points: &[[f64; D]]) -> Result<(Self, Vec<[f64; D]>), InputError> {
        finite(points)?;
        let needed = D + 2;
        if points.len() < needed {
            return Err(InputError::TooFew { found: points.len(), needed });
        }
        if points.len() as u64 > MOST_POINTS {
            return Err(InputError::TooMany { found: points.len() });
        }
        let corner = |pick: fn(f64, f64) -> f64| -> [f64; D] {
            std::array::from_fn(|axis| points.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0))
        };
        let (lower, upper) = (corner(f64::min), corner(f64::max));
        // Halved before they are subtracted and added: coordinates up to the largest f64 must not overflow.
        let longest = (0..D).map(|a| 0.5 * upper[a] - 0.5 * lower[a]).fold(0.0, f64::max);
        let scale = 0.5 / longest;
        if !scale.is_normal() {
            return Err(InputError::AllEqual { count: points.len() });
        }
        let origin = std::array::from_fn(|a| 0.5 * lower[a] + 0.5 * upper[a]);
        let sides = std::array::from_fn(|a| 2.0 * (0.5 * upper[a] - 0.5 * lower[a]) * scale);
        let frame = Self { origin, scale, sides };

        let mapped: Vec<[f64; D]> = points.iter().map(|p| frame.to_frame(p)).collect();
        let distinct = without_repetitions(&mapped);
        if distinct.len() < needed {
            return Err(InputError::TooFewDistinct { found: distinct.len(), needed });
        }
        not_flat(&distinct)?;
        Ok((frame, distinct))
    }

    /// Data coordinates to frame coordinates.
    pub fn to_frame(&self, point: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| (point[axis] - self.origin[axis]) * self.scale)
    }

    /// Frame coordinates to data coordinates.
    pub fn to_data(&self, point: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|axis| point[axis] / self.scale + self.origin[axis])
    }
}

/// Refuses points of which a coordinate is not finite.
pub(crate) fn finite<const D: usize>(points: &[[f64; D]]) -> Result<(), InputError> {
    match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(index) => Err(InputError::NotFinite { index }),
        None => Ok(()),
    }
}

/// Refuses points, in the frame, that lie on one line (or plane in 3D).
pub(crate) fn not_flat<const D: usize>(points: &[[f64; D]]) -> Result<(), InputError> {
    if flat(points) {
        return Err(InputError::Flat { kind: if D == 2 { "line" } else { "line or plane" } });
    }
    Ok(())
}

/// Whether the points fill no more than `D − 1` dimensions: orthogonal directions are taken from the farthest points in
/// turn until nothing sticks out by more than rounding can explain.
fn flat<const D: usize>(points: &[[f64; D]]) -> bool {
    let mut residuals: Vec<[f64; D]> =
        points.iter().map(|p| std::array::from_fn(|axis| p[axis] - points[0][axis])).collect();
    let square = |v: &[f64; D]| v.iter().map(|x| x * x).sum::<f64>();
    for _ in 0..D {
        let farthest = residuals.iter().copied().fold([0.0; D], |a, b| if square(&b) > square(&a) { b } else { a });
        let length = square(&farthest).sqrt();
        // Sides of size one in f64: a dozen times more than the rounding of the input's own last digits in f32.
        if length < 1e-6 {
            return true;
        }
        for r in &mut residuals {
            let along = (0..D).map(|axis| r[axis] * farthest[axis]).sum::<f64>() / (length * length);
            (0..D).for_each(|axis| r[axis] -= along * farthest[axis]);
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.5]];

    #[test]
    fn the_longest_side_becomes_one() {
        let (frame, points) = Frame::of(&TETRAHEDRON).unwrap();
        assert_eq!(frame.sides, [1.0, 0.5, 0.5]);
        assert_eq!(frame.to_frame(&TETRAHEDRON[0]), [-0.5, -0.25, -0.25]);
        assert_eq!(frame.to_data(&frame.to_frame(&TETRAHEDRON[4])), TETRAHEDRON[4]);
        assert!(points.len() == 5 && TETRAHEDRON.iter().all(|p| points.contains(&frame.to_frame(p))));
    }

    #[test]
    fn powers_of_two_and_large_offsets_change_no_bit() {
        let (_, points) = Frame::of(&TETRAHEDRON).unwrap();
        let scaled = TETRAHEDRON.map(|p| p.map(|x| x * 1024.0 + 5_000_000.0));
        assert_eq!(Frame::of(&scaled).unwrap().1, points);
    }

    #[test]
    fn what_has_no_shape_is_refused() {
        assert_eq!(Frame::of(&[[0.0, 1.0]]), Err(InputError::TooFew { found: 1, needed: 4 }));
        assert_eq!(Frame::of(&[[3.0, 1.0]; 9]), Err(InputError::AllEqual { count: 9 }));
        assert_eq!(Frame::of(&[[0.0, 0.0], [0.0, f64::NAN]]), Err(InputError::NotFinite { index: 1 }));
        let line: Vec<[f64; 3]> = (0..9).map(f64::from).map(|t| [0.1 * t, 0.7 * t, -0.3 * t]).collect();
        assert_eq!(Frame::of(&line), Err(InputError::Flat { kind: "line or plane" }));
        let plane: Vec<[f64; 3]> = (0..9).map(f64::from).map(|t| [t.sin(), t, 0.3 * t.sin() - 0.2 * t]).collect();
        assert_eq!(Frame::of(&plane), Err(InputError::Flat { kind: "line or plane" }));
        let pair = [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [-0.0, 0.0]];
        assert_eq!(Frame::of(&pair), Err(InputError::TooFewDistinct { found: 2, needed: 4 }));
        let huge = [[-1.7e308, 0.0], [1.7e308, 0.0], [0.0, 1e308], [0.0, -1e308]];
        assert_eq!(Frame::of(&huge), Err(InputError::AllEqual { count: 4 }));
    }
}
