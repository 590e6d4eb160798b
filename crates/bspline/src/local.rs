//! The coefficients that act at one point: sums over them and their transposes, slow axes first.
//!
//! Two axes are the case of three whose first axis has one basis function, the constant one. Widths are known to the
//! compiler for cubics. A partial derivative is the same chain of operations whether it is computed alone or with others,
//! so that all ways to evaluate a spline agree to the last bit.

use crate::basis::Basis;
use crate::knot_vector::MAX_DEGREE;

const WIDTH: usize = MAX_DEGREE + 1;
const PLANE: usize = WIDTH * WIDTH;

/// Where the coefficients of a point are: the first one, the strides of the first two of three axes, and how many act along
/// each.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Place {
    first: usize,
    strides: [usize; 2],
    widths: [usize; 3],
}

/// Basis values or derivatives of three axes.
type Weights<'a> = [&'a [f64]; 3];

impl Place {
    pub(crate) fn new<const D: usize>(strides: &[usize; D], basis: &[Basis; D]) -> Self {
        let first = basis.iter().zip(strides).map(|(basis, stride)| basis.first * stride).sum();
        let mut place = Self { first, strides: [0; 2], widths: [1; 3] };
        for axis in 0..D {
            place.widths[3 - D + axis] = basis[axis].derivative(0).len();
            if axis + 1 < D {
                place.strides[3 - D + axis] = strides[axis];
            }
        }
        place
    }
}

/// The weights of the given orders along each axis.
pub(crate) fn weights<'a, const D: usize>(basis: &'a [Basis; D], order: [usize; D]) -> Weights<'a> {
    let mut weights: Weights<'a> = [&[1.0]; 3];
    for axis in 0..D {
        weights[3 - D + axis] = basis[axis].derivative(order[axis]);
    }
    weights
}

/// Runs a function with widths that are constants where they are the common ones.
macro_rules! with_widths {
    ($place:expr, $function:ident($($argument:expr),*)) => {
        match $place.widths {
            [4, 4, 4] => $function([4, 4, 4], $($argument),*),
            [1, 4, 4] => $function([1, 4, 4], $($argument),*),
            widths => $function(widths, $($argument),*),
        }
    };
}

/// `Σ c[first + k] Π weights[axis][k_axis]`.
pub(crate) fn contract(coefficients: &[f64], place: &Place, weights: &Weights<'_>) -> f64 {
    with_widths!(place, contract_sized(coefficients, place, weights))
}

#[inline(always)]
fn contract_sized(widths: [usize; 3], coefficients: &[f64], place: &Place, weights: &Weights<'_>) -> f64 {
    let [_, _, nz] = widths;
    let mut plane = [0.0; PLANE];
    along_first(widths, coefficients, place, [weights[0]], [&mut plane]);
    let mut line = [0.0; WIDTH];
    along_second(widths, &plane, weights[1], &mut line);
    dot(&weights[2][..nz], &line[..nz])
}

/// Sums over the first axis, with several weights at once.
#[inline(always)]
fn along_first<const N: usize>(
    [nx, ny, nz]: [usize; 3],
    coefficients: &[f64],
    place: &Place,
    weights: [&[f64]; N],
    planes: [&mut [f64; PLANE]; N],
) {
    for i in 0..nx {
        for j in 0..ny {
            let start = place.first + i * place.strides[0] + j * place.strides[1];
            let line = &coefficients[start..start + nz];
            for n in 0..N {
                for (p, c) in planes[n][j * nz..j * nz + nz].iter_mut().zip(line) {
                    *p += weights[n][i] * c;
                }
            }
        }
    }
}

/// Sums over the second axis.
#[inline(always)]
fn along_second([_, ny, nz]: [usize; 3], plane: &[f64; PLANE], weights: &[f64], line: &mut [f64; WIDTH]) {
    for j in 0..ny {
        for k in 0..nz {
            line[k] += weights[j] * plane[j * nz + k];
        }
    }
}

#[inline(always)]
fn dot(weights: &[f64], line: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (w, l) in weights.iter().zip(line) {
        sum += w * l;
    }
    sum
}

/// Value and gradient: the partial derivatives of [`contract`] with what they have in common computed once.
pub(crate) fn value_and_gradient<const D: usize>(
    coefficients: &[f64],
    place: &Place,
    basis: &[Basis; D],
) -> (f64, [f64; D]) {
    let (values, slopes) = (weights(basis, [0; D]), weights(basis, [1; D]));
    let (value, gradient) = with_widths!(place, jet_sized(coefficients, place, &values, &slopes));
    (value, std::array::from_fn(|axis| gradient[3 - D + axis]))
}

#[inline(always)]
fn jet_sized(
    widths: [usize; 3],
    coefficients: &[f64],
    place: &Place,
    values: &Weights<'_>,
    slopes: &Weights<'_>,
) -> (f64, [f64; 3]) {
    let nz = widths[2];
    let (z, dz) = (&values[2][..nz], &slopes[2][..nz]);
    let mut plane = [0.0; PLANE];
    let mut gradient = [0.0; 3];
    // The constant function has no slope.
    if widths[0] > 1 {
        let mut sloping = [0.0; PLANE];
        along_first(widths, coefficients, place, [values[0], slopes[0]], [&mut plane, &mut sloping]);
        let mut line = [0.0; WIDTH];
        along_second(widths, &sloping, values[1], &mut line);
        gradient[0] = dot(z, &line[..nz]);
    } else {
        along_first(widths, coefficients, place, [values[0]], [&mut plane]);
    }
    let (mut line, mut sloping) = ([0.0; WIDTH], [0.0; WIDTH]);
    along_second(widths, &plane, values[1], &mut line);
    along_second(widths, &plane, slopes[1], &mut sloping);
    gradient[1] = dot(z, &sloping[..nz]);
    gradient[2] = dot(dz, &line[..nz]);
    (dot(z, &line[..nz]), gradient)
}

/// What the points of one cell add to its coefficients.
pub(crate) struct Sum {
    place: Place,
    sum: [f64; WIDTH * PLANE],
}

impl Sum {
    pub(crate) fn new(place: Place) -> Self {
        Self { place, sum: [0.0; WIDTH * PLANE] }
    }

    /// Whether a point's coefficients are the same.
    pub(crate) fn is_at(&self, place: &Place) -> bool {
        self.place == *place
    }

    /// Adds `factor · q`, the transpose of [`contract`].
    pub(crate) fn add_value(&mut self, weights: &Weights<'_>, factor: f64) {
        let Self { place, sum } = self;
        with_widths!(place, add_value_sized(sum, weights, factor));
    }

    /// Adds `g₁ u + g₂ v [+ g₃ w]`, the transpose of the gradient.
    pub(crate) fn add_gradient<const D: usize>(&mut self, basis: &[Basis; D], vector: &[f64; D]) {
        let (values, slopes) = (weights(basis, [0; D]), weights(basis, [1; D]));
        let mut g = [0.0; 3];
        g[3 - D..].copy_from_slice(vector);
        let Self { place, sum } = self;
        with_widths!(place, add_gradient_sized(sum, &values, &slopes, g));
    }

    /// Adds the sum to the coefficients, of which `before` are missing at the beginning of `out`.
    pub(crate) fn flush(&self, out: &mut [f64], before: usize) {
        with_widths!(self.place, flush_sized(self, out, before));
    }
}

#[inline(always)]
fn add_value_sized([nx, ny, nz]: [usize; 3], sum: &mut [f64], [x, y, z]: &Weights<'_>, factor: f64) {
    let mut plane = [0.0; PLANE];
    for j in 0..ny {
        for k in 0..nz {
            plane[j * nz + k] = (factor * y[j]) * z[k];
        }
    }
    for (x, sum) in x[..nx].iter().zip(sum.chunks_exact_mut(ny * nz)) {
        for (s, p) in sum.iter_mut().zip(&plane) {
            *s += x * p;
        }
    }
}

#[inline(always)]
fn add_gradient_sized(
    [nx, ny, nz]: [usize; 3],
    sum: &mut [f64],
    [x, y, z]: &Weights<'_>,
    [dx, dy, dz]: &Weights<'_>,
    g: [f64; 3],
) {
    // The gradient's components across the first axis share its values, the one along it has the slopes.
    let (mut across, mut along) = ([0.0; PLANE], [0.0; PLANE]);
    for j in 0..ny {
        for k in 0..nz {
            across[j * nz + k] = (g[1] * dy[j]) * z[k] + (g[2] * y[j]) * dz[k];
            along[j * nz + k] = (g[0] * y[j]) * z[k];
        }
    }
    if nx > 1 {
        for ((x, dx), sum) in x[..nx].iter().zip(&dx[..nx]).zip(sum.chunks_exact_mut(ny * nz)) {
            for (s, (across, along)) in sum.iter_mut().zip(across.iter().zip(&along)) {
                *s += x * across + dx * along;
            }
        }
    } else {
        for (s, across) in sum[..ny * nz].iter_mut().zip(&across) {
            *s += across;
        }
    }
}

#[inline(always)]
fn flush_sized([nx, ny, nz]: [usize; 3], local: &Sum, out: &mut [f64], before: usize) {
    let Place { first, strides, .. } = local.place;
    for i in 0..nx {
        for j in 0..ny {
            let start = first - before + i * strides[0] + j * strides[1];
            let line = (i * ny + j) * nz;
            for (o, s) in out[start..start + nz].iter_mut().zip(&local.sum[line..line + nz]) {
                *o += s;
            }
        }
    }
}
