//! The normal operator without a matrix.

use std::sync::Arc;
use thiserror::Error;
use zeroset_bspline::{CollocationError, DerivativeEnergy, EnergyError, KnotVector};

use crate::cell_points::CellPoints;
use crate::separable_energy::SeparableEnergy;

/// Why a normal operator could not be set up.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum OperatorError {
    /// The axes have different degrees.
    #[error("the axes have degrees {0:?}: use the same degree along all")]
    MixedDegrees(Vec<usize>),
    /// Not one weight per point.
    #[error("{found} weights were given for {needed} points")]
    Weights {
        /// Weights given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("weight {0} is not a finite number of at least zero")]
    BadWeight(usize),
    /// The energy's weight is not positive.
    #[error("the weight of the energy is {0}: it must be positive and finite, for the operator to be invertible")]
    BadEnergyWeight(f64),
    /// A point lies outside the lattice.
    #[error(transparent)]
    Collocation(#[from] CollocationError),
    /// The knots have no thin-plate energy.
    #[error(transparent)]
    Energy(#[from] EnergyError),
}

/// `A = Σ ωᵢ qᵢ qᵢᵀ + w H` as a function of a vector: the points are sorted by cell, the energy is applied axis by axis.
///
/// It needs about 13 numbers per point and three per coefficient, against 172 per coefficient of the
/// [assembled matrix](crate::NormalMatrix), and is the same for any number of threads.
#[derive(Debug)]
pub struct NormalOperator<const D: usize> {
    points: Arc<CellPoints>,
    energy: SeparableEnergy<D>,
    diagonal: Vec<f64>,
}

impl<const D: usize> NormalOperator<D> {
    /// The operator of points in frame coordinates with their weights ω ≥ 0, and the weight w > 0 of the thin-plate energy.
    ///
    /// # Errors
    /// Axes of different degrees, a degree below 2, weights that do not fit or are negative or not finite, points outside
    /// the knots' domain.
    pub fn new(
        knots: &[KnotVector; D],
        points: &[[f64; D]],
        weights: &[f64],
        energy_weight: f64,
    ) -> Result<Self, OperatorError> {
        let degrees = knots.each_ref().map(KnotVector::degree);
        if degrees.iter().any(|d| *d != degrees[0]) {
            return Err(OperatorError::MixedDegrees(degrees.to_vec()));
        }
        if weights.len() != points.len() {
            return Err(OperatorError::Weights { found: weights.len(), needed: points.len() });
        }
        if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(OperatorError::BadWeight(index));
        }
        if !(energy_weight.is_finite() && energy_weight > 0.0) {
            return Err(OperatorError::BadEnergyWeight(energy_weight));
        }
        let energy = SeparableEnergy::new(&DerivativeEnergy::thin_plate(knots)?, energy_weight);
        Ok(Self::joined(Arc::new(CellPoints::new(knots, points, weights)?), energy))
    }

    fn joined(points: Arc<CellPoints>, energy: SeparableEnergy<D>) -> Self {
        let mut diagonal = energy.diagonal();
        points.add_diagonal(&mut diagonal);
        Self { points, energy, diagonal }
    }

    /// The operator of the same points with another weight of the energy. Cheaper than a new one: the points are sorted.
    ///
    /// # Errors
    /// If the weight is not positive and finite.
    pub fn reweighted(&self, energy_weight: f64) -> Result<Self, OperatorError> {
        if !(energy_weight.is_finite() && energy_weight > 0.0) {
            return Err(OperatorError::BadEnergyWeight(energy_weight));
        }
        Ok(Self::joined(Arc::clone(&self.points), self.energy.reweighted(energy_weight)))
    }

    pub(crate) fn points(&self) -> &CellPoints {
        &self.points
    }

    /// Number of control coefficients.
    pub fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// `y = A x`.
    ///
    /// # Panics
    /// If `x` or `y` do not have one entry per coefficient.
    #[track_caller]
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        assert!(x.len() == self.size() && y.len() == self.size(), "one entry per coefficient");
        self.in_pool(|| {
            self.energy.apply(x, y);
            self.points.add_applied(x, y);
        });
    }

    /// Runs work among the threads at once, where the operator is large enough for them: otherwise every parallel loop
    /// would have to wake them.
    pub(crate) fn in_pool<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        if self.energy.is_small() && self.points.is_small() { work() } else { rayon::scope(|_| work()) }
    }

    /// The diagonal of `w H`.
    pub(crate) fn energy_diagonal(&self) -> Vec<f64> {
        self.energy.diagonal()
    }

    /// The diagonal of `A`.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NormalEquations;
    use proptest::prelude::*;
    use zeroset_bspline::Collocation;

    fn near(a: &[f64], b: &[f64]) -> bool {
        let size = b.iter().map(|v| v.abs()).fold(0.0, f64::max);
        // Sums of a few hundred products in another order.
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * size)
    }

    /// Points of a unit box, some of them crowded into one place, and what the assembled matrix says.
    fn check<const D: usize>(
        knots: [KnotVector; D],
        points: &[([f64; D], f64)],
        crowd: usize,
        w: f64,
        x: &[f64],
    ) -> Result<(), TestCaseError> {
        let mut positions: Vec<[f64; D]> = points.iter().map(|p| p.0).collect();
        let mut weights: Vec<f64> = points.iter().map(|p| p.1).collect();
        for i in 0..crowd {
            let near = positions[0].map(|u| 0.999 * u + 0.001 * ((i * 37) % 101) as f64 / 101.0);
            positions.push(near);
            weights.push(weights[i % points.len()]);
        }
        let size = knots.iter().map(KnotVector::basis_count).product();
        let x: Vec<f64> = x.iter().cycle().take(size).copied().collect();
        let free = NormalOperator::new(&knots, &positions, &weights, 3.0 * w).unwrap().reweighted(w).unwrap();
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots).unwrap());
        let matrix = equations.weighted(&Collocation::new(&knots, &positions).unwrap(), &weights, w).unwrap();
        let mut y = vec![f64::NAN; size];
        free.apply(&x, &mut y);
        prop_assert!(near(&y, &matrix.apply(&x)));
        prop_assert!(near(free.diagonal(), &matrix.diagonal()));
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut again = vec![f64::NAN; size];
        alone.install(|| free.apply(&x, &mut again));
        prop_assert_eq!(y, again, "the same bytes for any number of threads");
        Ok(())
    }

    fn axis(degree: usize, cells: usize, clamped: bool) -> KnotVector {
        if clamped {
            let breakpoints: Vec<f64> = (0..=cells).map(|i| (i as f64 / cells as f64).powi(2)).collect();
            KnotVector::clamped(degree, &breakpoints).unwrap()
        } else {
            KnotVector::uniform(degree, 0.0, 1.0 / cells as f64, cells).unwrap()
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn equals_the_assembled_matrix_in_space(
            degree in 2usize..=5,
            cells in [1usize..9, 1usize..9, 1usize..9],
            clamped in any::<[bool; 3]>(),
            points in proptest::collection::vec(([0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64], 0.0..2.0f64), 1..200),
            crowd in 0usize..80,
            w in 1e-4..1.0f64,
            x in proptest::collection::vec(-1.0..1.0f64, 997),
        ) {
            let knots = std::array::from_fn(|a| axis(degree, cells[a], clamped[a] && a == cells[0] % 3));
            check::<3>(knots, &points, crowd, w, &x)?;
        }

        #[test]
        fn equals_the_assembled_matrix_in_the_plane(
            degree in 2usize..=5,
            cells in [1usize..40, 1usize..40],
            clamped in any::<bool>(),
            points in proptest::collection::vec(([0.0..=1.0f64, 0.0..=1.0f64], 0.0..2.0f64), 1..400),
            crowd in 0usize..200,
            w in 1e-4..1.0f64,
            x in proptest::collection::vec(-1.0..1.0f64, 997),
        ) {
            let knots = std::array::from_fn(|a| axis(degree, cells[a], clamped && a == 1));
            check::<2>(knots, &points, crowd, w, &x)?;
        }
    }

    #[test]
    fn bad_input_is_refused() {
        let knots = [axis(3, 4, false), axis(3, 4, false)];
        let points = [[0.5, 0.1]];
        let error = |weights: &[f64], w| NormalOperator::new(&knots, &points, weights, w).unwrap_err();
        assert_eq!(error(&[1.0, 2.0], 1.0), OperatorError::Weights { found: 2, needed: 1 });
        assert_eq!(error(&[-1.0], 1.0), OperatorError::BadWeight(0));
        assert_eq!(error(&[1.0], 0.0), OperatorError::BadEnergyWeight(0.0));
        let operator = NormalOperator::new(&knots, &points, &[1.0], 1.0).unwrap();
        assert_eq!(operator.reweighted(-1.0).unwrap_err(), OperatorError::BadEnergyWeight(-1.0));
        let outside = CollocationError::Outside { index: 0, axis: 1 };
        assert_eq!(
            NormalOperator::new(&knots, &[[0.5, f64::NAN]], &[1.0], 1.0).unwrap_err(),
            OperatorError::Collocation(outside)
        );
        let mixed = [axis(3, 4, false), axis(2, 4, false)];
        assert_eq!(
            NormalOperator::new(&mixed, &points, &[1.0], 1.0).unwrap_err(),
            OperatorError::MixedDegrees(vec![3, 2])
        );
    }
}
