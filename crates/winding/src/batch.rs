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

    // No closures and no adaptors of the standard library: those are not inlined for sure, and a function of its own is
    // compiled for the oldest processor, with a call for every operation.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f64; BATCH] {
        let mut sums = [0.0; BATCH];
        let mut queries: [&[S::f64s]; D] = [&[]; D];
        for axis in 0..D {
            queries[axis] = S::as_simd_f64s(&self.queries[axis][..self.count]).0;
        }
        let out = S::as_mut_simd_f64s(&mut sums[..self.count]).0;
        let regular = simd.splat_f64s(self.regular);
        let one = simd.splat_f64s(1.0);
        for (centre, field) in self.far {
            let centre = splat(simd, centre);
            for v in 0..out.len() {
                let (mut r, square) = away(simd, &centre, &queries, v, regular);
                let inverse = simd.div_f64s(one, square);
                for r in &mut r {
                    *r = simd.mul_f64s(*r, inverse);
                }
                let mut value = polynomials(simd, field, &r, inverse);
                if D == 3 {
                    value = simd.mul_f64s(value, simd.sqrt_f64s(inverse));
                }
                out[v] = simd.add_f64s(out[v], value);
            }
        }
        for run in self.near {
            for [point, area] in *run {
                let (point, area) = (splat(simd, point), splat(simd, area));
                for v in 0..out.len() {
                    let (r, square) = away(simd, &point, &queries, v, regular);
                    let mut flux = simd.mul_f64s(area[0], r[0]);
                    for k in 1..D {
                        flux = simd.add_f64s(flux, simd.mul_f64s(area[k], r[k]));
                    }
                    let power = if D == 2 { square } else { simd.mul_f64s(square, simd.sqrt_f64s(square)) };
                    out[v] = simd.add_f64s(out[v], simd.div_f64s(flux, power));
                }
            }
        }
        sums
    }
}

/// The same numbers in all lanes.
#[inline(always)]
fn splat<S: Simd, const D: usize>(simd: S, x: &[f64; D]) -> [S::f64s; D] {
    let mut out = [simd.splat_f64s(0.0); D];
    for k in 0..D {
        out[k] = simd.splat_f64s(x[k]);
    }
    out
}

/// From the queries of register `v` to a place, and the square of that with ε².
#[inline(always)]
fn away<S: Simd, const D: usize>(
    simd: S,
    place: &[S::f64s; D],
    queries: &[&[S::f64s]; D],
    v: usize,
    regular: S::f64s,
) -> ([S::f64s; D], S::f64s) {
    let mut r = *place;
    let mut square = regular;
    for k in 0..D {
        r[k] = simd.sub_f64s(r[k], queries[k][v]);
        square = simd.add_f64s(square, simd.mul_f64s(r[k], r[k]));
    }
    (r, simd.max_f64s(square, simd.splat_f64s(SMALLEST_SQUARE)))
}

/// `A(v) + q⁻¹ (B(v) + q⁻¹ C)`, A of degree four, B of degree two.
#[inline(always)]
fn polynomials<S: Simd, const D: usize>(simd: S, field: &[f64], v: &[S::f64s; D], inverse: S::f64s) -> S::f64s {
    const { assert!(ORDER == 4) }
    if D == 2 {
        #[expect(clippy::expect_used, reason = "the tables have so many coefficients for D axes")]
        let field: &[f64; 22] = field.first_chunk().expect("the length is that of the tables");
        let a = in_two::<S, 4>(simd, &field[..15], v[0], v[1]);
        let b = in_two::<S, 2>(simd, &field[15..21], v[0], v[1]);
        nest(simd, a, inverse, nest(simd, b, inverse, simd.splat_f64s(field[21])))
    } else {
        #[expect(clippy::expect_used, reason = "the tables have so many coefficients for D axes")]
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
