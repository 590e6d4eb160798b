//! Values and derivatives of the basis functions of one axis at one position.

use crate::knot_vector::{KnotVector, MAX_DEGREE};

/// The highest derivative that [`Basis`] can hold.
pub const MAX_DERIVATIVE: usize = 3;

const WIDTH: usize = MAX_DEGREE + 1;

/// The `degree + 1` basis functions that do not vanish at a position, with their derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Basis {
    /// Index of the first of them.
    pub first: usize,
    width: usize,
    rows: [[f64; WIDTH]; MAX_DERIVATIVE + 1],
}

impl Basis {
    /// Evaluates the basis functions at `x` with derivatives up to `order`. `None` outside the domain.
    pub fn at(knots: &KnotVector, x: f64, order: usize) -> Option<Self> {
        knots.span(x).map(|span| Self::in_span(knots, span, x, order))
    }

    /// As [`Basis::at`], with the polynomial piece of a given span of positive length.
    ///
    /// In closed form for cubics on uniform knots.
    pub(crate) fn in_span(knots: &KnotVector, span: usize, x: f64, order: usize) -> Self {
        let t = knots.knots();
        match (knots.degree(), knots.uniform_spacing()) {
            (3, Some(spacing)) => Self::cardinal(span, (x - t[span]) / (t[span + 1] - t[span]), spacing, order),
            _ => Self::by_recurrence(knots, span, x, order),
        }
    }

    /// The triangular table of Cox and de Boor, kept whole for the derivatives (Piegl and Tiller 1997, section 2.3).
    fn by_recurrence(knots: &KnotVector, span: usize, x: f64, order: usize) -> Self {
        let degree = knots.degree();
        let t = knots.knots();
        // Row j of `table` holds the basis functions of degree j, column r the knot differences.
        let mut table = [[0.0; WIDTH]; WIDTH];
        let (mut left, mut right) = ([0.0; WIDTH], [0.0; WIDTH]);
        table[0][0] = 1.0;
        for j in 1..=degree {
            left[j] = x - t[span + 1 - j];
            right[j] = t[span + j] - x;
            let mut carried = 0.0;
            for r in 0..j {
                table[j][r] = right[r + 1] + left[j - r];
                let share = table[r][j - 1] / table[j][r];
                table[r][j] = carried + right[r + 1] * share;
                carried = left[j - r] * share;
            }
            table[j][j] = carried;
        }

        let mut rows = [[0.0; WIDTH]; MAX_DERIVATIVE + 1];
        for r in 0..=degree {
            rows[0][r] = table[r][degree];
        }
        let order = order.min(MAX_DERIVATIVE);
        for r in 0..=degree {
            let mut a = [[0.0; WIDTH]; 2];
            a[0][0] = 1.0;
            let (mut current, mut next) = (0, 1);
            for k in 1..=order.min(degree) {
                let lower = degree - k;
                let mut sum = 0.0;
                if r >= k {
                    a[next][0] = a[current][0] / table[lower + 1][r - k];
                    sum = a[next][0] * table[r - k][lower];
                }
                let begin = if r + 1 >= k { 1 } else { k - r };
                let end = if r <= lower + 1 { k - 1 } else { degree - r };
                for j in begin..=end {
                    a[next][j] = (a[current][j] - a[current][j - 1]) / table[lower + 1][r + j - k];
                    sum += a[next][j] * table[r + j - k][lower];
                }
                if r <= lower {
                    a[next][k] = -a[current][k - 1] / table[lower + 1][r];
                    sum += a[next][k] * table[r][lower];
                }
                rows[k][r] = sum;
                std::mem::swap(&mut current, &mut next);
            }
        }
        let mut factor = 1.0;
        for k in 1..=order.min(degree) {
            factor *= (degree + 1 - k) as f64;
            for value in &mut rows[k][..=degree] {
                *value *= factor;
            }
        }
        Self { first: span - degree, width: degree + 1, rows }
    }

    /// The four cubic cardinal functions at `u` of the way through a cell whose sides are `spacing`.
    fn cardinal(span: usize, u: f64, spacing: f64, order: usize) -> Self {
        let mut rows = [[0.0; WIDTH]; MAX_DERIVATIVE + 1];
        let v = 1.0 - u;
        let (values, slopes) = cubic_cardinals(u);
        rows[0][..4].copy_from_slice(&values);
        let pieces: [[f64; 4]; MAX_DERIVATIVE] = [slopes, [v, 3.0 * u - 2.0, 3.0 * v - 2.0, u], [-1.0, 3.0, -3.0, 1.0]];
        let mut scale = 1.0;
        for k in 1..=order.min(MAX_DERIVATIVE) {
            scale /= spacing;
            for r in 0..4 {
                rows[k][r] = pieces[k - 1][r] * scale;
            }
        }
        Self { first: span - 3, width: 4, rows }
    }

    /// The `derivative`-th derivatives of the functions `first`, `first + 1`, …; zeros above the degree.
    ///
    /// # Panics
    /// If `derivative` is above [`MAX_DERIVATIVE`].
    pub fn derivative(&self, derivative: usize) -> &[f64] {
        &self.rows[derivative][..self.width]
    }
}

/// Values and slopes of the four cubic cardinal functions that act on a cell of side 1, `u` of the way through it.
#[inline(always)]
pub fn cubic_cardinals(u: f64) -> ([f64; 4], [f64; 4]) {
    let v = 1.0 - u;
    let (uu, vv) = (u * u, v * v);
    let values = [vv * v / 6.0, 2.0 / 3.0 - uu * (1.0 - 0.5 * u), 2.0 / 3.0 - vv * (1.0 - 0.5 * v), uu * u / 6.0];
    (values, [-0.5 * vv, u * (1.5 * u - 2.0), -v * (1.5 * v - 2.0), 0.5 * uu])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knot_vectors() -> impl Strategy<Value = KnotVector> {
        (1usize..=5, proptest::collection::vec(0usize..4, 8..20)).prop_filter_map("valid", |(degree, steps)| {
            let mut knots = vec![0.0];
            for step in steps {
                knots.push(knots[knots.len() - 1] + [0.0, 0.3, 1.0, 2.5][step]);
            }
            KnotVector::new(degree, knots).ok()
        })
    }

    proptest! {
        #[test]
        fn partition_of_unity(knots in knot_vectors(), u in 0.0..=1.0f64) {
            let (start, end) = knots.domain();
            let x = (start + u * (end - start)).min(end);
            let basis = Basis::at(&knots, x, 3).unwrap();
            // A handful of terms of size one: rounding only.
            prop_assert!((basis.derivative(0).iter().sum::<f64>() - 1.0).abs() < 1e-14);
            prop_assert!(basis.derivative(0).iter().all(|&b| b >= 0.0));
            for k in 1..=3 {
                let row = basis.derivative(k);
                let size = row.iter().map(|b| b.abs()).fold(1.0, f64::max);
                prop_assert!(row.iter().sum::<f64>().abs() < 1e-13 * size);
            }
        }

        #[test]
        fn closed_forms_agree_with_the_recurrence(start in -3.0..3.0f64, spacing in 0.01..2.0f64, u in 0.0..=1.0f64) {
            let knots = KnotVector::uniform(3, start, spacing, 6).unwrap();
            prop_assert!(knots.uniform_spacing().is_some());
            let x = start + (2.0 + u) * spacing;
            let [closed, table] = [Basis::in_span, Basis::by_recurrence].map(|basis| basis(&knots, 5, x, 3));
            for k in 0..=3 {
                for (c, t) in closed.derivative(k).iter().zip(table.derivative(k)) {
                    // Knots are rounded at the size of their coordinates, 15 at most, beside cells of a hundredth at least.
                    prop_assert!((c - t).abs() * spacing.powi(k as i32) < 1e-12 / spacing.min(1.0), "{k}: {c} {t}");
                }
            }
        }

        #[test]
        fn derivatives_agree_with_differences_of_the_order_below(knots in knot_vectors(), u in 0.05..=0.95f64, cell in 0usize..20) {
            let cells: Vec<_> = knots.cells().collect();
            let (span, start, end) = cells[cell % cells.len()];
            let x = start + u * (end - start);
            let step = 1e-5 * (end - start);
            let basis = Basis::in_span(&knots, span, x, 3);
            let (before, after) = (Basis::in_span(&knots, span, x - step, 3), Basis::in_span(&knots, span, x + step, 3));
            for k in 1..=3 {
                for r in 0..=knots.degree() {
                    let difference = (after.derivative(k - 1)[r] - before.derivative(k - 1)[r]) / (2.0 * step);
                    let size = basis.derivative(k).iter().chain(basis.derivative(k - 1)).map(|b| b.abs()).fold(1.0, f64::max);
                    // Central differences: error step² times the derivative two orders up, and rounding / step.
                    prop_assert!((difference - basis.derivative(k)[r]).abs() < 2e-6 * size / (end - start).powi(2));
                }
            }
        }
    }
}
