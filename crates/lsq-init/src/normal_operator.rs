//! The normal operator of equation (15), `⊗(CᵀC) + w H`.
//!
//! With G = CᵀC, M mass, K stiffness and B bending matrix of an axis,
//!
//! ```text
//! ⊗G + w H = G⊗(G⊗G) + w [ B⊗(M⊗M) + 2 K⊗(M⊗K + K⊗M) + M⊗(B⊗M + 2 K⊗K + M⊗B) ]:
//! ```
//!
//! the four brackets slab by slab (a slab is what one index of the first axis selects), in cache, then the first axis.

use rayon::prelude::*;

use crate::axis_factors::{AxisFactors, BENDING, DATA, MASS, STIFFNESS};

/// The operator, with the space that its application needs.
#[derive(Debug)]
pub(crate) struct NormalOperator<'a> {
    axes: &'a [AxisFactors; 3],
    weight: f64,
    /// Per slab the four brackets.
    brackets: Vec<f64>,
}

/// Entries that one parallel task should at least work on, so that tasks of small slabs are worth starting.
const TASK: usize = 4096;

impl<'a> NormalOperator<'a> {
    pub(crate) fn new(axes: &'a [AxisFactors; 3], weight: f64) -> Self {
        let count: usize = axes.iter().map(AxisFactors::size).product();
        Self { axes, weight, brackets: vec![0.0; 4 * count] }
    }

    /// `(⊗(CᵀC) + w H) x`.
    pub(crate) fn apply(&mut self, x: &[f64], out: &mut [f64]) {
        self.combine(x, out, 1.0, self.weight);
    }

    /// `H x`.
    pub(crate) fn apply_energy(&mut self, x: &[f64], out: &mut [f64]) {
        self.combine(x, out, 0.0, 1.0);
    }

    fn combine(&mut self, x: &[f64], out: &mut [f64], data: f64, energy: f64) {
        let [first, middle, last] = self.axes;
        let slab = middle.size() * last.size();
        let tasks = (TASK / slab).max(1);
        self.brackets.par_chunks_mut(4 * slab).zip(x.par_chunks(slab)).with_min_len(tasks).for_each_init(
            || vec![0.0; 4 * slab],
            |scratch, (brackets, x)| {
                along_lines(last, x, scratch);
                across_lines(middle, last.size(), scratch, brackets);
            },
        );
        let brackets = &self.brackets;
        out.par_chunks_mut(slab).enumerate().with_min_len(tasks).for_each(|(i, out)| {
            out.fill(0.0);
            let (start, band) = first.row(i);
            for (factors, brackets) in band.iter().zip(brackets[4 * slab * start..].chunks_exact(4 * slab)) {
                let c = [
                    data * factors[DATA],
                    energy * factors[BENDING],
                    2.0 * energy * factors[STIFFNESS],
                    energy * factors[MASS],
                ];
                let [b0, b1, b2, b3] = quarters(brackets, slab, 0, slab);
                for k in 0..slab {
                    out[k] += c[0] * b0[k] + c[1] * b1[k] + c[2] * b2[k] + c[3] * b3[k];
                }
            }
        });
    }
}

/// The four matrices along each line of a slab: G x, M x, K x, B x in the quarters of `out`.
fn along_lines(axis: &AxisFactors, x: &[f64], out: &mut [f64]) {
    let slab = x.len();
    for i in 0..axis.size() {
        let (start, band) = axis.row(i);
        for (row, line) in x.chunks_exact(axis.size()).enumerate() {
            let mut sum = [0.0; 4];
            for (factors, value) in band.iter().zip(&line[start..]) {
                for q in 0..4 {
                    sum[q] += factors[q] * value;
                }
            }
            for q in 0..4 {
                out[q * slab + row * axis.size() + i] = sum[q];
            }
        }
    }
}

/// The four brackets from the four products along the lines.
fn across_lines(axis: &AxisFactors, line: usize, x: &[f64], out: &mut [f64]) {
    let slab = axis.size() * line;
    out.fill(0.0);
    let (out0, rest) = out.split_at_mut(slab);
    let (out1, rest) = rest.split_at_mut(slab);
    let (out2, out3) = rest.split_at_mut(slab);
    for j in 0..axis.size() {
        let here = j * line..(j + 1) * line;
        let (o0, o1, o2, o3) =
            (&mut out0[here.clone()], &mut out1[here.clone()], &mut out2[here.clone()], &mut out3[here]);
        let (start, band) = axis.row(j);
        for (offset, &[g, m, k, b]) in band.iter().enumerate() {
            let [x0, x1, x2, x3] = quarters(x, slab, (start + offset) * line, line);
            for i in 0..line {
                o0[i] += g * x0[i];
                o1[i] += m * x1[i];
                o2[i] += m * x2[i] + k * x1[i];
                o3[i] += m * x3[i] + 2.0 * k * x2[i] + b * x1[i];
            }
        }
    }
}

/// The same stretch of each of four slabs that follow each other.
fn quarters(slabs: &[f64], slab: usize, start: usize, length: usize) -> [&[f64]; 4] {
    std::array::from_fn(|q| &slabs[q * slab + start..][..length])
}
