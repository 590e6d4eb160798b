//! Fairness on a band level: a constant stencil, block by block.

use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;
use zeroset_bspline::{BlockField, IndexSet};

use crate::band_tasks::BandTasks;
use crate::bits::Bits;
use crate::scratch::Scratch;
use crate::vectors::clear;

/// Functions of cubic degree reach this far.
const REACH: usize = 3;

/// Places of a block along an axis.
const SIDE: usize = 8;

/// Coefficients that matter to a block, along an axis.
const HALO: usize = SIDE + 2 * REACH;

/// Energies of orders up to 3 are summed.
const ORDERS: usize = 4;

/// Diagonal and upper half of a row of a matrix that is the same in every row.
type Stencil = [f64; REACH + 1];

/// A fairness `Σ_k c_k ∫ ‖∇ᵏ f‖²` of orders 0 to 3, by its weights `c_k`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fairness {
    /// `c_0` to `c_3`; finite and not negative.
    pub weights: [f64; ORDERS],
}

impl Fairness {
    /// The thin-plate energy of equation (3) with a weight.
    pub fn thin_plate(weight: f64) -> Self {
        Self { weights: [0.0, 0.0, weight, 0.0] }
    }

    /// `weight · (∫ ‖∇³f‖² + ∫ ‖∇²f‖² / length²)`: third order for detail, second order beyond `length` against overshoots.
    pub fn third_order(weight: f64, length: f64) -> Self {
        Self { weights: [0.0, 0.0, weight / (length * length), weight] }
    }

    /// The same times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { weights: self.weights.map(|c| factor * c) }
    }
}

/// The matrix `H` of a [`Fairness`] on the active functions of one level.
///
/// The support of every active function lies inside the box, so that all rows are the same `7^D` stencil: a sum of Kronecker
/// products of Gram matrices, applied axis by axis to each block with its halo.
#[derive(Debug, Clone)]
pub struct BandEnergy<const D: usize> {
    active: Arc<IndexSet<D>>,
    tasks: Arc<BandTasks>,
    /// `grams[axis][k]` of the `k`-th derivatives.
    grams: [[Stencil; ORDERS]; D],
    fairness: Fairness,
    /// What the first axis does to `E_b` of the others: `Σ_a (a+b over a) c_{a+b} G_a`.
    last: [Stencil; ORDERS],
    /// A function's coefficients and sums, both in blocks, that copies share.
    scratch: Arc<Scratch<(BlockField<D>, Vec<f64>)>>,
    /// Numbers for the active functions, that copies share too.
    vectors: Arc<Scratch<[Vec<f64>; 3]>>,
}

impl<const D: usize> BandEnergy<D> {
    /// The energy on active functions whose cells have the given sides.
    pub fn new(active: Arc<IndexSet<D>>, sides: [f64; D], fairness: Fairness) -> Self {
        let tasks = Arc::new(BandTasks::new(&active));
        let grams = sides.map(grams);
        let last = last(&grams[0], &fairness);
        Self { active, tasks, grams, fairness, last, scratch: Arc::default(), vectors: Arc::default() }
    }

    /// The same functions with another fairness.
    pub fn with_fairness(&self, fairness: Fairness) -> Self {
        Self { fairness, last: last(&self.grams[0], &fairness), ..self.clone() }
    }

    /// The fairness whose matrix this is.
    pub fn fairness(&self) -> &Fairness {
        &self.fairness
    }

    /// The active functions.
    pub fn active(&self) -> &Arc<IndexSet<D>> {
        &self.active
    }

    /// The diagonal entry of `H`: the same for every function.
    pub fn diagonal(&self) -> f64 {
        let mut partial = [1.0, 0.0, 0.0, 0.0];
        for axis in (1..D).rev() {
            partial = std::array::from_fn(|k| {
                (0..=k).map(|a| BINOMIAL[k][a] * self.grams[axis][a][0] * partial[k - a]).sum()
            });
        }
        (0..ORDERS).map(|b| self.last[b][0] * partial[b]).sum()
    }

    /// `out = H x` for coefficients of the active functions, in their order.
    ///
    /// # Panics
    /// If `x` or `out` do not have one entry per active function.
    #[track_caller]
    pub fn apply_to_active(&self, x: &[f64], out: &mut [f64]) {
        self.with_scratch(|field, _| {
            field.scatter(x);
            self.apply(field, None, out);
        });
    }

    /// The active functions' share, in their order, of what `add` adds to zeros: one number per place of every block of the set.
    ///
    /// # Panics
    /// If `out` does not have one entry per active function.
    #[track_caller]
    pub fn sums(&self, add: impl FnOnce(&mut [f64]), out: &mut [f64]) {
        self.with_scratch(|_, sums| {
            clear(sums);
            add(sums);
            self.active.members_of_blocks(sums, out);
        });
    }

    /// Calls `work` with coefficients and sums of arbitrary values.
    pub(crate) fn with_scratch<R>(&self, work: impl FnOnce(&mut BlockField<D>, &mut [f64]) -> R) -> R {
        let places = self.active.block_count() * IndexSet::<D>::BLOCK;
        let new = || (BlockField::zeros(Arc::clone(&self.active)), vec![0.0; places]);
        self.scratch.with(new, |(field, sums)| work(field, sums))
    }

    /// Calls `work` with vectors of as many entries as there are active functions, of arbitrary values.
    pub(crate) fn with_vectors<R>(&self, work: impl FnOnce(&mut [Vec<f64>; 3]) -> R) -> R {
        self.vectors.with(|| [(); 3].map(|()| vec![0.0; self.active.len()]), work)
    }

    /// `out = (H f)` of the active functions, where `f` may have coefficients beyond them: for the gradient of the energy all
    /// that reach them count. `added` has further numbers to add, block by block.
    ///
    /// # Panics
    /// If `out` does not have one entry per active function, or `added` not one number per place of every block.
    #[track_caller]
    pub fn apply(&self, f: &BlockField<D>, added: Option<&[f64]>, out: &mut [f64]) {
        assert_eq!(out.len(), self.active.len(), "one entry per active function");
        let block = IndexSet::<D>::BLOCK;
        assert!(added.is_none_or(|a| a.len() == block * self.active.block_count()), "one number per place");
        let is_own = Arc::ptr_eq(f.set(), &self.active);
        self.tasks.for_each(&self.active, out, Buffers::new::<D>, |buffers, slot, out| {
            buffers.wanted = Wanted::new::<D>(&self.active.rows_of_block(slot));
            if is_own {
                f.gather_rows::<REACH>(self.tasks.slots_around(slot), buffers.wanted.lines::<D>(), &mut buffers.halo);
            } else {
                let first = self.active.block_start(slot).map(|k| i64::from(k) - REACH as i64);
                f.gather(first, HALO, &mut buffers.halo);
            }
            if self.fairness.weights[3] == 0.0 {
                Arch::new().dispatch(Block::<D, 3> { energy: self, buffers });
            } else {
                Arch::new().dispatch(Block::<D, 4> { energy: self, buffers });
            }
            let added = added.map(|added| &added[slot * block..][..block]);
            let mut out = out.iter_mut();
            self.active.for_each_place(slot, |place| {
                if let Some(out) = out.next() {
                    *out = buffers.result[place] + added.map_or(0.0, |added| added[place]);
                }
            });
        });
    }
}

const BINOMIAL: [[f64; ORDERS]; ORDERS] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

/// The Gram matrices of cubic cardinal functions and of their first three derivatives on cells of a given side.
fn grams(side: f64) -> [Stencil; ORDERS] {
    [
        [2416.0, 1191.0, 120.0, 1.0].map(|g| g / 5040.0 * side),
        [80.0, -15.0, -24.0, -1.0].map(|g| g / 120.0 / side),
        [16.0, -9.0, 0.0, 1.0].map(|g| g / 6.0 / side.powi(3)),
        [20.0, -15.0, 6.0, -1.0].map(|g| g / side.powi(5)),
    ]
}

fn last(grams: &[Stencil; ORDERS], fairness: &Fairness) -> [Stencil; ORDERS] {
    std::array::from_fn(|b| {
        std::array::from_fn(|t| {
            (0..ORDERS - b).map(|a| BINOMIAL[a + b][a] * fairness.weights[a + b] * grams[a][t]).sum()
        })
    })
}

/// The rows along the last axis that a block's members need, as bits per place along the second of three axes. In the plane there
/// is one place along the first.
#[derive(Clone, Copy, Default)]
struct Wanted {
    /// Of the result.
    result: [u8; SIDE],
    /// Of what the second axis is done with.
    planes: [u8; HALO],
    /// Of the halo.
    lines: [u16; HALO],
}

impl Wanted {
    fn new<const D: usize>(rows: &[u8; SIDE]) -> Self {
        let mut wanted = Self { result: *rows, ..Self::default() };
        let reach = if D == 3 { 2 * REACH } else { 0 };
        for (x, rows) in rows.iter().enumerate() {
            wanted.planes[x..=x + reach].iter_mut().for_each(|plane| *plane |= rows);
        }
        for (lines, plane) in wanted.lines.iter_mut().zip(wanted.planes) {
            *lines = (0..=2 * REACH).fold(0, |lines, y| lines | u16::from(plane) << y);
        }
        wanted
    }

    fn lines<const D: usize>(&self) -> &[u16] {
        if D == 3 { &self.lines } else { &self.lines[..1] }
    }
}

/// What one task needs.
struct Buffers {
    wanted: Wanted,
    halo: Vec<f64>,
    /// `E_k` over the last axis, one after the other.
    lines: Vec<f64>,
    /// `E_k` over the last two axes.
    planes: Vec<f64>,
    result: Vec<f64>,
}

impl Buffers {
    fn new<const D: usize>() -> Self {
        let halo = HALO.pow(D as u32);
        Self {
            wanted: Wanted::default(),
            halo: vec![0.0; halo],
            lines: vec![0.0; ORDERS * halo / HALO * SIDE],
            planes: vec![0.0; if D == 3 { ORDERS * HALO * SIDE * SIDE } else { 0 }],
            result: vec![0.0; IndexSet::<D>::BLOCK],
        }
    }
}

/// One block, for energies of orders below `N`.
struct Block<'a, const D: usize, const N: usize> {
    energy: &'a BandEnergy<D>,
    buffers: &'a mut Buffers,
}

impl<const D: usize, const N: usize> WithSimd for Block<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { energy, buffers } = self;
        let Buffers { wanted, halo, lines, planes, result } = buffers;
        along_last::<S, N>(simd, &energy.grams[D - 1], wanted.lines::<D>(), halo, lines);
        if D == 3 {
            across::<S, N>(simd, &energy.grams[1], &wanted.planes, lines, planes);
            for (x, rows) in wanted.result.iter().enumerate() {
                let first = x * SIDE * SIDE;
                along_first::<S, N, { SIDE * SIDE }>(simd, &energy.last, *rows, first, planes, result);
            }
        } else {
            along_first::<S, N, SIDE>(simd, &energy.last, wanted.result[0], 0, lines, result);
        }
    }
}

/// Stencils with their entries in all lanes.
#[inline(always)]
fn splat<S: Simd>(simd: S, stencils: &[Stencil; ORDERS], factors: [f64; ORDERS]) -> [[S::f64s; REACH + 1]; ORDERS] {
    let mut out = [[simd.splat_f64s(0.0); REACH + 1]; ORDERS];
    for k in 0..ORDERS {
        for t in 0..=REACH {
            out[k][t] = simd.splat_f64s(factors[k] * stencils[k][t]);
        }
    }
    out
}

/// The middle of seven numbers, and the sums of those that a symmetric stencil treats alike: numbers `step` registers apart, the first
/// at `place`.
#[inline(always)]
fn pairs<S: Simd>(simd: S, numbers: &[S::f64s], place: usize, step: usize) -> [S::f64s; REACH + 1] {
    let middle = place + REACH * step;
    let mut pairs = [numbers[middle]; REACH + 1];
    for t in 1..=REACH {
        pairs[t] = simd.add_f64s(numbers[middle - t * step], numbers[middle + t * step]);
    }
    pairs
}

/// The same of numbers that follow each other: lanes are adjacent too.
#[inline(always)]
fn adjacent_pairs<S: Simd>(simd: S, line: &[f64], v: usize) -> [S::f64s; REACH + 1] {
    let mut pairs = [registers::<S>(&line[REACH..REACH + SIDE])[v]; REACH + 1];
    for t in 1..=REACH {
        let (before, after) = (&line[REACH - t..REACH - t + SIDE], &line[REACH + t..REACH + t + SIDE]);
        pairs[t] = simd.add_f64s(registers::<S>(before)[v], registers::<S>(after)[v]);
    }
    pairs
}

#[inline(always)]
fn weighted<S: Simd>(simd: S, stencil: &[S::f64s; REACH + 1], pairs: &[S::f64s; REACH + 1]) -> S::f64s {
    let near = simd.add_f64s(simd.mul_f64s(stencil[0], pairs[0]), simd.mul_f64s(stencil[1], pairs[1]));
    let far = simd.add_f64s(simd.mul_f64s(stencil[2], pairs[2]), simd.mul_f64s(stencil[3], pairs[3]));
    simd.add_f64s(near, far)
}

#[inline(always)]
fn registers<S: Simd>(numbers: &[f64]) -> &[S::f64s] {
    S::as_simd_f64s(numbers).0
}

/// `E_k = G_k x` of every line that is wanted.
#[inline(always)]
fn along_last<S: Simd, const N: usize>(
    simd: S,
    grams: &[Stencil; ORDERS],
    wanted: &[u16],
    halo: &[f64],
    lines: &mut [f64],
) {
    let grams = splat(simd, grams, [1.0; ORDERS]);
    let level = halo.len() / HALO * SIDE;
    for (x, wanted) in wanted.iter().enumerate() {
        for y in Bits(*wanted) {
            let index = x * HALO + y;
            let line = &halo[index * HALO..][..HALO];
            for v in 0..SIDE / S::F64_LANES {
                let pairs = adjacent_pairs(simd, line, v);
                for k in 0..N {
                    let out = S::as_mut_simd_f64s(&mut lines[k * level + index * SIDE..][..SIDE]).0;
                    out[v] = weighted(simd, &grams[k], &pairs);
                }
            }
        }
    }
}

/// `E_k ← Σ_a (k over a) G_a E_{k−a}` along the second axis, for the rows that are wanted, plane by plane.
#[inline(always)]
fn across<S: Simd, const N: usize>(
    simd: S,
    grams: &[Stencil; ORDERS],
    wanted: &[u8; HALO],
    lines: &[f64],
    planes: &mut [f64],
) {
    // By the order of the source, then by that of the stencil.
    let mut factors = [[[simd.splat_f64s(0.0); REACH + 1]; ORDERS]; ORDERS];
    for b in 0..N {
        let mut binomials = [0.0; ORDERS];
        for a in 0..N - b {
            binomials[a] = BINOMIAL[a + b][a];
        }
        factors[b] = splat(simd, grams, binomials);
    }
    let step = SIDE / S::F64_LANES;
    for (x, wanted) in wanted.iter().enumerate() {
        let mut sources: [&[S::f64s]; N] = [&[]; N];
        for b in 0..N {
            sources[b] = registers::<S>(&lines[(b * HALO + x) * HALO * SIDE..][..HALO * SIDE]);
        }
        for y in Bits(u16::from(*wanted)) {
            for place in y * step..(y + 1) * step {
                let mut sums = [simd.splat_f64s(0.0); N];
                for b in 0..N {
                    let pairs = pairs(simd, sources[b], place, step);
                    for a in 0..N - b {
                        sums[a + b] = simd.add_f64s(sums[a + b], weighted(simd, &factors[b][a], &pairs));
                    }
                }
                for k in 0..N {
                    let out = S::as_mut_simd_f64s(&mut planes[(k * HALO + x) * SIDE * SIDE..][..SIDE * SIDE]).0;
                    out[place] = sums[k];
                }
            }
        }
    }
}

/// The first axis, for the rows that are wanted of those that begin `first` numbers into the result: one stencil for each order,
/// planes of `W` numbers.
#[inline(always)]
fn along_first<S: Simd, const N: usize, const W: usize>(
    simd: S,
    last: &[Stencil; ORDERS],
    wanted: u8,
    first: usize,
    input: &[f64],
    result: &mut [f64],
) {
    let stencils = splat(simd, last, [1.0; ORDERS]);
    let (step, row) = (W / S::F64_LANES, SIDE / S::F64_LANES);
    let mut sources: [&[S::f64s]; N] = [&[]; N];
    for b in 0..N {
        sources[b] = registers::<S>(&input[b * HALO * W..][..HALO * W]);
    }
    let out = S::as_mut_simd_f64s(&mut result[..SIDE * W]).0;
    for y in Bits(u16::from(wanted)) {
        let begin = first / S::F64_LANES + y * row;
        for place in begin..begin + row {
            let mut sum = simd.splat_f64s(0.0);
            for b in 0..N {
                sum = simd.add_f64s(sum, weighted(simd, &stencils[b], &pairs(simd, sources[b], place, step)));
            }
            out[place] = sum;
        }
    }
}
