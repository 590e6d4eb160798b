//! Exact refinement: the same function on finer knots.

use thiserror::Error;

use crate::knot_vector::{KnotError, KnotVector};
use crate::spline::{Spline, SplineError};
use crate::tensor::apply_along;

/// Why a spline could not be refined.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RefinementError {
    /// The degrees differ.
    #[error("degree {fine} cannot represent degree {coarse}: refinement keeps the degree")]
    Degree {
        /// Degree of the given spline.
        coarse: usize,
        /// Degree of the knots asked for.
        fine: usize,
    },
    /// The finer knots cover another interval.
    #[error("the finer knots cover another domain than the spline")]
    Domain,
    /// A knot of the spline is missing in the finer knots.
    #[error("the finer knots lack the knot {0} of the spline, or repeat it less often")]
    NotNested(f64),
    /// A knot to insert lies outside the open domain.
    #[error("the knot {0} lies outside the domain's interior")]
    Outside(f64),
    /// The knots are not valid together.
    #[error(transparent)]
    Knots(#[from] KnotError),
    /// The coefficients overflowed.
    #[error(transparent)]
    Spline(#[from] SplineError),
}

/// The matrix that takes the coefficients of one axis to finer knots: `degree + 1` entries per fine basis function.
///
/// Fine coefficient `j` is the blossom of the polynomial piece at the fine knots `τ_{j+1}, …, τ_{j+d}` (Ramshaw 1989),
/// so that the knots *outside* the domain need not nest: halving uniform knots gives the two-scale relation,
/// inserting one knot gives Boehm's algorithm.
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    width: usize,
    first: Vec<usize>,
    entries: Vec<f64>,
}

/// A span counts as wider than another from this ratio on: those of uniform knots differ by rounding.
const WIDER: f64 = 1.001;

impl Refinement {
    /// The matrix from `coarse` to `fine` knots.
    ///
    /// # Errors
    /// If the degrees or the domains differ, or an interior knot of `coarse` is missing in `fine`.
    pub fn new(coarse: &KnotVector, fine: &KnotVector) -> Result<Self, RefinementError> {
        let degree = coarse.degree();
        if fine.degree() != degree {
            return Err(RefinementError::Degree { coarse: degree, fine: fine.degree() });
        }
        let (start, end) = coarse.domain();
        if fine.domain() != (start, end) {
            return Err(RefinementError::Domain);
        }
        let mut remaining = fine.knots().iter().copied().filter(|&t| t > start && t < end);
        for knot in coarse.knots().iter().copied().filter(|&t| t > start && t < end) {
            if !remaining.by_ref().take_while(|&t| t <= knot).any(|t| t == knot) {
                return Err(RefinementError::NotNested(knot));
            }
        }

        let width = degree + 1;
        let cells: Vec<_> = fine.cells().collect();
        let (mut first, mut entries) = (Vec::new(), Vec::new());
        for j in 0..fine.basis_count() {
            // Any cell in the support of the fine function does: the middle one, unless it lies in a narrower coarse span than
            // another. The wider the span, the less the function's knots reach beyond it.
            let support: Vec<_> = cells.iter().filter(|(kappa, ..)| (j..=j + degree).contains(kappa)).collect();
            let span_width = |(_, a, b): &(usize, f64, f64)| {
                coarse.span(0.5 * (a + b)).map_or(0.0, |span| coarse.knots()[span + 1] - coarse.knots()[span])
            };
            let middle = support.get(support.len() / 2);
            let widest = support.iter().max_by(|a, b| span_width(a).total_cmp(&span_width(b)));
            let is_wider = |widest: &&&_| middle.is_some_and(|middle| span_width(widest) > WIDER * span_width(middle));
            let Some((_, a, b)) = widest.filter(is_wider).or(middle) else {
                // A function whose support is a single repeated knot vanishes on the domain: any coefficient is right.
                first.push(j.min(coarse.basis_count() - width));
                entries.extend(std::iter::repeat_n(0.0, width));
                continue;
            };
            let span = coarse.span(0.5 * (a + b)).ok_or(RefinementError::Domain)?;
            first.push(span - degree);
            let arguments = &fine.knots()[j + 1..=j + degree];
            for unit in 0..width {
                entries.push(blossom(coarse, span, unit, arguments));
            }
        }
        Ok(Self { width, first, entries })
    }

    /// Number of fine basis functions.
    pub fn rows(&self) -> usize {
        self.first.len()
    }

    /// The first coarse coefficient that fine coefficient `row` depends on, and the weights from there.
    pub fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.entries[row * self.width..][..self.width])
    }
}

/// The blossom, at `arguments`, of basis function `span − degree + unit`'s piece on `span` (de Boor's recursion with a
/// new argument at each step).
fn blossom(knots: &KnotVector, span: usize, unit: usize, arguments: &[f64]) -> f64 {
    let degree = knots.degree();
    let t = knots.knots();
    let mut d = vec![0.0; degree + 1];
    d[unit] = 1.0;
    for (step, u) in arguments.iter().enumerate() {
        for k in (step + 1..=degree).rev() {
            let (left, right) = (t[span - degree + k], t[span + k - step]);
            let share = (u - left) / (right - left);
            d[k] = (1.0 - share) * d[k - 1] + share * d[k];
        }
    }
    d[degree]
}

impl<const D: usize> Spline<D> {
    /// The same function on finer knots.
    ///
    /// # Errors
    /// As [`Refinement::new`].
    pub fn refined(&self, finer: [KnotVector; D]) -> Result<Self, RefinementError> {
        let mut shape = self.shape();
        let mut values = self.as_flat().to_vec();
        for axis in 0..D {
            let refinement = Refinement::new(&self.knots()[axis], &finer[axis])?;
            values = apply_along(&values, &shape, axis, refinement.rows(), |i| refinement.row(i));
            shape[axis] = refinement.rows();
        }
        Ok(Self::from_flat(finer, values)?)
    }

    /// The same function with every cell halved along every axis: on uniform knots the two-scale relation.
    ///
    /// # Errors
    /// If the cells are too small to be halved in f64.
    pub fn halved(&self) -> Result<Self, RefinementError> {
        self.refined(self.knots().each_ref().map(KnotVector::halved))
    }

    /// The same function with one more knot along one axis.
    ///
    /// # Errors
    /// If the knot is not strictly inside the domain, or would be repeated more than `degree + 1` times.
    ///
    /// # Panics
    /// If there is no such axis.
    #[track_caller]
    pub fn with_knot(&self, axis: usize, knot: f64) -> Result<Self, RefinementError> {
        let coarse = &self.knots()[axis];
        let (start, end) = coarse.domain();
        if !(knot > start && knot < end) {
            return Err(RefinementError::Outside(knot));
        }
        let mut knots = coarse.knots().to_vec();
        knots.insert(knots.partition_point(|&t| t <= knot), knot);
        let mut finer = self.knots().clone();
        finer[axis] = KnotVector::new(coarse.degree(), knots)?;
        self.refined(finer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn halving_cubic_cardinal_knots_gives_the_two_scale_weights() {
        let coarse = KnotVector::uniform(3, 0.0, 1.0, 8).unwrap();
        let refinement = Refinement::new(&coarse, &coarse.halved()).unwrap();
        let weights =
            |row: usize| -> Vec<f64> { refinement.row(row).1.iter().copied().filter(|w| w.abs() > 1e-14).collect() };
        let (mut even, mut odd) = (0, 0);
        for row in 0..refinement.rows() {
            let w = weights(row);
            // Exact in binary up to the divisions by 3: rounding only.
            let near =
                |exact: &[f64]| w.len() == exact.len() && w.iter().zip(exact).all(|(a, b)| (a - b).abs() < 1e-14);
            even += usize::from(near(&[0.125, 0.75, 0.125]));
            odd += usize::from(near(&[0.5, 0.5]));
        }
        assert_eq!((even, odd), (9, 10), "all fine functions have the cardinal weights");
    }

    #[test]
    fn coarser_or_shifted_knots_are_refused() {
        let knots = KnotVector::clamped(2, &[0.0, 1.0, 2.0]).unwrap();
        let missing = KnotVector::clamped(2, &[0.0, 0.5, 2.0]).unwrap();
        assert_eq!(Refinement::new(&knots, &missing), Err(RefinementError::NotNested(1.0)));
        let longer = KnotVector::clamped(2, &[0.0, 1.0, 3.0]).unwrap();
        assert_eq!(Refinement::new(&knots, &longer), Err(RefinementError::Domain));
        let higher = KnotVector::clamped(3, &[0.0, 1.0, 2.0]).unwrap();
        assert_eq!(Refinement::new(&knots, &higher), Err(RefinementError::Degree { coarse: 2, fine: 3 }));
        let spline = Spline::from_flat([knots.clone(), knots], vec![1.0; 16]).unwrap();
        for knot in [0.0, 2.0, f64::NAN] {
            assert!(matches!(spline.with_knot(1, knot), Err(RefinementError::Outside(_))), "{knot}");
        }
    }

    proptest! {
        #[test]
        fn refinement_changes_nothing(
            degree in 1usize..=5,
            clamped in any::<bool>(),
            f in proptest::collection::vec(-1.0..1.0f64, 9 * 9),
            inserted in proptest::collection::vec(0.01..3.99f64, 1..4),
            x in [0.0..=4.0f64, 0.0..=4.0f64],
        ) {
            let knots = if clamped {
                KnotVector::clamped(degree, &[0.0, 0.5, 2.0, 2.5, 4.0]).unwrap()
            } else {
                KnotVector::uniform(degree, 0.0, 1.0, 4).unwrap()
            };
            let n = knots.basis_count();
            let coarse = Spline::from_flat([knots.clone(), knots], f[..n * n].to_vec()).unwrap();
            let mut fine = coarse.halved().unwrap();
            for (i, knot) in inserted.iter().enumerate() {
                fine = fine.with_knot(i % 2, *knot).unwrap();
                // Twice the same knot, where the degree allows it.
                if degree > 1 { fine = fine.with_knot(i % 2, *knot).unwrap(); }
            }
            let (a, b) = (coarse.jet(&x), fine.jet(&x));
            // At most ten refinements of six terms in each of two axes: rounding in the value is below 1e-12 even for knots that
            // nearly coincide; derivatives lose a factor of the closest knots' distance.
            prop_assert!((a.value - b.value).abs() < 1e-12, "{} {}", a.value, b.value);
            let closest = fine.knots().iter().flat_map(|k| k.cells().map(|(_, s, e)| e - s)).fold(1.0, f64::min);
            for axis in 0..2 {
                prop_assert!((a.gradient[axis] - b.gradient[axis]).abs() < 1e-12 / closest);
            }
        }
    }
}
