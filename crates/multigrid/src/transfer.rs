//! Between nested lattices: exact refinement and its transpose.

use rayon::prelude::*;
use zeroset_bspline::{KnotVector, Refinement, RefinementError};

use crate::scratch::Scratch;

/// A matrix whose rows are short and contiguous.
#[derive(Debug)]
struct AxisMap {
    first: Vec<usize>,
    /// Where each row's entries begin, and the end.
    starts: Vec<usize>,
    entries: Vec<f64>,
}

impl AxisMap {
    fn new(rows: impl Iterator<Item = (usize, Vec<f64>)>) -> Self {
        let mut map = Self { first: vec![], starts: vec![0], entries: vec![] };
        for (first, entries) in rows {
            // Beside entries of size one, what rounding left of a zero.
            let counts = |e: &f64| e.abs() > 1e-15;
            let skip = entries.iter().position(counts).unwrap_or(0);
            let end = entries.iter().rposition(counts).map_or(skip, |last| last + 1);
            map.first.push(first + skip);
            map.entries.extend_from_slice(&entries[skip..end]);
            map.starts.push(map.entries.len());
        }
        map
    }

    fn rows(&self) -> usize {
        self.first.len()
    }

    fn row(&self, row: usize) -> (usize, &[f64]) {
        (self.first[row], &self.entries[self.starts[row]..self.starts[row + 1]])
    }

    /// The map along an axis of vectors of `length`, each in one piece.
    fn apply(&self, input: &[f64], length: usize, out: &mut [f64]) {
        if length == 1 {
            for (row, out) in out.iter_mut().enumerate() {
                let (first, entries) = self.row(row);
                *out = entries.iter().zip(&input[first..]).map(|(e, x)| e * x).sum();
            }
            return;
        }
        for (row, out) in out.chunks_exact_mut(length).enumerate() {
            self.apply_row(row, |index| &input[index * length..(index + 1) * length], out);
        }
    }

    fn apply_row<'v>(&self, row: usize, vector: impl Fn(usize) -> &'v [f64], out: &mut [f64]) {
        let (first, entries) = self.row(row);
        out.fill(0.0);
        for (index, e) in (first..).zip(entries) {
            for (o, x) in out.iter_mut().zip(vector(index)) {
                *o += e * x;
            }
        }
    }
}

/// Prolongation `P` from a lattice to the one with its cells halved, and restriction `Pᵀ`.
#[derive(Debug)]
pub(crate) struct Transfer<const D: usize> {
    coarse: [usize; D],
    fine: [usize; D],
    up: [AxisMap; D],
    down: [AxisMap; D],
    buffer: Scratch<Vec<f64>>,
}

/// Planes per task.
const CHUNK: usize = 4;

/// Below this many fine coefficients tasks are not worth their overhead.
const FEW: usize = 1 << 15;

impl<const D: usize> Transfer<D> {
    pub(crate) fn new(coarse: &[KnotVector; D], fine: &[KnotVector; D]) -> Result<Self, RefinementError> {
        let (mut up, mut down) = (Vec::with_capacity(D), Vec::with_capacity(D));
        for axis in 0..D {
            let refinement = Refinement::new(&coarse[axis], &fine[axis])?;
            let map = AxisMap::new((0..refinement.rows()).map(|row| {
                let (first, entries) = refinement.row(row);
                (first, entries.to_vec())
            }));
            let columns = coarse[axis].basis_count();
            let entry = |row: usize, column: usize| {
                let (first, entries) = map.row(row);
                column.checked_sub(first).and_then(|k| entries.get(k)).copied().unwrap_or(0.0)
            };
            down.push(AxisMap::new((0..columns).map(|column| {
                let touched = |row: &usize| entry(*row, column) != 0.0;
                let first = (0..map.rows()).find(touched).unwrap_or(0);
                let last = (0..map.rows()).rfind(touched).unwrap_or(0);
                (first, (first..=last).map(|row| entry(row, column)).collect())
            })));
            up.push(map);
        }
        let shape = |knots: &[KnotVector; D]| knots.each_ref().map(KnotVector::basis_count);
        #[expect(clippy::expect_used, reason = "one was pushed per axis")]
        let per_axis = |maps: Vec<AxisMap>| -> [AxisMap; D] { maps.try_into().expect("one map per axis") };
        Ok(Self {
            coarse: shape(coarse),
            fine: shape(fine),
            up: per_axis(up),
            down: per_axis(down),
            buffer: Scratch::new(),
        })
    }

    /// Shape of the finer lattice.
    pub(crate) fn fine(&self) -> [usize; D] {
        self.fine
    }

    /// `fine = P coarse`.
    pub(crate) fn prolong(&self, coarse: &[f64], fine: &mut [f64]) {
        let (coarse_plane, fine_plane, between) = self.plane_sizes();
        let buffer = || vec![0.0; coarse_plane + between];
        let work = |buffer: &mut Vec<f64>, (chunk, fine): (usize, &mut [f64])| {
            let (plane, lines) = buffer.split_at_mut(coarse_plane);
            for (i, out) in (chunk * CHUNK..).zip(fine.chunks_exact_mut(fine_plane)) {
                self.up[0].apply_row(i, |k| &coarse[k * coarse_plane..(k + 1) * coarse_plane], plane);
                if D == 3 {
                    self.up[1].apply(plane, self.coarse[2], lines);
                    last_axis(&self.up[2], lines, self.coarse[2], out, self.fine[2]);
                } else {
                    self.up[1].apply(plane, 1, out);
                }
            }
        };
        if fine.len() < FEW {
            work(&mut buffer(), (0, fine));
        } else {
            fine.par_chunks_mut(CHUNK * fine_plane).enumerate().for_each_init(buffer, work);
        }
    }

    /// `coarse = Pᵀ fine`.
    pub(crate) fn restrict(&self, fine: &[f64], coarse: &mut [f64]) {
        let (coarse_plane, fine_plane, between) = self.plane_sizes();
        let buffer = || vec![0.0; between];
        let within = |lines: &mut Vec<f64>, (partial, fine): (&mut [f64], &[f64])| {
            for (out, plane) in partial.chunks_exact_mut(coarse_plane).zip(fine.chunks_exact(fine_plane)) {
                if D == 3 {
                    last_axis(&self.down[2], plane, self.fine[2], lines, self.coarse[2]);
                    self.down[1].apply(lines, self.coarse[2], out);
                } else {
                    self.down[1].apply(plane, 1, out);
                }
            }
        };
        self.buffer.with(
            || vec![0.0; self.fine[0] * coarse_plane],
            |partial| {
                if fine.len() < FEW {
                    within(&mut buffer(), (partial, fine));
                } else {
                    let partial = partial.par_chunks_mut(CHUNK * coarse_plane);
                    partial.zip(fine.par_chunks(CHUNK * fine_plane)).for_each_init(buffer, within);
                }
                self.down[0].apply(partial, coarse_plane, coarse);
            },
        );
    }

    /// Coefficients of a plane across the first axis: coarse, fine, and fine only along the second axis.
    fn plane_sizes(&self) -> (usize, usize, usize) {
        let between = if D == 3 { self.fine[1] * self.coarse[2] } else { 0 };
        (self.coarse[1..].iter().product(), self.fine[1..].iter().product(), between)
    }
}

fn last_axis(map: &AxisMap, input: &[f64], columns: usize, out: &mut [f64], rows: usize) {
    for (x, out) in input.chunks_exact(columns).zip(out.chunks_exact_mut(rows)) {
        map.apply(x, 1, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::inner_product;
    use zeroset_bspline::Spline;

    fn check<const D: usize>(coarse: [KnotVector; D]) {
        let fine = coarse.each_ref().map(KnotVector::halved);
        let transfer = Transfer::new(&coarse, &fine).unwrap();
        let size = |knots: &[KnotVector; D]| knots.iter().map(KnotVector::basis_count).product::<usize>();
        let f: Vec<f64> = (0..size(&coarse)).map(|i| ((i * 37 + 11) % 101) as f64 / 50.0 - 1.0).collect();
        let mut up = vec![f64::NAN; size(&fine)];
        transfer.prolong(&f, &mut up);
        let exact = Spline::from_flat(coarse.clone(), f.clone()).unwrap().halved().unwrap();
        // The same convex combinations in another order.
        assert!(up.iter().zip(exact.as_flat()).all(|(a, b)| (a - b).abs() < 1e-14));
        let g: Vec<f64> = (0..size(&fine)).map(|i| ((i * 53 + 7) % 97) as f64 / 48.0 - 1.0).collect();
        let mut down = vec![f64::NAN; size(&coarse)];
        transfer.restrict(&g, &mut down);
        // Sums of a few thousand products of size one.
        assert!((inner_product(&up, &g) - inner_product(&f, &down)).abs() < 1e-10);
    }

    #[test]
    fn prolongation_is_refinement_and_restriction_its_transpose() {
        let uniform = |degree, cells| KnotVector::uniform(degree, 0.0, 0.25, cells).unwrap();
        check([uniform(3, 4), KnotVector::clamped(3, &[0.0, 0.5, 2.0]).unwrap(), uniform(3, 7)]);
        check([uniform(2, 1), uniform(2, 30)]);
        check([uniform(3, 18), uniform(3, 17), uniform(3, 16)]);
    }
}
