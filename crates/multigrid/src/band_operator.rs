//! The normal operator of a band level.

use rayon::prelude::*;
use std::borrow::Cow;

use crate::band_collocation::BandCollocation;
use crate::band_energy::BandEnergy;
use crate::vectors::{PIECE, clear};

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
}

impl<'a, const D: usize> BandOperator<'a, D> {
    /// Joins rows and energy.
    ///
    /// # Panics
    /// If there is not one α and β for every point.
    #[track_caller]
    pub fn new(rows: Vec<BandRows<'a, D>>, energy: BandEnergy<D>) -> Self {
        let mut diagonal = vec![0.0; energy.active().len()];
        let add = |sums: &mut [f64]| {
            for rows in &rows {
                rows.collocation.add_squares(&rows.alpha, &rows.beta, energy.active(), sums);
            }
        };
        energy.sums(add, &mut diagonal);
        let smooth = energy.diagonal();
        diagonal.par_chunks_mut(PIECE).with_min_len(8).for_each(|d| d.iter_mut().for_each(|d| *d += smooth));
        Self { rows, energy, diagonal }
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
        self.energy.with_scratch(|field, sums| {
            rayon::scope(|_| {
                field.scatter(x);
                clear(sums);
                for rows in &self.rows {
                    rows.collocation.add_applied(&rows.alpha, &rows.beta, field, sums);
                }
                self.energy.apply(field, Some(sums), y);
            });
        });
    }

    /// Calls `work` with three vectors of as many entries as there are active functions, of arbitrary values.
    pub(crate) fn with_vectors<R>(&self, work: impl FnOnce(&mut [Vec<f64>; 3]) -> R) -> R {
        self.energy.with_vectors(work)
    }

    /// The diagonal of `A`.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }
}
