//! Strides of coefficient arrays, and passes along one axis.

/// Strides of a C-ordered array.
pub(crate) fn strides<const D: usize>(shape: &[usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for axis in (0..D.saturating_sub(1)).rev() {
        strides[axis] = strides[axis + 1] * shape[axis + 1];
    }
    strides
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
