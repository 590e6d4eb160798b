//! How densely the points lie on the curve or surface.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;

use crate::kd_tree::tree_of;

/// Local and typical distance between neighbouring samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Spacing {
    /// Per point, in the unit of the points.
    pub local: Vec<f64>,
    /// Their median s.
    pub typical: f64,
    /// Density ρ = s^−(D−1): points per unit length in 2D, per unit area in 3D.
    pub density: f64,
    /// Per point: the share of curve or surface that it stands for, in units of the mean share.
    pub areas: Vec<f64>,
    /// Per point, the distance to the nearest other one.
    pub nearest: Vec<f64>,
}

/// How many neighbours an estimate looks at.
const NEIGHBOURS: usize = 6;

impl Spacing {
    /// Estimates the spacing from the distance `d_k` to the k-th neighbour, k = 6: around a point of a surface lie
    /// `k = ρ π d_k²` others, around one of a curve `k = 2 ρ d_k`.
    ///
    /// The points must be distinct and finite, and at least two.
    pub fn of<const D: usize>(points: &[[f64; D]]) -> Self {
        let k = NEIGHBOURS.min(points.len() - 1);
        let factor = per_distance::<D>(k);
        let tree = tree_of(points);
        // The point itself is among its own neighbours.
        let wanted = NonZero::<usize>::MIN.saturating_add(k);
        let (local, nearest): (Vec<f64>, Vec<f64>) = points
            .par_iter()
            .map(|p| {
                let neighbours = tree.query(p).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
                let mut distances: Vec<f64> = neighbours.iter().map(|n| n.distance.sqrt()).collect();
                distances.sort_by(f64::total_cmp);
                (factor * distances[k], distances[1])
            })
            .unzip();
        let mut sorted = local.clone();
        sorted.sort_by(f64::total_cmp);
        let typical = sorted[sorted.len() / 2];
        let areas = areas::<D>(&local, typical);
        Self { local, typical, density: typical.powi(1 - D as i32), areas, nearest }
    }

    /// The mean of the local spacing over each point's nearest neighbours, in the unit of the points: a single one errs by a fifth and
    /// more where samples are random.
    pub fn smoothed<const D: usize>(&self, points: &[[f64; D]]) -> Vec<f64> {
        let tree = tree_of(points);
        self.smoothed_in(&tree, points)
    }

    /// The areas by that spacing: a point that noise has taken far stands alone, and has a large one by its own.
    pub fn smoothed_areas<const D: usize>(&self, points: &[[f64; D]]) -> Vec<f64> {
        areas::<D>(&self.smoothed(points), self.typical)
    }

    /// As [`Spacing::smoothed`], with a tree of the points.
    pub(crate) fn smoothed_in<const D: usize>(&self, tree: &ImmutableKdTree<f64, D>, points: &[[f64; D]]) -> Vec<f64> {
        let Some(wanted) = NonZero::new(SMOOTH.min(points.len())) else { return vec![] };
        let mean = |point| {
            let nearest = tree.query(point).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
            nearest.iter().map(|n| self.local[n.item as usize]).sum::<f64>() / nearest.len() as f64
        };
        points.par_iter().map(mean).collect()
    }

    /// Which points are on no curve or surface with others: much farther from their neighbours than usual, and either
    /// much farther than those are from theirs, or spread with them over a volume rather than along a surface. In the plane also those
    /// that are much farther from even the nearest one, and have all of them on one side.
    ///
    /// Where those that are far from their neighbours [keep apart](Self::far_ones_keep_apart) they are a sparse part of it: however it is
    /// bent its points are no volume, and those that continue the dense part at its border are not isolated.
    pub fn isolated<const D: usize>(&self, points: &[[f64; D]], keeps_apart: bool) -> Vec<bool> {
        if points.len() <= 2 * VICINITY {
            return vec![false; points.len()];
        }
        let tree = tree_of(points);
        let wanted = NonZero::<usize>::MIN.saturating_add(VICINITY);
        let (far, alone) = (FAR * self.typical, ALONE * self.typical);
        (0..points.len())
            .into_par_iter()
            .map(|i| {
                let (local, nearest) = (self.local[i], if D == 2 { self.nearest[i] } else { 0.0 });
                if local <= far && nearest <= alone {
                    return false;
                }
                let mut neighbours = tree.query(&points[i]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
                neighbours.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.item.cmp(&b.item)));
                let indices: Vec<usize> = neighbours.iter().map(|n| n.item as usize).collect();
                let mut theirs: Vec<f64> = indices.iter().map(|&i| self.local[i]).collect();
                theirs.sort_by(f64::total_cmp);
                let usual = theirs[theirs.len() / 2];
                let beside = || one_sided(&points[i], indices[1..=NEIGHBOURS].iter().map(|&i| points[i]));
                if nearest > ALONE * usual && beside() {
                    return true;
                }
                if local <= far {
                    return false;
                }
                let contrasts = local > 0.8 * FAR * usual;
                let rounder_than = |limit: f64| roundness(points, &indices) > limit;
                if keeps_apart {
                    return contrasts && rounder_than(FLAT);
                }
                let strewn = D == 3 || local > FAR_IN_PLANE * self.typical;
                contrasts || strewn && rounder_than(ROUND)
            })
            .collect()
    }

    /// Whether hardly any of the other points has one that is far from its neighbours about it: as near as six such points are to each
    /// other. What is strewn over the box is near all of them. Not in the plane.
    pub fn far_ones_keep_apart<const D: usize>(&self, points: &[[f64; D]]) -> bool {
        let is_far = |i: &usize| self.local[*i] > FAR * self.typical;
        let (far, others): (Vec<usize>, Vec<usize>) = (0..points.len()).partition(is_far);
        if D == 2 || far.len() <= VICINITY {
            return false;
        }
        let [far, others] = [far, others].map(|indices| indices.iter().map(|i| points[*i]).collect::<Vec<_>>());
        let reach = Self::of(&far).typical / per_distance::<D>(NEIGHBOURS);
        let near = distances_to(&far, &others).iter().filter(|distance| **distance < reach).count();
        (near as f64) < AMONG * others.len() as f64
    }
}

/// The spacing of points whose k-th neighbour is at a distance of 1.
fn per_distance<const D: usize>(k: usize) -> f64 {
    if D == 2 { 2.0 / k as f64 } else { (std::f64::consts::PI / k as f64).sqrt() }
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

/// What share of curve or surface each point stands for by its spacing, in units of the mean share.
fn areas<const D: usize>(local: &[f64], typical: f64) -> Vec<f64> {
    let mut areas: Vec<f64> = local.iter().map(|s| (s / typical).powi(D as i32 - 1)).collect();
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    areas.iter_mut().for_each(|a| *a /= mean);
    areas
}

/// Of the other points such a share or more has one about it where points are strewn: 0.41 to 1 of points on six models with 1 to 25 % of
/// strays (a plate, which fills its box, has once 0.26), 0.02 to 0.3 where one half of a model is 16 to 60 times as dense as the other.
const AMONG: f64 = 0.35;
/// Roundness up to which a point continues the surface of its neighbours: two thirds of the points at the border of such a half, one in ten
/// of those strays, whose nearest neighbours lie around their foot.
const FLAT: f64 = 0.1;
/// Over so many neighbours a point's spacing is averaged.
const SMOOTH: usize = 24;
/// How many neighbours tell whether a point is isolated.
const VICINITY: usize = 12;
/// How many times the usual distance is far.
const FAR: f64 = 3.0;
/// So far off are hardly any points of a curve from the nearest one, however randomly they lie: one in three thousand.
const ALONE: f64 = 4.0;
/// And in the plane, where a bend or a corner of a sparse part makes its points as round as those of an area; points strewn over the
/// box are farther apart.
const FAR_IN_PLANE: f64 = 8.0;
/// Roundness above which a neighbourhood is no surface: that of points spread evenly through a ball is near 0.6, that of
/// a surface, flat within its neighbourhood, below 0.1.
pub(crate) const ROUND: f64 = 0.25;

/// How evenly some points spread in all directions: `det C / (tr C / D)^D` of their covariance C, from 0 (flat) to 1.
pub(crate) fn roundness<const D: usize>(points: &[[f64; D]], indices: &[usize]) -> f64 {
    let count = indices.len() as f64;
    let centre: [f64; D] = std::array::from_fn(|axis| indices.iter().map(|&i| points[i][axis]).sum::<f64>() / count);
    let mut c = [[0.0; 3]; 3];
    for &i in indices {
        for a in 0..D {
            for b in 0..D {
                c[a][b] += (points[i][a] - centre[a]) * (points[i][b] - centre[b]);
            }
        }
    }
    let trace: f64 = (0..D).map(|axis| c[axis][axis]).sum();
    let determinant = if D == 2 {
        c[0][0] * c[1][1] - c[0][1] * c[1][0]
    } else {
        c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1]) - c[0][1] * (c[1][0] * c[2][2] - c[1][2] * c[2][0])
            + c[0][2] * (c[1][0] * c[2][1] - c[1][1] * c[2][0])
    };
    determinant / (trace / D as f64).powi(D as i32)
}

/// The distance from each place to the nearest of the points, which must be distinct and finite.
pub(crate) fn distances_to<const D: usize>(points: &[[f64; D]], places: &[[f64; D]]) -> Vec<f64> {
    if places.is_empty() {
        return vec![];
    }
    let tree = tree_of(points);
    let nearest = |place| tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute().distance;
    places.par_iter().map(|place: &[f64; D]| nearest(place).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_samples_have_their_own_distance() {
        let circle: Vec<[f64; 2]> =
            (0..100).map(|i| f64::from(i) * 0.02 * std::f64::consts::PI).map(|t| [t.cos(), t.sin()]).collect();
        let spacing = Spacing::of(&circle);
        // Chords instead of arcs: third order in 3 · 0.0628.
        assert!((spacing.typical - 0.0628).abs() < 0.001, "{}", spacing.typical);
        assert!(spacing.areas.iter().all(|a| (a - 1.0).abs() < 1e-6), "a regular polygon");
        let grid: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        // Inside a square grid the sixth neighbour is a diagonal one: √2 · √(π/6) = 1.02.
        assert!((Spacing::of(&grid).typical - 1.02).abs() < 0.01);
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
        let isolated = Spacing::of(&points).isolated(&points, false);
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
        let isolated = |points: &[[f64; 3]]| {
            let spacing = Spacing::of(points);
            spacing.isolated(points, spacing.far_ones_keep_apart(points))
        };
        let count = |isolated: &[bool]| isolated.iter().filter(|isolated| **isolated).count();
        let found = isolated(&points);
        assert!(count(&found) <= 4, "{} at the borders", count(&found));
        // As many over a box about both halves are.
        let over = |i, step| 3.0 * any(i, step) - 1.5;
        points.truncate(4000);
        points.extend((1..=120).map(|i| [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|step| over(i, step))));
        let found = isolated(&points);
        assert!(count(&found[..4000]) == 0 && count(&found[4000..]) >= 110, "{} of 120", count(&found[4000..]));
    }

    /// Which are isolated among points of a square, an eighth as many along its left half (but for those beside the border between the
    /// halves, where neighbours differ eightfold), and some more.
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
        let isolated = Spacing::of(&points).isolated(&points, false);
        let inner = |i: &usize| (points[*i][0] - 0.5).abs() > 0.05;
        ((0..square).filter(|i| isolated[*i]).filter(inner).collect(), isolated[square..].to_vec())
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
    fn dense_parts_weigh_less_per_point() {
        let uneven: Vec<[f64; 2]> = (0..300)
            .map(|i| if i < 200 { 0.005 * f64::from(i) } else { 1.0 + 0.01 * f64::from(i - 200) })
            .map(|x| [x, 0.0])
            .collect();
        let areas = Spacing::of(&uneven).areas;
        assert!(
            (areas[250] / areas[100] - 2.0).abs() < 1e-9,
            "twice the distance, exactly representable up to rounding"
        );
    }
}
