//! The innermost loops over the points of a cell.

use pulp::{Arch, Simd, WithSimd};

use crate::cell_points::Cell;

/// Some cells, with where their numbers are.
pub(crate) struct CellTask<'p> {
    /// Basis functions along the first, and along each other of three axes.
    pub(crate) shape: (usize, usize),
    pub(crate) strides: [usize; 2],
    pub(crate) cells: &'p [Cell],
    pub(crate) values: &'p [f64],
    pub(crate) merged: &'p [f64],
    /// Coefficients that come before the output.
    pub(crate) before: usize,
}

/// Coefficients of one cell.
type Local<const X: usize, const W: usize> = [[[f64; W]; W]; X];

impl CellTask<'_> {
    /// Adds `Σ ωᵢ qᵢ (qᵢᵀ x)` of the cells' points.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        Arch::new().dispatch(Apply { task: self, x, out });
    }

    /// Adds `Σ ωᵢ qᵢ²`.
    pub(crate) fn add_diagonal(&self, out: &mut [f64]) {
        match self.shape {
            (1, 3) => self.squares::<1, 3>(out),
            (1, 4) => self.squares::<1, 4>(out),
            (1, 5) => self.squares::<1, 5>(out),
            (1, 6) => self.squares::<1, 6>(out),
            (3, 3) => self.squares::<3, 3>(out),
            (4, 4) => self.squares::<4, 4>(out),
            (5, 5) => self.squares::<5, 5>(out),
            (6, 6) => self.squares::<6, 6>(out),
            _ => {}
        }
    }

    fn squares<const X: usize, const W: usize>(&self, out: &mut [f64]) {
        for cell in self.cells {
            let mut sum = [[[0.0; W]; W]; X];
            for value in
                self.values[cell.points.start * (X + 2 * W)..cell.points.end * (X + 2 * W)].chunks_exact(X + 2 * W)
            {
                let (x, y, z) = factors::<X, W>(value);
                scatter(&mut sum, &x.map(|v| v * v), &y.map(|v| v * v), &z.map(|v| v * v), 1.0);
            }
            self.add(cell, &sum, out);
        }
    }

    #[inline(always)]
    fn visit<const X: usize, const W: usize>(&self, coefficients: &[f64], out: &mut [f64]) {
        for cell in self.cells {
            let mut local: Local<X, W> = [[[0.0; W]; W]; X];
            for i in 0..X {
                for j in 0..W {
                    let start = cell.first + i * self.strides[0] + j * self.strides[1];
                    local[i][j].copy_from_slice(&coefficients[start..start + W]);
                }
            }
            let mut sum: Local<X, W> = [[[0.0; W]; W]; X];
            match cell.merged {
                Some(begin) => {
                    let sum = sum.as_flattened_mut().as_flattened_mut();
                    let size = X * W * W;
                    let columns = self.merged[begin..begin + size * size].chunks_exact(size);
                    for (column, c) in columns.zip(local.as_flattened().as_flattened()) {
                        for (s, a) in sum.iter_mut().zip(column) {
                            *s += a * c;
                        }
                    }
                }
                None => {
                    let points = cell.points.start * (X + 2 * W)..cell.points.end * (X + 2 * W);
                    for value in self.values[points].chunks_exact(X + 2 * W) {
                        let (x, y, z) = factors::<X, W>(value);
                        let at = gather(&local, &x, &y, &z);
                        scatter(&mut sum, &x, &y, &z, at);
                    }
                }
            }
            self.add(cell, &sum, out);
        }
    }

    #[inline(always)]
    fn add<const X: usize, const W: usize>(&self, cell: &Cell, sum: &Local<X, W>, out: &mut [f64]) {
        for i in 0..X {
            for j in 0..W {
                let start = cell.first - self.before + i * self.strides[0] + j * self.strides[1];
                for (o, s) in out[start..start + W].iter_mut().zip(&sum[i][j]) {
                    *o += s;
                }
            }
        }
    }
}

struct Apply<'a, 'p> {
    task: &'a CellTask<'p>,
    x: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for Apply<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { task, x, out } = self;
        match task.shape {
            (1, 3) => task.visit::<1, 3>(x, out),
            (1, 4) => task.visit_cubic::<S, 1>(simd, x, out),
            (1, 5) => task.visit::<1, 5>(x, out),
            (1, 6) => task.visit::<1, 6>(x, out),
            (3, 3) => task.visit::<3, 3>(x, out),
            (4, 4) => task.visit_cubic::<S, 4>(simd, x, out),
            (5, 5) => task.visit::<5, 5>(x, out),
            (6, 6) => task.visit::<6, 6>(x, out),
            // Other degrees have no thin-plate energy; no points, no widths.
            _ => {}
        }
    }
}

#[inline(always)]
pub(crate) fn factors<const X: usize, const W: usize>(value: &[f64]) -> ([f64; X], [f64; W], [f64; W]) {
    let (mut x, mut y, mut z) = ([0.0; X], [0.0; W], [0.0; W]);
    x.copy_from_slice(&value[..X]);
    y.copy_from_slice(&value[X..X + W]);
    z.copy_from_slice(&value[X + W..X + 2 * W]);
    (x, y, z)
}

/// `qᵀ c`: the slow axes first, so that the long sums run over contiguous numbers.
#[inline(always)]
fn gather<const X: usize, const W: usize>(local: &Local<X, W>, x: &[f64; X], y: &[f64; W], z: &[f64; W]) -> f64 {
    let mut plane = [[0.0; W]; W];
    for i in 0..X {
        for j in 0..W {
            for k in 0..W {
                plane[j][k] += x[i] * local[i][j][k];
            }
        }
    }
    let mut line = [0.0; W];
    for j in 0..W {
        for k in 0..W {
            line[k] += y[j] * plane[j][k];
        }
    }
    let mut sum = 0.0;
    for k in 0..W {
        sum += z[k] * line[k];
    }
    sum
}

/// Adds `factor · q`.
#[inline(always)]
fn scatter<const X: usize, const W: usize>(
    sum: &mut Local<X, W>,
    x: &[f64; X],
    y: &[f64; W],
    z: &[f64; W],
    factor: f64,
) {
    let mut plane = [[0.0; W]; W];
    for j in 0..W {
        for k in 0..W {
            plane[j][k] = (factor * y[j]) * z[k];
        }
    }
    for i in 0..X {
        for j in 0..W {
            for k in 0..W {
                sum[i][j][k] += x[i] * plane[j][k];
            }
        }
    }
}

/// Adds `Σ q qᵀ` of points whose basis values are given one point after the other.
pub(crate) fn local_matrix(shape: (usize, usize), values: &[f64], out: &mut [f64]) {
    Arch::new().dispatch(Merge { shape, values, out });
}

struct Merge<'a> {
    shape: (usize, usize),
    values: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for Merge<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (depth, width) = self.shape;
        let mut q = Vec::with_capacity(depth * width * width);
        for value in self.values.chunks_exact(depth + 2 * width) {
            let (x, rest) = value.split_at(depth);
            let (y, z) = rest.split_at(width);
            q.clear();
            for x in x {
                for y in y {
                    q.extend(z.iter().map(|z| x * y * z));
                }
            }
            for (row, a) in self.out.chunks_exact_mut(q.len()).zip(&q) {
                for (entry, b) in row.iter_mut().zip(&q) {
                    *entry += a * b;
                }
            }
        }
    }
}
