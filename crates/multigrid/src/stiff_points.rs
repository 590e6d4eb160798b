//! Points that weigh more than all else where they are.
//!
//! Jacobi's method hardly moves the coefficients around such a point, though only one combination of them is held by it, and what
//! the others do between two lines of the lattice is out of reach for coarser ones. So the smoother takes such points in exactly.

use rayon::prelude::*;

use crate::cell_kernel::expand;
use crate::cell_points::CellPoints;
use crate::cholesky::{Factor, FactorError};

/// From which `ω qᵀ D⁻¹ q` on, the sum of its shares of the diagonal `D` of `A`, a point may be stiff: where others are near, none has
/// so much. Over all points that sums up to no more than the number of coefficients that they touch.
const ALONE: f64 = 1.0;

/// From which `ω qᵀ E⁻¹ q` on, with the diagonal `E` of the energy, a point is stiff. Below, conjugate gradients take hardly fewer
/// iterations: points that are spread evenly stay below, or have too many others beside them, for all smoothing lengths of a
/// fifth of their spacing and more.
const STIFF: f64 = 10.0;

/// Below this many points tasks are not worth their overhead.
const FEW: usize = 512;

/// A box of a lattice's coefficients, along three axes, the first of which has one in 2D.
#[derive(Debug, Clone, Copy)]
struct Patch {
    /// Flat index of the first.
    first: usize,
    extent: [usize; 3],
    /// Of the lattice.
    strides: [usize; 3],
}

impl Patch {
    /// `first` along each axis of the lattice.
    fn corner(&self) -> [usize; 3] {
        let [planes, lines, _] = self.strides;
        let within = if planes > 0 { self.first % planes } else { self.first };
        [self.first.checked_div(planes).unwrap_or(0), within / lines, within % lines]
    }

    /// One coefficient more on each side, as far as the lattice of this shape has any.
    fn widened(&self, shape: [usize; 3]) -> Self {
        let corner = self.corner();
        let below: [usize; 3] = corner.map(|c| c.min(1));
        let above: [usize; 3] = std::array::from_fn(|a| (shape[a] - corner[a] - self.extent[a]).min(1));
        Self {
            first: self.first - (0..3).map(|a| below[a] * self.strides[a]).sum::<usize>(),
            extent: std::array::from_fn(|a| self.extent[a] + below[a] + above[a]),
            ..*self
        }
    }

    fn size(&self) -> usize {
        self.extent.iter().product()
    }

    /// Where each line along the last axis begins.
    fn lines(self) -> impl Iterator<Item = usize> {
        let [planes, lines, _] = self.extent;
        (0..planes).flat_map(move |i| (0..lines).map(move |j| self.first + i * self.strides[0] + j * self.strides[1]))
    }

    /// `x ← change(x, value)` for the numbers of the patch.
    fn update(&self, values: &[f64], x: &mut [f64], change: impl Fn(f64, f64) -> f64) {
        for (start, line) in self.lines().zip(values.chunks_exact(self.extent[2])) {
            for (x, value) in x[start..].iter_mut().zip(line) {
                *x = change(*x, *value);
            }
        }
    }

    /// `Σ value · x`.
    fn product(&self, values: &[f64], x: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (start, line) in self.lines().zip(values.chunks_exact(self.extent[2])) {
            for (value, x) in line.iter().zip(&x[start..]) {
                sum += value * x;
            }
        }
        sum
    }

    /// Replaces `x`, which vanishes outside the patch, by `tridiag(−a, 1, −a) x` along an axis, as far as it lies inside.
    fn filter(&self, axis: usize, a: f64, x: &mut [f64]) {
        let (stride, length) = (self.strides[axis], self.extent[axis]);
        let mut ends = *self;
        ends.extent[axis] = 1;
        for start in ends.lines().flat_map(|line| line..line + ends.extent[2]) {
            let mut before = 0.0;
            for place in 0..length {
                let at = start + place * stride;
                let after = if place + 1 < length { x[at + stride] } else { 0.0 };
                let filtered = x[at] - a * (before + after);
                before = std::mem::replace(&mut x[at], filtered);
            }
        }
    }
}

/// Stiff points on a lattice: the matrix `Q`, whose columns are their `√ω q`.
#[derive(Debug)]
pub(crate) struct StiffPoints {
    /// In the order of their first coefficients, all of the same extent.
    patches: Vec<Patch>,
    values: Vec<f64>,
}

impl StiffPoints {
    /// Those of the `points` that are stiff beside the diagonals of `A` and of the energy in it.
    pub(crate) fn new(points: &CellPoints, diagonal: &[f64], energy: &[f64]) -> Self {
        let inverse: Vec<f64> = diagonal.iter().map(|d| 1.0 / d).collect();
        let [depth, width, _] = points.extent();
        let mut stiff = Self { patches: Vec::new(), values: Vec::new() };
        let mut q = Vec::with_capacity(depth * width * width);
        for (first, value) in points.heavier(&inverse, ALONE) {
            q.clear();
            expand((depth, width), value, &mut q);
            let patch = Patch { first, extent: points.extent(), strides: points.strides() };
            let beside = |(start, line): (usize, &[f64])| -> f64 {
                line.iter().zip(&energy[start..]).map(|(q, e)| q * q / e).sum()
            };
            if patch.lines().zip(q.chunks_exact(width)).map(beside).sum::<f64>() > STIFF {
                stiff.patches.push(patch);
                stiff.values.extend_from_slice(&q);
            }
        }
        stiff
    }

    /// Numbers of each column.
    fn each(&self) -> usize {
        self.patches.first().map_or(1, Patch::size)
    }

    fn columns(&self) -> impl Iterator<Item = (&Patch, &[f64])> {
        self.patches.iter().zip(self.values.chunks_exact(self.each()))
    }

    /// The diagonal of `A − Q Qᵀ`, and no less than that of the energy, which rounding could take away with the rest.
    pub(crate) fn taken_from(&self, diagonal: &[f64], energy: &[f64]) -> Vec<f64> {
        let mut rest = diagonal.to_vec();
        for (patch, q) in self.columns() {
            patch.update(q, &mut rest, |d, q| d - q * q);
        }
        rest.iter().zip(energy).map(|(rest, energy)| rest.max(*energy)).collect()
    }

    /// What they change about a preconditioner `B = S F S` of a lattice of this shape, with a diagonal `S` and the tensor product
    /// `F` of `tridiag(−a, 1, −a)` along its axes. Nothing where there are none.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub(crate) fn beside(
        self,
        shape: [usize; 3],
        scale: &[f64],
        a: f64,
    ) -> Result<Option<StiffCorrection>, FactorError> {
        let Some(reach) = self.patches.first().map(|patch| patch.extent[1]) else { return Ok(None) };
        // S Q.
        let mut scaled = Self { patches: self.patches.clone(), values: Vec::with_capacity(self.values.len()) };
        for (patch, q) in self.columns() {
            for (start, line) in patch.lines().zip(q.chunks_exact(patch.extent[2])) {
                scaled.values.extend(line.iter().zip(&scale[start..]).map(|(q, s)| q * s));
            }
        }
        // The lower half of 1 + (S Q)ᵀ F (S Q), column by column. The first axis that has coefficients orders the columns.
        let slowest = usize::from(shape[0] == 1);
        let corners: Vec<[usize; 3]> = self.patches.iter().map(Patch::corner).collect();
        let (mut starts, mut rows, mut entries) = (vec![0], Vec::new(), Vec::new());
        let mut image = vec![0.0; scale.len()];
        for (column, (patch, q)) in scaled.columns().enumerate() {
            patch.update(q, &mut image, |_, q| q);
            let wider = patch.widened(shape);
            (0..3).for_each(|axis| wider.filter(axis, a, &mut image));
            for (row, (other, p)) in scaled.columns().enumerate().skip(column) {
                let apart = |axis: usize| corners[row][axis].abs_diff(corners[column][axis]) > reach;
                if apart(slowest) {
                    break;
                }
                if !(slowest..3).any(apart) {
                    rows.push(row);
                    entries.push(other.product(p, &image) + if row == column { 1.0 } else { 0.0 });
                }
            }
            starts.push(rows.len());
            wider.lines().for_each(|start| image[start..start + wider.extent[2]].fill(0.0));
        }
        Ok(Some(StiffCorrection { factor: Factor::sparse(&starts, &rows, &entries)?, points: self }))
    }
}

/// `(1 + Qᵀ B Q)⁻¹`, by which `B` becomes the inverse of `B⁻¹ + Q Qᵀ`: `B − B Q (1 + Qᵀ B Q)⁻¹ Qᵀ B` (Woodbury 1950).
#[derive(Debug)]
pub(crate) struct StiffCorrection {
    points: StiffPoints,
    factor: Factor,
}

impl StiffCorrection {
    /// `r ← r − Q (1 + Qᵀ B Q)⁻¹ Qᵀ z` for `z = B r`.
    pub(crate) fn correct(&self, z: &[f64], r: &mut [f64]) {
        let StiffPoints { patches, values } = &self.points;
        let product = |(patch, q): (&Patch, &[f64])| patch.product(q, z);
        let products: Vec<f64> = if patches.len() < FEW {
            self.points.columns().map(product).collect()
        } else {
            let columns = patches.par_iter().zip(values.par_chunks_exact(self.points.each()));
            columns.with_min_len(FEW / 4).map(product).collect()
        };
        for ((patch, q), factor) in self.points.columns().zip(self.factor.solve(&products)) {
            patch.update(q, r, |r, q| r - factor * q);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    const A: f64 = 0.28;

    /// `S F S r`, axis by axis.
    fn filtered(shape: [usize; 3], scale: &[f64], r: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = r.iter().zip(scale).map(|(r, s)| r * s).collect();
        for axis in 0..3 {
            let stride: usize = shape[axis + 1..].iter().product();
            let before = x.clone();
            for (index, x) in x.iter_mut().enumerate() {
                let place = index / stride % shape[axis];
                *x -= if place > 0 { A * before[index - stride] } else { 0.0 };
                *x -= if place + 1 < shape[axis] { A * before[index + stride] } else { 0.0 };
            }
        }
        x.iter().zip(scale).map(|(x, s)| x * s).collect()
    }

    /// Heavy points, some close together and some in the lattice's corners, among many light ones.
    fn inverts<const D: usize>(heavy: &[[f64; D]]) {
        let light = (0..2000).map(|i| std::array::from_fn(|a| (i as f64 * [0.618, 0.414, 0.732][a]).fract()));
        let points: Vec<[f64; D]> = heavy.iter().copied().chain(light).collect();
        let weights: Vec<f64> = (0..points.len()).map(|i| if i < heavy.len() { 1e4 } else { 1e-4 }).collect();
        let knots: [KnotVector; D] =
            std::array::from_fn(|a| KnotVector::uniform(3, 0.0, 1.0 / (5 + a) as f64, 5 + a).unwrap());
        let mut shape = [1; 3];
        knots.iter().zip(&mut shape[3 - D..]).for_each(|(knots, n)| *n = knots.basis_count());
        let points = CellPoints::new(&knots, &points, &weights).unwrap();
        let energy = vec![0.5; shape.iter().product()];
        let mut diagonal = energy.clone();
        points.add_diagonal(&mut diagonal);
        let stiff = StiffPoints::new(&points, &diagonal, &energy);
        assert_eq!(stiff.patches.len(), heavy.len());
        let rest = stiff.taken_from(&diagonal, &energy);
        // All light points together weigh 0.2.
        assert!(rest.iter().all(|d| (0.5..0.7).contains(d)));

        let scale: Vec<f64> = (0..rest.len()).map(|i| 1.0 / (rest[i] + (i % 7) as f64).sqrt()).collect();
        let correction = stiff.beside(shape, &scale, A).unwrap().unwrap();
        let right: Vec<f64> = (0..rest.len()).map(|i| (i as f64).sin()).collect();
        let mut corrected = right.clone();
        correction.correct(&filtered(shape, &scale, &right), &mut corrected);
        let z = filtered(shape, &scale, &corrected);
        // (B⁻¹ + Q Qᵀ) z is the right side, so B⁻¹ z is the right side without Q Qᵀ z.
        let mut without = right.clone();
        for (patch, q) in correction.points.columns() {
            let product = patch.product(q, &z);
            patch.update(q, &mut without, |r, q| r - product * q);
        }
        let largest = z.iter().fold(0.0, |most: f64, z| most.max(z.abs()));
        for (z, again) in z.iter().zip(filtered(shape, &scale, &without)) {
            // The weights cost four of sixteen digits, sums of them another one or two.
            assert!((z - again).abs() < 1e-9 * largest, "{z} {again}");
        }
    }

    #[test]
    fn heavy_points_are_taken_in_exactly() {
        inverts::<2>(&[[0.0, 0.0], [1.0, 1.0], [0.31, 0.52], [0.33, 0.52], [0.9, 0.1]]);
        inverts::<3>(&[[0.0; 3], [1.0; 3], [0.31, 0.52, 0.44], [0.33, 0.52, 0.47], [0.05, 0.9, 0.5]]);
    }
}
