//! Fast diagonalisation of the normal operator.
//!
//! Along each axis one basis V makes the data matrix G and the bending matrix B diagonal at once; in the Kronecker product
//! of the three bases the normal operator is nearly diagonal (Lynch, Rice and Thomas 1964): the data term exactly, the
//! energy up to what its mass and stiffness matrices have off their diagonals there.

use rayon::prelude::*;

use crate::axis_factors::{AxisFactors, BENDING, DATA, Factors, MASS, STIFFNESS};
use crate::eigenbasis::{Change, Eigenbasis};

/// An approximate inverse of the normal operator.
#[derive(Debug)]
pub(crate) struct Preconditioner {
    bases: [Eigenbasis; 3],
    inverse_diagonal: Vec<f64>,
}

/// Lines that one parallel task transforms together; fixed, so that the bytes do not depend on the number of threads.
const LINES: usize = 64;

impl Preconditioner {
    /// `None` where no definite diagonal could be made: then nothing determines the spline.
    pub(crate) fn new(axes: &[AxisFactors; 3], weight: f64) -> Option<Self> {
        let bases: Vec<Eigenbasis> = axes.par_iter().map(basis).collect::<Option<_>>()?;
        let bases: [Eigenbasis; 3] = bases.try_into().ok()?;
        let [first, middle, last]: [Vec<Factors>; 3] = std::array::from_fn(|axis| diagonals(&axes[axis], &bases[axis]));
        let slab = middle.len() * last.len();
        let mut inverse_diagonal = vec![0.0; first.len() * slab];
        inverse_diagonal.par_chunks_mut(slab).zip(&first).for_each(|(out, &[g0, m0, k0, b0])| {
            for (out, &[g1, m1, k1, b1]) in out.chunks_exact_mut(last.len()).zip(&middle) {
                for (out, &[g2, m2, k2, b2]) in out.iter_mut().zip(&last) {
                    let energy =
                        b0 * m1 * m2 + m0 * (b1 * m2 + m1 * b2) + 2.0 * (k0 * (k1 * m2 + m1 * k2) + m0 * k1 * k2);
                    *out = 1.0 / (g0 * g1 * g2 + weight * energy);
                }
            }
        });
        let definite = inverse_diagonal.iter().all(|d| d.is_finite() && *d > 0.0);
        definite.then_some(Self { bases, inverse_diagonal })
    }

    /// The approximate inverse times a residual.
    pub(crate) fn apply(&self, residual: &[f64], out: &mut [f64]) {
        let [first, middle, last] = &self.bases;
        let slab = middle.size() * last.size();
        let group = LINES.div_ceil(middle.size()) * slab;
        out.par_chunks_mut(group).zip(residual.par_chunks(group)).for_each_init(
            || vec![0.0; group],
            |scratch, (out, residual)| {
                let scratch = &mut scratch[..out.len()];
                last.change_lines(Change::Analyse, residual, scratch);
                for (out, slab) in out.chunks_exact_mut(slab).zip(scratch.chunks_exact(slab)) {
                    middle.change_rows(Change::Analyse, slab, out);
                }
            },
        );
        first.invert_diagonalised(out, &self.inverse_diagonal);
        out.par_chunks_mut(group).for_each_init(
            || vec![0.0; group],
            |scratch, out| {
                let scratch = &mut scratch[..out.len()];
                for (slab, out) in out.chunks_exact(slab).zip(scratch.chunks_exact_mut(slab)) {
                    middle.change_rows(Change::Synthesise, slab, out);
                }
                last.change_lines(Change::Synthesise, scratch, out);
            },
        );
    }
}

/// The basis of one axis.
///
/// Simultaneous eigenvectors of G and B are those of `B V = (G + s B) V Λ` for any s, and `G + s B` is well conditioned
/// even where the nodes do not see every coefficient. What is degenerate in that problem is settled by a trace of the
/// other two matrices: linear functions (no bending) by K, functions that vanish at all nodes by M. The shares were tried
/// out on iteration counts, which move by less than a tenth when they change tenfold.
fn basis(axis: &AxisFactors) -> Option<Eigenbasis> {
    if axis.size() == 1 {
        return Some(Eigenbasis::unit());
    }
    let share = |which: usize, of: usize| axis.trace(of) / axis.trace(which);
    let stiffness = 1e-4 * share(STIFFNESS, BENDING);
    let (mass, bending) = (1e-6 * share(MASS, DATA), 0.1 * share(BENDING, DATA));
    Eigenbasis::new(
        axis.size(),
        |i, j| {
            let entry = axis.get(i, j);
            entry[BENDING] + stiffness * entry[STIFFNESS]
        },
        |i, j| {
            let entry = axis.get(i, j);
            entry[DATA] + mass * entry[MASS] + bending * entry[BENDING]
        },
    )
}

/// The diagonals of `Vᵀ A V` for the four matrices A of an axis.
fn diagonals(axis: &AxisFactors, basis: &Eigenbasis) -> Vec<Factors> {
    let (size, half) = (axis.size(), axis.half_bandwidth());
    let mut diagonals = vec![[0.0; 4]; size];
    for (vector, diagonal) in diagonals.iter_mut().enumerate() {
        for i in 0..size {
            let mut sum = [0.0; 4];
            for j in i.saturating_sub(half)..(i + half + 1).min(size) {
                let entry = axis.get(i, j);
                (0..4).for_each(|q| sum[q] += entry[q] * basis.entry(j, vector));
            }
            (0..4).for_each(|q| diagonal[q] += basis.entry(i, vector) * sum[q]);
        }
        // All four are semidefinite: what is below zero is rounding.
        diagonal.iter_mut().for_each(|d| *d = d.max(0.0));
    }
    diagonals
}
