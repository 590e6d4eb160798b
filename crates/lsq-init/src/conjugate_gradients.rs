//! Preconditioned conjugate gradients.

use rayon::prelude::*;

pub(crate) struct Solution {
    pub(crate) x: Vec<f64>,
    pub(crate) iterations: usize,
    /// `‖b − A x‖ / ‖b‖`, Euclidean.
    pub(crate) residual: f64,
}

pub(crate) fn conjugate_gradients(
    apply: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    right: Vec<f64>,
    tolerance: f64,
    most_iterations: usize,
) -> Solution {
    let size = dot(&right, &right).sqrt();
    let mut x = vec![0.0; right.len()];
    if size == 0.0 {
        return Solution { x, iterations: 0, residual: 0.0 };
    }
    let mut r = right;
    let mut z = precondition(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let mut residual = 1.0;
    for iterations in 1..=most_iterations {
        let q = apply(&p);
        let alpha = rz / dot(&p, &q);
        if !alpha.is_finite() {
            return Solution { x, iterations, residual };
        }
        x.iter_mut().zip(&p).for_each(|(x, p)| *x += alpha * p);
        r.iter_mut().zip(&q).for_each(|(r, q)| *r -= alpha * q);
        residual = dot(&r, &r).sqrt() / size;
        if residual <= tolerance {
            return Solution { x, iterations, residual };
        }
        z = precondition(&r);
        let next = dot(&r, &z);
        let beta = next / rz;
        rz = next;
        p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + beta * *p);
    }
    Solution { x, iterations: most_iterations, residual }
}

/// How many products one parallel task sums; fixed, so that the sum does not depend on the number of threads.
const CHUNK: usize = 16_384;

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let partial: Vec<f64> =
        a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| a.iter().zip(b).map(|(x, y)| x * y).sum()).collect();
    partial.iter().sum()
}
