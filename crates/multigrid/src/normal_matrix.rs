//! The assembled normal matrix.

use rayon::prelude::*;
use std::sync::Arc;
use zeroset_bspline::{Collocation, DerivativeEnergy};

use crate::assembly_error::AssemblyError;
use crate::band_pattern::BandPattern;
use crate::cell_points::CellPoints;
use crate::cholesky::{Analysis, Factor, FactorError};

/// The part of the normal equations that stays while weights change: the sparsity pattern, the entries of `H`, and,
/// once it was needed, the symbolic analysis of the factorisation.
#[derive(Debug)]
pub struct NormalEquations<const D: usize> {
    pattern: Arc<BandPattern<D>>,
    half_bandwidth: [usize; D],
    energy: Vec<f64>,
    analysis: Analysis,
}

/// `A = Σ rᵢ rᵢᵀ + w H`, its lower triangle stored.
#[derive(Debug, Clone)]
pub struct NormalMatrix<const D: usize> {
    pattern: Arc<BandPattern<D>>,
    entries: Vec<f64>,
}

impl<const D: usize> NormalEquations<D> {
    /// Prepares the pattern and the entries of the energy.
    pub fn new(energy: &DerivativeEnergy<D>) -> Self {
        let half_bandwidth = std::array::from_fn(|axis| energy.gram(axis, 0).half_bandwidth());
        let pattern = BandPattern::new(energy.shape(), half_bandwidth);
        let entries = (0..pattern.size())
            .into_par_iter()
            .flat_map_iter(|column| {
                // Of its rows in C order the lower triangle has the last ones.
                let all = energy.column(pattern.multi_index(column));
                let above = all.len() - (pattern.columns[column + 1] - pattern.columns[column]);
                all.into_iter().skip(above)
            })
            .collect();
        Self { pattern: Arc::new(pattern), half_bandwidth, energy: entries, analysis: Analysis::default() }
    }

    /// Number of control coefficients.
    pub fn size(&self) -> usize {
        self.pattern.size()
    }

    /// `Σ ωᵢ qᵢ qᵢᵀ + w H`: equation (7) with `ωᵢ = θᵢ²`.
    ///
    /// # Errors
    /// If shapes or lengths do not fit, or a weight is negative or not finite.
    pub fn weighted(
        &self,
        collocation: &Collocation<D>,
        weights: &[f64],
        energy_weight: f64,
    ) -> Result<NormalMatrix<D>, AssemblyError> {
        if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(AssemblyError::BadWeight(index));
        }
        let roots: Vec<f64> = weights.iter().map(|w| w.sqrt()).collect();
        self.rows(collocation, &roots, None, energy_weight)
    }

    /// `Σ rᵢ rᵢᵀ + w H` with rows `rᵢ = αᵢ qᵢ + βᵢ₁ uᵢ + βᵢ₂ vᵢ [+ βᵢ₃ wᵢ]`, as the Jacobian of the Sampson distance has
    /// them.
    ///
    /// # Errors
    /// If shapes or lengths do not fit, or a factor is not finite.
    pub fn rows(
        &self,
        collocation: &Collocation<D>,
        value_factors: &[f64],
        gradient_factors: Option<&[[f64; D]]>,
        energy_weight: f64,
    ) -> Result<NormalMatrix<D>, AssemblyError> {
        let (found, needed) = (collocation.shape(), self.pattern.shape);
        if found != needed {
            return Err(AssemblyError::Shape { found: found.to_vec(), needed: needed.to_vec() });
        }
        let count = collocation.point_count();
        for found in [value_factors.len(), gradient_factors.map_or(count, <[_]>::len)] {
            if found != count {
                return Err(AssemblyError::Weights { found, needed: count });
            }
        }
        let mut entries: Vec<f64> = self.energy.iter().map(|h| energy_weight * h).collect();
        let mut local = Vec::new();
        for point in 0..count {
            let alpha = value_factors[point];
            let beta = gradient_factors.map_or([0.0; D], |b| b[point]);
            if !(alpha.is_finite() && beta.iter().all(|b| b.is_finite())) {
                return Err(AssemblyError::BadWeight(point));
            }
            let (first, widths) = local_row(collocation, point, alpha, gradient_factors.map(|_| beta), &mut local);
            self.pattern.add_outer_product(&mut entries, &first, &widths, &local);
        }
        Ok(NormalMatrix { pattern: Arc::clone(&self.pattern), entries })
    }

    /// The data term alone, of points that are sorted by cell; equal degrees.
    pub(crate) fn data(&self, points: &CellPoints) -> Vec<f64> {
        let mut entries = vec![0.0; self.energy.len()];
        let widths = self.half_bandwidth.map(|half| half + 1);
        points.for_each_matrix(|first, matrix| {
            self.pattern.add_matrix(&mut entries, &self.pattern.multi_index(first), &widths, matrix);
        });
        entries
    }

    /// A data term and `w H`.
    pub(crate) fn with_energy(&self, data: &[f64], energy_weight: f64) -> NormalMatrix<D> {
        let entries = data.iter().zip(&self.energy).map(|(d, h)| d + energy_weight * h).collect();
        NormalMatrix { pattern: Arc::clone(&self.pattern), entries }
    }

    /// Factors a matrix that was assembled here. The symbolic analysis is done at the first call.
    ///
    /// # Errors
    /// If the matrix is not positive definite, or its factor does not fit into memory.
    pub fn factor(&self, matrix: &NormalMatrix<D>) -> Result<Factor, FactorError> {
        Factor::new(self.analysis.get(&self.pattern, &self.half_bandwidth)?, &self.pattern, &matrix.entries)
    }
}

/// The entries of one row in C order over the box on which it does not vanish: its first index and widths.
fn local_row<const D: usize>(
    collocation: &Collocation<D>,
    point: usize,
    alpha: f64,
    beta: Option<[f64; D]>,
    out: &mut Vec<f64>,
) -> ([usize; D], [usize; D]) {
    out.clear();
    let basis = collocation.basis(point);
    let widths: [usize; D] = std::array::from_fn(|axis| basis[axis].derivative(0).len());
    let mut k = [0; D];
    loop {
        let product = |derivative: Option<usize>| -> f64 {
            (0..D).map(|axis| basis[axis].derivative(usize::from(Some(axis) == derivative))[k[axis]]).product()
        };
        let mut value = alpha * product(None);
        if let Some(beta) = beta {
            for (axis, b) in beta.iter().enumerate() {
                value += b * product(Some(axis));
            }
        }
        out.push(value);
        let Some(axis) = (0..D).rev().find(|&axis| k[axis] + 1 < widths[axis]) else {
            return (basis.each_ref().map(|b| b.first), widths);
        };
        k[axis] += 1;
        k[axis + 1..].fill(0);
    }
}

impl<const D: usize> NormalMatrix<D> {
    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.pattern.size()
    }

    /// `A x`.
    ///
    /// # Panics
    /// If `x` does not have one entry per unknown.
    #[track_caller]
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.size(), "one entry per unknown");
        let mut out = vec![0.0; x.len()];
        for column in 0..x.len() {
            let range = self.pattern.columns[column]..self.pattern.columns[column + 1];
            let mut sum = 0.0;
            for (&row, a) in self.pattern.rows[range.clone()].iter().zip(&self.entries[range]) {
                sum += a * x[row];
                if row != column {
                    out[row] += a * x[column];
                }
            }
            out[column] += sum;
        }
        out
    }

    /// Adds a diagonal matrix.
    ///
    /// # Panics
    /// If there is not one entry per unknown.
    #[track_caller]
    pub fn add_diagonal(&mut self, entries: &[f64]) {
        assert_eq!(entries.len(), self.size(), "one entry per unknown");
        for (column, entry) in entries.iter().enumerate() {
            self.entries[self.pattern.columns[column]] += entry;
        }
    }

    /// The diagonal of the matrix.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.size()).map(|column| self.entries[self.pattern.columns[column]]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use zeroset_bspline::KnotVector;

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
        fn assembled_equals_matrix_free_and_solves(
            points in proptest::collection::vec((point(), -1.0..1.0f64, point()), 8..30),
            x in proptest::collection::vec(-1.0..1.0f64, 7 * 4 * 6),
            w in 1e-4..1.0f64,
        ) {
            let energy = DerivativeEnergy::thin_plate(&knots()).unwrap();
            let equations = NormalEquations::new(&energy);
            let positions: Vec<[f64; 3]> = points.iter().map(|p| p.0).collect();
            let alpha: Vec<f64> = points.iter().map(|p| p.1).collect();
            let beta: Vec<[f64; 3]> = points.iter().map(|p| p.2).collect();
            let collocation = Collocation::new(&knots(), &positions).unwrap();
            let matrix = equations.rows(&collocation, &alpha, Some(&beta), w).unwrap();

            let rows: Vec<f64> = collocation
                .values(&x)
                .iter()
                .zip(collocation.gradients(&x))
                .enumerate()
                .map(|(i, (v, g))| alpha[i] * v + beta[i].iter().zip(g).map(|(b, g)| b * g).sum::<f64>())
                .collect();
            let mut free: Vec<f64> = energy.apply(&x).iter().map(|h| w * h).collect();
            collocation.add_values_transposed(&rows.iter().zip(&alpha).map(|(r, a)| r * a).collect::<Vec<_>>(), &mut free);
            let scaled: Vec<[f64; 3]> = rows.iter().zip(&beta).map(|(r, b)| b.map(|b| r * b)).collect();
            collocation.add_gradients_transposed(&scaled, &mut free);
            let applied = matrix.apply(&x);
            let size = free.iter().map(|v| v.abs()).fold(0.0, f64::max);
            for (a, b) in applied.iter().zip(&free) {
                // Sums of a few hundred products in another order.
                prop_assert!((a - b).abs() <= 1e-12 * size);
            }

            let factor = equations.factor(&matrix).unwrap();
            let solved = factor.solve(&applied);
            let back = matrix.apply(&solved);
            for (a, b) in back.iter().zip(&applied) {
                // Backward stable: the residual is small at the size of A x, whatever the condition.
                prop_assert!((a - b).abs() <= 1e-10 * size.max(1.0));
            }
        }
    }

    #[test]
    fn points_on_a_plane_are_named_as_the_cause() {
        let knots = [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::uniform(3, 0.0, 0.25, 4).unwrap()];
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots).unwrap());
        let collocation = Collocation::new(&knots, &[[0.5, 0.1], [0.5, 0.4], [0.5, 0.9]]).unwrap();
        // Dyadic coordinates: the rounding of the zero pivot can fall on either side, so the weight is zero as well.
        let matrix = equations.weighted(&collocation, &[1.0; 3], 0.0).unwrap();
        assert_eq!(equations.factor(&matrix).unwrap_err(), FactorError::NotPositiveDefinite);
    }

    #[test]
    fn bad_input_is_refused() {
        let knots = [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::uniform(3, 0.0, 0.25, 4).unwrap()];
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots).unwrap());
        let collocation = Collocation::new(&knots, &[[0.5, 0.1]]).unwrap();
        assert_eq!(
            equations.weighted(&collocation, &[1.0, 2.0], 1.0).unwrap_err(),
            AssemblyError::Weights { found: 2, needed: 1 }
        );
        assert_eq!(equations.weighted(&collocation, &[-1.0], 1.0).unwrap_err(), AssemblyError::BadWeight(0));
        let other = [KnotVector::uniform(3, 0.0, 0.25, 4).unwrap(), KnotVector::uniform(3, 0.0, 0.5, 2).unwrap()];
        let collocation = Collocation::new(&other, &[[0.5, 0.1]]).unwrap();
        assert_eq!(
            equations.weighted(&collocation, &[1.0], 1.0).unwrap_err(),
            AssemblyError::Shape { found: vec![7, 5], needed: vec![7, 7] }
        );
    }
}
