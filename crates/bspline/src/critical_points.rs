//! Places where the gradient vanishes: the values at which level sets change their topology.

use std::cmp::Ordering;

use rayon::prelude::*;

use crate::block_mask::SIDE;
use crate::cell_band::{cell_extent, check_uniform};
use crate::coefficient_window::CoefficientWindow;
use crate::hierarchical_spline::{HierarchicalSpline, LOCAL, WIDTH};
use crate::index_set::IndexSet;
use crate::leaf_cells::{LeafCell, child, of_half};
use crate::spline::Jet;

/// Cells are halved so often before Newton's method begins in each part.
const HALVINGS: usize = 2;
/// Newton's method doubles the digits; from the middle of a part that holds a zero fewer steps are enough.
const STEPS: usize = 24;
/// It has ended when a step is shorter than this share of the cell.
const SETTLED: f64 = 1e-9;
/// A place is taken for one of a cell's own up to this share of its side beyond its faces, so that none between two cells is lost,
const BEYOND: f64 = 1e-6;
/// and for the same as another one within this share.
const SAME: f64 = 1e-5;

/// A place where `∇f = 0`.
///
/// When the level passes a critical value the topology of the level set changes there (Milnor 1963): for a function that is negative
/// inside, a rising level adds a component at one of Morse index 0, a bridge at one of index 1, and in space a membrane at
/// one of index 2; at the highest index a hollow is filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalPoint<const D: usize> {
    /// Where it is.
    pub place: [f64; D],
    /// f there.
    pub value: f64,
    /// The Morse index: the number of negative eigenvalues of the Hessian.
    pub index: usize,
}

/// A box in which one is looked for.
struct Cell<const D: usize> {
    lower: [f64; D],
    sides: [f64; D],
}

impl<const D: usize> HierarchicalSpline<D> {
    /// The critical points with `|f| ≤ limit`.
    ///
    /// Cells are ruled out by the coefficients that act on them, and by the differences of these along each axis, which bound the
    /// gradient; in parts of the others Newton's method begins. Where ∇f vanishes along a curve or a surface some of its places are found.
    /// A spline that is not a uniform cubic is bounded by its values only, and no more than one point is found in each cell.
    pub fn critical_points(&self, limit: f64) -> Vec<CriticalPoint<D>> {
        let mut found: Vec<_> = if check_uniform(self.root().knots()).is_ok() {
            (0..=self.levels().len()).flat_map(|level| self.on_level(level, limit)).collect()
        } else {
            self.on_any_knots(limit)
        };
        // What two parts or two cells share is found by both.
        found.sort_by(|a, b| a.place.iter().zip(&b.place).fold(Ordering::Equal, |o, (a, b)| o.then(a.total_cmp(b))));
        let tolerance = SAME * self.shortest_side();
        let mut distinct: Vec<CriticalPoint<D>> = Vec::with_capacity(found.len());
        for point in found {
            let off = |other: &CriticalPoint<D>, axis: usize| (other.place[axis] - point.place[axis]).abs();
            let mut near = distinct.iter().rev().take_while(|other| off(other, 0) <= tolerance);
            if !near.any(|other| (0..D).all(|axis| off(other, axis) <= tolerance)) {
                distinct.push(point);
            }
        }
        distinct
    }

    fn shortest_side(&self) -> f64 {
        let knots = self.knots_of(self.levels().len());
        let sides = knots.iter().flat_map(|knots| knots.cells().map(|(_, start, end)| end - start));
        sides.fold(f64::INFINITY, f64::min)
    }

    /// Those in a level's cells that no finer level covers.
    fn on_level(&self, level: usize, limit: f64) -> Vec<CriticalPoint<D>> {
        let (knots, finer) = (self.knots_of(level), self.levels().get(level).map(|level| level.cells()));
        let extent = cell_extent(knots);
        let all;
        let cells = match level {
            0 => {
                all = IndexSet::full(extent);
                &all
            }
            _ => self.levels()[level - 1].cells(),
        };
        let covered =
            |index: [u32; D]| finer.is_some_and(|finer| (0..1 << D).all(|corner| finer.contains(child(index, corner))));
        let axes: [(f64, f64); D] = std::array::from_fn(|axis| {
            let (start, end) = knots[axis].domain();
            (start, (end - start) / f64::from(extent[axis]))
        });
        let in_block = |slot: usize| {
            let start = cells.block_start(slot);
            let mut window = CoefficientWindow::<D>::zeros();
            self.gather(level, start.map(i64::from), CoefficientWindow::<D>::SIDE, window.as_mut_slice());
            let (low, high) = window.range();
            let mut found = Vec::new();
            if low > limit || high < -limit {
                return found;
            }
            let (lower, upper) = window.bounds();
            cells.for_each_place(slot, |place| {
                let places = [place / (SIDE * SIDE), place / SIDE % SIDE, place % SIDE];
                let places: [usize; D] = std::array::from_fn(|axis| places[3 - D + axis]);
                let index = std::array::from_fn(|axis| start[axis] + places[axis] as u32);
                if lower[place] > limit || upper[place] < -limit {
                    return;
                }
                let local = window.local(places);
                if may_vanish::<D>(&local) && !covered(index) {
                    let lower = std::array::from_fn(|axis| axes[axis].0 + f64::from(index[axis]) * axes[axis].1);
                    let cell = Cell { lower, sides: axes.map(|(_, side)| side) };
                    self.in_parts(&cell, &cell, &local, D * HALVINGS, limit, &mut found);
                }
            });
            found
        };
        let parts: Vec<_> = (0..cells.block_count()).into_par_iter().map(in_block).collect();
        parts.concat()
    }

    /// Those of a cell that Newton's method finds from the middles of its parts.
    fn in_parts(
        &self,
        cell: &Cell<D>,
        part: &Cell<D>,
        local: &[f64; LOCAL],
        halvings: usize,
        limit: f64,
        found: &mut Vec<CriticalPoint<D>>,
    ) {
        if halvings == 0 {
            let new = self.newton_from(cell, part).filter(|point| point.value.abs() <= limit);
            found.extend(new);
            return;
        }
        // One axis after the other, so that what is ruled out is not halved along the others.
        let axis = (D - halvings % D) % D;
        for half in 0..2 {
            let local = of_half::<D>(local, axis, half);
            let acting = &local[..WIDTH.pow(D as u32)];
            let in_reach = acting.iter().any(|c| *c <= limit) && acting.iter().any(|c| *c >= -limit);
            if in_reach && may_vanish::<D>(&local) {
                let mut part = Cell { ..*part };
                part.sides[axis] *= 0.5;
                part.lower[axis] += half as f64 * part.sides[axis];
                self.in_parts(cell, &part, &local, halvings - 1, limit, found);
            }
        }
    }

    /// Those in the cells of a spline without levels on any knots.
    fn on_any_knots(&self, limit: f64) -> Vec<CriticalPoint<D>> {
        let axes = self.root().knots().each_ref().map(|knots| knots.cells().collect::<Vec<_>>());
        let leaves = self.leaf_cells(|leaf| leaf.lower <= limit && leaf.upper >= -limit);
        let in_cell = |leaf: &LeafCell<D>| {
            let ends = |axis: usize| axes[axis][leaf.index[axis] as usize];
            let lower = std::array::from_fn(|axis| ends(axis).1);
            let cell = Cell { lower, sides: std::array::from_fn(|axis| ends(axis).2 - ends(axis).1) };
            self.newton_from(&cell, &cell).filter(|point| point.value.abs() <= limit)
        };
        leaves.par_iter().filter_map(in_cell).collect()
    }

    /// Newton's method from the middle of a part of a cell; none if it leads out of the cell.
    fn newton_from(&self, cell: &Cell<D>, part: &Cell<D>) -> Option<CriticalPoint<D>> {
        let mut place: [f64; D] = std::array::from_fn(|axis| part.lower[axis] + 0.5 * part.sides[axis]);
        for _ in 0..STEPS {
            let jet = self.jet(&place);
            let step = newton_step(&jet)?;
            // One step may lead far where f is nearly flat; what it leads to is another cell's.
            let longest = (0..D).map(|axis| (step[axis] / cell.sides[axis]).abs()).fold(0.0, f64::max);
            let shortened = (0.5 / longest).min(1.0);
            place = std::array::from_fn(|axis| place[axis] + shortened * step[axis]);
            let share = |axis: usize| (place[axis] - cell.lower[axis]) / cell.sides[axis];
            if !(0..D).all(|axis| (-0.5..=1.5).contains(&share(axis))) {
                return None;
            }
            if longest < SETTLED {
                let own = (0..D).all(|axis| (-BEYOND..=1.0 + BEYOND).contains(&share(axis)));
                return own.then(|| CriticalPoint { place, value: jet.value, index: morse_index(&jet.hessian) });
            }
        }
        None
    }
}

/// Whether the differences of the coefficients that act on a cell leave open that all components of ∇f vanish in it.
fn may_vanish<const D: usize>(local: &[f64; LOCAL]) -> bool {
    (0..D).all(|axis| match D - axis {
        1 => has_turn::<D, 1>(local),
        2 => has_turn::<D, WIDTH>(local),
        _ => has_turn::<D, { WIDTH * WIDTH }>(local),
    })
}

/// Whether the coefficients neither all rise nor all fall along the axis with that stride.
fn has_turn<const D: usize, const STRIDE: usize>(local: &[f64; LOCAL]) -> bool {
    let (mut rises, mut falls) = (false, false);
    for block in (0..WIDTH.pow(D as u32)).step_by(STRIDE * WIDTH) {
        for at in block..block + STRIDE * (WIDTH - 1) {
            let difference = local[at + STRIDE] - local[at];
            rises |= difference >= 0.0;
            falls |= difference <= 0.0;
        }
    }
    rises && falls
}

/// `−H⁻¹ ∇f` by Cramer's rule; none where H is singular or the place is outside the box.
fn newton_step<const D: usize>(jet: &Jet<D>) -> Option<[f64; D]> {
    let determinant = determinant(&jet.hessian);
    let step = std::array::from_fn(|axis| {
        let mut replaced = jet.hessian;
        for row in 0..D {
            replaced[row][axis] = -jet.gradient[row];
        }
        self::determinant(&replaced) / determinant
    });
    step.iter().all(|s: &f64| s.is_finite()).then_some(step)
}

fn determinant<const D: usize>(m: &[[f64; D]; D]) -> f64 {
    let minor = |a: usize, b: usize| m[0][a] * m[1][b] - m[0][b] * m[1][a];
    match D {
        2 => minor(0, 1),
        _ => m[2][2] * minor(0, 1) - m[2][1] * minor(0, 2) + m[2][0] * minor(1, 2),
    }
}

/// The negative eigenvalues of a symmetric matrix: as many as its characteristic polynomial has changes of sign when the sign of
/// its variable is turned. (Descartes' rule, which is exact where all roots are real.)
fn morse_index<const D: usize>(m: &[[f64; D]; D]) -> usize {
    let trace: f64 = (0..D).map(|k| m[k][k]).sum();
    let pairs = (0..D).flat_map(|a| (a + 1..D).map(move |b| (a, b)));
    let minors: f64 = pairs.map(|(a, b)| m[a][a] * m[b][b] - m[a][b] * m[b][a]).sum();
    let coefficients = [1.0, trace, minors, if D == 3 { determinant(m) } else { 0.0 }];
    let signs: Vec<bool> = coefficients.into_iter().filter(|c| *c != 0.0).map(|c| c > 0.0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}
