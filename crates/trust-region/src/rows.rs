//! Rows `αᵢ qᵢ + βᵢ₁ uᵢ + βᵢ₂ vᵢ [+ βᵢ₃ wᵢ]`, never stored: only their factors are.

use rayon::prelude::*;
use zeroset_bspline::{Basis, Collocation};

/// How many points one parallel task takes.
const CHUNK: usize = 1024;

/// Into how many parts a transposed product is split. Fixed, so that sums do not depend on the number of threads.
const PARTS: usize = 4;

/// A matrix with one row per point, by its factors α and β.
#[derive(Debug, Clone)]
pub(crate) struct Rows<'c, const D: usize> {
    collocation: &'c Collocation<D>,
    pub(crate) alpha: Vec<f64>,
    pub(crate) beta: Vec<[f64; D]>,
}

impl<'c, const D: usize> Rows<'c, D> {
    pub(crate) fn new(collocation: &'c Collocation<D>, alpha: Vec<f64>, beta: Vec<[f64; D]>) -> Self {
        Self { collocation, alpha, beta }
    }

    pub(crate) fn collocation(&self) -> &'c Collocation<D> {
        self.collocation
    }

    /// The product with a coefficient vector: one number per point.
    pub(crate) fn apply(&self, x: &[f64]) -> Vec<f64> {
        let strides = self.strides();
        (0..self.alpha.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|i| contract(x, &strides, self.collocation.basis(i), &self.beta[i], self.alpha[i], 1.0))
            .collect()
    }

    /// Adds the transposed product with one number per point to `out`.
    pub(crate) fn add_transposed(&self, y: &[f64], out: &mut [f64]) {
        self.scatter_all(out, |i, out, strides| {
            scatter(out, strides, self.collocation.basis(i), &self.beta[i], self.alpha[i], 1.0, &|row| row * y[i]);
        });
    }

    /// Adds the diagonal of `Σ rᵢ rᵢᵀ` to `out`.
    pub(crate) fn add_squares(&self, out: &mut [f64]) {
        self.scatter_all(out, |i, out, strides| {
            scatter(out, strides, self.collocation.basis(i), &self.beta[i], self.alpha[i], 1.0, &|row| row * row);
        });
    }

    fn scatter_all(&self, out: &mut [f64], one: impl Fn(usize, &mut [f64], &[usize; D]) + Sync) {
        let (count, strides) = (self.alpha.len(), self.strides());
        if count < PARTS * CHUNK {
            (0..count).for_each(|i| one(i, out, &strides));
            return;
        }
        let parts: Vec<Vec<f64>> = (0..PARTS)
            .into_par_iter()
            .map(|part| {
                let mut sum = vec![0.0; out.len()];
                (part * count / PARTS..(part + 1) * count / PARTS).for_each(|i| one(i, &mut sum, &strides));
                sum
            })
            .collect();
        for part in parts {
            out.iter_mut().zip(part).for_each(|(o, p)| *o += p);
        }
    }

    fn strides(&self) -> [usize; D] {
        let shape = self.collocation.shape();
        let mut strides = [1; D];
        for axis in (0..D.saturating_sub(1)).rev() {
            strides[axis] = strides[axis + 1] * shape[axis + 1];
        }
        strides
    }
}

/// One axis of a row's entries. `a` holds the products so far in which α or a derivative was chosen, `plain` the product
/// of the values alone, into which a derivative along a later axis can still go.
fn contract(x: &[f64], strides: &[usize], basis: &[Basis], beta: &[f64], a: f64, plain: f64) -> f64 {
    let (values, slopes, first) = (basis[0].derivative(0), basis[0].derivative(1), basis[0].first);
    let slope = beta[0] * plain;
    let mut sum = 0.0;
    if basis.len() == 1 {
        for ((x, n), m) in x[first..].iter().zip(values).zip(slopes) {
            sum += (a * n + slope * m) * x;
        }
    } else {
        for (k, (n, m)) in values.iter().zip(slopes).enumerate() {
            let rest = &x[(first + k) * strides[0]..];
            sum += contract(rest, &strides[1..], &basis[1..], &beta[1..], a * n + slope * m, plain * n);
        }
    }
    sum
}

/// The transpose of [`contract`]: adds `amount(entry)` for every entry of a row.
fn scatter(
    out: &mut [f64],
    strides: &[usize],
    basis: &[Basis],
    beta: &[f64],
    a: f64,
    plain: f64,
    amount: &impl Fn(f64) -> f64,
) {
    let (values, slopes, first) = (basis[0].derivative(0), basis[0].derivative(1), basis[0].first);
    let slope = beta[0] * plain;
    if basis.len() == 1 {
        for ((o, n), m) in out[first..].iter_mut().zip(values).zip(slopes) {
            *o += amount(a * n + slope * m);
        }
    } else {
        for (k, (n, m)) in values.iter().zip(slopes).enumerate() {
            let rest = &mut out[(first + k) * strides[0]..];
            scatter(rest, &strides[1..], &basis[1..], &beta[1..], a * n + slope * m, plain * n, amount);
        }
    }
}

/// `Σ aᵢ bᵢ`, in order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use zeroset_bspline::{DerivativeEnergy, KnotVector};
    use zeroset_multigrid::NormalEquations;

    fn knots() -> [KnotVector; 3] {
        [
            KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(),
            KnotVector::clamped(2, &[0.0, 0.5, 1.0]).unwrap(),
            KnotVector::uniform(4, 0.0, 0.5, 2).unwrap(),
        ]
    }

    fn point() -> impl Strategy<Value = [f64; 3]> {
        [0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn products_agree_with_the_assembled_matrix(
            points in proptest::collection::vec((point(), -1.0..1.0f64, point()), 1..30),
            x in proptest::collection::vec(-1.0..1.0f64, 7 * 4 * 6),
        ) {
            let positions: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
            let collocation = Collocation::new(&knots(), &positions).unwrap();
            let rows = Rows::new(&collocation, points.iter().map(|p| p.1).collect(), points.iter().map(|p| p.2).collect());
            let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots()).unwrap());
            let matrix = equations.rows(&collocation, &rows.alpha, Some(&rows.beta), 0.0).unwrap();
            let (mut applied, mut diagonal) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            rows.add_transposed(&rows.apply(&x), &mut applied);
            rows.add_squares(&mut diagonal);
            let size = matrix.apply(&x).iter().map(|v| v.abs()).fold(1.0, f64::max);
            for (a, b) in matrix.apply(&x).iter().zip(&applied) {
                // The same few thousand products in another order.
                prop_assert!((a - b).abs() <= 1e-12 * size);
            }
            let size = diagonal.iter().copied().fold(1.0, f64::max);
            for (a, b) in matrix.diagonal().iter().zip(&diagonal) {
                prop_assert!((a - b).abs() <= 1e-12 * size);
            }
        }
    }
}
