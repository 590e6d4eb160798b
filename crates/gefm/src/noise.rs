//! How noisy the points are.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use std::num::NonZero;
use zeroset_bspline::{Derivatives, Spline};

/// The median of `|X − Y|` for two independent normal variables with standard deviation 1: 0.6745 √2.
const MEDIAN_DIFFERENCE: f64 = 0.953_873;
/// A distance is compared with those of so many neighbours.
const NEIGHBOURS: usize = 15;
/// Neighbours are on opposite sides where what differs from the mean of all those is less than this share of what differs from the nearest:
/// 1.0 and more for independent noise, 0.5 to 0.62 for the voxels that a surface passes through.
const OPPOSITE: f64 = 0.7;

/// Standard deviation of the points' distances from the surface, estimated without knowing the surface: f need only be as
/// smooth as it. Neighbours on a smooth surface differ in their distance from f's zero set by their noise alone (Rice 1984,
/// Gasser, Sroka and Jennen-Steinmetz 1986), where neighbours are those whose feet on the zero set lie together. Detail that
/// is finer than f counts as noise. Of points on a lattice, such as voxels, neighbours lie on opposite sides and differ by more than
/// their noise; there what they differ by from the mean of their fifteen neighbours counts.
pub fn noise_deviation<const D: usize>(f: &Spline<D>, points: &[[f64; D]]) -> f64 {
    let found = f.evaluate(points, Derivatives::Gradient);
    let (distances, feet): (Vec<f64>, Vec<[f64; D]>) = points
        .iter()
        .zip(found.values.iter().zip(&found.gradients))
        .filter_map(|(point, (value, gradient))| {
            let norm = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            let distance = value / norm;
            let foot: [f64; D] = std::array::from_fn(|axis| point[axis] - distance * gradient[axis] / norm);
            foot.iter().all(|x| x.is_finite()).then_some((distance, foot))
        })
        .unzip();
    let Ok(tree) = ImmutableKdTree::<f64, D>::new_from_slice(&feet) else { return 0.0 };
    // A foot is its own nearest neighbour.
    let wanted = NonZero::<usize>::MIN.saturating_add(NEIGHBOURS);
    // What a distance differs by from that of the nearest neighbour, and from the mean of them all.
    let differences = |(index, foot): (usize, &[f64; D])| {
        let nearest = tree.query(foot).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let others = nearest.iter().map(|n| n.item as usize).filter(|other| *other != index).take(NEIGHBOURS);
        let mut others = others.map(|other| distances[other]);
        let first = others.next()?;
        let (sum, found) = others.fold((first, 1), |(sum, found), other| (sum + other, found + 1));
        Some(((distances[index] - first).abs(), (distances[index] - sum / f64::from(found)).abs()))
    };
    let (mut pairs, mut means): (Vec<f64>, Vec<f64>) =
        feet.par_iter().enumerate().filter_map(differences).collect::<Vec<_>>().into_iter().unzip();
    pairs.sort_unstable_by(f64::total_cmp);
    means.sort_unstable_by(f64::total_cmp);
    let Some(median) = pairs.get(pairs.len() / 2) else { return 0.0 };
    let by_pairs = median / MEDIAN_DIFFERENCE;
    let (mean, square) = capped(&means);
    let among = square * (NEIGHBOURS as f64 / (NEIGHBOURS + 1) as f64).sqrt();
    // Both sides of a wall are on opposite sides of what has welded them, too.
    if among < OPPOSITE * by_pairs && mean < LAYERED * square { among } else { by_pairs }
}

/// With less noise than this, in spacings, distances come from detail.
pub(crate) const LEAST_NOISE: f64 = 0.15;
/// What is far off counts as so many times the median.
const FARTHEST: f64 = 4.0;
/// Above this ratio distances are no noise: 0.80 for normal ones (0.77 to 0.83 was found for fits of noisy points, right or not), 0.87 for
/// even ones, and 0.92 to 0.96 where both sides of walls were welded into one.
pub const LAYERED: f64 = 0.88;

/// Mean deviation of `distances` from a zero set over their standard deviation about it (Geary 1935): √(2/π) for normal noise, towards 1
/// where the points lie in two layers on both sides of it, as those of a thin wall do that has been taken for noise. None for `noise`
/// below 0.15 of the `spacing`, or if all distances are zero.
pub fn layers(distances: &[f64], noise: f64, spacing: f64) -> Option<f64> {
    let mut sizes: Vec<f64> = distances.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
    if noise < LEAST_NOISE * spacing || sizes.is_empty() {
        return None;
    }
    sizes.sort_unstable_by(f64::total_cmp);
    let (mean, square) = capped(&sizes);
    (square > 0.0).then(|| mean / square)
}

/// Mean and root mean square of sizes in ascending order, of which what is far off counts for less.
fn capped(sizes: &[f64]) -> (f64, f64) {
    let most = FARTHEST * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let (sum, squares) =
        sizes.iter().map(|s| s.min(most)).fold((0.0, 0.0), |(sum, squares), s| (sum + s, squares + s * s));
    let count = sizes.len().max(1) as f64;
    (sum / count, (squares / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use zeroset_bspline::KnotVector;

    #[test]
    fn two_layers_are_told_from_noise() {
        let uniform = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43_758.545_3).rem_euclid(1.0);
        let normal = |i: usize| (0..12).map(|k| uniform(i, f64::from(k))).sum::<f64>() - 6.0;
        let ratio = |f: &dyn Fn(usize) -> f64| layers(&(0..4000).map(f).collect::<Vec<_>>(), 1.0, 1.0).unwrap();
        // It scatters by 0.2 over the root of the number; that what is beyond four medians, 2.7 standard deviations, counts as there, and that
        // twelve numbers make no tails, adds 0.01.
        assert!((ratio(&normal) - std::f64::consts::FRAC_2_PI.sqrt()).abs() < 0.02, "{}", ratio(&normal));
        let even = ratio(&|i| uniform(i, 0.5) - 0.5);
        assert!((even - 0.75f64.sqrt()).abs() < 0.01 && even < LAYERED, "{even}");
        // A wall four standard deviations thick.
        let side = |i: usize| if uniform(i, 20.0) < 0.5 { 2.0 } else { -2.0 };
        assert!(ratio(&|i| side(i) + normal(i)) > LAYERED, "{}", ratio(&|i| side(i) + normal(i)));
        // Some that are far off change little.
        let strays = |i: usize| if i.is_multiple_of(100) { 1e6 } else { normal(i) };
        assert!((ratio(&strays) - ratio(&normal)).abs() < 0.02, "{}", ratio(&strays));
        assert_eq!(layers(&[0.1, -0.1], 0.1, 1.0), None);
        assert_eq!(layers(&[], 1.0, 1.0), None);
        assert_eq!(layers(&[0.0; 3], 1.0, 1.0), None);
    }

    #[test]
    fn noise_is_told_from_a_smooth_misfit() {
        let knots = KnotVector::uniform(3, -1.0, 0.1, 20).unwrap();
        // f = x, by its Greville abscissae.
        let f = Spline::from_flat(
            [knots.clone(), knots],
            (0..23 * 23).map(|flat| -1.0 + 0.1 * ((flat / 23) as f64 - 1.0)).collect(),
        )
        .unwrap();
        // The true curve is a wave around the zero set of f.
        let wave = |y: f64| 0.05 * (3.0 * y).sin();
        let uniform = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43_758.545_3).rem_euclid(1.0);
        let points = |sigma: f64, draw: usize| -> Vec<[f64; 2]> {
            let normal = |i: usize| (0..12).map(|k| uniform(i, f64::from(k))).sum::<f64>() - 6.0;
            (4000 * draw..4000 * (draw + 1))
                .map(|i| (i, -0.9 + 1.8 * uniform(i, 77.0)))
                .map(|(i, y)| [wave(y) + sigma * normal(i), y])
                .collect()
        };
        let found = (0..16).map(|draw| noise_deviation(&f, &points(0.01, draw))).sum::<f64>() / 16.0;
        // The median of 4000 differences, of which half are independent, scatters by 3 %; the mean of 16 by less than 1 %.
        assert!((found / 0.01 - 1.0).abs() < 0.03, "{found}");
        // Neighbours are 0.00045 apart on average, on a slope of at most 0.15.
        assert!(noise_deviation(&f, &points(0.0, 0)) < 1e-4);
    }

    #[test]
    fn voxels_are_as_noisy_as_they_are() {
        let (side, cells) = (0.05, 40);
        let knots = KnotVector::uniform(3, -1.0, 0.1, 20).unwrap();
        // f = n·x, by its Greville abscissae.
        let normal = [0.8f64, 0.48, 0.36];
        let abscissa = |index: usize| -1.0 + 0.1 * (index as f64 - 1.0);
        let value = |flat: usize| {
            [flat / (23 * 23), flat / 23 % 23, flat % 23].iter().zip(normal).map(|(i, n)| n * abscissa(*i)).sum()
        };
        let f = Spline::from_flat(std::array::from_fn(|_| knots.clone()), (0..23usize.pow(3)).map(value).collect());
        let f = f.unwrap();
        let distance = |p: &[f64; 3]| (0..3).map(|k| normal[k] * p[k]).sum::<f64>();
        let centre = |index: usize| (index as f64 + 0.5) * side - 1.0;
        let reach = 0.5 * side * normal.iter().sum::<f64>();
        let voxels: Vec<[f64; 3]> = (0..cells * cells * cells)
            .map(|flat| [flat / (cells * cells), flat / cells % cells, flat % cells].map(centre))
            .filter(|p| distance(p).abs() < reach && p.iter().all(|x| x.abs() < 0.8))
            .collect();
        // Even between the planes that touch a voxel. (By pairs: 1.77 times that.)
        let expected = reach / 3f64.sqrt();
        let found = noise_deviation(&f, &voxels);
        // Neighbours' mean takes a part of it along, and those of few voxels are on one side.
        assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
    }
}
