//! Lower and upper bounds of a spline on each cell.

use ndarray::ArrayD;

use crate::spline::Spline;
use crate::tensor::strides;

/// Bounds of a spline on its cells: a B-spline lies in the convex hull of the coefficients that are active there.
#[derive(Debug, Clone, PartialEq)]
pub struct CellBounds {
    /// Lower bounds, one per cell (spans of positive length along each axis).
    pub lower: ArrayD<f64>,
    /// Upper bounds.
    pub upper: ArrayD<f64>,
}

impl<const D: usize> Spline<D> {
    /// Bounds `f` on every cell by the smallest and the largest of its `(degree + 1)^D` active coefficients.
    pub fn cell_bounds(&self) -> CellBounds {
        CellBounds { lower: self.windowed(f64::min), upper: self.windowed(f64::max) }
    }

    /// Bounds of f over the part of its box between two corners: the values there lie between them. None where that part is
    /// empty.
    pub fn bounds(&self, lower: &[f64; D], upper: &[f64; D]) -> Option<(f64, f64)> {
        let (start, end) = self.domain();
        let (mut first, mut last) = ([0; D], [0; D]);
        for axis in 0..D {
            let (from, to) = (lower[axis].max(start[axis]), upper[axis].min(end[axis]));
            if from > to {
                return None;
            }
            first[axis] = self.knots()[axis].span(from)? - self.knots()[axis].degree();
            last[axis] = self.knots()[axis].span(to)?;
        }
        let (mut index, shape) = (first, self.shape());
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        loop {
            let flat = (0..D - 1).fold(0, |flat, axis| (flat + index[axis]) * shape[axis + 1]);
            for c in &self.as_flat()[flat + first[D - 1]..=flat + last[D - 1]] {
                (least, most) = (least.min(*c), most.max(*c));
            }
            // The next line: the last of the leading axes counts fastest.
            let Some(axis) = (0..D - 1).rev().find(|axis| index[*axis] < last[*axis]) else {
                return Some((least, most));
            };
            index[axis] += 1;
            index[axis + 1..D - 1].copy_from_slice(&first[axis + 1..D - 1]);
        }
    }

    /// Slides a window of `degree + 1` along each axis in turn.
    fn windowed(&self, pick: impl Fn(f64, f64) -> f64) -> ArrayD<f64> {
        let mut shape = self.shape();
        let mut values = self.as_flat().to_vec();
        for axis in 0..D {
            let knots = &self.knots()[axis];
            let first: Vec<usize> = knots.cells().map(|(span, ..)| span - knots.degree()).collect();
            let old_strides = strides(&shape);
            let mut new_shape = shape;
            new_shape[axis] = first.len();
            let new_strides = strides(&new_shape);
            let count: usize = new_shape.iter().product();
            values = (0..count)
                .map(|flat| {
                    let offset: usize = (0..D)
                        .map(|a| {
                            let i = flat / new_strides[a] % new_shape[a];
                            old_strides[a] * if a == axis { first[i] } else { i }
                        })
                        .sum();
                    (1..=knots.degree())
                        .fold(values[offset], |best, k| pick(best, values[offset + k * old_strides[axis]]))
                })
                .collect();
            shape = new_shape;
        }
        #[expect(clippy::expect_used, reason = "the loop above fills exactly this shape")]
        let bounds = ArrayD::from_shape_vec(shape.to_vec(), values).expect("one bound per cell");
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::KnotVector;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn values_stay_within_the_bounds(
            f in proptest::collection::vec(-1.0..1.0f64, 7 * 6),
            x in [0.0..=4.0f64, 0.0..=3.0f64],
        ) {
            let knots = [
                KnotVector::uniform(3, 0.0, 1.0, 4).unwrap(),
                KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0]).unwrap(),
            ];
            let spline = Spline::from_flat(knots, f).unwrap();
            let bounds = spline.cell_bounds();
            prop_assert_eq!(bounds.lower.shape(), &[4, 3]);
            let cell = [(x[0] as usize).min(3), (x[1] as usize).min(2)];
            let value = spline.value(&x);
            // Rounding of a convex combination of values below one.
            prop_assert!(value >= bounds.lower[cell.as_slice()] - 1e-14);
            prop_assert!(value <= bounds.upper[cell.as_slice()] + 1e-14);
        }
    }
}
