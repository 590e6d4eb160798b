//! The thin-plate energy applied without allocation, in blocks of eight numbers.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::sync::Arc;
use zeroset_bspline::DerivativeEnergy;

use crate::energy_kernel::{AxisStencils, BLOCK, Entry, Stack, along_line, sweep};
use crate::scratch::Scratch;

/// `w H` for the thin-plate energy, as [`DerivativeEnergy::apply`] but without allocating and several times faster.
///
/// Along the last axis lines are padded to whole blocks; with `E₀ = M`, `E₁ = K`, `E₂ = S` there, each further axis makes
/// `E₀ ← M E₀`, `E₁ ← K E₀ + M E₁`, `E₂ ← S E₀ + 2 K E₁ + M E₂`.
#[derive(Debug)]
pub(crate) struct SeparableEnergy<const D: usize> {
    shape: [usize; D],
    half: usize,
    axes: Arc<[AxisStencils; D]>,
    weight: f64,
    /// Length of a padded line, and of a plane of them.
    line: usize,
    plane: usize,
    partial: Scratch<Vec<f64>>,
}

/// Below this many coefficients tasks are not worth their overhead.
const FEW: usize = 1 << 14;

impl<const D: usize> SeparableEnergy<D> {
    /// `energy` must be of order two.
    pub(crate) fn new(energy: &DerivativeEnergy<D>, weight: f64) -> Self {
        let shape = energy.shape();
        let half = (0..D).map(|axis| energy.gram(axis, 0).half_bandwidth()).max().unwrap_or(0);
        let line = shape[D - 1].next_multiple_of(BLOCK);
        let plane = line * shape[1..D - 1].iter().product::<usize>();
        let axes = std::array::from_fn(|axis| AxisStencils::new(energy, axis, half));
        Self { shape, half, axes: Arc::new(axes), weight, line, plane, partial: Scratch::new() }
    }

    /// The same with another weight.
    pub(crate) fn reweighted(&self, weight: f64) -> Self {
        Self { axes: Arc::clone(&self.axes), weight, partial: Scratch::new(), ..*self }
    }

    /// The diagonal of `w H`.
    pub(crate) fn diagonal(&self) -> Vec<f64> {
        let mut products = vec![[self.weight, 0.0, 0.0]];
        for (axis, stencils) in self.axes.iter().enumerate() {
            let entries: Vec<Entry> = (0..self.shape[axis]).map(|row| stencils.diagonal(row)).collect();
            let next = |[e0, e1, e2]: &Entry| {
                let extend = |[m, k, s]: &Entry| [m * e0, k * e0 + m * e1, s * e0 + 2.0 * k * e1 + m * e2];
                entries.iter().map(extend).collect::<Vec<_>>()
            };
            let further = products.iter().flat_map(next);
            products = further.collect();
        }
        products.into_iter().map(|[_, _, e2]| e2).collect()
    }

    /// Whether one thread does better alone.
    pub(crate) fn is_small(&self) -> bool {
        self.shape.iter().product::<usize>() < FEW
    }

    /// `out = w H x`.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        let planes = self.shape[0];
        let inner = out.len() / planes;
        let each = FEW / 4 / inner + 1;
        let within_buffer = || vec![0.0; 3 * self.plane + self.line + 2 * self.half];
        let within = |buffer: &mut Vec<f64>, (partial, x): (&mut [f64], &[f64])| {
            Arch::new().dispatch(Within { energy: self, partial, x, buffer });
        };
        let across_buffer = || vec![0.0; self.plane];
        self.partial.with(
            || vec![0.0; 3 * planes * self.plane],
            |partial| {
                if self.is_small() {
                    within(&mut within_buffer(), (partial, x));
                } else {
                    let partial = partial.par_chunks_mut(3 * self.plane * each);
                    partial.zip(x.par_chunks(inner * each)).for_each_init(within_buffer, within);
                }
                let across = |buffer: &mut Vec<f64>, (chunk, out): (usize, &mut [f64])| {
                    Arch::new().dispatch(Across { energy: self, partial, first: chunk * each, out, buffer });
                };
                if self.is_small() {
                    across(&mut across_buffer(), (0, out));
                } else {
                    out.par_chunks_mut(inner * each).enumerate().for_each_init(across_buffer, across);
                }
            },
        );
    }
}

/// All axes but the first, for some planes.
struct Within<'a, const D: usize> {
    energy: &'a SeparableEnergy<D>,
    partial: &'a mut [f64],
    x: &'a [f64],
    buffer: &'a mut [f64],
}

impl<const D: usize> Within<'_, D> {
    #[inline(always)]
    fn run<S: Simd, const P: usize, const T: usize>(self, simd: S) {
        let Self { energy, partial, x, buffer } = self;
        let (line, plane) = (energy.line, energy.plane);
        let inner: usize = energy.shape[1..].iter().product();
        let (lines, padded) = buffer.split_at_mut(3 * plane);
        for (out, x) in partial.chunks_exact_mut(3 * plane).zip(x.chunks_exact(inner)) {
            let target = if D == 3 { &mut *lines } else { &mut *out };
            let (e0, rest) = target.split_at_mut(plane);
            let (e1, e2) = rest.split_at_mut(plane);
            for (((x, e0), e1), e2) in x
                .chunks_exact(energy.shape[D - 1])
                .zip(e0.chunks_exact_mut(line))
                .zip(e1.chunks_exact_mut(line))
                .zip(e2.chunks_exact_mut(line))
            {
                padded[P..P + x.len()].copy_from_slice(x);
                along_line::<S, P>(simd, &energy.axes[D - 1], padded, [e0, e1, e2]);
            }
            if D == 3 {
                let stack = Stack { data: lines, level: plane, row: line };
                sweep::<S, P, T, true>(simd, &energy.axes[1], stack, 0..energy.shape[1], line, out);
            }
        }
    }
}

impl<const D: usize> WithSimd for Within<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.energy.half {
            2 => self.run::<S, 2, 5>(simd),
            3 => self.run::<S, 3, 7>(simd),
            4 => self.run::<S, 4, 9>(simd),
            _ => self.run::<S, 5, 11>(simd),
        }
    }
}

/// The first axis, for some planes.
struct Across<'a, const D: usize> {
    energy: &'a SeparableEnergy<D>,
    partial: &'a [f64],
    first: usize,
    out: &'a mut [f64],
    buffer: &'a mut [f64],
}

impl<const D: usize> Across<'_, D> {
    #[inline(always)]
    fn run<S: Simd, const P: usize, const T: usize>(self, simd: S) {
        let Self { energy, partial, first, out, buffer } = self;
        let (line, plane) = (energy.line, energy.plane);
        let inner: usize = energy.shape[1..].iter().product();
        let stack = Stack { data: partial, level: plane, row: 3 * plane };
        for (row, out) in (first..).zip(out.chunks_exact_mut(inner)) {
            sweep::<S, P, T, false>(simd, &energy.axes[0], stack, row..row + 1, plane, buffer);
            for (out, h) in out.chunks_exact_mut(energy.shape[D - 1]).zip(buffer.chunks_exact(line)) {
                for (o, h) in out.iter_mut().zip(h) {
                    *o = energy.weight * h;
                }
            }
        }
    }
}

impl<const D: usize> WithSimd for Across<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.energy.half {
            2 => self.run::<S, 2, 5>(simd),
            3 => self.run::<S, 3, 7>(simd),
            4 => self.run::<S, 4, 9>(simd),
            _ => self.run::<S, 5, 11>(simd),
        }
    }
}
