//! Small dense linear algebra, by faer: bases that diagonalise two matrices of one axis at once, and the change to them
//! along an axis of an array. Sequential kernels on chunks of fixed size, so that the bytes do not depend on the number
//! of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Col, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

/// How many columns one parallel task of [`Eigenbasis::invert_diagonalised`] takes.
const COLUMNS: usize = 256;

/// The generalized eigenvectors V of a symmetric pair, as columns.
#[derive(Debug, Clone)]
pub(crate) struct Eigenbasis {
    vectors: Mat<f64>,
}

/// Which product a change of basis is.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Change {
    /// With `Vᵀ`, from coefficients of a functional to its values on the eigenvectors.
    Analyse,
    /// With `V`, from coordinates in the basis to coefficients.
    Synthesise,
}

impl Eigenbasis {
    /// `A V = B V Λ` with `Vᵀ B V = 1`, or `None` where B is not numerically positive definite.
    pub(crate) fn new(
        size: usize,
        a: impl Fn(usize, usize) -> f64,
        b: impl Fn(usize, usize) -> f64,
    ) -> Option<Eigenbasis> {
        let mut factor = Mat::from_fn(size, size, &b);
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(size, Par::Seq, Default::default()));
        cholesky_in_place(
            factor.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .ok()?;
        // L⁻¹ A L⁻ᵀ, formed by solving twice.
        let mut reduced = Mat::from_fn(size, size, &a);
        solve_lower_triangular_in_place(factor.as_ref(), reduced.as_mut(), Par::Seq);
        let mut reduced = reduced.transpose().to_owned();
        solve_lower_triangular_in_place(factor.as_ref(), reduced.as_mut(), Par::Seq);
        let (mut values, mut vectors) = (Col::<f64>::zeros(size), Mat::<f64>::zeros(size, size));
        let scratch = self_adjoint_evd_scratch::<f64>(size, ComputeEigenvectors::Yes, Par::Seq, Default::default());
        self_adjoint_evd(
            reduced.as_ref(),
            values.as_diagonal_mut(),
            Some(vectors.as_mut()),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .ok()?;
        solve_upper_triangular_in_place(factor.transpose(), vectors.as_mut(), Par::Seq);
        Some(Self { vectors })
    }

    /// The basis of an axis with one coefficient.
    pub(crate) fn unit() -> Self {
        Self { vectors: Mat::identity(1, 1) }
    }

    /// Number of coefficients of the axis.
    pub(crate) fn size(&self) -> usize {
        self.vectors.nrows()
    }

    /// Entry `index` of the eigenvector `vector`.
    pub(crate) fn entry(&self, index: usize, vector: usize) -> f64 {
        self.vectors[(index, vector)]
    }

    /// Changes the basis along the last axis: of each line of `size` values.
    pub(crate) fn change_lines(&self, change: Change, lines: &[f64], out: &mut [f64]) {
        let size = self.size();
        let count = lines.len() / size;
        let v = match change {
            Change::Analyse => self.vectors.as_ref(),
            Change::Synthesise => self.vectors.transpose(),
        };
        let lines = MatRef::from_row_major_slice(lines, count, size);
        matmul(MatMut::from_row_major_slice_mut(out, count, size), Accum::Replace, lines, v, 1.0, Par::Seq);
    }

    /// Changes the basis along the first axis of `size` contiguous rows.
    pub(crate) fn change_rows(&self, change: Change, rows: &[f64], out: &mut [f64]) {
        let size = self.size();
        let inner = rows.len() / size;
        let rows = MatRef::from_row_major_slice(rows, size, inner);
        let out = MatMut::from_row_major_slice_mut(out, size, inner);
        matmul(out, Accum::Replace, self.oriented(change), rows, 1.0, Par::Seq);
    }

    /// `V diag(scale) Vᵀ` along the first axis of `size` contiguous rows, in place, each entry with its own scale.
    pub(crate) fn invert_diagonalised(&self, values: &mut [f64], scale: &[f64]) {
        let size = self.size();
        let inner = values.len() / size;
        let values = MatMut::from_row_major_slice_mut(values, size, inner);
        let scale = MatRef::from_row_major_slice(scale, size, inner);
        values.par_col_chunks_mut(COLUMNS).enumerate().for_each_init(
            || vec![0.0; size * COLUMNS],
            |scratch, (index, mut values)| {
                let width = values.ncols();
                let mut changed = MatMut::from_row_major_slice_mut(&mut scratch[..size * width], size, width);
                let analyse = self.oriented(Change::Analyse);
                matmul(changed.as_mut(), Accum::Replace, analyse, values.as_ref(), 1.0, Par::Seq);
                let scale = scale.subcols(index * COLUMNS, width);
                faer::zip!(changed.as_mut(), scale).for_each(|faer::unzip!(value, scale)| *value *= *scale);
                let synthesise = self.oriented(Change::Synthesise);
                matmul(values.as_mut(), Accum::Replace, synthesise, changed.as_ref(), 1.0, Par::Seq);
            },
        );
    }

    fn oriented(&self, change: Change) -> MatRef<'_, f64> {
        match change {
            Change::Analyse => self.vectors.transpose(),
            Change::Synthesise => self.vectors.as_ref(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_matrices_become_diagonal() {
        let a = |i: usize, j: usize| 1.0 / (1.0 + (i as f64 - j as f64).powi(2)) - 0.3;
        let b = |i: usize, j: usize| if i == j { 3.0 + i as f64 } else { 1.0 / (1.0 + i.abs_diff(j) as f64) };
        let basis = Eigenbasis::new(6, a, b).unwrap();
        let form = |m: &dyn Fn(usize, usize) -> f64, r: usize, s: usize| -> f64 {
            (0..36).map(|k| basis.entry(k / 6, r) * m(k / 6, k % 6) * basis.entry(k % 6, s)).sum()
        };
        for (r, s) in (0..36).map(|k| (k / 6, k % 6)) {
            // Sums of 36 products of size one.
            assert!((form(&b, r, s) - f64::from(u8::from(r == s))).abs() < 1e-13);
            assert!(r == s || form(&a, r, s).abs() < 1e-13);
        }
    }

    #[test]
    fn an_indefinite_second_matrix_is_refused() {
        assert!(Eigenbasis::new(2, |i, j| f64::from(u8::from(i == j)), |_, _| 1.0).is_none());
    }
}
