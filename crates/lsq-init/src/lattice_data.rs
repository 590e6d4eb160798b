//! The values on the lattice, and the passes between them and the coefficients: one slab of nodes (what one index of the
//! first axis selects) at a time through the last two axes, in cache, so that the lattice itself is read once.

use rayon::prelude::*;
use zeroset_bspline::AxisCollocation;

/// A matrix whose rows have their entries next to each other.
#[derive(Debug, Clone)]
pub(crate) struct Banded {
    columns: usize,
    first: Vec<usize>,
    start: Vec<usize>,
    entries: Vec<f64>,
}

impl Banded {
    /// The collocation matrix C of an axis with `functions` basis functions.
    pub(crate) fn collocation(collocation: &AxisCollocation, functions: usize) -> Self {
        let mut matrix = Self { columns: functions, first: Vec::new(), start: vec![0], entries: Vec::new() };
        for node in 0..collocation.rows() {
            let (first, values) = collocation.row(node);
            matrix.first.push(first);
            matrix.entries.extend_from_slice(values);
            matrix.start.push(matrix.entries.len());
        }
        matrix
    }

    /// One node on the one function of an axis that is not there.
    pub(crate) fn unit() -> Self {
        Self { columns: 1, first: vec![0], start: vec![0, 1], entries: vec![1.0] }
    }

    /// The transpose. The first columns must not descend, so that the rows of the transpose are without gaps too.
    pub(crate) fn transposed(&self) -> Self {
        let mut rows = vec![(0, Vec::new()); self.columns];
        for row in 0..self.rows() {
            let (first, entries) = self.row(row);
            for (column, entry) in (first..).zip(entries) {
                let (first, entries): &mut (usize, Vec<f64>) = &mut rows[column];
                if entries.is_empty() {
                    *first = row;
                }
                entries.push(*entry);
            }
        }
        let mut matrix = Self { columns: self.rows(), first: Vec::new(), start: vec![0], entries: Vec::new() };
        for (first, entries) in rows {
            matrix.first.push(first);
            matrix.entries.extend(entries);
            matrix.start.push(matrix.entries.len());
        }
        matrix
    }

    pub(crate) fn rows(&self) -> usize {
        self.first.len()
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.entries[self.start[row]..self.start[row + 1]])
    }

    /// Applied to each line of `columns` values.
    fn along_lines(&self, input: &[f64], out: &mut [f64]) {
        for (out, line) in out.chunks_exact_mut(self.rows()).zip(input.chunks_exact(self.columns)) {
            for (i, out) in out.iter_mut().enumerate() {
                let (first, entries) = self.row(i);
                *out = entries.iter().zip(&line[first..]).map(|(a, b)| a * b).sum();
            }
        }
    }

    /// One row of the matrix applied to rows of `out.len()` values.
    fn across(&self, row: usize, input: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let (first, entries) = self.row(row);
        for (entry, values) in entries.iter().zip(input[first * out.len()..].chunks_exact(out.len())) {
            out.iter_mut().zip(values).for_each(|(o, v)| *o += entry * v);
        }
    }
}

/// `⊗Cᵀ φ`, by the transposed collocation matrices.
pub(crate) fn right_side(transposed: &[Banded; 3], phi: &[f64]) -> Vec<f64> {
    let [first, middle, last] = transposed;
    let (nodes, slab) = (middle.columns() * last.columns(), middle.rows() * last.rows());
    let mut reduced = vec![0.0; first.columns() * slab];
    reduced.par_chunks_mut(slab).zip(phi.par_chunks(nodes)).for_each_init(
        || vec![0.0; middle.rows() * last.columns()],
        |scratch, (out, phi)| {
            for (j, line) in scratch.chunks_exact_mut(last.columns()).enumerate() {
                middle.across(j, phi, line);
            }
            last.along_lines(scratch, out);
        },
    );
    let mut right = vec![0.0; first.rows() * slab];
    right.par_chunks_mut(slab).enumerate().for_each(|(i, out)| first.across(i, &reduced, out));
    right
}

/// `Σ (f − φ)²` over the nodes, by the collocation matrices.
pub(crate) fn squared_misfit(collocations: &[Banded; 3], coefficients: &[f64], phi: &[f64]) -> f64 {
    let [first, middle, last] = collocations;
    let slab = middle.columns() * last.columns();
    // One sum per slab, so that the total does not depend on the number of threads.
    let partial: Vec<f64> = phi
        .par_chunks(middle.rows() * last.rows())
        .enumerate()
        .map_init(
            || (vec![0.0; slab], vec![0.0; middle.columns() * last.rows()], vec![0.0; last.rows()]),
            |(coarse, lines, line), (i, phi)| {
                first.across(i, coefficients, coarse);
                last.along_lines(coarse, lines);
                let mut sum = 0.0;
                for (j, phi) in phi.chunks_exact(last.rows()).enumerate() {
                    middle.across(j, lines, line);
                    sum += line.iter().zip(phi).map(|(f, phi)| (f - phi) * (f - phi)).sum::<f64>();
                }
                sum
            },
        )
        .collect();
    partial.iter().sum()
}
