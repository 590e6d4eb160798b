//! The paper's fast sweeping: Godunov's upwind scheme, eqs. 12 and 13, solved by Gauss–Seidel sweeps.

use rayon::prelude::*;

use crate::ghost::Ghosted;
use crate::near_field::NearField;
use crate::rows::{Group, Rows};
use crate::sweep::{Swept, sweep, sweep_order};
use crate::tiles::{Field, Parts, Tile};

/// Sweeps the near field outwards, nodes less than `radius` cells from a point staying as they are; returns distances in lattice units, with ghosts.
pub(crate) fn godunov<const D: usize>(
    ghosted: &Ghosted<D>,
    near: NearField,
    radius: usize,
    rounds: usize,
) -> (Vec<f64>, Swept) {
    let mut u = near.squared;
    let exact = (radius as f64).powi(2);
    let fixed: Vec<bool> = u.par_iter().with_min_len(1 << 14).map(|squared| *squared < exact).collect();
    u.par_iter_mut().with_min_len(1 << 14).for_each(|value| *value = value.sqrt());
    let mut distances = Distances { u, fixed };
    let swept = sweep(ghosted, rounds, &mut distances);
    (distances.u, swept)
}

/// Distances in lattice units, infinite where unknown, and which of them stay as they are.
struct Distances {
    u: Vec<f64>,
    fixed: Vec<bool>,
}

impl<const D: usize> Field<D> for Distances {
    fn relax(&mut self, lattice: &Ghosted<D>, _: [usize; D], sweep: usize) -> f64 {
        let mut rows = Rows::new(lattice.row_len());
        let groups = Group::all(lattice, sweep_order(sweep));
        groups.map(|group| rows.relax(&mut self.u, &self.fixed, &group)).fold(0.0, f64::max)
    }

    fn part(&self, tile: &Tile<'_, D>) -> Self {
        Self { u: tile.part(&self.u), fixed: tile.part(&self.fixed) }
    }

    fn put_back(&mut self, parts: &Parts<'_, '_, D, Self>) {
        parts.slabs(&mut self.u).zip(parts.par_iter()).for_each(|(u, (tile, part))| tile.put_back(u, &part.u));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::local_solution::{local_solution, positive_square};
    use crate::near_field::near_field;
    use crate::rows::SOLVED;

    fn left_hand_side(x: f64, neighbours: [f64; 3]) -> f64 {
        neighbours.map(|a| positive_square(pulp::Scalar, x - a)).iter().sum()
    }

    /// Solves to the fixed point and checks eqs. 12 and 13 at each node that was free to change.
    fn fixed_point_satisfies_the_scheme<const D: usize>(shape: [usize; D], points: &[[f64; D]]) {
        let ghosted = Ghosted::new(shape);
        let near = near_field(&ghosted, points, 2);
        let start: Vec<f64> = near.squared.iter().map(|squared| squared.sqrt()).collect();
        let (u, swept) = godunov(&ghosted, near, 2, 50);
        assert_eq!(swept.last_change, 0.0, "50 rounds reach the fixed point");
        let mut free = 0;
        for number in 0..ghosted.row_count() {
            let first = ghosted.row(number, [true; D]).start;
            for at in first..first + ghosted.row_len() {
                if start[at] < 2.0 {
                    assert_eq!(u[at], start[at], "exact values stay");
                    continue;
                }
                let mut neighbours = [f64::INFINITY; 3];
                for (least, stride) in neighbours.iter_mut().zip(ghosted.strides()) {
                    *least = u[at - stride].min(u[at + stride]);
                }
                let side = left_hand_side(u[at], neighbours);
                assert!(side <= 1.0 + SOLVED);
                // Equality up to SOLVED and rounding, except where the start value was already lower.
                assert!(side >= 1.0 - 2.0 * SOLVED || u[at] == start[at]);
                free += usize::from(u[at] < start[at]);
            }
        }
        assert!(free > 100, "the test looked at free nodes");
    }

    #[test]
    fn fixed_points_satisfy_equations_12_and_13() {
        // Two points see the node (5, 5) at a right angle from 1.5 cells: there the scheme would undercut the
        // exact value, 0.5 + √½ < 1.5.
        let corner = [[3.5, 5.0], [5.0, 3.5]];
        fixed_point_satisfies_the_scheme([30, 21], &[[20.0, 11.1], [8.0, 18.7], corner[0], corner[1]]);
        fixed_point_satisfies_the_scheme([12, 9, 14], &[[3.2, 4.9, 0.3], [10.0, 1.1, 12.9]]);
    }

    /// Sweeps node after node, in the order that the paper lists.
    fn node_after_node<const D: usize>(shape: [usize; D], points: &[[f64; D]], sweeps: usize) -> Vec<f64> {
        let ghosted = Ghosted::new(shape);
        let mut u: Vec<f64> = near_field(&ghosted, points, 2).squared.iter().map(|squared| squared.sqrt()).collect();
        let fixed: Vec<bool> = u.iter().map(|u| *u < 2.0).collect();
        for forwards in (0..sweeps).map(sweep_order::<D>) {
            for number in 0..ghosted.row_count() {
                let start = ghosted.row(number, forwards).start;
                for step in 0..ghosted.row_len() {
                    let at = start + if forwards[D - 1] { step } else { ghosted.row_len() - 1 - step };
                    let mut neighbours = [f64::INFINITY; 3];
                    for (least, stride) in neighbours.iter_mut().zip(ghosted.strides()) {
                        *least = u[at - stride].min(u[at + stride]);
                    }
                    if !fixed[at] && left_hand_side(u[at], neighbours) > 1.0 + SOLVED {
                        u[at] = u[at].min(local_solution(pulp::Scalar, neighbours[0], neighbours[1], neighbours[2]));
                    }
                }
            }
        }
        u
    }

    fn several_rows_at_once_agree<const D: usize>(shape: [usize; D], points: &[[f64; D]]) {
        let ghosted = Ghosted::new(shape);
        let (u, swept) = godunov(&ghosted, near_field(&ghosted, points, 2), 2, 1);
        assert!(swept.last_change > 0.0, "all orders count");
        assert!(u == node_after_node(shape, points, swept.sweeps), "not a bit differs");
    }

    #[test]
    fn several_rows_at_once_have_the_values_of_node_after_node() {
        // Rows fewer than, as many as, and more than are visited at once.
        several_rows_at_once_agree([21, 30], &[[20.0, 11.1], [8.0, 18.7], [3.5, 5.0]]);
        several_rows_at_once_agree([3, 30], &[[2.0, 11.1], [0.0, 25.7]]);
        several_rows_at_once_agree([12, 8, 14], &[[3.2, 4.9, 0.3], [10.0, 1.1, 12.9]]);
        several_rows_at_once_agree([7, 19, 5], &[[3.2, 4.9, 0.3], [5.0, 16.1, 3.9]]);
    }
}
