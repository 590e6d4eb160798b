//! The normal operator of a band level.

use std::sync::Arc;
use zeroset_bspline::{BlockField, IndexSet};

use crate::band_collocation::BandCollocation;
use crate::band_energy::BandEnergy;
use crate::scratch::Scratch;

/// `A = Σᵢ rᵢ rᵢᵀ + H` on the active functions of a level, with rows `rᵢ = αᵢ qᵢ + βᵢ · ∇qᵢ` for the points in its cells and
/// the weights of the energy in `H`. It is applied without a matrix, and is the same for any number of threads.
#[derive(Debug)]
pub struct BandOperator<'a, const D: usize> {
    collocation: &'a BandCollocation<D>,
    alpha: Vec<f64>,
    beta: Vec<[f64; D]>,
    energy: BandEnergy<D>,
    diagonal: Vec<f64>,
    /// The vector in blocks, and the data term's result in blocks.
    scratch: Scratch<(BlockField<D>, Vec<f64>)>,
}

impl<'a, const D: usize> BandOperator<'a, D> {
    /// Joins rows, in the order of the collocation, and energy.
    ///
    /// # Panics
    /// If there is not one α and β for every point.
    #[track_caller]
    pub fn new(
        collocation: &'a BandCollocation<D>,
        alpha: Vec<f64>,
        beta: Vec<[f64; D]>,
        energy: BandEnergy<D>,
    ) -> Self {
        let active = Arc::clone(energy.active());
        let mut sums = vec![0.0; IndexSet::<D>::BLOCK * active.block_count()];
        collocation.add_squares(&alpha, &beta, &active, &mut sums);
        let mut diagonal = vec![0.0; active.len()];
        active.members_of_blocks(&sums, &mut diagonal);
        let smooth = energy.diagonal();
        diagonal.iter_mut().for_each(|d| *d += smooth);
        let scratch = Scratch::new();
        scratch.with(|| (BlockField::zeros(active), sums), |_| ());
        Self { collocation, alpha, beta, energy, diagonal, scratch }
    }

    /// Number of active functions.
    pub fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// `y = A x`, entries in the order of the active functions.
    ///
    /// # Panics
    /// If `x` or `y` do not have one entry per active function.
    #[track_caller]
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        let active: &Arc<IndexSet<D>> = self.energy.active();
        let new = || (BlockField::zeros(Arc::clone(active)), vec![0.0; IndexSet::<D>::BLOCK * active.block_count()]);
        self.scratch.with(new, |(field, sums)| {
            rayon::scope(|_| {
                field.scatter(x);
                sums.fill(0.0);
                self.collocation.add_applied(&self.alpha, &self.beta, field, sums);
                self.energy.apply(field, Some(sums), y);
            });
        });
    }

    /// The diagonal of `A`.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }
}
