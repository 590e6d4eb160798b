//! Places where the topology of the zero set hangs on little: critical points of f with values so near zero that the points cannot
//! tell on which side of zero they are.

use serde::Serialize;
use zeroset_bspline::{CriticalPoint, HierarchicalSpline};

use crate::points::frame::Frame;
use crate::points::kd_tree::{tree_of, within};
use crate::points::spacing::NOISY;

/// The zero set is as sure as this share of the standard deviation of the points, of which a smooth function averages many,
const OF_NOISE: f64 = 0.1;
/// and this share of their spacing, for what they leave to fairness.
const OF_SPACING: f64 = 0.015;
/// Where refinement has changed the topology, which is a reason to doubt it, more of both is in reach.
const REFINED_OF_NOISE: f64 = 0.25;
const REFINED_OF_SPACING: f64 = 0.05;
/// Two critical points of successive Morse indices on the same side of zero, the one of the higher index above the other, are a wrinkle of f:
/// levels between them have a hole or a bridge that neither zero nor the levels beyond both have, so that nothing at zero hangs on them (a pair
/// of low persistence: Edelsbrunner, Letscher and Zomorodian 2002). They are one up to so many times what the points cannot tell in height, for
/// each of the two values may be off by as much,
const WRINKLE_HEIGHT: f64 = 2.0;
/// and so many spacings, or standard deviations of the noise, from each other.
const WRINKLE_LENGTH: f64 = 3.0;
/// The report lists so many at most.
const LISTED: usize = 100;

/// A place where a small change of f would join, part, fill or pierce something.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FragilePlace {
    /// Where, in data coordinates.
    pub place: Vec<f64>,
    /// By how much f differs there from zero, in the data's unit: negative inside.
    pub value: f64,
    /// What is there: the Morse index of the critical point. 0: a speck, or what nearly is one; 1: a neck (inside) or a gap
    /// between walls (outside); 2 in space: a thin wall (inside) or a tunnel (outside); the dimension: a hollow.
    pub index: usize,
}

/// The critical points of f nearer to zero than points with this `noise` and `spacing`, in the frame, can tell, the nearest first, without
/// those that are but wrinkles, and, in space, without the walls and gaps that have withstood noise.
pub fn fragile<const D: usize>(
    f: &HierarchicalSpline<D>,
    noise: f64,
    spacing: f64,
    frame: &Frame<D>,
) -> Vec<FragilePlace> {
    let reach = reach(noise, spacing);
    let height = WRINKLE_HEIGHT * reach;
    let wide = f.critical_points(reach + height);
    let wrinkles = wrinkles(&wide, height, WRINKLE_LENGTH * spacing.max(noise));
    // Noise pierces and bridges them, but closes no hole and parts nothing.
    let noisy = noise > NOISY * spacing;
    let is_fragile = |(point, wrinkle): &(&CriticalPoint<D>, &bool)| {
        !**wrinkle && point.value.abs() <= reach && !(noisy && is_whole(point))
    };
    let mut found: Vec<&CriticalPoint<D>> =
        wide.iter().zip(&wrinkles).filter(is_fragile).map(|(point, _)| point).collect();
    found.sort_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    found.truncate(LISTED);
    let in_data = |point: &CriticalPoint<D>| FragilePlace {
        place: frame.to_data(&point.place).to_vec(),
        value: point.value / frame.scale,
        index: point.index,
    };
    found.into_iter().map(in_data).collect()
}

/// Whether it is the thinnest place of a wall without a hole, or the narrowest one between parts without a bridge.
fn is_whole<const D: usize>(point: &CriticalPoint<D>) -> bool {
    D == 3 && point.index == if point.value < 0.0 { D - 1 } else { 1 }
}

/// Which of the points cancel in pairs, those of the least height first: each is in one pair at most.
fn wrinkles<const D: usize>(points: &[CriticalPoint<D>], height: f64, length: f64) -> Vec<bool> {
    let mut cancelled = vec![false; points.len()];
    if points.is_empty() {
        return cancelled;
    }
    let places: Vec<[f64; D]> = points.iter().map(|point| point.place).collect();
    let tree = tree_of(&places);
    let rise = |below: &CriticalPoint<D>, above: &CriticalPoint<D>| {
        let rise = above.value - below.value;
        let is_pair = above.index == below.index + 1 && (above.value < 0.0) == (below.value < 0.0);
        (is_pair && (0.0..height).contains(&rise)).then_some(rise)
    };
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, below) in points.iter().enumerate() {
        pairs.extend(
            within(&tree, &below.place, length).filter_map(|j| rise(below, &points[j]).map(|rise| (rise, i, j))),
        );
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    for (_, i, j) in pairs {
        if !cancelled[i] && !cancelled[j] {
            (cancelled[i], cancelled[j]) = (true, true);
        }
    }
    cancelled
}

/// How far from zero the points cannot tell the side.
pub fn reach(noise: f64, spacing: f64) -> f64 {
    OF_NOISE * noise + OF_SPACING * spacing
}

/// Whether the topology of f hangs on little where it is not that of the initial shape.
pub fn is_doubtful<const D: usize>(f: &HierarchicalSpline<D>, noise: f64, spacing: f64) -> bool {
    !f.critical_points(REFINED_OF_NOISE * noise + REFINED_OF_SPACING * spacing).is_empty()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lattice::domain::Domain;
    use crate::lattice::domain::tests::spline;

    /// The product of the distances from two places, less b² (an oval of Cassini): one curve if b is above half of the distance
    /// between them, otherwise two, with a critical point in the midst.
    pub(crate) fn oval(b: f64) -> HierarchicalSpline<2> {
        let domain = Domain::<2>::around(&[1.0, 1.0], 32);
        let f = |[x, y]: [f64; 2]| ((x - 0.25).hypot(y) * (x + 0.25).hypot(y) - b * b) / 0.5;
        HierarchicalSpline::new(spline(&domain, 1, f)).unwrap()
    }

    #[test]
    fn what_is_below_zero_with_its_hole_is_a_wrinkle_and_a_neck_between_two_parts_is_not() {
        let point = |x: f64, value, index| CriticalPoint { place: [x, 0.0, 0.0], value, index };
        // A thin wall, with a thinnest place and a saddle beside it; another so far away that it is none of this.
        let wall = [point(0.0, -0.1, 2), point(1.0, -0.3, 1), point(9.0, -0.2, 1)];
        assert_eq!(wrinkles(&wall, 1.0, 2.0), [true, true, false]);
        // A hole is still there at zero if only its rim is below, and what is deep below the thinnest place is no wrinkle.
        assert_eq!(wrinkles(&[point(0.0, 0.1, 2), point(1.0, -0.3, 1)], 1.0, 2.0), [false; 2]);
        assert_eq!(wrinkles(&wall, 0.1, 2.0), [false; 3]);
        // Three parts in a row hang together by two necks: with the part in the midst one of them goes, the other is there at zero.
        let row = [point(-1.0, -0.2, 1), point(0.0, -0.5, 0), point(1.0, -0.1, 1)];
        assert_eq!(wrinkles(&row, 1.0, 2.0), [true, true, false]);
        assert!(wrinkles::<3>(&[], 1.0, 1.0).is_empty());
    }

    #[test]
    fn walls_and_gaps_are_whole_where_holes_and_bridges_are_not() {
        let point = |value, index| CriticalPoint { place: [0.0; 3], value, index };
        assert!(is_whole(&point(-0.1, 2)) && is_whole(&point(0.1, 1)));
        assert!(!is_whole(&point(-0.1, 1)) && !is_whole(&point(0.1, 2)) && !is_whole(&point(-0.1, 0)));
        // In the plane a thin limb and a bridge are the same.
        assert!(!is_whole(&CriticalPoint { place: [0.0; 2], value: -0.1, index: 1 }));
    }

    #[test]
    fn what_hangs_by_a_thread_is_named_and_what_does_not_is_not() {
        let frame = Frame { origin: [10.0, 20.0], scale: 0.5, sides: [1.0; 2] };
        let spacing = 0.1;
        for (b, gap) in [(0.2495, true), (0.2505, false)] {
            let found = fragile(&oval(b), 0.0, spacing, &frame);
            let [only] = &found[..] else { panic!("{b}: {found:?}") };
            // A hundredth of a cell: coefficients are values here, which smooths a little.
            assert!((only.place[0] - 10.0).abs() < 1e-3 && (only.place[1] - 20.0).abs() < 1e-3, "{only:?}");
            assert_eq!((only.index, only.value > 0.0), (1, gap), "{only:?}");
        }
        for b in [0.24, 0.26] {
            assert_eq!(fragile(&oval(b), 0.0, spacing, &frame), [], "{b}");
            // Noise makes it unsure.
            assert!(!fragile(&oval(b), 0.15, spacing, &frame).is_empty(), "{b}");
        }
    }
}
