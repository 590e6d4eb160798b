//! The innermost loops over the points of a cubic cell.

use pulp::Simd;

use crate::cell_kernel::{CellTask, factors};

/// Coefficients of a cubic cell in one plane.
const PLANE: usize = 16;

/// Halves added to halves, the same for any width of the registers.
#[inline(always)]
fn sum_of_plane(p: &[f64; PLANE]) -> f64 {
    let mut four = [0.0; 4];
    for k in 0..4 {
        four[k] = (p[k] + p[k + 8]) + (p[k + 4] + p[k + 12]);
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

impl CellTask<'_> {
    /// As [`CellTask::visit`], for cubics: four numbers per line, sixteen per plane, whole registers.
    #[inline(always)]
    pub(crate) fn visit_cubic<S: Simd, const X: usize>(&self, simd: S, coefficients: &[f64], out: &mut [f64]) {
        let registers = PLANE / S::F64_LANES;
        for cell in self.cells {
            let mut local = [[0.0; PLANE]; X];
            let mut sum = [[0.0; PLANE]; X];
            for i in 0..X {
                for j in 0..4 {
                    let start = cell.first + i * self.strides[0] + j * self.strides[1];
                    local[i][4 * j..4 * j + 4].copy_from_slice(&coefficients[start..start + 4]);
                }
            }
            match cell.merged {
                Some(begin) => {
                    let size = X * PLANE;
                    let sum = S::as_mut_simd_f64s(sum.as_flattened_mut()).0;
                    let columns = self.merged[begin..begin + size * size].chunks_exact(size);
                    for (column, c) in columns.zip(local.as_flattened()) {
                        let c = simd.splat_f64s(*c);
                        for (s, a) in sum.iter_mut().zip(S::as_simd_f64s(column).0) {
                            *s = simd.add_f64s(*s, simd.mul_f64s(*a, c));
                        }
                    }
                }
                None => {
                    let points = cell.points.start * (X + 8)..cell.points.end * (X + 8);
                    for value in self.values[points].chunks_exact(X + 8) {
                        let (x, y, z) = factors::<X, 4>(value);
                        let mut yz = [0.0; PLANE];
                        for j in 0..4 {
                            for k in 0..4 {
                                yz[4 * j + k] = y[j] * z[k];
                            }
                        }
                        let mut products = [0.0; PLANE];
                        let yz = &S::as_simd_f64s(&yz).0[..registers];
                        let target = &mut S::as_mut_simd_f64s(&mut products).0[..registers];
                        for r in 0..registers {
                            let mut plane = simd.splat_f64s(0.0);
                            for i in 0..X {
                                let line = S::as_simd_f64s(&local[i]).0[r];
                                plane = simd.add_f64s(plane, simd.mul_f64s(simd.splat_f64s(x[i]), line));
                            }
                            target[r] = simd.mul_f64s(plane, yz[r]);
                        }
                        let at = sum_of_plane(&products);
                        for i in 0..X {
                            let factor = simd.splat_f64s(at * x[i]);
                            let sum = &mut S::as_mut_simd_f64s(&mut sum[i]).0[..registers];
                            for r in 0..registers {
                                sum[r] = simd.add_f64s(sum[r], simd.mul_f64s(factor, yz[r]));
                            }
                        }
                    }
                }
            }
            for i in 0..X {
                for j in 0..4 {
                    let start = cell.first - self.before + i * self.strides[0] + j * self.strides[1];
                    for (o, s) in out[start..start + 4].iter_mut().zip(&sum[i][4 * j..4 * j + 4]) {
                        *o += s;
                    }
                }
            }
        }
    }
}
