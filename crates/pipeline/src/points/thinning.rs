//! Fewer points for the topology stage, which needs no more than its lattices can tell apart.

use std::collections::BTreeMap;

use kiddo::ImmutableKdTree;
use rayon::prelude::*;
use zeroset_trust_region::lots;

use crate::points::kd_tree::within;
use crate::points::spacing::Spacing;

/// At most about so many points are worth hearing on a lattice of 32 cells along the longest side.
pub const ENOUGH: usize = 12_000;
/// On one of 64 cells, of shapes with thin parts, so many are.
pub const MORE: usize = 4 * ENOUGH;

/// Draws others than those that are held out of the fit later.
const SEED: u64 = 1;

/// Some of the points, and how far apart they are.
pub type Few<const D: usize> = (Vec<[f64; D]>, Spacing);

/// How points are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// Evenly, about so many of more than twice as many: thin walls and gaps keep their points.
    Even(usize),
    /// So many at random, the sparser parts less thinned: of points with deep noise even ones would fill its depth, and many do too, where
    /// they do not tell the noise from a body.
    Random(usize),
}

/// Some of the points and their spacing, by position alone; none if that is all. Of points in lines none that lies between those that tell their
/// spacing. `spacing` is that of all points, frame units.
pub fn thinned<const D: usize>(points: &[[f64; D]], spacing: &Spacing, choice: Choice) -> Option<Few<D>> {
    if let Some(lines) = &spacing.lines {
        let few = lines.left(points);
        let spacing = Spacing::of(&few);
        return Some(thinned_evenly_spaced(&few, &spacing, choice).unwrap_or((few, spacing)));
    }
    thinned_evenly_spaced(points, spacing, choice)
}

/// The same of points that are not in lines.
fn thinned_evenly_spaced<const D: usize>(points: &[[f64; D]], spacing: &Spacing, choice: Choice) -> Option<Few<D>> {
    let few = match choice {
        Choice::Even(count) if points.len() > 2 * count => evenly(points, spacing.typical, count),
        Choice::Random(count) if count < points.len() => at_random(points, spacing, count),
        _ => return None,
    };
    let spacing = Spacing::of(&few);
    Some((few, spacing))
}

/// One point per cell of a lattice fine enough to leave about `count`.
fn evenly<const D: usize>(points: &[[f64; D]], typical: f64, count: usize) -> Vec<[f64; D]> {
    let share = points.len() as f64 / count as f64;
    one_per_cell(points, typical * share.powf(1.0 / (D as f64 - 1.0)))
}

/// Of each cubic cell of that side the point nearest to its centre.
pub(crate) fn one_per_cell<const D: usize>(points: &[[f64; D]], cell: f64) -> Vec<[f64; D]> {
    let mut chosen: BTreeMap<[i64; D], (f64, [f64; D])> = BTreeMap::new();
    for point in points {
        let place = point.map(|x| (x / cell).floor());
        let distance: f64 = (0..D).map(|axis| (point[axis] / cell - place[axis] - 0.5).powi(2)).sum();
        let best = chosen.entry(place.map(|x| x as i64)).or_insert((distance, *point));
        if distance.total_cmp(&best.0).then_with(|| by_position(point, &best.1)).is_lt() {
            *best = (distance, *point);
        }
    }
    chosen.into_values().map(|(_, point)| point).collect()
}

/// Each point with the chance that leaves about so many at the same spacing everywhere.
fn at_random<const D: usize>(points: &[[f64; D]], spacing: &Spacing, count: usize) -> Vec<[f64; D]> {
    let areas = spacing.smoothed_areas(points);
    let share = count as f64 / points.len() as f64;
    let chosen = points.iter().zip(lots(points, SEED)).zip(&areas).filter(|((_, lot), area)| *lot < share * *area);
    chosen.map(|((point, _), _)| *point).collect()
}

/// Which of the points are left out when one after the other, in that order, takes away those that are nearer to it than a `distance`.
pub(crate) fn left_out_around<const D: usize>(
    points: &[[f64; D]],
    tree: &ImmutableKdTree<f64, D>,
    order: impl IntoIterator<Item = usize>,
    distance: impl Fn(usize) -> f64,
) -> Vec<bool> {
    let (mut left_out, mut gone) = (vec![true; points.len()], vec![false; points.len()]);
    for index in order {
        if !gone[index] {
            left_out[index] = false;
            within(tree, &points[index], distance(index)).for_each(|near| gone[near] = true);
        }
    }
    left_out
}

/// An order that is drawn by a hash of the points' positions.
pub(crate) fn drawn<const D: usize>(points: &[[f64; D]], seed: u64) -> Vec<usize> {
    let lots: Vec<f64> = lots(points, seed).collect();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.par_sort_by(|a, b| lots[*a].total_cmp(&lots[*b]).then_with(|| by_position(&points[*a], &points[*b])));
    order
}

/// An order of points that does not depend on theirs.
pub(crate) fn by_position<const D: usize>(a: &[f64; D], b: &[f64; D]) -> std::cmp::Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of side 1 with points of density 40 000.
    fn square() -> Vec<[f64; 3]> {
        (0..40_000)
            .map(|i| [0.754_877_666, 0.569_840_296].map(|step| (f64::from(i) * step).fract() - 0.5))
            .map(|[x, y]| [x, y, 0.1])
            .collect()
    }

    #[test]
    fn the_choice_does_not_depend_on_the_order() {
        let points = square();
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        let sorted = |points: &[[f64; 3]], choice| {
            let (mut few, _) = thinned(points, &Spacing::of(points), choice).unwrap();
            few.sort_by(by_position);
            few
        };
        for (choice, range) in [
            // One per cell of √(40 000 / 12 000) spacings.
            (Choice::Even(ENOUGH), 9_000..=14_000),
            // Binomial: a standard deviation of 61.
            (Choice::Random(4000), 3_750..=4_250),
        ] {
            let few = sorted(&points, choice);
            assert!(range.contains(&few.len()), "{choice:?}: {}", few.len());
            assert_eq!(sorted(&reversed, choice), few);
        }
        let spacing = Spacing::of(&points[..1000]);
        assert!(thinned(&points[..1000], &spacing, Choice::Even(ENOUGH)).is_none());
        assert!(thinned(&points[..1000], &spacing, Choice::Random(1000)).is_none());
    }

    #[test]
    fn a_random_choice_is_as_dense_everywhere() {
        let uniform = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43_758.545_3).rem_euclid(1.0);
        let place = |i: usize| [uniform(i, 1.0) - 0.5, uniform(i, 2.0), 0.1];
        // The left half four times as dense as the right one.
        let points: Vec<[f64; 3]> =
            (0..40_000).map(place).enumerate().filter(|(i, p)| p[0] < 0.0 || i % 4 == 0).map(|(_, p)| p).collect();
        let (few, _) = thinned(&points, &Spacing::of(&points), Choice::Random(4000)).unwrap();
        let left = few.iter().filter(|p| p[0] < 0.0).count() as f64 / few.len() as f64;
        // A standard deviation is 0.008; by number it would be 0.8.
        assert!((left - 0.5).abs() < 0.04, "{left}");
    }
}
