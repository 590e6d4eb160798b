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

/// Calls a method with the numbers of basis functions as constants. Other degrees have no thin-plate energy; no points, no widths.
macro_rules! with_sizes {
    ($task:ident.$method:ident($($argument:expr),*)) => {
        match $task.shape {
            (1, 3) => $task.$method::<1, 3>($($argument),*),
            (1, 4) => $task.$method::<1, 4>($($argument),*),
            (1, 5) => $task.$method::<1, 5>($($argument),*),
            (1, 6) => $task.$method::<1, 6>($($argument),*),
            (3, 3) => $task.$method::<3, 3>($($argument),*),
            (4, 4) => $task.$method::<4, 4>($($argument),*),
            (5, 5) => $task.$method::<5, 5>($($argument),*),
            (6, 6) => $task.$method::<6, 6>($($argument),*),
            _ => {}
        }
    };
}

impl CellTask<'_> {
    /// Adds `Σ ωᵢ qᵢ (qᵢᵀ x)` of the cells' points.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        Arch::new().dispatch(Apply { task: self, x, out });
    }

    /// Adds `Σ ωᵢ qᵢ²`.
    pub(crate) fn add_diagonal(&self, out: &mut [f64]) {
        with_sizes!(self.squares(out));
    }

    fn squares<const X: usize, const W: usize>(&self, out: &mut [f64]) {
        for cell in self.cells {
            let mut sum = [[[0.0; W]; W]; X];
            for (x, y, z) in self.squared::<X, W>(cell) {
                scatter(&mut sum, &x, &y, &z, 1.0);
            }
            self.add(cell, &sum, out);
        }
    }

    /// Calls `visit` with every point's place in the sorted order, its cell, and `Σ c ω q²` with the coefficients `c`.
    pub(crate) fn weigh(&self, c: &[f64], visit: impl FnMut(usize, &Cell, f64)) {
        with_sizes!(self.sums(c, visit));
    }

    fn sums<const X: usize, const W: usize>(&self, c: &[f64], mut visit: impl FnMut(usize, &Cell, f64)) {
        for cell in self.cells {
            let local = self.local::<X, W>(cell, c);
            for (point, (x, y, z)) in cell.points.clone().zip(self.squared(cell)) {
                visit(point, cell, gather(&local, &x, &y, &z));
            }
        }
    }

    /// The squares of every point's basis values.
    fn squared<const X: usize, const W: usize>(
        &self,
        cell: &Cell,
    ) -> impl Iterator<Item = ([f64; X], [f64; W], [f64; W])> {
        let per_point = X + 2 * W;
        let values = self.values[cell.points.start * per_point..cell.points.end * per_point].chunks_exact(per_point);
        values.map(factors::<X, W>).map(|(x, y, z)| (x.map(|v| v * v), y.map(|v| v * v), z.map(|v| v * v)))
    }

    #[inline(always)]
    fn local<const X: usize, const W: usize>(&self, cell: &Cell, coefficients: &[f64]) -> Local<X, W> {
        let mut local: Local<X, W> = [[[0.0; W]; W]; X];
        for i in 0..X {
            for j in 0..W {
                let start = cell.first + i * self.strides[0] + j * self.strides[1];
                local[i][j].copy_from_slice(&coefficients[start..start + W]);
            }
        }
        local
    }

    #[inline(always)]
    fn visit<const X: usize, const W: usize>(&self, coefficients: &[f64], out: &mut [f64]) {
        for cell in self.cells {
            let local = self.local::<X, W>(cell, coefficients);
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
            (1, 4) => task.visit_cubic::<S, 1>(simd, x, out),
            (4, 4) => task.visit_cubic::<S, 4>(simd, x, out),
            _ => with_sizes!(task.visit(x, out)),
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

/// Appends `q`, the products of a point's basis values along three axes.
#[inline(always)]
pub(crate) fn expand((depth, width): (usize, usize), value: &[f64], q: &mut Vec<f64>) {
    let (x, rest) = value.split_at(depth);
    let (y, z) = rest.split_at(width);
    for x in x {
        for y in y {
            q.extend(z.iter().map(|z| x * y * z));
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
            q.clear();
            expand((depth, width), value, &mut q);
            for (row, a) in self.out.chunks_exact_mut(q.len()).zip(&q) {
                for (entry, b) in row.iter_mut().zip(&q) {
                    *entry += a * b;
                }
            }
        }
    }
}
