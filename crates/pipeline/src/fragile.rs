//! Places where the topology of the zero set hangs on little: critical points of f with values so near zero that the points cannot
//! tell on which side of zero they are.

use serde::Serialize;
use zeroset_bspline::HierarchicalSpline;

use crate::frame::Frame;

/// The zero set is as sure as this share of the standard deviation of the points, of which a smooth function averages many,
const OF_NOISE: f64 = 0.1;
/// and this share of their spacing, for what they leave to fairness.
const OF_SPACING: f64 = 0.015;
/// Where refinement has changed the topology, which is a reason to doubt it, more of both is in reach.
const REFINED_OF_NOISE: f64 = 0.25;
const REFINED_OF_SPACING: f64 = 0.05;
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

/// The critical points of f nearer to zero than points with this `noise` and `spacing`, in the frame, can tell, the nearest first.
pub fn fragile<const D: usize>(
    f: &HierarchicalSpline<D>,
    noise: f64,
    spacing: f64,
    frame: &Frame<D>,
) -> Vec<FragilePlace> {
    let mut found = f.critical_points(reach(noise, spacing));
    found.sort_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
    found.truncate(LISTED);
    let in_data = |point: &zeroset_bspline::CriticalPoint<D>| FragilePlace {
        place: frame.to_data(&point.place).to_vec(),
        value: point.value / frame.scale,
        index: point.index,
    };
    found.iter().map(in_data).collect()
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
    use crate::domain::Domain;
    use crate::domain::tests::spline;

    /// The product of the distances from two places, less b² (an oval of Cassini): one curve if b is above half of the distance
    /// between them, otherwise two, with a critical point in the midst.
    pub(crate) fn oval(b: f64) -> HierarchicalSpline<2> {
        let domain = Domain::<2>::around(&[1.0, 1.0], 32);
        let f = |[x, y]: [f64; 2]| ((x - 0.25).hypot(y) * (x + 0.25).hypot(y) - b * b) / 0.5;
        HierarchicalSpline::new(spline(&domain, 1, f)).unwrap()
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
        for b in [0.2, 0.3] {
            assert_eq!(fragile(&oval(b), 0.0, spacing, &frame), [], "{b}");
            // Noise makes it unsure.
            assert!(!fragile(&oval(b), 1.0, spacing, &frame).is_empty(), "{b}");
        }
    }
}
