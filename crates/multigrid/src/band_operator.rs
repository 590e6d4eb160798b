//! The normal operator of a band level.

use std::borrow::Cow;
use std::sync::Arc;
use zeroset_bspline::{BlockField, IndexSet};

use crate::band_collocation::BandCollocation;
use crate::band_energy::BandEnergy;
use crate::scratch::Scratch;

/// Rows `rᵢ = αᵢ qᵢ + βᵢ · ∇qᵢ` for points in the cells of a level, in the order of their collocation.
#[derive(Debug, Clone)]
pub struct BandRows<'a, const D: usize> {
    /// The points.
    pub collocation: Cow<'a, BandCollocation<D>>,
    /// One factor of the value for every point.
    pub alpha: Vec<f64>,
    /// One vector for every point, by which its gradient is multiplied.
    pub beta: Vec<[f64; D]>,
}

/// `A = Σᵢ rᵢ rᵢᵀ + H` on the active functions of a level, with the rows of all given [`BandRows`] and the weights of the
/// energy in `H`. It is applied without a matrix, and is the same for any number of threads.
#[derive(Debug)]
pub struct BandOperator<'a, const D: usize> {
    rows: Vec<BandRows<'a, D>>,
    energy: BandEnergy<D>,
    diagonal: Vec<f64>,
    /// The vector in blocks, and the data term's result in blocks.
    scratch: Scratch<(BlockField<D>, Vec<f64>)>,
}

impl<'a, const D: usize> BandOperator<'a, D> {
    /// Joins rows and energy.
    ///
    /// # Panics
    /// If there is not one α and β for every point.
    #[track_caller]
    pub fn new(rows: Vec<BandRows<'a, D>>, energy: BandEnergy<D>) -> Self {
        let active = Arc::clone(energy.active());
        let mut sums = vec![0.0; IndexSet::<D>::BLOCK * active.block_count()];
        for rows in &rows {
            rows.collocation.add_squares(&rows.alpha, &rows.beta, &active, &mut sums);
        }
        let mut diagonal = vec![0.0; active.len()];
        active.members_of_blocks(&sums, &mut diagonal);
        let smooth = energy.diagonal();
        diagonal.iter_mut().for_each(|d| *d += smooth);
        let scratch = Scratch::new();
        scratch.with(|| (BlockField::zeros(active), sums), |_| ());
        Self { rows, energy, diagonal, scratch }
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
                for rows in &self.rows {
                    rows.collocation.add_applied(&rows.alpha, &rows.beta, field, sums);
                }
                self.energy.apply(field, Some(sums), y);
            });
        });
    }

    /// The diagonal of `A`.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }
}
