//! The normal operator of equation (15), `⊗(CᵀC) + w H`.
//!
//! With G = CᵀC, M mass, K stiffness and B bending matrix of an axis,
//!
//! ```text
//! ⊗G + w H = G⊗(G⊗G) + w [ B⊗(M⊗M) + 2 K⊗(M⊗K + K⊗M) + M⊗(B⊗M + 2 K⊗K + M⊗B) ]:
//! ```
//!
//! the four brackets slab by slab (a slab is what one index of the first axis selects), in cache, then the first axis. Lines
//! of brackets are padded to whole vector registers.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use zeroset_bspline::MAX_DEGREE;

use crate::axis_factors::{AxisFactors, BENDING, DATA, MASS, STIFFNESS};

/// The operator, with the space that its application needs.
#[derive(Debug)]
pub(crate) struct NormalOperator<'a> {
    axes: &'a [AxisFactors; 3],
    weight: f64,
    /// Length of a padded line.
    line: usize,
    /// The diagonals of the last axis's matrices, one line each: from the lowest to the highest, four per place.
    diagonals: Vec<f64>,
    /// Per slab the four brackets.
    brackets: Vec<f64>,
}

/// Lines are padded to a multiple of this many numbers, in which any vector register goes.
const BLOCK: usize = 8;

/// Entries that one parallel task should at least work on, so that tasks of small slabs are worth starting.
const TASK: usize = 4096;

/// Slabs that one task makes together along the first axis, since they share most of the brackets,
const GROUP: usize = 8;
/// and padded numbers of a slab that it makes at a time, so that what they share stays in cache.
const STRETCH: usize = 512;

impl<'a> NormalOperator<'a> {
    pub(crate) fn new(axes: &'a [AxisFactors; 3], weight: f64) -> Self {
        let [first, middle, last] = axes;
        let line = last.size().next_multiple_of(BLOCK);
        let half = last.half_bandwidth();
        let mut diagonals = vec![0.0; (2 * half + 1) * 4 * line];
        for row in 0..last.size() {
            let (start, band) = last.row(row);
            for (column, factors) in (start..).zip(band) {
                for (q, factor) in factors.iter().enumerate() {
                    diagonals[((column + half - row) * 4 + q) * line + row] = *factor;
                }
            }
        }
        let brackets = vec![0.0; 4 * first.size() * middle.size() * line];
        Self { axes, weight, line, diagonals, brackets }
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
        let (line, diagonals) = (self.line, self.diagonals.as_slice());
        let slab = middle.size() * last.size();
        let padded = middle.size() * line;
        let tasks = (TASK / slab).max(1);
        self.brackets.par_chunks_mut(4 * padded).zip(x.par_chunks(slab)).with_min_len(tasks).for_each_init(
            || (vec![0.0; line + 2 * last.half_bandwidth()], vec![0.0; 4 * padded]),
            |(source, products), (out, x)| {
                Arch::new().dispatch(Within { middle, last, line, diagonals, x, source, products, out });
            },
        );
        let brackets = self.brackets.as_slice();
        out.par_chunks_mut(GROUP * slab).enumerate().with_min_len(tasks.div_ceil(GROUP)).for_each_init(
            || vec![0.0; STRETCH + line],
            |sums, (group, out)| {
                let weights = [data, energy];
                let start = group * GROUP;
                Arch::new().dispatch(Across {
                    first,
                    last: last.size(),
                    line,
                    padded,
                    brackets,
                    weights,
                    start,
                    sums,
                    out,
                });
            },
        );
    }
}

/// The four brackets of a slab.
struct Within<'a> {
    middle: &'a AxisFactors,
    last: &'a AxisFactors,
    line: usize,
    diagonals: &'a [f64],
    x: &'a [f64],
    /// A line with zeros on either side.
    source: &'a mut [f64],
    products: &'a mut [f64],
    out: &'a mut [f64],
}

impl WithSimd for Within<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { middle, last, line, diagonals, x, source, products, out } = self;
        let padded = middle.size() * line;
        for (row, x) in x.chunks_exact(last.size()).enumerate() {
            source[last.half_bandwidth()..][..x.len()].copy_from_slice(x);
            let products = quarters_mut(products, padded, row * line, line);
            match last.half_bandwidth() {
                0 => along_line::<S, 1>(simd, diagonals, source, products),
                1 => along_line::<S, 3>(simd, diagonals, source, products),
                2 => along_line::<S, 5>(simd, diagonals, source, products),
                3 => along_line::<S, 7>(simd, diagonals, source, products),
                4 => along_line::<S, 9>(simd, diagonals, source, products),
                _ => along_line::<S, 11>(simd, diagonals, source, products),
            }
        }
        for row in 0..middle.size() {
            across_lines(simd, middle, row, products, quarters_mut(out, padded, row * line, line));
        }
    }
}

/// The four matrices along a line: G x, M x, K x, B x.
#[inline(always)]
fn along_line<S: Simd, const T: usize>(simd: S, diagonals: &[f64], source: &[f64], out: [&mut [f64]; 4]) {
    let line = out[0].len();
    for (q, out) in out.into_iter().enumerate() {
        let out = S::as_mut_simd_f64s(out).0;
        let mut factors: [&[S::f64s]; T] = [&[]; T];
        let mut values: [&[S::f64s]; T] = [&[]; T];
        for t in 0..T {
            factors[t] = &S::as_simd_f64s(&diagonals[(4 * t + q) * line..][..line]).0[..out.len()];
            values[t] = &S::as_simd_f64s(&source[t..t + line]).0[..out.len()];
        }
        for b in 0..out.len() {
            let mut sum = simd.mul_f64s(factors[0][b], values[0][b]);
            for t in 1..T {
                sum = simd.add_f64s(sum, simd.mul_f64s(factors[t][b], values[t][b]));
            }
            out[b] = sum;
        }
    }
}

/// One line of the four brackets from the four products along the lines.
#[inline(always)]
fn across_lines<S: Simd>(simd: S, axis: &AxisFactors, row: usize, products: &[f64], out: [&mut [f64]; 4]) {
    let (line, slab) = (out[0].len(), products.len() / 4);
    let (start, band) = axis.row(row);
    let [out0, out1, out2, out3] = out.map(|out| S::as_mut_simd_f64s(out).0);
    for block in 0..out0.len() {
        let mut sums = [simd.splat_f64s(0.0); 4];
        for (other, &[g, m, k, b]) in (start..).zip(band) {
            let place = other * line + block * S::F64_LANES;
            let mut x = [simd.splat_f64s(0.0); 4];
            for q in 0..4 {
                x[q] = S::as_simd_f64s(&products[q * slab + place..][..S::F64_LANES]).0[0];
            }
            let [g, m, k, b] = [simd.splat_f64s(g), simd.splat_f64s(m), simd.splat_f64s(k), simd.splat_f64s(b)];
            let mixed = simd.mul_f64s(k, x[2]);
            sums[0] = simd.add_f64s(sums[0], simd.mul_f64s(g, x[0]));
            sums[1] = simd.add_f64s(sums[1], simd.mul_f64s(m, x[1]));
            sums[2] = simd.add_f64s(sums[2], simd.add_f64s(simd.mul_f64s(m, x[2]), simd.mul_f64s(k, x[1])));
            let bent = simd.add_f64s(simd.mul_f64s(m, x[3]), simd.add_f64s(mixed, mixed));
            sums[3] = simd.add_f64s(sums[3], simd.add_f64s(bent, simd.mul_f64s(b, x[1])));
        }
        (out0[block], out1[block], out2[block], out3[block]) = (sums[0], sums[1], sums[2], sums[3]);
    }
}

/// The first axis, for some slabs.
struct Across<'a> {
    first: &'a AxisFactors,
    /// Length of a line of the output.
    last: usize,
    line: usize,
    padded: usize,
    brackets: &'a [f64],
    /// Of the data term and of the energy.
    weights: [f64; 2],
    /// The first of the slabs.
    start: usize,
    sums: &'a mut [f64],
    out: &'a mut [f64],
}

impl WithSimd for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { first, last, line, padded, brackets, weights: [data, energy], start, sums, out } = self;
        let lines = padded / line;
        let together = (STRETCH / line).max(1);
        for from in (0..lines).step_by(together) {
            let to = (from + together).min(lines);
            for (row, out) in (start..).zip(out.chunks_exact_mut(lines * last)) {
                let (other, band) = first.row(row);
                let mut weights = [[simd.splat_f64s(0.0); 4]; 2 * MAX_DEGREE + 1];
                for (weights, factors) in weights.iter_mut().zip(band) {
                    weights[0] = simd.splat_f64s(data * factors[DATA]);
                    weights[1] = simd.splat_f64s(energy * factors[BENDING]);
                    weights[2] = simd.splat_f64s(2.0 * energy * factors[STIFFNESS]);
                    weights[3] = simd.splat_f64s(energy * factors[MASS]);
                }
                let length = (to - from) * line;
                let target = S::as_mut_simd_f64s(&mut sums[..length]).0;
                for block in 0..target.len() {
                    let place = from * line + block * S::F64_LANES;
                    // Apart, so that a large energy's rounding does not swallow the data.
                    let mut sums = [simd.splat_f64s(0.0); 2];
                    for (other, weights) in (other..).zip(&weights[..band.len()]) {
                        let mut parts = [simd.splat_f64s(0.0); 4];
                        for q in 0..4 {
                            let at = (4 * other + q) * padded + place;
                            let bracket = S::as_simd_f64s(&brackets[at..at + S::F64_LANES]).0[0];
                            parts[q] = simd.mul_f64s(weights[q], bracket);
                        }
                        sums[0] = simd.add_f64s(sums[0], parts[0]);
                        let energy = simd.add_f64s(simd.add_f64s(parts[1], parts[2]), parts[3]);
                        sums[1] = simd.add_f64s(sums[1], energy);
                    }
                    target[block] = simd.add_f64s(sums[0], sums[1]);
                }
                let out = out[from * last..to * last].chunks_exact_mut(last);
                for (out, sums) in out.zip(sums.chunks_exact(line)) {
                    out.copy_from_slice(&sums[..last]);
                }
            }
        }
    }
}

/// The same stretch of each of four slabs that follow each other.
#[inline(always)]
fn quarters_mut(slabs: &mut [f64], slab: usize, start: usize, length: usize) -> [&mut [f64]; 4] {
    let (a, rest) = slabs.split_at_mut(slab);
    let (b, rest) = rest.split_at_mut(slab);
    let (c, d) = rest.split_at_mut(slab);
    [a, b, c, d].map(|quarter| &mut quarter[start..start + length])
}
