//! The V-cycle on nested lattices.

use std::sync::Arc;
use thiserror::Error;
use zeroset_bspline::{DerivativeEnergy, KnotVector, RefinementError};

use crate::cholesky::{Factor, FactorError};
use crate::normal_matrix::NormalEquations;
use crate::normal_operator::{NormalOperator, OperatorError};
use crate::scratch::Scratch;
use crate::smoother::{Smoother, Vectors};
use crate::transfer::Transfer;

/// Why a multigrid solver could not be set up.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MultigridError {
    /// The operator of a level was refused.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// The coarsest level could not be factored.
    #[error(transparent)]
    Factor(#[from] FactorError),
    /// The lattices do not nest.
    #[error(transparent)]
    Refinement(#[from] RefinementError),
}

/// `A = Σ ωᵢ qᵢ qᵢᵀ + w H` on a lattice that came from a coarse one by halving, with a V-cycle as preconditioner.
///
/// Every level's operator is built on its own basis with the same points, weights and w. Since the spaces nest, that is the
/// Galerkin operator `Pᵀ A P`. The coarsest level is solved by Cholesky's method; it should have no more than a few thousand
/// coefficients.
#[derive(Debug)]
pub struct Multigrid<const D: usize> {
    knots: [KnotVector; D],
    /// From the finest to the one before the coarsest.
    levels: Vec<Level<D>>,
    bottom: Bottom<D>,
    /// The weight w of the thin-plate energy.
    energy_weight: f64,
    vectors: Scratch<Vec<Vectors>>,
}

#[derive(Debug)]
struct Level<const D: usize> {
    operator: NormalOperator<D>,
    smoother: Smoother<D>,
    transfer: Arc<Transfer<D>>,
}

impl<const D: usize> Level<D> {
    /// `transfer` goes to the next coarser level.
    ///
    /// # Errors
    /// If memory does not suffice.
    fn new(operator: NormalOperator<D>, transfer: Arc<Transfer<D>>) -> Result<Self, FactorError> {
        let smoother = operator.in_pool(|| Smoother::new(transfer.fine(), &operator))?;
        Ok(Self { smoother, operator, transfer })
    }
}

#[derive(Debug)]
struct Bottom<const D: usize> {
    operator: NormalOperator<D>,
    equations: Arc<NormalEquations<D>>,
    /// The data term's part of the assembled matrix.
    data: Arc<Vec<f64>>,
    factor: Factor,
}

impl<const D: usize> Bottom<D> {
    fn new(
        operator: NormalOperator<D>,
        equations: Arc<NormalEquations<D>>,
        data: Arc<Vec<f64>>,
        energy_weight: f64,
    ) -> Result<Self, FactorError> {
        let factor = equations.factor(&equations.with_energy(&data, energy_weight))?;
        Ok(Self { operator, equations, data, factor })
    }
}

impl<const D: usize> Multigrid<D> {
    /// Builds all levels: `coarse` knots and those that come from them by up to `halvings` [halvings](KnotVector::halved),
    /// for points with weights ω ≥ 0 and the weight w > 0 of the thin-plate energy.
    ///
    /// # Errors
    /// As [`NormalOperator::new`], and if the coarsest level is not positive definite: points on a line or plane.
    pub fn new(
        coarse: &[KnotVector; D],
        halvings: u32,
        points: &[[f64; D]],
        weights: &[f64],
        energy_weight: f64,
    ) -> Result<Self, MultigridError> {
        let operator = NormalOperator::new(coarse, points, weights, energy_weight)?;
        let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(coarse).map_err(OperatorError::from)?);
        let data = equations.data(operator.points());
        let bottom = Bottom::new(operator, Arc::new(equations), Arc::new(data), energy_weight)?;
        let coarsest =
            Self { knots: coarse.clone(), levels: Vec::new(), bottom, energy_weight, vectors: Scratch::new() };
        (0..halvings).try_fold(coarsest, |solver, _| solver.refined(points, weights))
    }

    /// The solver one [halving](KnotVector::halved) further, of the same points, weights ω and w: the levels that there are
    /// are the coarser ones of the new one.
    ///
    /// # Errors
    /// As [`NormalOperator::new`].
    pub fn refined(mut self, points: &[[f64; D]], weights: &[f64]) -> Result<Self, MultigridError> {
        let finer = self.knots.each_ref().map(KnotVector::halved);
        let operator = NormalOperator::new(&finer, points, weights, self.energy_weight)?;
        let transfer = Transfer::new(&self.knots, &finer)?;
        self.levels.insert(0, Level::new(operator, Arc::new(transfer))?);
        Ok(Self { knots: finer, vectors: Scratch::new(), ..self })
    }

    /// The solver of the same points on the same lattices with another weight of the energy: several times cheaper than
    /// a new one.
    ///
    /// # Errors
    /// If the weight is not positive and finite, or the coarsest level is not positive definite with it.
    pub fn reweighted(&self, energy_weight: f64) -> Result<Self, MultigridError> {
        let mut levels = Vec::with_capacity(self.levels.len());
        for level in &self.levels {
            levels.push(Level::new(level.operator.reweighted(energy_weight)?, Arc::clone(&level.transfer))?);
        }
        let Bottom { operator, equations, data, .. } = &self.bottom;
        let operator = operator.reweighted(energy_weight)?;
        let bottom = Bottom::new(operator, Arc::clone(equations), Arc::clone(data), energy_weight)?;
        Ok(Self { knots: self.knots.clone(), levels, bottom, energy_weight, vectors: Scratch::new() })
    }

    /// The finest knots, on which the unknowns live.
    pub fn knots(&self) -> &[KnotVector; D] {
        &self.knots
    }

    /// Number of unknowns on the finest level.
    pub fn size(&self) -> usize {
        self.operator().size()
    }

    /// The operator of the finest level.
    pub fn operator(&self) -> &NormalOperator<D> {
        self.levels.first().map_or(&self.bottom.operator, |level| &level.operator)
    }

    /// `y = A x` on the finest level.
    ///
    /// # Panics
    /// If `x` or `y` do not have one entry per unknown.
    #[track_caller]
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.operator().apply(x, y);
    }

    /// One V-cycle from zero: `z ≈ A⁻¹ r`, linear in `r`, symmetric and positive definite.
    ///
    /// # Panics
    /// If `residual` or `z` do not have one entry per unknown.
    #[track_caller]
    pub fn precondition(&self, residual: &[f64], z: &mut [f64]) {
        assert!(residual.len() == self.size() && z.len() == self.size(), "one entry per unknown");
        let vectors = || self.levels.iter().map(|level| Vectors::new(level.operator.size())).collect();
        self.operator().in_pool(|| {
            self.vectors.with(vectors, |vectors| self.cycle(&self.levels, vectors, residual, z));
        });
    }

    fn cycle(&self, levels: &[Level<D>], vectors: &mut [Vectors], right: &[f64], z: &mut [f64]) {
        let (Some((level, coarser)), Some((v, below))) = (levels.split_first(), vectors.split_first_mut()) else {
            z.copy_from_slice(&self.bottom.factor.solve(right));
            return;
        };
        v.x.fill(0.0);
        v.residual.copy_from_slice(right);
        level.smoother.smooth(&level.operator, v, true);
        let mut restricted = vec![0.0; coarser.first().map_or(self.bottom.operator.size(), |l| l.operator.size())];
        level.transfer.restrict(&v.residual, &mut restricted);
        let mut correction = vec![0.0; restricted.len()];
        self.cycle(coarser, below, &restricted, &mut correction);
        v.correct(&level.operator, |fine| level.transfer.prolong(&correction, fine));
        level.smoother.smooth(&level.operator, v, false);
        z.copy_from_slice(&v.x);
    }
}
