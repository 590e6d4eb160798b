//! Fast diagonalisation of the normal operator.
//!
//! With `Kᵢ V = Gᵢ V Λ` along each axis, `Gᵢ = CᵢᵀCᵢ` and Kᵢ the stiffness matrix, the Kronecker products of the V nearly
//! diagonalise `⊗Gᵢ + w H` (Lynch, Rice and Thomas 1964): exactly the data term, and the energy up to what its mass and
//! bending matrices have off their diagonals in the same basis.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;
use zeroset_bspline::{BandedMatrix, DerivativeEnergy};

use crate::eigenpairs::generalized_eigenvectors;
use crate::normal_operator::AxisGram;

/// An approximate inverse of the normal operator.
pub(crate) struct Preconditioner<const D: usize> {
    vectors: [Mat<f64>; D],
    inverse_diagonal: Vec<f64>,
}

impl<const D: usize> Preconditioner<D> {
    /// `None` where no definite matrix could be made: then nothing determines the spline.
    pub(crate) fn new(data: &[AxisGram; D], energy: &DerivativeEnergy<D>, weight: f64) -> Option<Self> {
        let mut vectors = Vec::with_capacity(D);
        let mut diagonals = Vec::with_capacity(D);
        for axis in 0..D {
            let (mass, stiffness) = (energy.gram(axis, 0), energy.gram(axis, 1));
            let (data_gram, size) = (&data[axis], mass.size());
            let trace = |at: &dyn Fn(usize) -> f64| (0..size).map(at).sum::<f64>();
            // A spline has more coefficients than its cells have nodes, so that G alone may be singular: a little of the
            // mass matrix makes it definite, and the true diagonal is taken below.
            let ev = |n: &str, d: f64| std::env::var(n).map_or(d, |s| s.parse::<f64>().unwrap());
            let bending = energy.gram(axis, 2);
            let share = ev("SHARE", 1e-3) * trace(&|i| data_gram.get(i, i)) / trace(&|i| mass.get(i, i));
            let v = generalized_eigenvectors(
                size,
                |i, j| ev("KK", 1.0) * stiffness.get(i, j) + ev("BB", 0.0) * bending.get(i, j) * trace(&|i| stiffness.get(i, i)) / trace(&|i| bending.get(i, i)),
                |i, j| data_gram.get(i, j) + share * mass.get(i, j) + ev("SB", 0.0) * bending.get(i, j) * trace(&|i| data_gram.get(i, i)) / trace(&|i| bending.get(i, i)),
            )?;
            let own = diagonal_of(&v, |i, j| data_gram.get(i, j), data_gram.half_bandwidth());
            let energies: Vec<Vec<f64>> = (0..=energy.order())
                .map(|k| {
                    let gram: &BandedMatrix = energy.gram(axis, k);
                    diagonal_of(&v, |i, j| gram.get(i, j), gram.half_bandwidth())
                })
                .collect();
            diagonals.push((own, energies));
            vectors.push(v);
        }
        let shape = energy.shape();
        let count: usize = shape.iter().product();
        let inverse_diagonal: Vec<f64> = (0..count)
            .map(|flat| {
                let mut rest = flat;
                let mut data_term = 1.0;
                let mut partial = vec![0.0; energy.order() + 1];
                partial[0] = 1.0;
                for axis in (0..D).rev() {
                    let i = rest % shape[axis];
                    rest /= shape[axis];
                    let (own, energies) = &diagonals[axis];
                    data_term *= own[i].max(0.0);
                    for k in (0..partial.len()).rev() {
                        partial[k] = (0..=k).map(|a| binomial(k, a) * energies[a][i] * partial[k - a]).sum();
                    }
                }
                1.0 / (data_term + weight * partial[energy.order()])
            })
            .collect();
        if inverse_diagonal.iter().any(|d| !(d.is_finite() && *d > 0.0)) {
            return None;
        }
        Some(Self { vectors: vectors.try_into().ok()?, inverse_diagonal })
    }

    pub(crate) fn apply(&self, residual: &[f64]) -> Vec<f64> {
        let shape: [usize; D] = std::array::from_fn(|axis| self.vectors[axis].nrows());
        let mut x = residual.to_vec();
        for axis in 0..D {
            x = dense_along(&x, &shape, axis, self.vectors[axis].transpose());
        }
        x.iter_mut().zip(&self.inverse_diagonal).for_each(|(x, d)| *x *= d);
        for axis in 0..D {
            x = dense_along(&x, &shape, axis, self.vectors[axis].as_ref());
        }
        x
    }
}

/// The diagonal of `Vᵀ A V` for a banded A.
fn diagonal_of(v: &Mat<f64>, a: impl Fn(usize, usize) -> f64, half_bandwidth: usize) -> Vec<f64> {
    let size = v.nrows();
    (0..size)
        .map(|column| {
            let mut sum = 0.0;
            for i in 0..size {
                for j in i.saturating_sub(half_bandwidth)..(i + half_bandwidth + 1).min(size) {
                    sum += v[(i, column)] * a(i, j) * v[(j, column)];
                }
            }
            sum
        })
        .collect()
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product()
}

/// How many lines or columns one parallel task takes; fixed, so that the bytes do not depend on the number of threads.
const CHUNK: usize = 256;

/// Applies a square matrix along one axis of a C-ordered array.
fn dense_along(input: &[f64], shape: &[usize], axis: usize, matrix: MatRef<'_, f64>) -> Vec<f64> {
    let size = shape[axis];
    let inner: usize = shape[axis + 1..].iter().product();
    let mut output = vec![0.0; input.len()];
    if inner == 1 {
        let lines = CHUNK * size;
        output.par_chunks_mut(lines).zip(input.par_chunks(lines)).for_each(|(out, lines)| {
            let count = lines.len() / size;
            matmul(
                MatMut::from_row_major_slice_mut(out, count, size),
                Accum::Replace,
                MatRef::from_row_major_slice(lines, count, size),
                matrix.transpose(),
                1.0,
                Par::Seq,
            );
        });
    } else {
        let slab = size * inner;
        output.par_chunks_mut(slab).zip(input.par_chunks(slab)).for_each(|(out, slab)| {
            let (out, slab) =
                (MatMut::from_row_major_slice_mut(out, size, inner), MatRef::from_row_major_slice(slab, size, inner));
            out.par_col_chunks_mut(CHUNK).enumerate().for_each(|(index, out)| {
                let columns = slab.subcols(index * CHUNK, out.ncols());
                matmul(out, Accum::Replace, matrix, columns, 1.0, Par::Seq);
            });
        });
    }
    output
}
