//! Contractions of coefficient arrays with one small weight vector per axis, and passes along one axis.

/// Strides of a C-ordered array.
pub(crate) fn strides<const D: usize>(shape: &[usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for axis in (0..D.saturating_sub(1)).rev() {
        strides[axis] = strides[axis + 1] * shape[axis + 1];
    }
    strides
}

/// `Σ c[first + k] Π weights[axis][k_axis]` over the box of weights.
pub(crate) fn contract<const D: usize>(
    coefficients: &[f64],
    strides: &[usize; D],
    first: &[usize; D],
    weights: &[&[f64]; D],
) -> f64 {
    fn along(coefficients: &[f64], strides: &[usize], first: &[usize], weights: &[&[f64]]) -> f64 {
        let mut sum = 0.0;
        if weights.len() == 1 {
            for (c, w) in coefficients[first[0]..].iter().zip(weights[0]) {
                sum += c * w;
            }
        } else {
            for (k, w) in weights[0].iter().enumerate() {
                let rest = &coefficients[(first[0] + k) * strides[0]..];
                sum += w * along(rest, &strides[1..], &first[1..], &weights[1..]);
            }
        }
        sum
    }
    along(coefficients, strides, first, weights)
}

/// Adds `factor · Π weights[axis][k_axis]` to `out[first + k]`: the transpose of [`contract`].
pub(crate) fn scatter<const D: usize>(
    out: &mut [f64],
    strides: &[usize; D],
    first: &[usize; D],
    weights: &[&[f64]; D],
    factor: f64,
) {
    fn along(out: &mut [f64], strides: &[usize], first: &[usize], weights: &[&[f64]], factor: f64) {
        if weights.len() == 1 {
            for (o, w) in out[first[0]..].iter_mut().zip(weights[0]) {
                *o += factor * w;
            }
        } else {
            for (k, w) in weights[0].iter().enumerate() {
                let rest = &mut out[(first[0] + k) * strides[0]..];
                along(rest, &strides[1..], &first[1..], &weights[1..], factor * w);
            }
        }
    }
    along(out, strides, first, weights, factor);
}

/// Applies a row-banded matrix along one axis of a C-ordered array of `shape`: the separable pass of which lattice
/// sampling, refinement, Gram matrices and least squares are made. Parallel, each entry summed in a fixed order.
///
/// `row(i)` gives the first column and the entries of row `i`; along that axis the result has `rows` entries.
///
/// # Panics
/// If `input` does not have the shape, or a row reaches beyond the axis.
pub fn apply_along<'m>(
    input: &[f64],
    shape: &[usize],
    axis: usize,
    rows: usize,
    row: impl Fn(usize) -> (usize, &'m [f64]) + Sync,
) -> Vec<f64> {
    use rayon::prelude::*;
    let inner: usize = shape[axis + 1..].iter().product();
    let columns = shape[axis];
    let outer: usize = shape[..axis].iter().product();
    let mut output = vec![0.0; outer * rows * inner];
    if inner == 1 {
        output.par_chunks_mut(rows.max(1)).zip(input.par_chunks(columns.max(1))).with_min_len(64).for_each(
            |(out, line)| {
                for (i, value) in out.iter_mut().enumerate() {
                    let (first, entries) = row(i);
                    *value = entries.iter().zip(&line[first..]).map(|(a, b)| a * b).sum();
                }
            },
        );
    } else {
        output.par_chunks_mut(inner).with_min_len((4096 / inner).max(1)).enumerate().for_each(|(index, out)| {
            let (slab, i) = (index / rows, index % rows);
            let (first, entries) = row(i);
            for (k, a) in entries.iter().enumerate() {
                let start = (slab * columns + first + k) * inner;
                for (o, v) in out.iter_mut().zip(&input[start..start + inner]) {
                    *o += a * v;
                }
            }
        });
    }
    output
}
