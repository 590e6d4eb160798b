//! Points with noise deeper than they are apart, averaged.
//!
//! Where noise is that deep, no smoothing length between it and the shape's own detail is left if it is counted in spacings: the more points
//! there are, the more of them fill the layer around the surface. Means of points are what the rest of the road knows how to deal with:
//! points with noise of half the distance between them. Which points lie side by side is told by their feet on a surface, so there are two
//! kinds of means: of points in balls about as wide as the layer is deep, good enough for a first f̂, and of points with feet together on that
//! f̂'s zero set.

use kiddo::SquaredEuclidean;
use rayon::prelude::*;
use zeroset_bspline::{Derivatives, Spline};

use crate::points::kd_tree::{tree_of, within};
use crate::points::left_out::kept;
use crate::points::roundness::MedianRoundness;
use crate::points::spacing::Spacing;
use crate::points::thinning::{by_position, drawn, left_out_around, one_per_cell};

/// The smallest ball's radius in spacings, in the plane and in space: noise of less than 2.3 and 1.36 of these needs no means.
const FIRST: [f64; 2] = [6.5, 4.0];
/// By what the next one is wider.
const WIDER: f64 = std::f64::consts::SQRT_2;
/// No wider than this share of the points' extent: that much of the shape is not flat, whatever the noise.
const WIDEST: f64 = 0.25;
/// Balls around points that fill an area or a volume are rounder than this in the median, at any radius.
const ROUND: f64 = 0.75;
/// Around points with noise of a standard deviation of this share of its radius, in the plane and in space, it is as round as that.
const DEPTH: [f64; 2] = [0.355, 0.341];

/// In standard deviations of the noise: sides of the cells that have one ball each at first, and the radius of the balls,
const CELL: f64 = 1.2;
const BALL: f64 = 1.8;
/// of no fewer points than these.
const FEWEST_IN_BALL: usize = 6;
/// Balls are taken around means of balls so often, in the plane and in space: each time means at the layer's edge come closer to its middle, and
/// means on a surface that curves both ways closer to each other.
const ROUNDS: [usize; 2] = [6, 2];
/// How far these are apart at least, in standard deviations,
const APART: [f64; 2] = [0.8, 0.6];
/// and how far a point is from its own in space, where they are not yet in the middle.
const REACH: f64 = 4.0;
const FEWEST_IN_CELL: usize = 3;

/// Newton steps to a point's foot,
const STEPS: usize = 5;
/// the last of which is shorter than this share of the standard deviation.
const ARRIVED: f64 = 0.01;
/// Noise that is to be left in means with feet together, in units of the distance between them: deeper noise is harder to fit, and means that
/// are farther apart lose detail.
const LEFT: f64 = 0.6;
/// The least distance between places of which one after the other takes away what is nearer, drawn at random, in units of what is then usual:
/// Rényi's constant in the plane, the root of 0.697 in space (random sequential adsorption of intervals, and of disks that cover 0.547).
const PACKED: [f64; 2] = [0.748, 0.835];
/// Draws their order.
const SEED: u64 = 5;
/// One point is no mean.
const FEWEST_ON_SURFACE: usize = 2;

/// The standard deviation of the points from a curve or surface, if it is so deep that averages tell more; in the unit of the points.
pub fn depth<const D: usize>(points: &[[f64; D]], spacing: &Spacing) -> Option<f64> {
    let roundness = MedianRoundness::of(points);
    let extent = (0..D).map(|axis| {
        let along = || points.iter().map(|p| p[axis]);
        along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
    });
    let widest = WIDEST * extent.fold(0.0, f64::max);
    let mut radius = FIRST[usize::from(D == 3)] * spacing.typical;
    let mut round = roundness.within(radius);
    while round > ROUND && radius < widest {
        let (wider, less_round) = (WIDER * radius, roundness.within(WIDER * radius));
        if less_round <= ROUND {
            // Between the two, as a power of the radius.
            let share = (round / ROUND).ln() / (round / less_round).ln();
            return Some(DEPTH[usize::from(D == 3)] * radius * WIDER.powf(share));
        }
        (radius, round) = (wider, less_round);
    }
    None
}

/// Means of points in balls about as wide as the layer is deep, for noise of a standard deviation of `depth`, by mean shift: about as far apart
/// as that.
pub fn in_balls<const D: usize>(points: &[[f64; D]], depth: f64) -> Vec<[f64; D]> {
    let mut points = points.to_vec();
    points.par_sort_unstable_by(by_position);
    let tree = tree_of(&points);
    let in_ball = |centre: &[f64; D]| {
        let mut near: Vec<usize> = within(&tree, centre, BALL * depth).collect();
        near.sort_unstable();
        mean(near.iter().map(|i| &points[*i]), FEWEST_IN_BALL)
    };
    let mut centres = one_per_cell(&points, CELL * depth);
    for _ in 0..ROUNDS[usize::from(D == 3)] {
        centres = centres.par_iter().filter_map(in_ball).collect();
    }
    centres.par_sort_unstable_by(by_position);
    let tree = tree_of(&centres);
    let others = left_out_around(&centres, &tree, 0..centres.len(), |_| APART[usize::from(D == 3)] * depth);
    let centres = kept(&centres, &others);
    if D == 3 { nearest_means(&centres, &points, &points, REACH * depth, FEWEST_IN_CELL) } else { centres }
}

/// Means of points with feet together on the zero set of `f`, from which they have a standard deviation of `depth`: as far apart as it takes
/// that the noise left in them is 0.6 of that. Each point counts in one of them, so that this noise is independent.
pub fn on_zero_set<const D: usize>(points: &[[f64; D]], f: &Spline<D>, depth: f64) -> Vec<[f64; D]> {
    let (points, feet) = with_feet(points, f, depth);
    let Some(local) = (feet.len() > 1).then(|| Spacing::of(&feet).smoothed(&feet)) else { return vec![] };
    // On a length h there are h/s points, on an area h² h²/s², and the mean of n has depth/√n.
    let wanted = |spacing: f64| match D {
        2 => (spacing * (depth / LEFT).powi(2)).cbrt(),
        _ => (spacing * depth / LEFT).sqrt(),
    };
    let distance = |index: usize| PACKED[usize::from(D == 3)] * wanted(local[index]);
    let others = left_out_around(&feet, &tree_of(&feet), 0..feet.len(), distance);
    nearest_means(&kept(&feet, &others), &feet, &points, f64::INFINITY, FEWEST_ON_SURFACE)
}

/// Those of the points that have a foot on the zero set of `f` within reach, and these, in an order that is drawn.
fn with_feet<const D: usize>(points: &[[f64; D]], f: &Spline<D>, depth: f64) -> (Vec<[f64; D]>, Vec<[f64; D]>) {
    let points: Vec<[f64; D]> = drawn(points, SEED).into_iter().map(|index| points[index]).collect();
    let mut feet = points.clone();
    let mut distances = vec![];
    for _ in 0..STEPS {
        let at = f.evaluate(&feet, Derivatives::Gradient);
        distances = at.sampson_distances();
        for ((foot, distance), gradient) in feet.iter_mut().zip(&distances).zip(&at.gradients) {
            let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            *foot = std::array::from_fn(|axis| foot[axis] - distance * gradient[axis] / norm);
        }
    }
    let arrived = |((point, foot), last): &(([f64; D], [f64; D]), f64)| {
        let moved: f64 = point.iter().zip(foot).map(|(a, b)| (a - b).powi(2)).sum();
        moved < (REACH * depth).powi(2) && last.abs() < ARRIVED * depth
    };
    points.into_iter().zip(feet).zip(distances).filter(arrived).map(|(found, _)| found).unzip()
}

/// For each centre the mean of the points whose `places` are nearest to it, and not too far, if they are not too few.
fn nearest_means<const D: usize>(
    centres: &[[f64; D]],
    places: &[[f64; D]],
    points: &[[f64; D]],
    farthest: f64,
    fewest: usize,
) -> Vec<[f64; D]> {
    if centres.is_empty() {
        return vec![];
    }
    let tree = tree_of(centres);
    let nearest = |place| tree.query(place).nearest_one::<SquaredEuclidean<f64>>().execute();
    let found: Vec<_> = places.par_iter().map(nearest).collect();
    let mut members = vec![vec![]; centres.len()];
    for (point, near) in points.iter().zip(found) {
        if near.distance < farthest * farthest {
            members[near.item as usize].push(point);
        }
    }
    members.into_iter().filter_map(|members| mean(members.into_iter(), fewest)).collect()
}

/// The mean of some points, if they are not too few.
fn mean<'a, const D: usize>(of: impl Iterator<Item = &'a [f64; D]> + Clone, fewest: usize) -> Option<[f64; D]> {
    let count = of.clone().count();
    let sum = of.fold([0.0; D], |sum, point| std::array::from_fn(|axis| sum[axis] + point[axis]));
    (count >= fewest).then(|| sum.map(|x| x / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    /// Numbers of mean 0 and variance 1: sums of twelve of a congruence.
    fn normal(mut state: u64) -> impl FnMut() -> f64 {
        let mut uniform = move || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// Random points of a circle and of a sphere of radius 0.4, with noise in all directions.
    fn circle(count: u32, noise: f64) -> Vec<[f64; 2]> {
        let mut normal = normal(1);
        let at = |i: u32| (f64::from(i) * 0.618_033_988_75 * std::f64::consts::TAU).sin_cos();
        (0..count).map(|i| <[f64; 2]>::from(at(i)).map(|x| 0.4 * x + noise * normal())).collect()
    }

    fn sphere(count: u32, noise: f64) -> Vec<[f64; 3]> {
        let mut normal = normal(2);
        (0..count)
            .map(|_| {
                let v = [normal(), normal(), normal()];
                let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                v.map(|x| 0.4 * x / length + noise * normal())
            })
            .collect()
    }

    /// The root mean square of how far points are from that circle or sphere.
    fn beside<const D: usize>(points: &[[f64; D]]) -> f64 {
        let squares = points.iter().map(|p| (p.iter().map(|x| x * x).sum::<f64>().sqrt() - 0.4).powi(2));
        (squares.sum::<f64>() / points.len() as f64).sqrt()
    }

    /// f = x by its Greville abscissae, for x and others between -1 and 1.
    fn plane<const D: usize>() -> Spline<D> {
        let knots: [KnotVector; D] = std::array::from_fn(|_| KnotVector::uniform(3, -1.0, 0.1, 20).unwrap());
        let first = |flat: usize| flat / 23usize.pow(D as u32 - 1);
        let coefficients = (0..23usize.pow(D as u32)).map(|flat| -1.0 + 0.1 * (first(flat) as f64 - 1.0)).collect();
        Spline::from_flat(knots, coefficients).unwrap()
    }

    /// Random points around x = 0, between -0.9 and 0.9 in other directions.
    fn layer<const D: usize>(count: u32, noise: f64) -> Vec<[f64; D]> {
        let mut normal = normal(3);
        // Kronecker sequences: even, but without rows.
        let even = |i: u32, step: f64| 1.8 * (f64::from(i) * step).fract() - 0.9;
        let steps = [0.0, 0.754_877_666, 0.569_840_296];
        let at = |i: u32, axis: usize| if axis == 0 { 0.0 } else { even(i, steps[axis]) };
        (0..count)
            .map(|i| std::array::from_fn(|axis| at(i, axis) + if axis == 0 { noise * normal() } else { 0.0 }))
            .collect()
    }

    #[test]
    fn the_depth_is_that_of_the_noise() {
        // To a fifth: balls of nearly three standard deviations of a curved layer.
        let is_near = |found: Option<f64>, wanted: f64| found.is_some_and(|found| (found / wanted - 1.0).abs() < 0.2);
        for noise in [0.02, 0.04] {
            let (circle, sphere) = (circle(20_000, noise), sphere(40_000, noise));
            let found = (depth(&circle, &Spacing::of(&circle)), depth(&sphere, &Spacing::of(&sphere)));
            assert!(is_near(found.0, noise) && is_near(found.1, noise), "{noise}: {found:?}");
        }
    }

    #[test]
    fn what_is_hardly_noisy_or_fills_an_area_has_no_depth() {
        for noise in [0.0, 0.5] {
            let circle = circle(2000, noise * 0.8 * std::f64::consts::PI / 2000.0);
            assert_eq!(depth(&circle, &Spacing::of(&circle)), None, "{noise}");
        }
        let step = [0.754_877_666, 0.569_840_296];
        let square: Vec<[f64; 2]> = (0..4000).map(|i| step.map(|step| (f64::from(i) * step).fract())).collect();
        assert_eq!(depth(&square, &Spacing::of(&square)), None);
    }

    #[test]
    fn means_of_balls_are_near_the_middle_in_any_order() {
        let noise = 0.02;
        let (circle, sphere) = (circle(20_000, noise), sphere(40_000, noise));
        let (of_circle, of_sphere) = (in_balls(&circle, noise), in_balls(&sphere, noise));
        // In spacings: 160 and 2.8 of the points, on a circumference of 2.51 and an area of 2.01.
        let apart = (2.51 / of_circle.len() as f64, (2.01 / of_sphere.len() as f64).sqrt());
        let left = (beside(&of_circle) / apart.0, beside(&of_sphere) / apart.1);
        assert!(left.0 < 0.15 && left.1 < 1.5, "{left:?}");
        assert!(apart.0 < 1.3 * noise && apart.1 < 1.3 * noise, "{apart:?}");
        let reversed: Vec<[f64; 3]> = sphere.iter().rev().copied().collect();
        assert_eq!(in_balls(&reversed, noise), of_sphere);
    }

    #[test]
    fn means_on_the_zero_set_have_the_noise_that_is_wanted() {
        let noise = 0.05;
        let (strip, slab) = (layer::<2>(20_000, noise), layer::<3>(40_000, noise));
        let means = (on_zero_set(&strip, &plane(), noise), on_zero_set(&slab, &plane(), noise));
        let left = |sizes: f64, count: usize, apart: f64| (sizes / count as f64).sqrt() / apart;
        let squares = |x: f64| x * x;
        let found = (
            left(means.0.iter().map(|p| squares(p[0])).sum(), means.0.len(), 1.8 / means.0.len() as f64),
            left(means.1.iter().map(|p| squares(p[0])).sum(), means.1.len(), 1.8 / (means.1.len() as f64).sqrt()),
        );
        // Means of unequal numbers, of some hundred and some thousand draws.
        assert!((found.0 / LEFT - 1.0).abs() < 0.15 && (found.1 / LEFT - 1.0).abs() < 0.15, "{found:?}");
        let reversed: Vec<[f64; 3]> = slab.iter().rev().copied().collect();
        assert_eq!(on_zero_set(&reversed, &plane(), noise), means.1);
    }

    #[test]
    fn points_without_a_foot_nearby_have_no_part_in_means() {
        let mut points = layer::<2>(4000, 0.02);
        points.extend((0..200).map(|i| [0.5, 0.008 * f64::from(i) - 0.8]));
        points.extend([[7.0, 0.0], [-7.0, 0.0]]);
        let means = on_zero_set(&points, &plane(), 0.02);
        assert!(means.len() > 100 && means.iter().all(|mean| mean[0].abs() < 0.05), "{}", means.len());
        // What is nowhere near has none at all.
        assert!(on_zero_set(&[[0.5, 0.0], [0.5, 0.1]], &plane(), 0.02).is_empty());
    }
}
