//! Whether an open surface has two sides everywhere.
//!
//! Around a Möbius band the side turns over: no function is negative on one side of it and positive on the other. Somewhere the signs
//! meet, and the zero set leaves the points there. Winding numbers do not show it, for an open surface has no inside.

use std::collections::BTreeSet;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::points::frame::Frame;
use crate::points::kd_tree::tree_of;
use crate::trust::{place, shape_name};

/// How many neighbours are looked at.
const NEIGHBOURS: usize = 6;
/// And how far away they may be, in spacings.
const NEAR: f64 = 1.5;
/// Normals with a smaller scalar product are opposite.
const OPPOSITE: f64 = -0.5;
/// The largest sine between a tangent plane and the way to a neighbour in it.
const IN_PLANE: f64 = 0.5;

/// An open surface whose sides meet at more of its points is not to be trusted.
const ONE_SIDED: f64 = 0.02;
/// So many points that hang together along a seam are no chance: of noisy points a few turn here and there, of three sheets that are torn 9 to 52.
const SEAM: usize = 8;
/// In the plane a seam is a place, with a point on each side.
const SEAM_OF_CURVE: usize = 2;

/// A warning or a doubt, where the two sides of an open surface meet at some of its points or at too many; as [`turning`].
pub fn verdict<const D: usize>(
    points: &[[f64; D]],
    gradients: &[[f64; D]],
    spacing: &[f64],
    frame: &Frame<D>,
) -> (Option<String>, Option<String>) {
    let tree = tree_of(points);
    let turning = turning((points, &tree), gradients, spacing);
    let share = turning.len() as f64 / points.len() as f64;
    if share > ONE_SIDED {
        let doubt = format!(
            "no trustworthy open {} was found: at {:.1} % of the points its two sides meet; it may have one side only, as \
             a Möbius band, or walls closer than its points: try a denser scan, or parts of it",
            shape_name(D),
            100.0 * share
        );
        return (None, Some(doubt));
    }
    let seam = longest_seam(points, &tree, turning);
    let warning = (seam.len() >= if D == 2 { SEAM_OF_CURVE } else { SEAM }).then(|| {
        let place = place(&frame.to_data(&points[seam[seam.len() / 2]]));
        format!(
            "the two sides of the {} meet at {} points, as at {place}: it turns over there, or lies above itself like a ramp of several \
             turns, so that it is torn or joined there; try parts of it",
            shape_name(D),
            seam.len()
        )
    });
    (warning, None)
}

/// The points with a neighbour in their tangent plane where the `gradients` point the other way. `spacing` is local.
fn turning<const D: usize>(
    (points, tree): (&[[f64; D]], &ImmutableKdTree<f64, D>),
    gradients: &[[f64; D]],
    spacing: &[f64],
) -> Vec<usize> {
    if points.len() <= NEIGHBOURS {
        return vec![];
    }
    let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|k| a[k] * b[k]).sum::<f64>();
    let normals: Vec<[f64; D]> = gradients
        .iter()
        .map(|g| {
            let norm = dot(g, g).sqrt();
            g.map(|x| if norm > 0.0 { x / norm } else { 0.0 })
        })
        .collect();
    let turns = |i: usize| {
        neighbours(tree, &points[i]).into_iter().any(|j| {
            let way: [f64; D] = std::array::from_fn(|k| points[j][k] - points[i][k]);
            let length = dot(&way, &way).sqrt();
            let in_plane = |normal| dot(normal, &way).abs() < IN_PLANE * length;
            length < NEAR * spacing[i]
                && dot(&normals[i], &normals[j]) < OPPOSITE
                && in_plane(&normals[i])
                && in_plane(&normals[j])
        })
    };
    (0..points.len()).into_par_iter().filter(|&i| turns(i)).collect()
}

/// The most of some points that hang together, each one of the nearest of another.
fn longest_seam<const D: usize>(
    points: &[[f64; D]],
    tree: &ImmutableKdTree<f64, D>,
    turning: Vec<usize>,
) -> Vec<usize> {
    let mut left: BTreeSet<usize> = turning.into_iter().collect();
    let mut longest = vec![];
    while let Some(first) = left.pop_first() {
        let (mut seam, mut at) = (vec![first], 0);
        while let Some(point) = seam.get(at) {
            let beside = neighbours(tree, &points[*point]);
            seam.extend(beside.into_iter().filter(|j| left.remove(j)));
            at += 1;
        }
        if seam.len() > longest.len() {
            longest = seam;
        }
    }
    longest
}

/// The nearest points of one, and that itself.
fn neighbours<const D: usize>(tree: &ImmutableKdTree<f64, D>, point: &[f64; D]) -> Vec<usize> {
    let wanted = NonZero::<usize>::MIN.saturating_add(NEIGHBOURS);
    let nearest = tree.query(point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
    nearest.iter().map(|n| n.item as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_that_turns_over_is_seen_and_two_walls_are_not() {
        let grid: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        let up = vec![[0.0, 0.0, 2.0]; 400];
        assert!(turning((&grid, &tree_of(&grid)), &up, &[1.0; 400]).is_empty());
        let mut turned = up.clone();
        turned[200..].iter_mut().for_each(|normal| normal[2] = -2.0);
        // A row of twenty on each side of the middle.
        assert_eq!(turning((&grid, &tree_of(&grid)), &turned, &[1.0; 400]), (180..220).collect::<Vec<_>>());
        let walls: Vec<[f64; 3]> =
            grid.iter().enumerate().map(|(i, p)| [p[0], p[1] % 10.0, if i < 200 { 0.0 } else { 1.0 }]).collect();
        assert!(turning((&walls, &tree_of(&walls)), &turned, &[1.0; 400]).is_empty());
    }

    #[test]
    fn a_seam_is_warned_of_and_many_are_a_doubt() {
        let judged = |side: u32, turned: &dyn Fn(u32, u32) -> bool| {
            let grid: Vec<[f64; 3]> = (0..side * side).map(|i| [i / side, i % side, 0].map(f64::from)).collect();
            let up = |p: &[f64; 3]| if turned(p[0] as u32, p[1] as u32) { -1.0 } else { 1.0 };
            let normals: Vec<[f64; 3]> = grid.iter().map(|p| [0.0, 0.0, up(p)]).collect();
            verdict(
                &grid,
                &normals,
                &vec![1.0; grid.len()],
                &Frame { origin: [10.0, 0.0, 0.0], scale: 0.5, sides: [1.0; 3] },
            )
        };
        assert_eq!(judged(50, &|_, _| false), (None, None));
        assert_eq!(judged(120, &|x, y| x == 60 && y % 17 == 5), (None, None), "seven points here and there");
        // A hundred of 2500, and two of every row of 120.
        let (warning, doubt) = judged(50, &|x, _| x >= 25);
        assert!(warning.is_none() && doubt.is_some_and(|doubt| doubt.contains("4.0 %")));
        let (warning, doubt) = judged(120, &|x, _| x >= 60);
        assert!(doubt.is_none() && warning.is_some_and(|w| w.contains("at 240 points, as at (1")));
    }

    #[test]
    fn the_two_sides_of_a_sharp_edge_are_two_walls() {
        // Half lines down from a corner, 50° between them, with their first points at different distances from it: the way from
        // one point to the other is nearly along one line, and across the other.
        let (s, c) = 25f64.to_radians().sin_cos();
        let side = |x: f64, first: f64| (0..20).map(move |i| first + f64::from(i)).map(move |t| [x * s * t, -c * t]);
        let points: Vec<[f64; 2]> = side(1.0, 0.5).chain(side(-1.0, 0.1)).collect();
        let normals: Vec<[f64; 2]> = (0..40).map(|i| [if i < 20 { c } else { -c }, s]).collect();
        assert!(turning((&points, &tree_of(&points)), &normals, &[1.0; 40]).is_empty());
    }
}
