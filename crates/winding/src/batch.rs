//! The sums of a batch of queries that share one list of boxes and points: vector registers run over the queries.

use pulp::{Simd, WithSimd};

use crate::direct_sum::SMALLEST_SQUARE;
use crate::multi_index::ORDER;
use crate::multipole::Source;

/// The most queries of a batch, whole vector registers of any processor.
pub(crate) const BATCH: usize = 32;

/// Queries by axis, and what they interact with.
pub(crate) struct Batch<'a, const D: usize> {
    /// A multiple of eight, at most [`BATCH`].
    pub count: usize,
    pub queries: &'a [[f64; BATCH]; D],
    /// ε².
    pub regular: f64,
    /// Centres and polynomials of far boxes.
    pub far: &'a [([f64; D], &'a [f64])],
    /// Runs of near points.
    pub near: &'a [&'a [Source<D>]],
}

impl<const D: usize> WithSimd for Batch<'_, D> {
    /// W times the area of the unit sphere.
    type Output = [f64; BATCH];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; BATCH] {
        let mut sums = [0.0; BATCH];
        let queries: [&[S::f64s]; D] = self.queries.each_ref().map(|q| S::as_simd_f64s(&q[..self.count]).0);
        let out = S::as_mut_simd_f64s(&mut sums[..self.count]).0;
        let regular = simd.splat_f64s(self.regular);
        let (one, smallest) = (simd.splat_f64s(1.0), simd.splat_f64s(SMALLEST_SQUARE));
        let away = |from: &[S::f64s; D], v: usize| {
            let r: [S::f64s; D] = std::array::from_fn(|k| simd.sub_f64s(from[k], queries[k][v]));
            let square = r.iter().fold(regular, |sum, &r| simd.add_f64s(sum, simd.mul_f64s(r, r)));
            (r, simd.max_f64s(square, smallest))
        };
        for (centre, field) in self.far {
            let centre = centre.map(|c| simd.splat_f64s(c));
            for v in 0..out.len() {
                let (r, square) = away(&centre, v);
                let inverse = simd.div_f64s(one, square);
                let direction = r.map(|r| simd.mul_f64s(r, inverse));
                let mut value = polynomials(simd, field, &direction, inverse);
                if D == 3 {
                    value = simd.mul_f64s(value, simd.sqrt_f64s(inverse));
                }
                out[v] = simd.add_f64s(out[v], value);
            }
        }
        for [point, area] in self.near.iter().copied().flatten() {
            let (point, area) = (point.map(|c| simd.splat_f64s(c)), area.map(|c| simd.splat_f64s(c)));
            for v in 0..out.len() {
                let (r, square) = away(&point, v);
                let mut flux = simd.mul_f64s(area[0], r[0]);
                for k in 1..D {
                    flux = simd.add_f64s(flux, simd.mul_f64s(area[k], r[k]));
                }
                let power = if D == 2 { square } else { simd.mul_f64s(square, simd.sqrt_f64s(square)) };
                out[v] = simd.add_f64s(out[v], simd.div_f64s(flux, power));
            }
        }
        sums
    }
}

/// `A(v) + q⁻¹ (B(v) + q⁻¹ C)`, A of degree four, B of degree two.
#[inline(always)]
fn polynomials<S: Simd, const D: usize>(simd: S, field: &[f64], v: &[S::f64s; D], inverse: S::f64s) -> S::f64s {
    const { assert!(ORDER == 4) }
    if D == 2 {
        let field: &[f64; 22] = field.first_chunk().expect("the length is that of the tables");
        let a = in_two::<S, 4>(simd, &field[..15], v[0], v[1]);
        let b = in_two::<S, 2>(simd, &field[15..21], v[0], v[1]);
        nest(simd, a, inverse, nest(simd, b, inverse, simd.splat_f64s(field[21])))
    } else {
        let field: &[f64; 46] = field.first_chunk().expect("the length is that of the tables");
        let [x, y, z] = [v[0], v[1], v[D - 1]];
        let mut a = simd.splat_f64s(field[0]);
        a = nest(simd, in_two::<S, 1>(simd, &field[1..4], y, z), x, a);
        a = nest(simd, in_two::<S, 2>(simd, &field[4..10], y, z), x, a);
        a = nest(simd, in_two::<S, 3>(simd, &field[10..20], y, z), x, a);
        a = nest(simd, in_two::<S, 4>(simd, &field[20..35], y, z), x, a);
        let mut b = simd.splat_f64s(field[35]);
        b = nest(simd, in_two::<S, 1>(simd, &field[36..39], y, z), x, b);
        b = nest(simd, in_two::<S, 2>(simd, &field[39..45], y, z), x, b);
        nest(simd, a, inverse, nest(simd, b, inverse, simd.splat_f64s(field[45])))
    }
}

/// `sum + x · inner`, by two roundings on every processor.
#[inline(always)]
fn nest<S: Simd>(simd: S, sum: S::f64s, x: S::f64s, inner: S::f64s) -> S::f64s {
    simd.add_f64s(sum, simd.mul_f64s(x, inner))
}

/// The polynomial of degree `N` in two variables by nested Horner schemes.
#[inline(always)]
fn in_two<S: Simd, const N: usize>(simd: S, c: &[f64], y: S::f64s, z: S::f64s) -> S::f64s {
    let mut value = simd.splat_f64s(c[0]);
    let mut next = 1;
    for degree in 1..=N {
        let mut row = simd.splat_f64s(c[next]);
        for k in 1..=degree {
            row = nest(simd, simd.splat_f64s(c[next + k]), z, row);
        }
        value = nest(simd, row, y, value);
        next += degree + 1;
    }
    value
}
