//! Points in lines, along which they lie much closer than across: scan lines, slices, strokes.
//!
//! The sixth neighbour, by which spacing goes, lies in the same line then and tells nothing of the gap to the next one. What can be known of
//! the surface between the lines, how far apart lattice nodes may be and what is a hole is for that gap to say. So the points are thinned until
//! they are about as far apart along the lines as across; these tell the spacing and the side, and the others lie between them.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use zeroset_trust_region::lots;

use crate::points::kd_tree::tree_of;
use crate::points::left_out::kept;
use crate::points::spacing::covariance;
use crate::points::thinning::{drawn, left_out_around};

/// So many neighbours of a point tell whether it lies in a line: all are in it where the next line is more than six times as far away as
/// they are from each other.
const VICINITY: usize = 12;
/// So many points are asked.
const ASKED: f64 = 4000.0;
/// Points lie in lines if the breadth of those neighbours is below this in the median. Of random points on a surface it is 0.23, of 500 on a
/// hand 0.24, of noisy ones more; of lines that are three times as far apart as their points 0.23, six times 0.02, of strokes on a torus 0.003.
const IN_LINES: f64 = 0.14;
/// Thinned ones are just about not in lines any more when it is this:
const HARDLY: f64 = 0.18;
/// five times as far apart across as along. They are to be three times, for there are points missing by chance along the lines.
const FARTHER: f64 = 1.75;
/// What is thinned away within: this share of the spacing along the lines, growing by this factor.
const FIRST: f64 = 0.5;
const GROWTH: f64 = 1.25;
/// Fewer points than these tell nothing.
const FEWEST: usize = 40;
/// Draws which points stay and which are asked.
const SEED: u64 = 2;

/// Points in lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Lines {
    /// Which points are thinned away; the others are about as far apart along the lines as across.
    pub between: Vec<bool>,
    /// Of each point, which of the others is the nearest one, counted among them alone.
    pub nearest: Vec<usize>,
    /// What each point stands for, as a share of what that one does: one by the number of all that have it.
    pub share: Vec<f64>,
}

impl Lines {
    /// None if points are not in lines; in the plane a line is the shape. `along` is how far each is from its neighbours.
    pub fn of<const D: usize>(points: &[[f64; D]], tree: &ImmutableKdTree<f64, D>, along: &[f64]) -> Option<Self> {
        if D == 2 || points.len() < FEWEST || breadth(points, tree) >= IN_LINES {
            return None;
        }
        let order = drawn(points, SEED);
        let thinned = |share: f64| {
            let between = left_out_around(points, tree, order.iter().copied(), |index| share * along[index]);
            let few = kept(points, &between);
            (few.len() >= FEWEST).then_some((between, few))
        };
        let mut share = FIRST;
        loop {
            let (_, few) = thinned(share)?;
            if breadth(&few, &tree_of(&few)) >= HARDLY {
                break;
            }
            share *= GROWTH;
        }
        let (between, few) = thinned(FARTHER * share)?;
        let tree = tree_of(&few);
        let nearest_of = |p| tree.query(p).nearest_one::<SquaredEuclidean<f64>>().execute().item as usize;
        let nearest: Vec<usize> = points.par_iter().map(nearest_of).collect();
        let mut counts = vec![0.0; few.len()];
        nearest.iter().for_each(|&i| counts[i] += 1.0);
        let share = nearest.iter().map(|&i| 1.0 / counts[i]).collect();
        Some(Self { between, nearest, share })
    }

    /// The points that are left.
    pub fn left<const D: usize>(&self, points: &[[f64; D]]) -> Vec<[f64; D]> {
        kept(points, &self.between)
    }
}

/// How far the neighbours of a point spread across a line, in the median: `(1 − tr C² / (tr C)²) / 2` of their covariance C, which is 0
/// in a line, up to ¼ in a plane and up to ⅓ in a body.
fn breadth<const D: usize>(points: &[[f64; D]], tree: &ImmutableKdTree<f64, D>) -> f64 {
    let share = ASKED / points.len() as f64;
    let asked: Vec<usize> = lots(points, SEED + 1).zip(0..).filter(|(lot, _)| *lot < share).map(|(_, i)| i).collect();
    let wanted = NonZero::<usize>::MIN.saturating_add(VICINITY);
    let of = |&i: &usize| {
        let near = tree.query(&points[i]).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let indices: Vec<usize> = near.iter().map(|n| n.item as usize).collect();
        let c = covariance(points, &indices);
        let trace: f64 = (0..D).map(|axis| c[axis][axis]).sum();
        0.5 * (1.0 - c.iter().flatten().map(|x| x * x).sum::<f64>() / (trace * trace))
    };
    let mut found: Vec<f64> = asked.par_iter().map(of).collect();
    let middle = found.len() / 2;
    if found.is_empty() { f64::INFINITY } else { *found.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use crate::points::spacing::Spacing;
    use crate::points::thinning::by_position;

    fn uniform(i: usize, k: f64) -> f64 {
        ((i as f64 * 12.9898 + k).sin() * 43_758.545_3).rem_euclid(1.0)
    }

    /// A tube of radius 0.2 and length 1 in rings a distance of 1/20 apart, their points a tenth of that, with noise of so much.
    fn rings(noise: f64) -> Vec<[f64; 3]> {
        let (rings, around) = (20, (TAU * 0.2 * 20.0 * 10.0) as usize);
        (0..rings * around)
            .map(|i| {
                let ring = i / around;
                let angle = ((i % around) as f64 + uniform(ring, 1.0)) / around as f64 * TAU;
                let off = [2.0, 3.0, 4.0].map(|k| noise * (2.0 * uniform(i, k) - 1.0));
                let z = (ring as f64 + 0.5) / rings as f64 - 0.5;
                [0.2 * angle.cos() + off[0], 0.2 * angle.sin() + off[1], z + off[2]]
            })
            .collect()
    }

    #[test]
    fn lines_are_thinned_until_points_are_about_as_far_apart_along_as_across() {
        let points = rings(0.0);
        let spacing = Spacing::of(&points);
        let lines = spacing.lines.as_ref().unwrap();
        // A third of the distance between rings, or a little more: sevenths to halves.
        let left = lines.left(&points);
        let along = TAU * 0.2 * 20.0 / left.len() as f64;
        assert!((0.05 / 7.0..0.05 / 2.0).contains(&along), "{along}");
        assert_eq!((spacing.count(), lines.nearest.len()), (left.len(), points.len()));
        // What the sixth neighbour in the line says is 0.011.
        assert!((0.015..0.05).contains(&spacing.typical), "{}", spacing.typical);
        // Those that are left stand for the area, which all share: 0.2 τ.
        assert!((lines.share.iter().sum::<f64>() - left.len() as f64).abs() < 1e-9 * left.len() as f64);
        assert!((spacing.areas.iter().sum::<f64>() - points.len() as f64).abs() < 1e-9 * points.len() as f64);
        let area = points.len() as f64 / spacing.density / (0.2 * TAU);
        // The spacing goes by the sixth neighbour, which is farther where points are in lines.
        assert!((0.7..1.5).contains(&area), "{area}");
        // Thinned, they are not in lines any more.
        assert!(Spacing::of(&left).lines.is_none());
    }

    #[test]
    fn neither_order_nor_direction_matters() {
        let points = rings(0.0);
        let left = |points: &[[f64; 3]]| {
            let mut left = Spacing::of(points).lines.unwrap().left(points);
            left.sort_by(by_position);
            left
        };
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        assert_eq!(left(&points), left(&reversed));
        let turned: Vec<_> = points.iter().map(|p| [-p[1], p[2], p[0]]).collect();
        let mut back: Vec<_> = left(&turned).iter().map(|p| [p[2], -p[0], p[1]]).collect();
        back.sort_by(by_position);
        assert_eq!(left(&points), back);
    }

    #[test]
    fn what_is_not_in_lines_stays() {
        let random = |i| [uniform(i, 1.0) - 0.5, uniform(i, 2.0) - 0.5, 0.1 * uniform(i, 3.0).powi(8)];
        let surface: Vec<[f64; 3]> = (0..3000).map(random).collect();
        assert!(Spacing::of(&surface).lines.is_none());
        // Noise of the distance between the rings leaves nothing of them.
        assert!(Spacing::of(&rings(0.05)).lines.is_none());
        assert!(Spacing::of(&rings(0.002)).lines.is_some());
        // A ring alone: thinned as far as it takes it is not there any more.
        assert!(Spacing::of(&rings(0.0)[..250]).lines.is_none());
        // Curves in the plane.
        let circle: Vec<[f64; 2]> = (0..500).map(|i| (f64::from(i) / 500.0 * TAU).sin_cos().into()).collect();
        assert!(Spacing::of(&circle).lines.is_none());
    }
}
