//! The thin-plate energy, equation (3), and its relatives of other orders.

use rayon::prelude::*;
use thiserror::Error;

use crate::gram::BandedMatrix;
use crate::knot_vector::KnotVector;

/// Why an energy could not be set up.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EnergyError {
    /// The derivatives of this order vanish identically.
    #[error("axis {axis}: degree {degree} has no derivatives of order {order}: choose a degree of at least {order}")]
    Degree {
        /// Axis of the knot vector.
        axis: usize,
        /// Its degree.
        degree: usize,
        /// Order of the energy.
        order: usize,
    },
    /// A repeated knot makes a derivative jump that the integral would have to see.
    #[error(
        "axis {axis}: an interior knot is repeated {multiplicity} times, so that derivatives of order {order} are not \
         square-integrable at degree {degree}: repeat interior knots at most {most} times"
    )]
    Multiplicity {
        /// Axis of the knot vector.
        axis: usize,
        /// Largest interior multiplicity found.
        multiplicity: usize,
        /// Largest that works.
        most: usize,
        /// Degree of the knot vector.
        degree: usize,
        /// Order of the energy.
        order: usize,
    },
}

/// Orders of derivatives that there are, the values' among them.
const ORDERS: usize = crate::MAX_DERIVATIVE + 1;
/// The entries of `E_0` to `E_order` over no axis.
const NONE: [f64; ORDERS] = [1.0, 0.0, 0.0, 0.0];
/// `k over a`.
const BINOMIAL: [[f64; ORDERS]; ORDERS] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

/// The quadratic form `fᵀ H f = ∫ ‖∇ᵏ f‖²` over the domain, exactly integrated.
///
/// For `k = 2` it is the thin-plate energy of equation (3). `H` is a sum of Kronecker products of one-dimensional
/// [Gram matrices](BandedMatrix::gram), and is applied as such: it never needs to be stored.
#[derive(Debug, Clone)]
pub struct DerivativeEnergy<const D: usize> {
    order: usize,
    shape: [usize; D],
    /// `grams[axis][derivative]`.
    grams: [Vec<BandedMatrix>; D],
}

impl<const D: usize> DerivativeEnergy<D> {
    /// The thin-plate energy, `∫ ‖∇² f‖²_F`: equation (3).
    ///
    /// # Errors
    /// A degree below 2, or an interior knot repeated `degree` times or more.
    pub fn thin_plate(knots: &[KnotVector; D]) -> Result<Self, EnergyError> {
        Self::new(knots, 2)
    }

    /// The energy of the derivatives of a given order, `∫ Σ_{|α| = order} (order! / α!) (∂^α f)²`.
    ///
    /// # Errors
    /// A degree below `order`, or an interior knot repeated more than `degree + 1 − order` times.
    pub fn new(knots: &[KnotVector; D], order: usize) -> Result<Self, EnergyError> {
        for (axis, knots) in knots.iter().enumerate() {
            let degree = knots.degree();
            if degree < order || order > crate::MAX_DERIVATIVE {
                return Err(EnergyError::Degree { axis, degree, order });
            }
            let (multiplicity, most) = (knots.interior_multiplicity(), degree + 1 - order);
            if multiplicity > most {
                return Err(EnergyError::Multiplicity { axis, multiplicity, most, degree, order });
            }
        }
        Ok(Self {
            order,
            shape: knots.each_ref().map(KnotVector::basis_count),
            grams: knots.each_ref().map(|knots| (0..=order).map(|k| BandedMatrix::gram(knots, k)).collect()),
        })
    }

    /// Number of control coefficients along each axis.
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// Order `k` of the derivatives.
    pub fn order(&self) -> usize {
        self.order
    }

    /// The Gram matrix of one axis and derivative, the factors of `H`.
    ///
    /// # Panics
    /// If `derivative` is above the order of the energy.
    pub fn gram(&self, axis: usize, derivative: usize) -> &BandedMatrix {
        &self.grams[axis][derivative]
    }

    /// `H f` for coefficients in C order.
    ///
    /// By `E_k(x, rest) = Σ_a (k over a) G_a ⊗ E_{k−a}(rest)`, axis by axis from the last: 12 banded passes for the
    /// thin-plate energy in 3D. All passes but those along the first axis run within a plane, while it is in cache.
    ///
    /// # Panics
    /// If the length is not the product of the shape.
    #[track_caller]
    pub fn apply(&self, coefficients: &[f64]) -> Vec<f64> {
        assert_eq!(coefficients.len(), self.shape.iter().product::<usize>(), "one coefficient per basis function");
        let orders = self.order + 1;
        let plane: usize = self.shape[1..].iter().product();
        // For each plane, E_0 to E_order over the axes after the first.
        let mut partial = vec![0.0; orders * coefficients.len()];
        partial
            .par_chunks_mut(orders * plane)
            .zip(coefficients.par_chunks(plane))
            .for_each_init(|| vec![0.0; orders * plane], |scratch, (out, input)| self.within(1, input, out, scratch));
        let mut out = vec![0.0; coefficients.len()];
        out.par_chunks_mut(plane).enumerate().for_each(|(i, out)| {
            let terms = self.terms(0, self.order, i, |other, k| &partial[(other * orders + k) * plane..][..plane]);
            combine(out, &terms);
        });
        out
    }

    /// `E_0` to `E_order` over the axes from `axis` on, one after the other in `out`.
    fn within(&self, axis: usize, input: &[f64], out: &mut [f64], scratch: &mut [f64]) {
        let orders = self.order + 1;
        let size = self.shape[axis];
        if axis == D - 1 {
            for k in 0..orders {
                for (i, value) in out[k * size..(k + 1) * size].iter_mut().enumerate() {
                    let (first, row) = self.grams[axis][k].row(i);
                    *value = row.iter().zip(&input[first..]).map(|(g, x)| g * x).sum();
                }
            }
            return;
        }
        let line: usize = self.shape[axis + 1..].iter().product();
        for (input, lower) in input.chunks(line).zip(scratch.chunks_mut(orders * line)) {
            self.within(axis + 1, input, lower, &mut []);
        }
        for k in 0..orders {
            for i in 0..size {
                let terms = self.terms(axis, k, i, |other, k| &scratch[(other * orders + k) * line..][..line]);
                combine(&mut out[k * input.len() + i * line..][..line], &terms);
            }
        }
    }

    /// The terms of `Σ_a (k over a) Σ_j G_a[i, j] E_{k−a}[j]`.
    fn terms<'p>(
        &self,
        axis: usize,
        k: usize,
        i: usize,
        partial: impl Fn(usize, usize) -> &'p [f64],
    ) -> Vec<(f64, &'p [f64])> {
        let mut terms = Vec::with_capacity((k + 1) * (2 * self.grams[axis][0].half_bandwidth() + 1));
        for a in 0..=k {
            let (first, row) = self.grams[axis][a].row(i);
            terms.extend(row.iter().enumerate().map(|(t, g)| (BINOMIAL[k][a] * g, partial(first + t, k - a))));
        }
        terms
    }

    /// `fᵀ H f`.
    ///
    /// # Panics
    /// If the length is not the product of the shape.
    #[track_caller]
    pub fn energy(&self, coefficients: &[f64]) -> f64 {
        let applied = self.apply(coefficients);
        coefficients.iter().zip(&applied).map(|(f, h)| f * h).sum()
    }

    /// One entry of `H`, by the multi-indices of its row and its column. Zero where two indices differ by more than the
    /// degree along some axis.
    pub fn entry(&self, row: [usize; D], column: [usize; D]) -> f64 {
        let mut partial = NONE;
        for axis in (0..D).rev() {
            partial = self.with_axis(&self.gram_entries(axis, row[axis], column[axis]), &partial);
        }
        partial[self.order]
    }

    /// The entries of one column of `H`, given by its multi-index, in C order over the rows whose indices differ from its by at most the degree
    /// along every axis.
    pub fn column(&self, column: [usize; D]) -> Vec<f64> {
        let mut partial = vec![NONE];
        for axis in (0..D).rev() {
            let (first, row) = self.grams[axis][0].row(column[axis]);
            let rows = (first..first + row.len()).map(|row| self.gram_entries(axis, row, column[axis]));
            partial = rows.flat_map(|entries| partial.iter().map(move |p| self.with_axis(&entries, p))).collect();
        }
        partial.iter().map(|p| p[self.order]).collect()
    }

    /// An entry of the Gram matrix of every derivative along an axis.
    fn gram_entries(&self, axis: usize, row: usize, column: usize) -> [f64; ORDERS] {
        std::array::from_fn(|k| self.grams[axis].get(k).map_or(0.0, |gram| gram.get(row, column)))
    }

    /// The entries of `E_0` to `E_order` over one axis more, given those of its Gram matrices.
    fn with_axis(&self, entries: &[f64; ORDERS], partial: &[f64; ORDERS]) -> [f64; ORDERS] {
        let mut all = [0.0; ORDERS];
        for k in 0..=self.order {
            all[k] = (0..=k).map(|a| BINOMIAL[k][a] * entries[a] * partial[k - a]).sum();
        }
        all
    }

    /// The diagonal of `H` in C order.
    pub fn diagonal(&self) -> Vec<f64> {
        let count = self.shape.iter().product();
        let strides = crate::tensor::strides(&self.shape);
        (0..count)
            .map(|flat: usize| {
                let index = std::array::from_fn(|axis| flat / strides[axis] % self.shape[axis]);
                self.entry(index, index)
            })
            .collect()
    }
}

/// `out = Σ factor · x`, blockwise so that `out` stays in cache, four terms at a time.
fn combine(out: &mut [f64], terms: &[(f64, &[f64])]) {
    const BLOCK: usize = 1024;
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        out.fill(0.0);
        let part = |x: &'_ [f64]| -> std::ops::Range<usize> { block * BLOCK..(block * BLOCK + BLOCK).min(x.len()) };
        for four in terms.chunks(4) {
            if let [(a, p), (b, q), (c, r), (d, s)] = four {
                let (p, q, r, s) = (&p[part(p)], &q[part(q)], &r[part(r)], &s[part(s)]);
                for (((o, p), q), (r, s)) in out.iter_mut().zip(p).zip(q).zip(r.iter().zip(s)) {
                    *o += (a * p + b * q) + (c * r + d * s);
                }
            } else {
                for (a, x) in four {
                    for (o, x) in out.iter_mut().zip(&x[part(x)]) {
                        *o += a * x;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knots() -> [KnotVector; 3] {
        [
            KnotVector::uniform(3, 0.0, 0.5, 4).unwrap(),
            KnotVector::clamped(3, &[0.0, 1.0, 1.5]).unwrap(),
            KnotVector::new(3, vec![0.0, 0.2, 0.3, 1.0, 1.5, 1.5, 2.0, 3.0, 4.0, 5.0]).unwrap(),
        ]
    }

    fn multi_index(flat: usize, shape: [usize; 3]) -> [usize; 3] {
        [flat / (shape[1] * shape[2]), flat / shape[2] % shape[1], flat % shape[2]]
    }

    #[test]
    fn a_column_has_the_entries_of_its_band() {
        for order in 1..=2 {
            let energy = DerivativeEnergy::new(&knots(), order).unwrap();
            let shape = energy.shape();
            for column in (0..shape.iter().product()).map(|flat| multi_index(flat, shape)) {
                let rows = (0..shape.iter().product()).map(|flat| multi_index(flat, shape));
                let in_band = |row: &[usize; 3]| (0..3).all(|axis| row[axis].abs_diff(column[axis]) <= 3);
                let (band, rest): (Vec<[usize; 3]>, Vec<_>) = rows.partition(in_band);
                let entries: Vec<f64> = band.iter().map(|row| energy.entry(*row, column)).collect();
                assert_eq!(energy.column(column), entries);
                assert!(rest.iter().all(|row| energy.entry(*row, column) == 0.0));
            }
        }
    }

    #[test]
    fn assembled_and_applied_agree() {
        for order in 1..=3 {
            // Order 3 wants no double knots at degree 3.
            let mut knots = knots();
            if order == 3 {
                knots[2] = KnotVector::new(3, vec![0.0, 0.2, 0.3, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0]).unwrap();
            }
            let energy = DerivativeEnergy::new(&knots, order).unwrap();
            let count: usize = energy.shape().iter().product();
            let f: Vec<f64> = (0..count).map(|i| ((i * 37 + 11) % 101) as f64 / 50.0 - 1.0).collect();
            let applied = energy.apply(&f);
            let size = applied.iter().map(|v| v.abs()).fold(0.0, f64::max);
            for row in 0..count {
                let r = multi_index(row, energy.shape());
                let sum: f64 =
                    (0..count).map(|column| energy.entry(r, multi_index(column, energy.shape())) * f[column]).sum();
                // The same few hundred products summed in another order.
                assert!((sum - applied[row]).abs() < 1e-12 * size, "order {order}, row {row}");
            }
        }
    }

    #[test]
    fn linear_functions_have_no_thin_plate_energy_and_a_parabola_has_the_known_one() {
        let knots = KnotVector::uniform(3, 0.0, 0.25, 8).unwrap();
        let energy = DerivativeEnergy::thin_plate(&[knots.clone(), knots.clone()]).unwrap();
        let n = knots.basis_count();
        let greville = |r: usize| knots.knots()[r + 1..r + 4].iter().sum::<f64>() / 3.0;
        let square = |r: usize| {
            let t = &knots.knots()[r + 1..r + 4];
            (t[0] * t[1] + t[1] * t[2] + t[0] * t[2]) / 3.0
        };
        let linear: Vec<f64> = (0..n * n).map(|i| greville(i / n) - 2.0 * greville(i % n)).collect();
        // Coefficients up to 4, entries of H up to 1/h² = 16 times a few: rounding of sums that cancel.
        assert!(energy.energy(&linear).abs() < 1e-11);
        // f = x² + xy over [0, 2]²: ‖∇²f‖² = 4 + 2, times the area 4.
        let quadratic: Vec<f64> = (0..n * n).map(|i| square(i / n) + greville(i / n) * greville(i % n)).collect();
        assert!((energy.energy(&quadratic) - 24.0).abs() < 1e-10);
    }

    #[test]
    fn rough_functions_are_refused() {
        let linear = KnotVector::uniform(1, 0.0, 1.0, 4).unwrap();
        assert_eq!(
            DerivativeEnergy::thin_plate(&[linear.clone(), linear]).unwrap_err(),
            EnergyError::Degree { axis: 0, degree: 1, order: 2 }
        );
        let smooth = KnotVector::uniform(2, 0.0, 1.0, 4).unwrap();
        let kinked = KnotVector::new(2, vec![0., 0., 0., 1., 1., 2., 2., 2.]).unwrap();
        assert_eq!(
            DerivativeEnergy::thin_plate(&[smooth, kinked]).unwrap_err(),
            EnergyError::Multiplicity { axis: 1, multiplicity: 2, most: 1, degree: 2, order: 2 }
        );
    }

    proptest! {
        #[test]
        fn symmetric_and_semidefinite(seed in proptest::collection::vec(-1.0..1.0f64, 7 * 5 * 6 * 2)) {
            let energy = DerivativeEnergy::thin_plate(&knots()).unwrap();
            let (f, g) = seed.split_at(7 * 5 * 6);
            let (hf, hg) = (energy.apply(f), energy.apply(g));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            let size = dot(&hf, f).max(dot(&hg, g));
            // Two sums of 210 products each.
            prop_assert!((dot(&hf, g) - dot(f, &hg)).abs() < 1e-12 * size);
            prop_assert!(dot(&hf, f) >= 0.0);
        }
    }
}
