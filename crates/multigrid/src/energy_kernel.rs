//! The innermost loops of the thin-plate energy: three banded matrices at once along one axis.

use std::array::from_fn;
use zeroset_bspline::DerivativeEnergy;

/// Numbers that are worked on together.
pub(crate) const BLOCK: usize = 8;

type Block = [f64; BLOCK];

/// One entry of the mass, stiffness and bending matrices.
type Entry = [f64; 3];

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

    /// The rows that share one stencil.
    fn interior(&self) -> std::ops::Range<usize> {
        if self.stencil.is_some() { self.half..self.count - self.half } else { self.count..self.count }
    }
}

/// `M x`, `K x` and `S x` of one line. `padded` has `half` zeros on either side of the line; the results are whole blocks.
#[inline(always)]
pub(crate) fn along_line<const P: usize>(axis: &AxisStencils, padded: &[f64], out: [&mut [f64]; 3]) {
    let [e0, e1, e2] = out;
    if let Some(stencil) = &axis.stencil {
        let stencil: [Entry; MAX_STENCIL] = from_fn(|t| stencil.get(t).copied().unwrap_or_default());
        let (e0, e1, e2) = (e0.as_chunks_mut().0, e1.as_chunks_mut().0, e2.as_chunks_mut().0);
        for (b, ((e0, e1), e2)) in e0.iter_mut().zip(e1).zip(e2).enumerate() {
            let window = &padded[b * BLOCK..b * BLOCK + BLOCK + 2 * P];
            let mut sums = [[0.0; BLOCK]; 3];
            for t in 0..=P {
                for l in 0..BLOCK {
                    let value = if t == 0 { window[P + l] } else { window[P - t + l] + window[P + t + l] };
                    for k in 0..3 {
                        sums[k][l] += stencil[t][k] * value;
                    }
                }
            }
            [*e0, *e1, *e2] = sums;
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

const MAX_STENCIL: usize = 6;

/// `E₀`, `E₁` and `E₂` of the axes behind the one to be swept: `E_k` of row `r` begins at `k · level + r · row`.
#[derive(Clone, Copy)]
pub(crate) struct Stack<'a> {
    pub(crate) data: &'a [f64],
    pub(crate) level: usize,
    pub(crate) row: usize,
}

impl<'a> Stack<'a> {
    #[inline(always)]
    fn blocks(&self, k: usize, start: usize, blocks: usize) -> &'a [Block] {
        let start = k * self.level + start;
        &self.data[start..start + blocks * BLOCK].as_chunks().0[..blocks]
    }
}

/// `E₂ = S E₀ + 2 K E₁ + M E₂` of the given rows along an axis, and with `ALL` also `E₁ = K E₀ + M E₁` and `E₀ = M E₀`, which
/// come before it in `out`; each has the length of the rows.
#[inline(always)]
pub(crate) fn sweep<const P: usize, const T: usize, const ALL: bool>(
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
        let place = (row - rows.start) * length;
        single_row::<P, T, ALL>(axis, stack, row, &mut out[place..], level, length / BLOCK);
    }
    let Some(stencil) = &axis.stencil else { return };
    let stencil: [Entry; MAX_STENCIL] = from_fn(|t| stencil.get(t).copied().unwrap_or_default());
    // Rows that lie one behind the other are one long row.
    let (step, blocks) =
        if stack.row == length { ((end - start).max(1), (end - start) * length / BLOCK) } else { (1, length / BLOCK) };
    for row in (start..end).step_by(step) {
        let place = (row - rows.start) * length;
        long_row::<P, ALL>(&stencil, stack, row, &mut out[place..], level, blocks);
    }
}

/// A row with its own entries.
#[inline(always)]
fn single_row<const P: usize, const T: usize, const ALL: bool>(
    axis: &AxisStencils,
    stack: Stack<'_>,
    row: usize,
    out: &mut [f64],
    level: usize,
    blocks: usize,
) {
    let mut entries = [[0.0; 3]; T];
    entries.copy_from_slice(&axis.rows[row * T..][..T]);
    // Rows outside the matrix have entries of zero.
    let sources: [[&[Block]; 3]; T] = from_fn(|t| {
        let other = (row + t).saturating_sub(P).min(axis.count - 1);
        from_fn(|k| stack.blocks(k, other * stack.row, blocks))
    });
    for b in 0..blocks {
        let mut sums = [[0.0; BLOCK]; 3];
        for t in 0..T {
            accumulate::<ALL>(&mut sums, entries[t], [sources[t][0][b], sources[t][1][b], sources[t][2][b]]);
        }
        store::<ALL>(sums, out, level, b);
    }
}

/// Rows that have the stencil.
#[inline(always)]
fn long_row<const P: usize, const ALL: bool>(
    stencil: &[Entry; MAX_STENCIL],
    stack: Stack<'_>,
    row: usize,
    out: &mut [f64],
    level: usize,
    blocks: usize,
) {
    let centre: [&[Block]; 3] = from_fn(|k| stack.blocks(k, row * stack.row, blocks));
    let before: [[&[Block]; 3]; P] = from_fn(|t| from_fn(|k| stack.blocks(k, (row - t - 1) * stack.row, blocks)));
    let after: [[&[Block]; 3]; P] = from_fn(|t| from_fn(|k| stack.blocks(k, (row + t + 1) * stack.row, blocks)));
    for b in 0..blocks {
        let mut sums = [[0.0; BLOCK]; 3];
        accumulate::<ALL>(&mut sums, stencil[0], [centre[0][b], centre[1][b], centre[2][b]]);
        for t in 0..P {
            let mut pair = [[0.0; BLOCK]; 3];
            for k in 0..3 {
                for l in 0..BLOCK {
                    pair[k][l] = before[t][k][b][l] + after[t][k][b][l];
                }
            }
            accumulate::<ALL>(&mut sums, stencil[t + 1], pair);
        }
        store::<ALL>(sums, out, level, b);
    }
}

#[inline(always)]
fn accumulate<const ALL: bool>(sums: &mut [Block; 3], [m, k, s]: Entry, e: [Block; 3]) {
    for l in 0..BLOCK {
        if ALL {
            sums[0][l] += m * e[0][l];
            sums[1][l] += k * e[0][l] + m * e[1][l];
        }
        sums[2][l] += (s * e[0][l] + (2.0 * k) * e[1][l]) + m * e[2][l];
    }
}

#[inline(always)]
fn store<const ALL: bool>(sums: [Block; 3], out: &mut [f64], level: usize, b: usize) {
    if ALL {
        for k in 0..3 {
            out[k * level + b * BLOCK..][..BLOCK].copy_from_slice(&sums[k]);
        }
    } else {
        out[b * BLOCK..][..BLOCK].copy_from_slice(&sums[2]);
    }
}
