//! Normals that come with the points.

use rustc_hash::FxHashMap;

use crate::error::InputError;
use crate::points::frame::Frame;

/// Points in data coordinates with a normal each.
#[derive(Clone, Copy)]
pub struct Known<'a, const D: usize> {
    points: &'a [[f64; D]],
    normals: &'a [[f64; D]],
}

impl<'a, const D: usize> Known<'a, D> {
    /// Joins them.
    ///
    /// # Errors
    /// Not one normal per point, or one that is not finite.
    pub fn new(points: &'a [[f64; D]], normals: &'a [[f64; D]]) -> Result<Self, InputError> {
        if normals.len() != points.len() {
            return Err(InputError::Normals { found: normals.len(), needed: points.len() });
        }
        match normals.iter().position(|n| n.iter().any(|x| !x.is_finite())) {
            Some(index) => Err(InputError::NormalNotFinite { index }),
            None => Ok(Self { points, normals }),
        }
    }

    /// The normals of some of the points, which are given in the frame; of several points in one place, that of the first.
    pub fn of(&self, some: &[[f64; D]], frame: &Frame<D>) -> Vec<[f64; D]> {
        let bits = |point: &[f64; D]| point.map(f64::to_bits);
        let mut found: FxHashMap<[u64; D], Option<[f64; D]>> = some.iter().map(|point| (bits(point), None)).collect();
        for (point, normal) in self.points.iter().zip(self.normals) {
            if let Some(none @ None) = found.get_mut(&bits(&frame.to_frame(point))) {
                *none = Some(*normal);
            }
        }
        some.iter().map(|point| found[&bits(point)].unwrap_or([0.0; D])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_keep_their_normals_through_the_frame() {
        let points = [[3.0, 1.0], [3.0, 1.0], [0.1, 2.0], [-5.0, 0.3], [0.7, -0.9], [1.5, 2.5]];
        let normals = [[1.0, 0.0], [0.0, 1.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0], [5.0, 0.0]];
        let (frame, distinct) = Frame::of(&points).unwrap();
        assert_eq!(distinct.len(), 5);
        let known = Known::new(&points, &normals).unwrap();
        for (place, found) in distinct.iter().zip(known.of(&distinct, &frame)) {
            let first = points.iter().position(|point| frame.to_frame(point) == *place).unwrap();
            assert_eq!(found, normals[first]);
        }
        let fifth = frame.to_frame(&points[4]);
        assert_eq!(known.of(&[fifth], &frame), [normals[4]]);
        assert_eq!(Known::new(&points, &normals[1..]).err(), Some(InputError::Normals { found: 5, needed: 6 }));
        let bad = [[0.0, f64::NAN]; 6];
        assert_eq!(Known::new(&points, &bad).err(), Some(InputError::NormalNotFinite { index: 0 }));
    }
}
