//! Sparse Cholesky factorisation.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::Perm;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use std::sync::{Arc, OnceLock};
use thiserror::Error;

use crate::band_pattern::BandPattern;
use crate::nested_dissection::nested_dissection;

/// Why a normal matrix could not be factored.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FactorError {
    /// A pivot was not positive.
    #[error(
        "the normal matrix is not positive definite: the points lie on a line or plane, or the fairness weight is zero \
         or too small for f64; use more points or a larger smoothing length"
    )]
    NotPositiveDefinite,
    /// The symbolic analysis failed.
    #[error("the factorisation of {unknowns} unknowns does not fit into memory: use a coarser lattice")]
    OutOfMemory {
        /// Number of unknowns.
        unknowns: usize,
    },
}

/// The symbolic part, worked out once per pattern.
#[derive(Debug, Default)]
pub(crate) struct Analysis(OnceLock<Arc<SymbolicCholesky<usize>>>);

impl Analysis {
    pub(crate) fn get<const D: usize>(
        &self,
        pattern: &BandPattern<D>,
        half_bandwidth: &[usize; D],
    ) -> Result<Arc<SymbolicCholesky<usize>>, FactorError> {
        if let Some(symbolic) = self.0.get() {
            return Ok(Arc::clone(symbolic));
        }
        let size = pattern.size();
        let forward = nested_dissection(&pattern.shape, half_bandwidth);
        let mut inverse = vec![0; size];
        for (position, &index) in forward.iter().enumerate() {
            inverse[index] = position;
        }
        let order = Perm::new_checked(forward.into_boxed_slice(), inverse.into_boxed_slice(), size);
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(size, size, &pattern.columns, None, &pattern.rows),
            Side::Lower,
            SymmetricOrdering::Custom(order.as_ref()),
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| FactorError::OutOfMemory { unknowns: size })?;
        Ok(Arc::clone(self.0.get_or_init(|| Arc::new(symbolic))))
    }
}

/// A factored normal matrix, `A = L Lᵀ`.
#[derive(Debug)]
pub struct Factor {
    symbolic: Arc<SymbolicCholesky<usize>>,
    values: Vec<f64>,
}

impl Factor {
    pub(crate) fn new<const D: usize>(
        symbolic: Arc<SymbolicCholesky<usize>>,
        pattern: &BandPattern<D>,
        entries: &[f64],
    ) -> Result<Self, FactorError> {
        let size = pattern.size();
        let structure = SymbolicSparseColMatRef::new_checked(size, size, &pattern.columns, None, &pattern.rows);
        Self::numeric(symbolic, structure, entries)
    }

    /// Of a matrix given by the lower half of its columns: where each begins, with one more for the end, the rows of its
    /// entries, and those.
    pub(crate) fn sparse(starts: &[usize], rows: &[usize], entries: &[f64]) -> Result<Self, FactorError> {
        let size = starts.len() - 1;
        let structure = SymbolicSparseColMatRef::new_checked(size, size, starts, None, rows);
        let order = SymmetricOrdering::Amd;
        let symbolic = factorize_symbolic_cholesky(structure, Side::Lower, order, CholeskySymbolicParams::default())
            .map_err(|_| FactorError::OutOfMemory { unknowns: size })?;
        Self::numeric(Arc::new(symbolic), structure, entries)
    }

    fn numeric(
        symbolic: Arc<SymbolicCholesky<usize>>,
        structure: SymbolicSparseColMatRef<usize>,
        entries: &[f64],
    ) -> Result<Self, FactorError> {
        let size = structure.ncols();
        let mut values = vec![0.0; symbolic.len_val()];
        // Sequential: a parallel factorisation would round differently for another number of threads.
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let out_of_memory = |_| FactorError::OutOfMemory { unknowns: size };
        let mut memory = MemBuffer::try_new(scratch).map_err(out_of_memory)?;
        symbolic
            .factorize_numeric_llt::<f64>(
                &mut values,
                SparseColMatRef::new(structure, entries),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|_| FactorError::NotPositiveDefinite)?;
        if values.iter().any(|v| !v.is_finite()) {
            return Err(FactorError::NotPositiveDefinite);
        }
        Ok(Self { symbolic, values })
    }

    /// Number of entries of the factor.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// `A⁻¹ b`.
    ///
    /// # Panics
    /// If `right` does not have one entry per unknown.
    #[track_caller]
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        let size = x.len();
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut x, size, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        x
    }
}
