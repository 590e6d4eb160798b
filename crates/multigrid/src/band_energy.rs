//! Fairness on a band level: a constant stencil, block by block.

use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;
use zeroset_bspline::{BlockField, IndexSet};

use crate::band_tasks::BandTasks;

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
}

impl<const D: usize> BandEnergy<D> {
    /// The energy on active functions whose cells have the given sides.
    pub fn new(active: Arc<IndexSet<D>>, sides: [f64; D], fairness: Fairness) -> Self {
        let tasks = Arc::new(BandTasks::new(&active));
        let grams = sides.map(grams);
        Self { active, tasks, grams, fairness, last: last(&grams[0], &fairness) }
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
        self.tasks.for_each(&self.active, out, Buffers::new::<D>, |buffers, slot, out| {
            let first = self.active.block_start(slot).map(|k| i64::from(k) - REACH as i64);
            f.gather(first, HALO, &mut buffers.halo);
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

/// What one task needs.
struct Buffers {
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
    fn with_simd<S: Simd>(self, _: S) {
        let Self { energy, buffers } = self;
        let Buffers { halo, lines, planes, result } = buffers;
        along_last::<N>(&energy.grams[D - 1], halo, lines);
        if D == 3 {
            across::<N>(&energy.grams[1], lines, planes);
            along_first::<N, { SIDE * SIDE }>(&energy.last, planes, result);
        } else {
            along_first::<N, SIDE>(&energy.last, lines, result);
        }
    }
}

type Line = [f64; SIDE];

/// `E_k = G_k x` of every line.
#[inline(always)]
fn along_last<const N: usize>(grams: &[Stencil; ORDERS], halo: &[f64], lines: &mut [f64]) {
    let count = halo.len() / HALO;
    for (index, x) in halo.as_chunks::<HALO>().0.iter().enumerate() {
        let mut sums = [[0.0; SIDE]; N];
        for e in 0..SIDE {
            let pairs = [x[e + 3], x[e + 2] + x[e + 4], x[e + 1] + x[e + 5], x[e] + x[e + 6]];
            for k in 0..N {
                sums[k][e] = (grams[k][0] * pairs[0] + grams[k][1] * pairs[1])
                    + (grams[k][2] * pairs[2] + grams[k][3] * pairs[3]);
            }
        }
        for k in 0..N {
            lines[(k * count + index) * SIDE..][..SIDE].copy_from_slice(&sums[k]);
        }
    }
}

/// `E_k ← Σ_a (k over a) G_a E_{k−a}` along the second axis, plane by plane.
#[inline(always)]
fn across<const N: usize>(grams: &[Stencil; ORDERS], lines: &[f64], planes: &mut [f64]) {
    let (lines, planes) = (lines.as_chunks::<SIDE>().0, planes.as_chunks_mut::<SIDE>().0);
    for x in 0..HALO {
        for y in 0..SIDE {
            let mut sums = [[0.0; SIDE]; N];
            for b in 0..N {
                let row = |t: usize| &lines[(b * HALO + x) * HALO + y + t];
                let pairs = pairs(row);
                for a in 0..N - b {
                    for t in 0..=REACH {
                        let factor = BINOMIAL[a + b][a] * grams[a][t];
                        for e in 0..SIDE {
                            sums[a + b][e] += factor * pairs[t][e];
                        }
                    }
                }
            }
            for k in 0..N {
                planes[(k * HALO + x) * SIDE + y] = sums[k];
            }
        }
    }
}

#[inline(always)]
fn pairs<'l>(row: impl Fn(usize) -> &'l Line) -> [Line; REACH + 1] {
    std::array::from_fn(|t| {
        if t == 0 {
            *row(REACH)
        } else {
            let (before, after) = (row(REACH - t), row(REACH + t));
            std::array::from_fn(|e| before[e] + after[e])
        }
    })
}

/// The first axis: one stencil for each order, rows of `W` numbers.
#[inline(always)]
fn along_first<const N: usize, const W: usize>(last: &[Stencil; ORDERS], input: &[f64], result: &mut [f64]) {
    let input = input.as_chunks::<SIDE>().0;
    let lines = W / SIDE;
    for (at, out) in result.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
        let mut sum = [0.0; SIDE];
        for b in 0..N {
            let row = |t: usize| &input[b * HALO * lines + at + t * lines];
            let pairs = pairs(row);
            for t in 0..=REACH {
                for e in 0..SIDE {
                    sum[e] += last[b][t] * pairs[t][e];
                }
            }
        }
        *out = sum;
    }
}
