//! Points that lie on no curve or surface with others.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

use crate::points::kd_tree::tree_of;
use crate::points::left_out::{MOST, mark, without};
use crate::points::spacing::{NEIGHBOURS, ROUND, Spacing, distances_to, per_distance, roundness};

/// Isolated points are looked for so often at most, each time among those that are left,
const ROUNDS: usize = 4;
/// as long as a larger share than this is found: the tips of sparse parts would be worn away.
const MANY_ISOLATED: f64 = 0.005;
/// Of the other points such a share or more has one about it where points are strewn, in space and in the plane. In space 0.41 to 1 of
/// points on six models with 1 to 25 % of strays (a plate, which fills its box, has once 0.26), 0.02 to 0.3 where one half of a model is
/// 16 to 60 times as dense as the other. In the plane 0.86 to 1 about 14 outlines with 3 and 10 % of strays, 0.75 and more with 25 % (one
/// in twenty less), 0.02 to 0.35 where one half has an eighth of the density or it falls to a thirtieth from end to end.
const AMONG: [f64; 2] = [0.35, 0.7];
/// A sparse part's points have two others of it about them within so many times the distance at which most have.
const APART: f64 = 3.0;
/// Roundness up to which a point continues the surface of its neighbours: two thirds of the points at the border of such a half, one in ten
/// of those strays, whose nearest neighbours lie around their foot.
const FLAT: f64 = 0.1;
/// How many neighbours tell whether a point is isolated.
const VICINITY: usize = 12;
/// How many times the usual distance is far.
const FAR: f64 = 3.0;
/// So far off are hardly any points of a curve from the nearest one, however randomly they lie: one in three thousand.
const ALONE: f64 = 4.0;
/// And in the plane, where a bend or a corner of a sparse part makes its points as round as those of an area; points strewn over the
/// box are farther apart.
const FAR_IN_PLANE: f64 = 8.0;

/// Which points lie on no surface with others (none, if these are so many that they must be the shape), the other points, and
/// their spacing.
pub fn isolated<const D: usize>(points: &[[f64; D]], spacing: Spacing) -> (Vec<bool>, Vec<[f64; D]>, Spacing) {
    let mut isolated = vec![false; points.len()];
    let (mut rest, mut rest_spacing) = (points.to_vec(), spacing.clone());
    let sparse = SparsePart::of(points, &spacing);
    // Among many strays some look like a surface together, until the others are gone.
    for _ in 0..ROUNDS {
        let found = found_once(&rest, &rest_spacing, sparse.as_ref());
        if !found.contains(&true) {
            break;
        }
        mark(&mut isolated, &found);
        let count = isolated.iter().filter(|isolated| **isolated).count();
        if count as f64 > MOST * points.len() as f64 {
            return (vec![false; points.len()], points.to_vec(), spacing);
        }
        let few = (found.iter().filter(|found| **found).count() as f64) < MANY_ISOLATED * points.len() as f64;
        (rest, rest_spacing) = without(&rest, &found, rest_spacing);
        if few {
            break;
        }
    }
    (isolated, rest, rest_spacing)
}

/// Which points are on no curve or surface with others: much farther from their neighbours than usual, and either
/// much farther than those are from theirs, or spread with them over a volume rather than along a surface. In the plane also those
/// that are much farther from even the nearest one, and have all of them on one side.
///
/// However a `sparse` part of it is bent, its points are no volume. Those that contrast with their neighbours, as they do beside the
/// border of a dense part, are not isolated either where they continue it or have others of the sparse part about them.
fn found_once<const D: usize>(points: &[[f64; D]], spacing: &Spacing, sparse: Option<&SparsePart<D>>) -> Vec<bool> {
    if points.len() <= 2 * VICINITY {
        return vec![false; points.len()];
    }
    let tree = tree_of(points);
    let wanted = NonZero::<usize>::MIN.saturating_add(VICINITY);
    let (far, alone) = (FAR * spacing.typical, ALONE * spacing.typical);
    (0..points.len())
        .into_par_iter()
        .map(|i| {
            let (local, nearest) = (spacing.local[i], if D == 2 { spacing.nearest[i] } else { 0.0 });
            if local <= far && nearest <= alone {
                return false;
            }
            let mut neighbours = tree.query(&points[i]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
            neighbours.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.item.cmp(&b.item)));
            let indices: Vec<usize> = neighbours.iter().map(|n| n.item as usize).collect();
            let mut theirs: Vec<f64> = indices.iter().map(|&i| spacing.local[i]).collect();
            theirs.sort_by(f64::total_cmp);
            let usual = theirs[theirs.len() / 2];
            let beside = || one_sided(&points[i], indices[1..=NEIGHBOURS].iter().map(|&i| points[i]));
            let contrasts = local > far && local > 0.8 * FAR * usual || nearest > ALONE * usual && beside();
            let rounder_than = |limit: f64| roundness(points, &indices) > limit;
            if let Some(sparse) = sparse {
                return contrasts && rounder_than(FLAT) && !sparse.is_about(&points[i]);
            }
            let strewn = local > if D == 2 { FAR_IN_PLANE * spacing.typical } else { far };
            contrasts || strewn && rounder_than(ROUND)
        })
        .collect()
}

/// The points that are far from their neighbours, where they are a sparse part of the curve or surface.
struct SparsePart<const D: usize> {
    tree: ImmutableKdTree<f64, D>,
    /// How far from the second nearest other one each of them is at most.
    apart: f64,
}

impl<const D: usize> SparsePart<D> {
    /// They are that if they keep apart from the others: if hardly any of those has one about it, as near as six of them are to each
    /// other. What is strewn over the box is near all of them.
    fn of(points: &[[f64; D]], spacing: &Spacing) -> Option<Self> {
        let is_far = |i: &usize| spacing.local[*i] > FAR * spacing.typical;
        let (far, others): (Vec<usize>, Vec<usize>) = (0..points.len()).partition(is_far);
        let plane = usize::from(D == 2);
        if far.len() <= [VICINITY, NEIGHBOURS][plane] {
            return None;
        }
        let [far, others] = [far, others].map(|indices| indices.iter().map(|i| points[*i]).collect::<Vec<_>>());
        let reach = Spacing::of(&far).typical / per_distance::<D>(NEIGHBOURS);
        let near = distances_to(&far, &others).iter().filter(|distance| **distance < reach).count();
        if near as f64 >= AMONG[plane] * others.len() as f64 {
            return None;
        }
        let tree = tree_of(&far);
        let mut seconds: Vec<f64> = far.par_iter().map(|point| second_other(&tree, point)).collect();
        seconds.sort_by(f64::total_cmp);
        Some(Self { tree, apart: APART * seconds[seconds.len() / 2] })
    }

    /// Whether one of its points has others of it about it.
    fn is_about(&self, point: &[f64; D]) -> bool {
        second_other(&self.tree, point) <= self.apart
    }
}

/// How far the second nearest point is from one in the tree, besides itself.
fn second_other<const D: usize>(tree: &ImmutableKdTree<f64, D>, point: &[f64; D]) -> f64 {
    let three = NonZero::<usize>::MIN.saturating_add(2);
    let nearest = tree.query(point).nearest_n::<SquaredEuclidean<f64>>(three).execute();
    nearest.iter().map(|n| n.distance).fold(0.0, f64::max).sqrt()
}

/// Whether some places are all on one side of a point: seen from there no two are in directions more than 120° apart.
fn one_sided<const D: usize>(point: &[f64; D], places: impl Iterator<Item = [f64; D]>) -> bool {
    let directions: Vec<[f64; D]> = places
        .map(|place| {
            let step: [f64; D] = std::array::from_fn(|axis| place[axis] - point[axis]);
            let length = step.iter().map(|x| x * x).sum::<f64>().sqrt();
            step.map(|x| x / length)
        })
        .collect();
    let cosine = |a: &[f64; D], b: &[f64; D]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    directions.iter().all(|a| directions.iter().all(|b| cosine(a, b) > -0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which are found in the first round.
    fn isolated_once<const D: usize>(points: &[[f64; D]]) -> Vec<bool> {
        let spacing = Spacing::of(points);
        found_once(points, &spacing, SparsePart::of(points, &spacing).as_ref())
    }

    #[test]
    fn points_off_the_surface_are_isolated_and_sparse_parts_are_not() {
        // A square grid, ten times coarser on its right half, and points above it on a coarse cubic lattice.
        let mut points: Vec<[f64; 3]> = (0..10_000).map(|i| [f64::from(i % 100), f64::from(i / 100), 0.0]).collect();
        points.extend((0..100).map(|i| [104.0 + 10.0 * f64::from(i % 10), 10.0 * f64::from(i / 10), 0.0]));
        let surface = points.len();
        points.extend(
            (0..125).map(|i| [f64::from(i % 5), f64::from(i / 5 % 5), f64::from(i / 25)].map(|x| 20.0 * (x + 0.9))),
        );
        let isolated = isolated_once(&points);
        let wrong = isolated[..surface].iter().filter(|i| **i).count();
        // Beside the border between the halves neighbours differ tenfold.
        assert!(wrong <= 20, "{wrong} of the sparse part");
        assert!(isolated[surface..].iter().all(|i| *i));
    }

    #[test]
    fn a_sparse_half_is_not_isolated_however_it_is_bent() {
        let any = |i: usize, step: f64| (i as f64 * step).fract();
        // Half of a ring with 4000 points, the other half with 120, as far apart as its tube is thick (Roberts' sequences).
        let ring = |i: usize, count: usize, from: f64| {
            let along = std::f64::consts::PI * (from + (i as f64 + 0.5) / count as f64);
            let around = std::f64::consts::TAU * any(i, 0.618_033_988_749_895);
            let from_axis = 1.0 + 0.25 * around.cos();
            [from_axis * along.cos(), from_axis * along.sin(), 0.25 * around.sin()]
        };
        let mut points: Vec<[f64; 3]> =
            (0..4000).map(|i| ring(i, 4000, 0.0)).chain((0..120).map(|i| ring(i, 120, 1.0))).collect();
        let count = |isolated: &[bool]| isolated.iter().filter(|isolated| **isolated).count();
        let found = isolated_once(&points);
        assert!(count(&found) <= 4, "{} at the borders", count(&found));
        // As many over a box about both halves are.
        let over = |i, step| 3.0 * any(i, step) - 1.5;
        points.truncate(4000);
        points.extend((1..=120).map(|i| [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| over(i, step))));
        let found = isolated_once(&points);
        assert!(count(&found[..4000]) == 0 && count(&found[4000..]) >= 110, "{} of 120", count(&found[4000..]));
    }

    /// Which are isolated among points of a square, an eighth as many along its left half, and some more.
    fn isolated_beside_a_square(more: &[[f64; 2]]) -> (Vec<usize>, Vec<bool>) {
        let side = |i: i32| {
            let t = if i < 40 { 0.5 * f64::from(i) / 40.0 } else { 0.5 + 0.5 * f64::from(i - 40) / 320.0 };
            [[t, 0.0], [t, 1.0]]
        };
        let mut points: Vec<[f64; 2]> = (0..360).flat_map(side).collect();
        points.extend((1..80).map(|i| [0.0, f64::from(i) / 80.0]));
        points.extend((1..640).map(|i| [1.0, f64::from(i) / 640.0]));
        let square = points.len();
        points.extend(more);
        let isolated = isolated_once(&points);
        ((0..square).filter(|i| isolated[*i]).collect(), isolated[square..].to_vec())
    }

    #[test]
    fn corners_of_a_sparse_outline_are_not_isolated() {
        assert_eq!(isolated_beside_a_square(&[]).0, [0; 0]);
    }

    #[test]
    fn points_beside_a_curve_are_isolated() {
        let s = 1.0 / 640.0;
        // Beside the dense part, inside and outside, and halfway; but not in a gap of the curve.
        let beside = [[1.0 + 6.0 * s, 0.4], [1.0 - 6.0 * s, 0.6], [0.5, 0.5]];
        let mut line: Vec<[f64; 2]> = (0..5).map(|i| [1.0 + f64::from(i + 1) * s, 1.0]).collect();
        line.extend((0..20).map(|i| [1.0 + 12.0 * s + f64::from(i) * s, 1.0]));
        let in_gap = [1.0 + 8.5 * s, 1.0];
        let (square, found) = isolated_beside_a_square(&[&beside[..], &line, &[in_gap]].concat());
        assert_eq!((square, &found[..3]), (vec![], &[true; 3][..]));
        assert!(found[3..].iter().all(|isolated| !isolated), "{found:?}");
    }

    #[test]
    fn strays_are_isolated_whatever_their_number() {
        let golden = |i: usize, step: f64| (i as f64 * step).fract();
        let sphere = (0..4000).map(|i| {
            let (z, angle) =
                (2.0 * (i as f64 + 0.5) / 4000.0 - 1.0, std::f64::consts::TAU * golden(i, 0.618_033_988_749_895));
            let ring = (1.0 - z * z).sqrt();
            [ring * angle.cos(), ring * angle.sin(), z]
        });
        for strays in [40, 160, 800] {
            // Quasi-random in a box half as large again (Roberts' sequence), but four spacings and more off the surface.
            let stray = |i| [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| 3.0 * golden(i, step) - 1.5);
            let spacing = (4.0 * std::f64::consts::PI / 4000.0).sqrt();
            let is_off = |p: &[f64; 3]| (p.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() > 4.0 * spacing;
            let points: Vec<[f64; 3]> = sphere.clone().chain((0..).map(stray).filter(is_off).take(strays)).collect();
            let (found, rest, _) = isolated(&points, Spacing::of(&points));
            assert!(
                !found[..4000].contains(&true) && rest.len() <= 4000 + strays / 50,
                "{strays}: {} left",
                rest.len() - 4000
            );
        }
    }
}
