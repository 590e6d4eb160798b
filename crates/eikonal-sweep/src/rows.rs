//! Gauss–Seidel passes of Godunov's scheme along several rows at once.

use std::array::from_fn;

use pulp::{Arch, Simd, WithSimd};

use crate::ghost::Ghosted;
use crate::local_solution::{local_solution, positive_square};

/// Excess of the left-hand side of eq. 12 over h², relative, below which a node counts as solved.
///
/// A value that solves its equation leaves an excess of rounding size, about 4u·2⁻⁵² for a distance of u cells; solving again would
/// only move its last bits, sweep after sweep.
pub(crate) const SOLVED: f64 = 1e-12;

/// How many neighbouring rows are visited at once.
const LANES: usize = 8;

/// Nodes that each row is behind the one before. One would do, but each value would be waited for.
const BEHIND: usize = 2;

/// Neighbouring rows of a lattice in the order of a sweep.
pub(crate) struct Group {
    /// Positions of the first nodes of the row before, the rows, and the row after.
    starts: [usize; LANES + 2],
    count: usize,
    /// From a node to its neighbour across the plane of the rows; none in the plane.
    across: Option<usize>,
    /// Whether the rows are visited from their first node on.
    forwards: bool,
}

impl Group {
    /// All rows of a lattice, in an order that gives the values of row after row.
    pub(crate) fn all<const D: usize>(lattice: &Ghosted<D>, forwards: [bool; D]) -> impl Iterator<Item = Self> {
        let (side, step) = (lattice.shape()[D - 2], lattice.strides()[D - 2]);
        let numbers =
            (0..lattice.row_count()).step_by(side).flat_map(move |first| (first..first + side).step_by(LANES));
        numbers.map(move |number| {
            let count = LANES.min(side - number % side);
            let first = lattice.row(number, forwards).start;
            let start = |row| match forwards[D - 2] {
                true => first + row * step - step,
                false => first + step - row * step,
            };
            Self {
                starts: from_fn(|row| start(row.min(count + 1))),
                count,
                across: (D == 3).then_some(lattice.strides()[0]),
                forwards: forwards[D - 1],
            }
        })
    }
}

/// Rows next to each other, each some nodes behind the one before, so that nodes at one place, one in each row, do not depend on each
/// other: their neighbours in other rows are at the places before and after, visited and not yet visited as in row after row.
pub(crate) struct Rows {
    /// Nodes in a row.
    n: usize,
    /// Distances in the row before, the rows and the row after; infinite where a row has no node at a place.
    u: Vec<[f64; LANES + 2]>,
    /// u_xmin of eq. 12 across the plane of the rows, infinite in the plane; negative where no value changes.
    across: Vec<[f64; LANES]>,
}

impl Rows {
    /// For rows of `n` nodes.
    pub(crate) fn new(n: usize) -> Self {
        let places = n + 2 + BEHIND * (LANES + 1);
        Self { n, u: vec![[f64::INFINITY; LANES + 2]; places], across: vec![[-1.0; LANES]; places] }
    }

    /// One Gauss–Seidel pass along the rows of a group, u ← min(u, ũ), h = 1, but where `fixed`; returns the largest decrease.
    pub(crate) fn relax(&mut self, u: &mut [f64], fixed: &[bool], group: &Group) -> f64 {
        self.load(u, fixed, group);
        let largest = Arch::new().dispatch(Pass(self));
        self.store(u, group);
        largest
    }

    fn load(&mut self, u: &[f64], fixed: &[bool], group: &Group) {
        let n = self.n;
        if group.count < LANES {
            *self = Self::new(n);
        }
        for (row, start) in group.starts[..group.count + 2].iter().enumerate() {
            let from = &u[start - 1..][..n + 2];
            for (step, place) in self.u[BEHIND * row..][..n + 2].iter_mut().enumerate() {
                place[row] = from[if group.forwards { step } else { n + 1 - step }];
            }
        }
        for (lane, start) in group.starts[1..][..group.count].iter().enumerate() {
            let fixed = &fixed[*start..][..n];
            let neighbours = group.across.map(|across| [&u[start - across..][..n], &u[start + across..][..n]]);
            for (step, place) in self.across[BEHIND * (lane + 1) + 1..][..n].iter_mut().enumerate() {
                let k = if group.forwards { step } else { n - 1 - step };
                let least = neighbours.map_or(f64::INFINITY, |[below, above]| min(below[k], above[k]));
                place[lane] = if fixed[k] { -1.0 } else { least };
            }
        }
    }

    fn store(&self, u: &mut [f64], group: &Group) {
        let n = self.n;
        for (row, start) in group.starts.iter().enumerate().skip(1).take(group.count) {
            let to = &mut u[*start..][..n];
            for (step, place) in self.u[BEHIND * row + 1..][..n].iter().enumerate() {
                to[if group.forwards { step } else { n - 1 - step }] = place[row];
            }
        }
    }
}

/// The smaller number, as one instruction; no operand is NaN.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

struct Pass<'r>(&'r mut Rows);

impl WithSimd for Pass<'_> {
    type Output = f64;

    /// The left-hand side of eq. 12 grows with u, so ũ < u exactly where it exceeds h² at the present u: only there is the solution
    /// taken.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Rows { u, across, .. } = self.0;
        let zero = simd.splat_f64s(0.0);
        let mut largest = [zero; LANES];
        // As many of these as a register has numbers share the first of them.
        let mut before = [simd.splat_f64s(f64::INFINITY); LANES];
        for p in BEHIND + 1..u.len() - BEHIND {
            let [rows_before, here, next, rows_after] = [u[p - BEHIND], u[p], u[p + 1], u[p + BEHIND]];
            for l in (0..LANES).step_by(S::F64_LANES) {
                let old = load::<S>(&here[l + 1..]);
                let a = load::<S>(&across[p][l..]);
                let b = simd.min_f64s(load::<S>(&rows_before[l..]), load::<S>(&rows_after[l + 2..]));
                let c = simd.min_f64s(before[l], load::<S>(&next[l + 1..]));
                let side = positive_square(simd, simd.sub_f64s(old, a));
                let side = simd.add_f64s(side, positive_square(simd, simd.sub_f64s(old, b)));
                let side = simd.add_f64s(side, positive_square(simd, simd.sub_f64s(old, c)));
                let is_solved = simd.less_than_or_equal_f64s(side, simd.splat_f64s(1.0 + SOLVED));
                let stays = simd.or_m64s(is_solved, simd.less_than_f64s(a, zero));
                let solution = simd.min_f64s(local_solution(simd, a, b, c), old);
                let decrease = simd.select_f64s(stays, zero, simd.sub_f64s(old, solution));
                largest[l] = simd.max_f64s(largest[l], decrease);
                before[l] = simd.select_f64s(stays, old, solution);
                S::as_mut_simd_f64s(&mut u[p][l + 1..][..S::F64_LANES]).0[0] = before[l];
            }
        }
        largest.into_iter().map(|largest| simd.reduce_max_f64s(largest)).fold(0.0, f64::max)
    }
}

#[inline(always)]
fn load<S: Simd>(from: &[f64]) -> S::f64s {
    S::as_simd_f64s(&from[..S::F64_LANES]).0[0]
}
