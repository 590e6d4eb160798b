//! Smoothing: Chebyshev polynomials in the filtered Jacobi preconditioner times the operator.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::cholesky::FactorError;
use crate::normal_operator::NormalOperator;
use crate::scratch::Scratch;
use crate::spectrum::largest_eigenvalue;
use crate::stiff_points::{StiffCorrection, StiffPoints};
use crate::vectors::add_scaled;

/// Steps to estimate the largest eigenvalue, from which the smoothing starts.
const LANCZOS: usize = 10;

/// How much of its neighbours a coefficient loses along each axis.
const FILTER: f64 = 0.28;

/// Degree of the polynomial, which is the number of steps before and after the coarse correction.
const DEGREE: usize = 2;

/// The polynomial damps eigenvalues from the largest down to this share of it.
const LOWER: f64 = 1.0 / 16.0;

/// Below this many coefficients tasks are not worth their overhead.
const FEW: usize = 1 << 15;

/// `B = D^-½ (F ⊗ F [⊗ F]) D^-½` with the diagonal `D` of `A` and `F = tridiag(−a, 1, −a)`, and Chebyshev steps with it.
///
/// `D` and `B` are those of `A` without its [stiff points](StiffPoints), which are then added to `B⁻¹` as they are.
///
/// With `F = 1` this is Chebyshev–Jacobi. But the mass matrices in `H` make functions that oscillate along several axes
/// nearly as cheap as smooth ones (by a factor of 38 for cubics in 3D), out of reach for the coarse lattice and for Jacobi's
/// method alike. `F` raises them.
#[derive(Debug)]
pub(crate) struct Smoother<const D: usize> {
    shape: [usize; D],
    /// `D^-½`.
    scale: Vec<f64>,
    largest: f64,
    /// What `B` becomes by the points that are stiff.
    stiff: Option<StiffCorrection>,
    partial: Scratch<Vec<f64>>,
    corrected: Scratch<[Vec<f64>; 2]>,
}

/// Vectors of one level.
#[derive(Debug, Clone, Default)]
pub(crate) struct Vectors {
    /// The correction so far.
    pub(crate) x: Vec<f64>,
    /// What is left of the right side.
    pub(crate) residual: Vec<f64>,
    direction: Vec<f64>,
    applied: Vec<f64>,
}

impl Vectors {
    pub(crate) fn new(size: usize) -> Self {
        let zeros = vec![0.0; size];
        Self { x: zeros.clone(), residual: zeros.clone(), direction: zeros.clone(), applied: zeros }
    }

    /// Adds a correction, given in `direction`, and takes its image from the residual.
    pub(crate) fn correct<const D: usize>(
        &mut self,
        operator: &NormalOperator<D>,
        correction: impl FnOnce(&mut [f64]),
    ) {
        correction(&mut self.direction);
        add_scaled(&mut self.x, 1.0, &self.direction);
        self.reduce(operator);
    }

    fn reduce<const D: usize>(&mut self, operator: &NormalOperator<D>) {
        operator.apply(&self.direction, &mut self.applied);
        add_scaled(&mut self.residual, -1.0, &self.applied);
    }
}

impl<const D: usize> Smoother<D> {
    /// # Errors
    /// If memory does not suffice.
    pub(crate) fn new(shape: [usize; D], operator: &NormalOperator<D>) -> Result<Self, FactorError> {
        let energy = operator.energy_diagonal();
        let points = StiffPoints::new(operator.points(), operator.diagonal(), &energy);
        let diagonal = points.taken_from(operator.diagonal(), &energy);
        let scale: Vec<f64> = diagonal.iter().map(|d| 1.0 / d.sqrt()).collect();
        let mut three = [1; 3];
        three[3 - D..].copy_from_slice(&shape);
        let stiff = points.beside(three, &scale, FILTER)?;
        let mut smoother =
            Self { shape, scale, largest: 1.0, stiff, partial: Scratch::new(), corrected: Scratch::new() };
        let inverse = |r: &[f64], z: &mut [f64]| smoother.direction(r, 0.0, 1.0, z, None);
        smoother.largest = largest_eigenvalue(LANCZOS, operator.diagonal(), |x, y| operator.apply(x, y), inverse);
        Ok(smoother)
    }

    /// Chebyshev steps on `A x = b`, from `x` and the residual that belongs to it (Saad 2003, algorithm 12.1). The residual
    /// is brought up to date after the last step only if it `is_needed`.
    pub(crate) fn smooth(&self, operator: &NormalOperator<D>, v: &mut Vectors, is_needed: bool) {
        let (upper, lower) = (self.largest, LOWER * self.largest);
        let (middle, half) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        let ratio = middle / half;
        let mut rho = 1.0 / ratio;
        self.direction(&v.residual, 0.0, 1.0 / middle, &mut v.direction, Some(&mut v.x));
        for _ in 1..DEGREE {
            v.reduce(operator);
            let next = 1.0 / (2.0 * ratio - rho);
            self.direction(&v.residual, next * rho, 2.0 * next / half, &mut v.direction, Some(&mut v.x));
            rho = next;
        }
        if is_needed {
            v.reduce(operator);
        }
    }

    /// `d ← α d + β B r`, and `x ← x + d`.
    fn direction(&self, r: &[f64], alpha: f64, beta: f64, d: &mut [f64], x: Option<&mut [f64]>) {
        let Some(stiff) = &self.stiff else { return self.filtered(r, alpha, beta, d, x) };
        let new = || [vec![0.0; r.len()], vec![0.0; r.len()]];
        self.corrected.with(new, |[z, corrected]| {
            self.filtered(r, 0.0, 1.0, z, None);
            corrected.copy_from_slice(r);
            stiff.correct(z, corrected);
            self.filtered(corrected, alpha, beta, d, x);
        });
    }

    /// The same without what stiff points change.
    fn filtered(&self, r: &[f64], alpha: f64, beta: f64, d: &mut [f64], x: Option<&mut [f64]>) {
        let plane: usize = self.shape[1..].iter().product();
        let (last, few, chunk) = (self.shape[D - 1], r.len() < FEW, 4 * plane);
        let within = |buffer: &mut Vec<f64>, (out, (r, scale)): (&mut [f64], (&[f64], &[f64]))| {
            Arch::new().dispatch(Within { r, scale, last, plane, deep: D == 3, out, buffer });
        };
        self.partial.with(
            || vec![0.0; r.len()],
            |partial| {
                if few {
                    within(&mut vec![0.0; plane], (partial, (r, &self.scale)));
                } else {
                    let input = r.par_chunks(chunk).zip(self.scale.par_chunks(chunk));
                    partial.par_chunks_mut(chunk).zip(input).for_each_init(|| vec![0.0; plane], within);
                }
                let across = |first: usize, d: &mut [f64], x: Option<&mut [f64]>| {
                    let scale = &self.scale[first..first + d.len()];
                    Arch::new().dispatch(Across { partial, scale, first: first / plane, plane, alpha, beta, d, x });
                };
                match x {
                    x if few => across(0, d, x),
                    Some(x) => d
                        .par_chunks_mut(chunk)
                        .zip(x.par_chunks_mut(chunk))
                        .enumerate()
                        .for_each(|(index, (d, x))| across(index * chunk, d, Some(x))),
                    None => d.par_chunks_mut(chunk).enumerate().for_each(|(index, d)| across(index * chunk, d, None)),
                }
            },
        );
    }
}

/// `D^-½`, then `F` along all axes but the first, for some planes.
struct Within<'a> {
    r: &'a [f64],
    scale: &'a [f64],
    last: usize,
    plane: usize,
    deep: bool,
    out: &'a mut [f64],
    buffer: &'a mut [f64],
}

impl WithSimd for Within<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { r, scale, last, plane, deep, out, buffer } = self;
        let planes = r.chunks_exact(plane).zip(scale.chunks_exact(plane));
        for ((r, scale), out) in planes.zip(out.chunks_exact_mut(plane)) {
            for (o, (r, s)) in out.iter_mut().zip(r.iter().zip(scale)) {
                *o = r * s;
            }
            filter(out, last, 1, buffer);
            if deep {
                filter(buffer, plane, last, out);
            } else {
                out.copy_from_slice(buffer);
            }
        }
    }
}

/// `F` along an axis of `input`, whose lines have `length` numbers at a distance of `stride`.
#[inline(always)]
fn filter(input: &[f64], length: usize, stride: usize, out: &mut [f64]) {
    for (x, out) in input.chunks_exact(length).zip(out.chunks_exact_mut(length)) {
        if length <= stride {
            out.copy_from_slice(x);
            continue;
        }
        for (o, (x, next)) in out.iter_mut().zip(x.iter().zip(&x[stride..])).take(stride) {
            *o = x - FILTER * next;
        }
        let end = length - stride;
        if end > stride {
            let inner = out[stride..end].iter_mut().zip(&x[stride..end]);
            for ((o, x), (before, after)) in inner.zip(x[..end - stride].iter().zip(&x[2 * stride..])) {
                *o = x - FILTER * (before + after);
            }
        }
        for (o, (x, before)) in out[end..].iter_mut().zip(x[end..].iter().zip(&x[end - stride..])) {
            *o = x - FILTER * before;
        }
    }
}

/// `F` along the first axis, `D^-½`, and the new direction, for some planes.
struct Across<'a> {
    partial: &'a [f64],
    scale: &'a [f64],
    first: usize,
    plane: usize,
    alpha: f64,
    beta: f64,
    d: &'a mut [f64],
    x: Option<&'a mut [f64]>,
}

impl WithSimd for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { partial, scale, first, plane, alpha, beta, d, x } = self;
        let planes = partial.len() / plane;
        let layer = |i: usize| &partial[i * plane..(i + 1) * plane];
        for ((i, d), scale) in (first..).zip(d.chunks_exact_mut(plane)).zip(scale.chunks_exact(plane)) {
            let here = layer(i);
            // A plane that does not exist takes part with nothing.
            let (before, lower) = if i > 0 { (layer(i - 1), FILTER) } else { (here, 0.0) };
            let (after, upper) = if i + 1 < planes { (layer(i + 1), FILTER) } else { (here, 0.0) };
            let values = here.iter().zip(before.iter().zip(after)).zip(scale);
            if alpha == 0.0 {
                // Whatever is in `d` must not be multiplied: it may not be a number.
                for (d, ((h, (b, a)), s)) in d.iter_mut().zip(values) {
                    *d = beta * s * (h - (lower * b + upper * a));
                }
            } else {
                for (d, ((h, (b, a)), s)) in d.iter_mut().zip(values) {
                    *d = alpha * *d + beta * s * (h - (lower * b + upper * a));
                }
            }
        }
        if let Some(x) = x {
            for (x, d) in x.iter_mut().zip(d) {
                *x += *d;
            }
        }
    }
}
