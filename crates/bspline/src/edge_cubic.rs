//! A spline along an edge of a lattice that divides its cells: one cubic of one variable.

use crate::basis::Basis;
use crate::hierarchical_spline::{HierarchicalSpline, LOCAL, WIDTH};
use crate::knot_vector::KnotVector;

/// Coefficients of 1, t, t², t³.
type Cubic = [f64; WIDTH];

/// f and ∇f on a segment parallel to an axis and within one cell of a cubic spline, by the share `t` of the way along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCubic<const D: usize> {
    axis: usize,
    /// From the start to the end; negative against the axis.
    length: f64,
    value: Cubic,
    /// ∂f along the other axes; nothing at the segment's own.
    slopes: [Cubic; D],
}

impl<const D: usize> EdgeCubic<D> {
    /// f, and its derivative by `t`.
    pub fn value_and_slope(&self, t: f64) -> (f64, f64) {
        let [a, b, c, d] = self.value;
        (a + t * (b + t * (c + t * d)), b + t * (2.0 * c + t * (3.0 * d)))
    }

    /// `∇f`.
    pub fn gradient(&self, t: f64) -> [f64; D] {
        let mut gradient = self.slopes.map(|[a, b, c, d]| a + t * (b + t * (c + t * d)));
        gradient[self.axis] = self.value_and_slope(t).1 / self.length;
        gradient
    }
}

impl<const D: usize> HierarchicalSpline<D> {
    /// f and ∇f on the segment between two places that differ along one axis. None if they differ along several, if the segment
    /// leaves a cell (by more than rounding) or the box, or if the spline is not cubic.
    ///
    /// Sums of the coefficients across the segment are made once, where [`HierarchicalSpline::value_and_gradient`] makes all
    /// sums at every place: equal up to rounding.
    pub fn along_edge(&self, start: &[f64; D], end: &[f64; D]) -> Option<EdgeCubic<D>> {
        let mut differing = (0..D).filter(|&axis| start[axis] != end[axis]);
        let axis = differing.next().filter(|_| differing.next().is_none())?;
        let length = end[axis] - start[axis];
        let mut middle = *start;
        middle[axis] += 0.5 * length;
        let place @ (level, cell) = self.cubic_cell(&middle)?;
        let (_, low, high) = cell_ends(&self.knots_of(level)[axis], cell[axis])?;
        let slack = ROUNDING * length.abs();
        let within = |x: f64| x >= low - slack && x <= high + slack;
        if !(within(start[axis]) && within(end[axis])) {
            return None;
        }
        let (coefficients, basis) = self.local(place, start, WIDTH - 1);
        let mut across = [[0.0; WIDTH]; 3];
        sums_across(&coefficients, &basis, axis, &mut across);
        // Taylor's series ends after the third power.
        let power = |line: &[f64; WIDTH], k: usize, factor: f64| -> f64 {
            basis[axis].derivative(k).iter().zip(line).map(|(n, c)| n * c).sum::<f64>() * factor
        };
        let (square, cube) = (length * length / 2.0, length * length * length / 6.0);
        let cubic = |line: &[f64; WIDTH]| -> Cubic {
            [power(line, 0, 1.0), power(line, 1, length), power(line, 2, square), power(line, 3, cube)]
        };
        let mut slopes = [[0.0; WIDTH]; D];
        for (other, line) in (0..D).filter(|&other| other != axis).zip(&across[1..]) {
            slopes[other] = cubic(line);
        }
        Some(EdgeCubic { axis, length, value: cubic(&across[0]), slopes })
    }

    /// The level and the cell at a place where f is a cubic.
    fn cubic_cell(&self, x: &[f64; D]) -> Option<(usize, [u32; D])> {
        if !self.levels().is_empty() {
            return self.locate(x);
        }
        let mut cell = [0; D];
        for (axis, knots) in self.root().knots().iter().enumerate() {
            if knots.degree() + 1 != WIDTH {
                return None;
            }
            cell[axis] = (knots.span(x[axis])? - knots.degree()) as u32;
        }
        Some((0, cell))
    }
}

/// How far a segment may stick out of a cell, in its lengths: nodes of a lattice are rounded where knots are not.
const ROUNDING: f64 = 1e-6;

/// The cell whose first coefficient is `first`, as [`KnotVector::cells`] gives it.
fn cell_ends(knots: &KnotVector, first: u32) -> Option<(usize, f64, f64)> {
    let span = first as usize + knots.degree();
    Some((span, *knots.knots().get(span)?, *knots.knots().get(span + 1)?))
}

/// Sums of a cell's coefficients over all axes but one: of f, and of the slopes along each of the other axes in turn.
fn sums_across<const D: usize>(
    coefficients: &[f64; LOCAL],
    basis: &[Basis; D],
    axis: usize,
    [values, first, second]: &mut [[f64; WIDTH]; 3],
) {
    let stride = |axis: usize| WIDTH.pow((D - 1 - axis) as u32);
    let weights = |axis: usize, k: usize| -> [f64; WIDTH] {
        let mut weights = [0.0; WIDTH];
        weights.copy_from_slice(basis[axis].derivative(k));
        weights
    };
    let last = (0..D).rfind(|&other| other != axis).unwrap_or(0);
    let (along, inner) = (stride(axis), stride(last));
    let (v, dv) = (weights(last, 0), weights(last, 1));
    if D == 2 {
        for k in 0..WIDTH {
            for j in 0..WIDTH {
                let c = coefficients[k * along + j * inner];
                values[k] += v[j] * c;
                first[k] += dv[j] * c;
            }
        }
        return;
    }
    let other = (0..D).find(|&other| other != axis).unwrap_or(0);
    let (outer, u, du) = (stride(other), weights(other, 0), weights(other, 1));
    for k in 0..WIDTH {
        for i in 0..WIDTH {
            let (mut sum, mut sloping) = (0.0, 0.0);
            for j in 0..WIDTH {
                let c = coefficients[k * along + i * outer + j * inner];
                sum += v[j] * c;
                sloping += dv[j] * c;
            }
            values[k] += u[i] * sum;
            first[k] += du[i] * sum;
            second[k] += u[i] * sloping;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::{CellBand, Spline};

    /// A spline with a level more around one point, and one edge of every axis within each of many cells of its lattice.
    fn check<const D: usize>(f: &[f64], x: &[f64; D], t: f64, back: bool) -> Result<(), TestCaseError> {
        let knots: [KnotVector; D] = std::array::from_fn(|_| KnotVector::uniform(3, -1.0, 0.25, 8).unwrap());
        let next = |count: usize| f.iter().cycle().take(count).copied().collect::<Vec<f64>>();
        let band = CellBand::new(&knots, &[[0.1; D]], &[1], [3, 3]).unwrap();
        let mut spline =
            HierarchicalSpline::new(Spline::from_flat(knots, next(11usize.pow(D as u32))).unwrap()).unwrap();
        for levels in 0..2 {
            if levels > 0 {
                spline.push_level(Arc::clone(&band.active()[0])).unwrap();
                spline.correct_finest(next(band.active()[0].len())).unwrap();
            }
            for axis in 0..D {
                let mut start = *x;
                start[axis] = (x[axis] * 16.0).floor() / 16.0;
                let mut end = start;
                end[axis] += 0.0625;
                if back {
                    std::mem::swap(&mut start, &mut end);
                }
                let edge = spline.along_edge(&start, &end).unwrap();
                let at: [f64; D] = std::array::from_fn(|a| start[a] + t * (end[a] - start[a]));
                let (value, gradient) = spline.value_and_gradient(&at);
                let (along, slope) = edge.value_and_slope(t);
                // A few dozen products of size one; slopes are larger by 1 / 0.125.
                prop_assert!((along - value).abs() < 1e-13, "{along} {value}");
                prop_assert!((slope - (end[axis] - start[axis]) * gradient[axis]).abs() < 1e-13);
                for (a, b) in edge.gradient(t).iter().zip(gradient) {
                    prop_assert!((a - b).abs() < 1e-12 * 8.0, "{a} {b}");
                }
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn an_edge_has_the_values_and_gradients_of_the_spline(
            f in proptest::collection::vec(-1.0..1.0f64, 127),
            x in [-1.0..0.999f64, -1.0..0.999f64, -1.0..0.999f64],
            t in 0.0..=1.0f64,
            back in any::<bool>(),
        ) {
            check(&f, &x, t, back)?;
            check(&f, &[x[0], x[1]], t, back)?;
        }
    }

    #[test]
    fn what_is_no_edge_of_a_cell_has_no_cubic() {
        let of_degree = |degree: usize| {
            let knots = KnotVector::uniform(degree, 0.0, 0.5, 4).unwrap();
            let coefficients = vec![1.0; (4 + degree).pow(2)];
            HierarchicalSpline::new(Spline::from_flat([knots.clone(), knots], coefficients).unwrap()).unwrap()
        };
        let cubic = of_degree(3);
        assert!(cubic.along_edge(&[0.5, 0.3], &[1.0, 0.3]).is_some());
        assert!(cubic.along_edge(&[0.5, 0.3], &[1.0, 0.4]).is_none(), "not parallel to an axis");
        assert!(cubic.along_edge(&[0.5, 0.3], &[0.5, 0.3]).is_none(), "no length");
        assert!(cubic.along_edge(&[0.4, 0.3], &[0.6, 0.3]).is_none(), "two cells");
        assert!(cubic.along_edge(&[1.9, 0.3], &[2.3, 0.3]).is_none(), "beyond the box");
        assert!(of_degree(2).along_edge(&[0.5, 0.3], &[1.0, 0.3]).is_none(), "quadratic");
    }
}
