//! The innermost loops over the points of a block of cells.
//!
//! Two axes are the case of three whose first axis has one basis function, the constant one.

use pulp::{Simd, WithSimd};
use zeroset_bspline::cubic_cardinals;

use crate::band_collocation::Place;

/// Functions that act on the cells of a block, along an axis.
pub(crate) const TILE: usize = 11;

/// Functions that act on a cell, along an axis.
const WIDTH: usize = 4;

/// Those of the last two axes.
const PLANE: usize = WIDTH * WIDTH;

/// Values and slopes of the four cubic cardinal functions that act on a cell of a given side, at a position between 0 and 1.
#[inline(always)]
pub(crate) fn cardinal(t: f64, side: f64) -> ([f64; WIDTH], [f64; WIDTH]) {
    let (values, slopes) = cubic_cardinals(t);
    (values, slopes.map(|slope| slope / side))
}

/// Values and slopes along three axes.
struct Factors {
    x: [f64; WIDTH],
    dx: [f64; WIDTH],
    y: [f64; WIDTH],
    dy: [f64; WIDTH],
    z: [f64; WIDTH],
    dz: [f64; WIDTH],
}

#[inline(always)]
fn factors<const D: usize>(position: &[f64; D], sides: &[f64; D]) -> Factors {
    let (x, dx) = if D == 3 { cardinal(position[0], sides[0]) } else { ([1.0, 0.0, 0.0, 0.0], [0.0; WIDTH]) };
    let (y, dy) = cardinal(position[D - 2], sides[D - 2]);
    let (z, dz) = cardinal(position[D - 1], sides[D - 1]);
    Factors { x, dx, y, dy, z, dz }
}

/// Functions along the first of three axes.
const fn depth(dimension: usize) -> usize {
    if dimension == 3 { WIDTH } else { 1 }
}

#[inline(always)]
fn product(y: &[f64; WIDTH], z: &[f64; WIDTH]) -> [f64; PLANE] {
    let mut out = [0.0; PLANE];
    for j in 0..WIDTH {
        for k in 0..WIDTH {
            out[WIDTH * j + k] = y[j] * z[k];
        }
    }
    out
}

/// The coefficients of plane `i` of a cell.
#[inline(always)]
fn plane(tile: &[f64], first: usize, i: usize) -> [f64; PLANE] {
    let mut out = [0.0; PLANE];
    for j in 0..WIDTH {
        let start = first + (i * TILE + j) * TILE;
        out[WIDTH * j..WIDTH * j + WIDTH].copy_from_slice(&tile[start..start + WIDTH]);
    }
    out
}

#[inline(always)]
fn dot(a: &[f64; PLANE], b: &[f64; PLANE]) -> f64 {
    let mut sums = [0.0; WIDTH];
    for j in 0..WIDTH {
        for k in 0..WIDTH {
            sums[k] += a[WIDTH * j + k] * b[WIDTH * j + k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// `f` and `∇f` at the points of a block, from the coefficients of its tile.
pub(crate) struct ValueAndGradient<'a, const D: usize> {
    pub(crate) tile: &'a [f64],
    pub(crate) places: &'a [Place<D>],
    pub(crate) sides: &'a [f64; D],
    pub(crate) out: &'a mut [(f64, [f64; D])],
}

impl<const D: usize> WithSimd for ValueAndGradient<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (place, out) in self.places.iter().zip(self.out) {
            let f = factors(&place.position, self.sides);
            let (mut flat, mut sloping) = ([0.0; PLANE], [0.0; PLANE]);
            for i in 0..depth(D) {
                let c = plane(self.tile, usize::from(place.first), i);
                for p in 0..PLANE {
                    flat[p] += f.x[i] * c[p];
                    sloping[p] += f.dx[i] * c[p];
                }
            }
            let value = product(&f.y, &f.z);
            let gradient =
                [dot(&sloping, &value), dot(&flat, &product(&f.dy, &f.z)), dot(&flat, &product(&f.y, &f.dz))];
            out.0 = dot(&flat, &value);
            out.1.copy_from_slice(&gradient[3 - D..]);
        }
    }
}

/// The rows `rᵢ = αᵢ qᵢ + βᵢ · ∇qᵢ` of a block's points.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a, const D: usize> {
    pub(crate) places: &'a [Place<D>],
    pub(crate) alpha: &'a [f64],
    pub(crate) beta: &'a [[f64; D]],
    pub(crate) sides: &'a [f64; D],
}

impl<const D: usize> Rows<'_, D> {
    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.places.len()
    }

    /// One of them.
    #[inline(always)]
    pub(crate) fn row(&self, index: usize) -> Row<D> {
        let place = &self.places[index];
        let f = factors(&place.position, self.sides);
        let (alpha, beta) = (self.alpha[index], &self.beta[index]);
        let along = if D == 3 { beta[0] } else { 0.0 };
        let yz = product(&f.y, &f.z);
        let (by, bz) = (product(&f.dy, &f.z), product(&f.y, &f.dz));
        let mut across = [0.0; PLANE];
        for p in 0..PLANE {
            across[p] = beta[D - 2] * by[p] + beta[D - 1] * bz[p];
        }
        let mut first = [0.0; WIDTH];
        for i in 0..WIDTH {
            first[i] = alpha * f.x[i] + along * f.dx[i];
        }
        Row { place: usize::from(place.first), first, x: f.x, yz, across }
    }
}

/// One row: entry `(i, p)` is `first[i] · yz[p] + x[i] · across[p]`.
pub(crate) struct Row<const D: usize> {
    place: usize,
    first: [f64; WIDTH],
    x: [f64; WIDTH],
    yz: [f64; PLANE],
    across: [f64; PLANE],
}

impl<const D: usize> Row<D> {
    /// Its product with the coefficients of a tile.
    #[inline(always)]
    pub(crate) fn dot(&self, tile: &[f64]) -> f64 {
        let (mut a, mut b) = ([0.0; PLANE], [0.0; PLANE]);
        for i in 0..depth(D) {
            let c = plane(tile, self.place, i);
            for p in 0..PLANE {
                a[p] += self.first[i] * c[p];
                b[p] += self.x[i] * c[p];
            }
        }
        dot(&a, &self.yz) + dot(&b, &self.across)
    }

    /// Adds its multiple to a tile.
    #[inline(always)]
    pub(crate) fn add_to(&self, tile: &mut [f64], factor: f64) {
        for i in 0..depth(D) {
            let (a, b) = (factor * self.first[i], factor * self.x[i]);
            for j in 0..WIDTH {
                let start = self.place + (i * TILE + j) * TILE;
                for (k, out) in tile[start..start + WIDTH].iter_mut().enumerate() {
                    *out += a * self.yz[WIDTH * j + k] + b * self.across[WIDTH * j + k];
                }
            }
        }
    }

    /// Adds the squares of its entries to a tile.
    #[inline(always)]
    pub(crate) fn add_squares_to(&self, tile: &mut [f64]) {
        for i in 0..depth(D) {
            for j in 0..WIDTH {
                let start = self.place + (i * TILE + j) * TILE;
                for (k, out) in tile[start..start + WIDTH].iter_mut().enumerate() {
                    let p = WIDTH * j + k;
                    let entry = self.first[i] * self.yz[p] + self.x[i] * self.across[p];
                    *out += entry * entry;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cardinal_functions_are_those_of_uniform_knots() {
        let knots = zeroset_bspline::KnotVector::uniform(3, 0.0, 0.5, 4).unwrap();
        for x in [0.5, 0.61, 0.99] {
            let basis = zeroset_bspline::Basis::at(&knots, x, 1).unwrap();
            let (values, slopes) = cardinal((x - 0.5) / 0.5, 0.5);
            for k in 0..4 {
                // A few operations on numbers of size one.
                assert!((values[k] - basis.derivative(0)[k]).abs() < 1e-15);
                assert!((slopes[k] - basis.derivative(1)[k]).abs() < 1e-14);
            }
        }
    }
}
