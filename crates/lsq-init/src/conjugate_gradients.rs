//! Preconditioned conjugate gradients.

use rayon::prelude::*;

/// Where the iteration ended.
#[derive(Debug)]
pub(crate) struct Solution {
    pub(crate) x: Vec<f64>,
    pub(crate) iterations: usize,
    /// `‖b − A x‖ / ‖b‖`, Euclidean, as the recurrence carries it.
    pub(crate) residual: f64,
}

/// Solves `A x = right` from zero until the relative residual falls to `tolerance`, or an iteration breaks down, or the
/// iterations are spent. `apply` and `precondition` write A and an approximate inverse times their first argument to the
/// second.
pub(crate) fn conjugate_gradients(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64]),
    right: &[f64],
    tolerance: f64,
    most_iterations: usize,
) -> Solution {
    let norm = dot(right, right).sqrt();
    let mut x = vec![0.0; right.len()];
    if norm == 0.0 {
        return Solution { x, iterations: 0, residual: 0.0 };
    }
    let mut r = right.to_vec();
    let mut q = vec![0.0; right.len()];
    // The same space holds A p and, when that is spent, the preconditioned residual.
    precondition(&r, &mut q);
    let mut p = q.clone();
    let mut rz = dot(&r, &q);
    let mut residual = 1.0;
    for iteration in 1..=most_iterations {
        apply(&p, &mut q);
        let alpha = rz / dot(&p, &q);
        if !alpha.is_finite() {
            return Solution { x, iterations: iteration, residual };
        }
        residual = step(alpha, &p, &q, &mut x, &mut r).sqrt() / norm;
        if residual <= tolerance {
            return Solution { x, iterations: iteration, residual };
        }
        precondition(&r, &mut q);
        let next = dot(&r, &q);
        let beta = next / rz;
        rz = next;
        p.par_chunks_mut(CHUNK).zip(q.par_chunks(CHUNK)).for_each(|(p, z)| {
            p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p);
        });
    }
    Solution { x, iterations: most_iterations, residual }
}

/// How many products one parallel task sums; fixed, so that the sum does not depend on the number of threads.
const CHUNK: usize = 16_384;

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let partial: Vec<f64> =
        a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum()).collect();
    partial.iter().sum()
}

/// `x + α p`, `r − α q`, and the new `r · r`.
fn step(alpha: f64, p: &[f64], q: &[f64], x: &mut [f64], r: &mut [f64]) -> f64 {
    let chunks = x.par_chunks_mut(CHUNK).zip(r.par_chunks_mut(CHUNK));
    let partial: Vec<f64> = chunks
        .zip(p.par_chunks(CHUNK).zip(q.par_chunks(CHUNK)))
        .map(|((x, r), (p, q))| {
            x.iter_mut().zip(p).for_each(|(x, p)| *x += alpha * p);
            r.iter_mut().zip(q).for_each(|(r, q)| *r -= alpha * q);
            r.iter().map(|r| r * r).sum()
        })
        .collect();
    partial.iter().sum()
}
