//! The generalized eigenproblem of two small dense matrices, by faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Col, Mat, Par};

/// `K V = G V Λ` with `Vᵀ G V = 1`: the columns of V, or `None` where G is not positive definite. Sequential, so that the
/// bytes do not depend on the number of threads.
pub(crate) fn generalized_eigenvectors(
    size: usize,
    k: impl Fn(usize, usize) -> f64,
    g: impl Fn(usize, usize) -> f64,
) -> Option<Mat<f64>> {
    let mut factor = Mat::from_fn(size, size, &g);
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(size, Par::Seq, Default::default()));
    cholesky_in_place(factor.as_mut(), Default::default(), Par::Seq, MemStack::new(&mut memory), Default::default())
        .ok()?;
    // C = L⁻¹ K L⁻ᵀ, formed by solving twice.
    let mut c = Mat::from_fn(size, size, &k);
    solve_lower_triangular_in_place(factor.as_ref(), c.as_mut(), Par::Seq);
    let mut c = c.transpose().to_owned();
    solve_lower_triangular_in_place(factor.as_ref(), c.as_mut(), Par::Seq);
    let (mut values, mut vectors) = (Col::<f64>::zeros(size), Mat::<f64>::zeros(size, size));
    let scratch = self_adjoint_evd_scratch::<f64>(size, ComputeEigenvectors::Yes, Par::Seq, Default::default());
    self_adjoint_evd(
        c.as_ref(),
        values.as_diagonal_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .ok()?;
    solve_upper_triangular_in_place(factor.transpose(), vectors.as_mut(), Par::Seq);
    Some(vectors)
}
