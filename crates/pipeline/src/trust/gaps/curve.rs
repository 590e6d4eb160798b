//! Of curves: whether the ends that gaps join may belong together otherwise.

use zeroset_isosurface::Curves;

use crate::points::frame::Frame;
use crate::points::kd_tree::{tree_of, within};
use crate::points::support::{Nearest, SPECK, Support};

/// A curve runs through a gap where it is farther from all points than they support.
const AWAY: f64 = 1.0;
/// The gap begins and ends where it is nearer than this share of that.
const NEAR: f64 = 1.0 / 3.0;
/// The direction there is that of so many spacings of the curve before or after.
const STRETCH: f64 = 2.0;
/// What a gap is joined by costs its length, and so many times that for each square of a radian that it turns by at its ends.
const TURN: f64 = 1.0;

/// The warning of closed `curves`, in the frame; `nearest` has the nearest point of every vertex of the loops, one loop after the other.
pub fn gap_warning(
    curves: &Curves,
    (support, nearest): (&Support<'_, 2>, &[Nearest]),
    frame: &Frame<2>,
) -> Option<String> {
    let mut gaps = Vec::new();
    let mut first = 0;
    for (number, cycle) in curves.loops.iter().enumerate() {
        gaps_of((number, cycle), &nearest[first..first + cycle.len()], support, &mut gaps);
        first += cycle.len();
    }
    super::warning(
        &otherwise(&gaps),
        "curves may as well run otherwise through gaps between the points",
        "which ends belong together",
        frame,
    )
}

/// Where a curve goes into a gap, or comes out of it.
#[derive(Debug, Clone, Copy)]
struct End {
    place: [f64; 2],
    /// Along the curve, with the inside on its left, of any length.
    direction: [f64; 2],
}

/// What a gap joins.
#[derive(Debug, Clone, Copy)]
struct Gap {
    from: End,
    to: End,
    cost: f64,
    /// The number of the curve that it is in.
    cycle: usize,
    /// How many points stand for all of that one, and for its part before each end.
    points: f64,
    before: [f64; 2],
}

impl Gap {
    /// What it costs both if each ends where the other one does, over what it costs now; none if a speck would be left of a curve.
    fn exchanged(&self, other: &Self) -> Option<f64> {
        let between = |a: &Self, b: &Self| (b.before[0] - a.before[1]).rem_euclid(a.points);
        let parts = [between(self, other), between(other, self)];
        (self.cycle != other.cycle || parts.iter().all(|points| *points > SPECK))
            .then(|| (cost(&self.from, &other.to) + cost(&other.from, &self.to)) / (self.cost + other.cost))
    }
}

/// What it costs to go from one end to another: a straight line its length.
fn cost(from: &End, to: &End) -> f64 {
    let way = [to.place[0] - from.place[0], to.place[1] - from.place[1]];
    let turns = angle(&from.direction, &way).powi(2) + angle(&way, &to.direction).powi(2);
    way[0].hypot(way[1]) * (1.0 + TURN * turns)
}

/// Between two vectors.
fn angle(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
}

/// Adds the gaps of a closed curve.
fn gaps_of((number, cycle): (usize, &[[f64; 2]]), nearest: &[Nearest], support: &Support<'_, 2>, gaps: &mut Vec<Gap>) {
    let n = cycle.len();
    let mut points = 0.0;
    let side = |i: usize| {
        let before = points;
        points += distance(&cycle[i], &cycle[(i + 1) % n]) / support.share(nearest[i].sample);
        before
    };
    let before: Vec<f64> = (0..n).map(side).collect();
    let near: Vec<usize> = (0..n).filter(|i| nearest[*i].remoteness < NEAR).collect();
    let end = |at: usize, backward: bool| {
        let length = STRETCH * support.share(nearest[at].sample);
        let before = |k: usize| cycle[(if backward { at + n - k } else { at + k }) % n];
        let far = (1..n).map(before).find(|other| distance(other, &cycle[at]) > length).unwrap_or(before(n / 2));
        let sign = if backward { 1.0 } else { -1.0 };
        End { place: cycle[at], direction: std::array::from_fn(|axis| sign * (cycle[at][axis] - far[axis])) }
    };
    for (k, &a) in near.iter().enumerate() {
        let b = near[(k + 1) % near.len()];
        let between = if b > a { b - a } else { b + n - a };
        if (1..between).any(|k| nearest[(a + k) % n].remoteness > AWAY) {
            let (from, to) = (end(a, true), end(b, false));
            gaps.push(Gap { from, to, cost: cost(&from, &to), cycle: number, points, before: [before[a], before[b]] });
        }
    }
}

/// In the midst of gaps of which two cost less if each ends where the other one does, most gained first.
fn otherwise(gaps: &[Gap]) -> Vec<[f64; 2]> {
    if gaps.len() < 2 {
        return vec![];
    }
    let ends: Vec<[f64; 2]> = gaps.iter().map(|gap| gap.to.place).collect();
    let tree = tree_of(&ends);
    let mut pairs = Vec::new();
    for (i, gap) in gaps.iter().enumerate() {
        // No way of the pair is longer than what both cost now.
        let reach = 2.0 * gap.cost;
        for j in within(&tree, &gap.from.place, reach) {
            let other = &gaps[j];
            // Each pair once, by the one that costs more.
            if (other.cost, j) >= (gap.cost, i) {
                continue;
            }
            if let Some(share) = gap.exchanged(other).filter(|share| *share < 1.0) {
                pairs.push((share, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut told = vec![false; gaps.len()];
    let mut places = Vec::new();
    for (_, i, j) in pairs {
        if !told[i] && !told[j] {
            (told[i], told[j]) = (true, true);
            let corners = [&gaps[i], &gaps[j]].map(|gap| [gap.from.place, gap.to.place]);
            places.push(std::array::from_fn(|axis| 0.25 * corners.iter().flatten().map(|p| p[axis]).sum::<f64>()));
        }
    }
    places
}

fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::spacing::Spacing;

    /// A polygon with a vertex every tenth of a unit.
    fn polygon(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        let along = |(a, b): (&[f64; 2], &[f64; 2])| {
            let steps = (10.0 * distance(a, b)).round();
            let at = |k: u32| std::array::from_fn(|axis| a[axis] + f64::from(k) / steps * (b[axis] - a[axis]));
            (0..steps as u32).map(at).collect::<Vec<[f64; 2]>>()
        };
        sides.flat_map(along).collect()
    }

    fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> Vec<[f64; 2]> {
        polygon(&[[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    }

    /// Of curves with a point at every tenth vertex, but for those that are `missing`.
    fn places(loops: Vec<Vec<[f64; 2]>>, missing: impl Fn(&[f64; 2]) -> bool) -> Vec<[f64; 2]> {
        let all = loops.concat();
        let points: Vec<[f64; 2]> = all.iter().step_by(10).filter(|p| !missing(p)).copied().collect();
        let spacing = Spacing::of(&points);
        let support = Support::new(&points, &spacing);
        let mut gaps = Vec::new();
        for (number, cycle) in loops.iter().enumerate() {
            gaps_of((number, cycle), &support.nearest(cycle), &support, &mut gaps);
        }
        otherwise(&gaps)
    }

    #[test]
    fn ends_of_a_band_that_face_each_other_may_be_one() {
        let stumps = || vec![rectangle([-30.0, -4.0], [-2.0, 2.0]), rectangle([4.0, 30.0], [-2.0, 2.0])];
        let [place] = places(stumps(), |p| p[0].abs() < 6.0)[..] else { panic!() };
        assert!(place.iter().all(|x| x.abs() < 0.5), "between them: {place:?}");
        // With the points of one of the ends nothing is in doubt, nor where they are too far apart.
        assert!(places(stumps(), |p| p[0].abs() < 6.0 && p[0] < 0.0).is_empty());
        let apart = vec![rectangle([-50.0, -24.0], [-2.0, 2.0]), rectangle([24.0, 50.0], [-2.0, 2.0])];
        assert!(places(apart, |p| p[0].abs() < 26.0).is_empty());
    }

    #[test]
    fn a_band_that_goes_on_may_have_two_ends_if_it_is_thin() {
        let of = |thickness: f64| places(vec![rectangle([-40.0, 40.0], [0.0, thickness])], |p| p[0].abs() < 10.0);
        // Two turns of half a circle cost 12 times the thickness, to go on 40.
        assert_eq!((of(3.0).len(), of(4.0).len()), (1, 0));
    }

    #[test]
    fn a_few_points_between_gaps_are_no_curve_of_their_own() {
        // A straight curve, but for what noise has moved off it between two gaps: without it there would be nothing to turn.
        let end = |x: f64, y: f64| End { place: [x, y], direction: [1.0, 0.0] };
        let gap = |from: End, to: End, before: [f64; 2]| Gap {
            from,
            to,
            cost: cost(&from, &to),
            cycle: 0,
            points: 100.0,
            before,
        };
        let between = |points: f64| {
            let first = gap(end(-6.0, 0.0), end(0.0, 2.0), [20.0, 26.0]);
            first.exchanged(&gap(end(0.0, 2.0), end(6.0, 0.0), [26.0 + points, 32.0 + points]))
        };
        assert!(between(SPECK + 1.0).is_some_and(|share| share < 1.0));
        assert_eq!(between(SPECK - 1.0), None);
    }
}
