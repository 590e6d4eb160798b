//! The innermost loops of the thin-plate energy: three banded matrices at once along one axis.

use pulp::Simd;
use std::array::from_fn;
use zeroset_bspline::DerivativeEnergy;

/// Lines are padded to a multiple of this many numbers, in which any vector register goes.
pub(crate) const BLOCK: usize = 8;

/// One entry of the mass, stiffness and bending matrices.
pub(crate) type Entry = [f64; 3];

/// The rows of one axis's mass, stiffness and bending matrices.
#[derive(Debug)]
pub(crate) struct AxisStencils {
    half: usize,
    count: usize,
    /// `2 half + 1` entries per row, zero outside the matrix.
    rows: Vec<Entry>,
    /// Diagonal and upper half of the rows `half .. count − half`, when these are all the same: uniform knots.
    stencil: Option<Vec<Entry>>,
}

impl AxisStencils {
    pub(crate) fn new<const D: usize>(energy: &DerivativeEnergy<D>, axis: usize, half: usize) -> Self {
        let count = energy.shape()[axis];
        let entry = |row: usize, column: usize| from_fn(|k| energy.gram(axis, k).get(row, column));
        let rows = (0..count)
            .flat_map(|row| {
                (0..=2 * half).map(move |t| (row + t).checked_sub(half).map_or([0.0; 3], |column| entry(row, column)))
            })
            .collect();
        let stencil = (count > 2 * half).then(|| (0..=half).map(|t| entry(count / 2, count / 2 + t)).collect());
        let uniform = |stencil: &Vec<Entry>| {
            (half..count - half).all(|row| {
                (0..=half).all(|t| {
                    let near = |entry: Entry| (0..3).all(|k| (entry[k] - stencil[t][k]).abs() <= 1e-14 * stencil[0][k]);
                    near(entry(row, row + t)) && near(entry(row, row - t))
                })
            })
        };
        Self { half, count, rows, stencil: stencil.filter(uniform) }
    }

    /// The diagonal entries of a row.
    pub(crate) fn diagonal(&self, row: usize) -> Entry {
        self.rows[row * (2 * self.half + 1) + self.half]
    }

    /// The rows that share one stencil.
    fn interior(&self) -> std::ops::Range<usize> {
        if self.stencil.is_some() { self.half..self.count - self.half } else { self.count..self.count }
    }
}

const MAX_STENCIL: usize = 6;

/// `M x`, `K x` and `S x` of one line. `padded` has `P` zeros on either side of the line; the results are whole blocks.
#[inline(always)]
pub(crate) fn along_line<S: Simd, const P: usize>(
    simd: S,
    axis: &AxisStencils,
    padded: &[f64],
    [e0, e1, e2]: [&mut [f64]; 3],
) {
    if let Some(stencil) = &axis.stencil {
        let stencil = splat(simd, stencil);
        let blocks = e0.len() / S::F64_LANES;
        let shifted = |shift: usize| &S::as_simd_f64s(&padded[shift..shift + e0.len()]).0[..blocks];
        let centre = shifted(P);
        let before: [&[S::f64s]; P] = from_fn(|t| shifted(P - t - 1));
        let after: [&[S::f64s]; P] = from_fn(|t| shifted(P + t + 1));
        let out = [S::as_mut_simd_f64s(e0).0, S::as_mut_simd_f64s(e1).0, S::as_mut_simd_f64s(e2).0];
        let out = out.map(|out| &mut out[..blocks]);
        for b in 0..blocks {
            let mut sums = [simd.splat_f64s(0.0); 3];
            for k in 0..3 {
                sums[k] = simd.mul_f64s(stencil[0][k], centre[b]);
            }
            for t in 0..P {
                let pair = simd.add_f64s(before[t][b], after[t][b]);
                for k in 0..3 {
                    sums[k] = simd.add_f64s(sums[k], simd.mul_f64s(stencil[t + 1][k], pair));
                }
            }
            for k in 0..3 {
                out[k][b] = sums[k];
            }
        }
    }
    let interior = axis.interior();
    for row in (0..interior.start).chain(interior.end..axis.count) {
        let mut sums = [0.0; 3];
        for (entry, x) in axis.rows[row * (2 * P + 1)..][..2 * P + 1].iter().zip(&padded[row..]) {
            for k in 0..3 {
                sums[k] += entry[k] * x;
            }
        }
        [e0[row], e1[row], e2[row]] = sums;
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, stencil: &[Entry]) -> [[S::f64s; 3]; MAX_STENCIL] {
    let mut out = [[simd.splat_f64s(0.0); 3]; MAX_STENCIL];
    for (out, entry) in out.iter_mut().zip(stencil) {
        for k in 0..3 {
            out[k] = simd.splat_f64s(entry[k]);
        }
    }
    out
}

/// `E₀`, `E₁` and `E₂` of the axes behind the one to be swept: `E_k` of row `r` begins at `k · level + r · row`.
#[derive(Clone, Copy)]
pub(crate) struct Stack<'a> {
    pub(crate) data: &'a [f64],
    pub(crate) level: usize,
    pub(crate) row: usize,
}

impl<'a> Stack<'a> {
    #[inline(always)]
    fn registers<S: Simd>(&self, k: usize, row: usize, length: usize) -> &'a [S::f64s] {
        let start = k * self.level + row * self.row;
        &S::as_simd_f64s(&self.data[start..start + length]).0[..length / S::F64_LANES]
    }
}

/// `E₂ = S E₀ + 2 K E₁ + M E₂` of the given rows along an axis, and with `ALL` also `E₁ = K E₀ + M E₁` and `E₀ = M E₀`, which
/// come before it in `out`; rows have the given length, whole blocks.
#[inline(always)]
pub(crate) fn sweep<S: Simd, const P: usize, const T: usize, const ALL: bool>(
    simd: S,
    axis: &AxisStencils,
    stack: Stack<'_>,
    rows: std::ops::Range<usize>,
    length: usize,
    out: &mut [f64],
) {
    let level = if ALL { out.len() / 3 } else { 0 };
    let interior = axis.interior();
    let (start, end) = (interior.start.clamp(rows.start, rows.end), interior.end.clamp(rows.start, rows.end));
    for row in (rows.start..start).chain(end..rows.end) {
        let out = targets::<S, ALL>(out, level, (row - rows.start) * length, length);
        single_row::<S, P, T, ALL>(simd, axis, stack, row, length, out);
    }
    let Some(stencil) = &axis.stencil else { return };
    let stencil = splat(simd, stencil);
    // Rows that lie one behind the other are one long row.
    let together = if stack.row == length { (end - start).max(1) } else { 1 };
    for row in (start..end).step_by(together) {
        let out = targets::<S, ALL>(out, level, (row - rows.start) * length, together * length);
        long_row::<S, P, ALL>(simd, &stencil, stack, row, together * length, out);
    }
}

/// The places of `E₀`, `E₁` and `E₂`; of `E₂` alone the first two are empty.
#[inline(always)]
fn targets<S: Simd, const ALL: bool>(out: &mut [f64], level: usize, at: usize, length: usize) -> [&mut [S::f64s]; 3] {
    let (e0, rest) = out.split_at_mut(level);
    let (e1, e2) = rest.split_at_mut(level);
    let part = if ALL { at..at + length } else { 0..0 };
    [&mut e0[part.clone()], &mut e1[part], &mut e2[at..at + length]].map(|e| S::as_mut_simd_f64s(e).0)
}

/// A row with its own entries.
#[inline(always)]
fn single_row<S: Simd, const P: usize, const T: usize, const ALL: bool>(
    simd: S,
    axis: &AxisStencils,
    stack: Stack<'_>,
    row: usize,
    length: usize,
    mut out: [&mut [S::f64s]; 3],
) {
    let entries: [Entry; T] = from_fn(|t| axis.rows[row * T + t]);
    // Rows outside the matrix have entries of zero.
    let other = |t: usize| (row + t).saturating_sub(P).min(axis.count - 1);
    let sources: [[&[S::f64s]; 3]; T] = from_fn(|t| from_fn(|k| stack.registers::<S>(k, other(t), length)));
    for b in 0..length / S::F64_LANES {
        let mut sums = [simd.splat_f64s(0.0); 3];
        for t in 0..T {
            let mut entry = [simd.splat_f64s(0.0); 3];
            for k in 0..3 {
                entry[k] = simd.splat_f64s(entries[t][k]);
            }
            accumulate::<S, ALL>(simd, &mut sums, entry, [sources[t][0][b], sources[t][1][b], sources[t][2][b]]);
        }
        store::<S, ALL>(sums, &mut out, b);
    }
}

/// Rows that have the stencil.
#[inline(always)]
fn long_row<S: Simd, const P: usize, const ALL: bool>(
    simd: S,
    stencil: &[[S::f64s; 3]; MAX_STENCIL],
    stack: Stack<'_>,
    row: usize,
    length: usize,
    mut out: [&mut [S::f64s]; 3],
) {
    let source = |k: usize, row: usize| stack.registers::<S>(k, row, length);
    let centre: [&[S::f64s]; 3] = from_fn(|k| source(k, row));
    let before: [[&[S::f64s]; 3]; P] = from_fn(|t| from_fn(|k| source(k, row - t - 1)));
    let after: [[&[S::f64s]; 3]; P] = from_fn(|t| from_fn(|k| source(k, row + t + 1)));
    for b in 0..length / S::F64_LANES {
        let mut sums = [simd.splat_f64s(0.0); 3];
        accumulate::<S, ALL>(simd, &mut sums, stencil[0], [centre[0][b], centre[1][b], centre[2][b]]);
        for t in 0..P {
            let mut pair = [simd.splat_f64s(0.0); 3];
            for k in 0..3 {
                pair[k] = simd.add_f64s(before[t][k][b], after[t][k][b]);
            }
            accumulate::<S, ALL>(simd, &mut sums, stencil[t + 1], pair);
        }
        store::<S, ALL>(sums, &mut out, b);
    }
}

#[inline(always)]
fn accumulate<S: Simd, const ALL: bool>(simd: S, sums: &mut [S::f64s; 3], [m, k, s]: [S::f64s; 3], e: [S::f64s; 3]) {
    if ALL {
        sums[0] = simd.add_f64s(sums[0], simd.mul_f64s(m, e[0]));
        sums[1] = simd.add_f64s(sums[1], simd.add_f64s(simd.mul_f64s(k, e[0]), simd.mul_f64s(m, e[1])));
    }
    let mixed = simd.mul_f64s(k, simd.add_f64s(e[1], e[1]));
    let outer = simd.add_f64s(simd.mul_f64s(s, e[0]), simd.mul_f64s(m, e[2]));
    sums[2] = simd.add_f64s(sums[2], simd.add_f64s(mixed, outer));
}

#[inline(always)]
fn store<S: Simd, const ALL: bool>(sums: [S::f64s; 3], out: &mut [&mut [S::f64s]; 3], b: usize) {
    if ALL {
        out[0][b] = sums[0];
        out[1][b] = sums[1];
    }
    out[2][b] = sums[2];
}
