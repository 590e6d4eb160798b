//! The thin-plate energy applied without allocation, in blocks of eight numbers.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use zeroset_bspline::DerivativeEnergy;

use crate::energy_kernel::{AxisStencils, BLOCK, Stack, along_line, sweep};
use crate::scratch::Scratch;

/// `w H` for the thin-plate energy, as [`DerivativeEnergy::apply`] but without allocating and several times faster.
///
/// Along the last axis lines are padded to whole blocks; with `E₀ = M`, `E₁ = K`, `E₂ = S` there, each further axis makes
/// `E₀ ← M E₀`, `E₁ ← K E₀ + M E₁`, `E₂ ← S E₀ + 2 K E₁ + M E₂`.
#[derive(Debug)]
pub(crate) struct SeparableEnergy<const D: usize> {
    shape: [usize; D],
    half: usize,
    axes: [AxisStencils; D],
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
        Self { shape, half, axes, weight, line, plane, partial: Scratch::new() }
    }

    /// `out = w H x`.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        let planes = self.shape[0];
        self.partial.with(
            || vec![0.0; 3 * planes * self.plane],
            |partial| {
                let partial = &mut partial[..];
                let inner = out.len() / planes;
                let each = if out.len() < FEW { planes } else { FEW / 4 / inner + 1 };
                partial.par_chunks_mut(3 * self.plane * each).zip(x.par_chunks(inner * each)).for_each_init(
                    || vec![0.0; 3 * self.plane + self.line + 2 * self.half],
                    |buffer, (partial, x)| Arch::new().dispatch(Within { energy: self, partial, x, buffer }),
                );
                out.par_chunks_mut(inner * each).enumerate().for_each_init(
                    || vec![0.0; self.plane],
                    |buffer, (chunk, out)| {
                        Arch::new().dispatch(Across { energy: self, partial, first: chunk * each, out, buffer });
                    },
                );
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
    fn run<const P: usize, const T: usize>(self) {
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
                along_line::<P>(&energy.axes[D - 1], padded, [e0, e1, e2]);
            }
            if D == 3 {
                let stack = Stack { data: lines, level: plane, row: line };
                sweep::<P, T, true>(&energy.axes[1], stack, 0..energy.shape[1], line, out);
            }
        }
    }
}

impl<const D: usize> WithSimd for Within<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        match self.energy.half {
            2 => self.run::<2, 5>(),
            3 => self.run::<3, 7>(),
            4 => self.run::<4, 9>(),
            _ => self.run::<5, 11>(),
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
    fn run<const P: usize, const T: usize>(self) {
        let Self { energy, partial, first, out, buffer } = self;
        let (line, plane) = (energy.line, energy.plane);
        let inner: usize = energy.shape[1..].iter().product();
        let stack = Stack { data: partial, level: plane, row: 3 * plane };
        for (row, out) in (first..).zip(out.chunks_exact_mut(inner)) {
            sweep::<P, T, false>(&energy.axes[0], stack, row..row + 1, plane, buffer);
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
    fn with_simd<S: Simd>(self, _: S) {
        match self.energy.half {
            2 => self.run::<2, 5>(),
            3 => self.run::<3, 7>(),
            4 => self.run::<4, 9>(),
            _ => self.run::<5, 11>(),
        }
    }
}
