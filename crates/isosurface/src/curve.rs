//! From samples to closed polylines: marching squares with the asymptotic decider.

use std::collections::HashMap;

use zeroset_bspline::HierarchicalSpline;

use crate::cell::positives_joined;
use crate::error::Error;
use crate::function::ImplicitFunction;
use crate::options::{Options, Report};
use crate::polylines::Curves;
use crate::root::{Zero, on_segment};
use crate::samples::LatticeSamples;

/// Extracts the zero set as closed polylines, their vertices on `f = 0` where a function is given. Where the zero set
/// leaves the lattice it follows the lattice's rim.
///
/// # Errors
/// If no sample is negative.
pub fn curve(
    samples: &LatticeSamples<2>,
    function: Option<&impl ImplicitFunction<2>>,
    options: &Options,
) -> Result<(Curves, Report), Error> {
    let shape = samples.shape();
    let mut report = Report::default();
    // From an edge (its lower node and axis) to the next one, with the inside on the left.
    let mut next: HashMap<Edge, Edge> = HashMap::new();
    let mut starts = Vec::new();
    for i in 0..shape[0] - 1 {
        for j in samples.cells().row(i).iter().flat_map(|run| run.from as usize..run.to as usize) {
            // Counter-clockwise corners; side k runs from corner k to corner k + 1.
            let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            let values = corners.map(|node| samples.value(&node));
            let side = |k: usize| -> Edge {
                match k % 4 {
                    0 => ([i, j], 0),
                    1 => ([i + 1, j], 1),
                    2 => ([i, j + 1], 0),
                    _ => ([i, j], 1),
                }
            };
            let positive = |k: usize| values[k % 4] >= 0.0;
            let leaves: Vec<usize> = (0..4).filter(|&k| positive(k) && !positive(k + 1)).collect();
            report.cells += usize::from(!leaves.is_empty());
            report.ambiguous += usize::from(leaves.len() == 2);
            let ahead = leaves.len() == 2 && positives_joined(values);
            for &leave in &leaves {
                let entered = |k: &usize| !positive(*k) && positive(k + 1);
                let enter = if ahead {
                    (1..4).map(|step| leave + step).find(entered)
                } else {
                    (1..4).map(|step| leave + 4 - step).find(entered)
                };
                // From the leave to the enter f > 0 is on the left; the curve runs the other way.
                if let Some(enter) = enter {
                    next.insert(side(enter), side(leave));
                    starts.push(side(enter));
                }
            }
        }
    }
    if starts.is_empty() {
        return Err(Error::Empty);
    }
    let mut loops = Vec::new();
    for start in starts {
        let mut cycle = Vec::new();
        let mut edge = start;
        while let Some(following) = next.remove(&edge) {
            let (vertex, capped) = zero(samples, function, edge, options);
            report.capped += usize::from(capped);
            report.unreached += usize::from(!vertex.reached);
            cycle.push(vertex.position);
            edge = following;
        }
        if !cycle.is_empty() {
            loops.push(cycle);
        }
    }
    Ok((Curves { loops, paths: Vec::new() }, report))
}

/// Extracts the zero set of a spline from the cells of its dense lattice, halved as often as asked for (at least as often as
/// there are levels): [`curve`] of [`LatticeSamples::crossed`]. The curves are those of samples on the whole lattice, at a cost
/// that grows with their length.
///
/// # Errors
/// If f is not negative at any node, or cells become too small or too many along an axis.
pub fn curve_of(spline: &HierarchicalSpline<2>, halvings: u32, options: &Options) -> Result<(Curves, Report), Error> {
    curve(&LatticeSamples::crossed(spline, halvings)?, Some(spline), options)
}

/// An edge of the lattice: its lower node and its axis.
type Edge = ([usize; 2], usize);

/// The zero on an edge, and whether it lies on a cap.
fn zero(
    samples: &LatticeSamples<2>,
    function: Option<&impl ImplicitFunction<2>>,
    (node, axis): Edge,
    options: &Options,
) -> (Zero<2>, bool) {
    let mut other = node;
    other[axis] += 1;
    let (within, without) = if samples.value(&node) < 0.0 { (node, other) } else { (other, node) };
    let ends = [within, without].map(|node| samples.position(&node));
    if samples.is_outer(&without) {
        let position = std::array::from_fn(|axis| 0.5 * (ends[0][axis] + ends[1][axis]));
        return (Zero::held(position), true);
    }
    let values = [within, without].map(|node| samples.value(&node));
    (on_segment(function, &ends[0], &ends[1], values, options), false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::ArrayD;
    use proptest::prelude::*;

    struct Ring;

    impl ImplicitFunction<2> for Ring {
        fn value_and_gradient(&self, x: &[f64; 2]) -> (f64, [f64; 2]) {
            let r = x[0].hypot(x[1]);
            let sign = if r > 0.6 { 1.0 } else { -1.0 };
            ((r - 0.6).abs() - 0.3, x.map(|x| sign * x / r))
        }
    }

    fn axes(count: usize) -> [Vec<f64>; 2] {
        let axis: Vec<f64> = (0..count).map(|i| -1.03 + 2.06 * i as f64 / (count - 1) as f64).collect();
        [axis.clone(), axis]
    }

    #[test]
    fn a_ring_has_a_rim_and_a_hole() {
        let samples = LatticeSamples::of(axes(60), &Ring).unwrap();
        let (curves, report) = curve(&samples, Some(&Ring), &Options::default()).unwrap();
        let topology = curves.topology();
        assert_eq!((topology.loops, topology.parts, topology.holes, report.capped), (2, 1, 1, 0));
        // Chords of the length of a cell, 0.035: relative error (0.035 / 0.3)² / 24 and less on the outer circle.
        let pi = std::f64::consts::PI;
        assert!((topology.area - pi * (0.81 - 0.09)).abs() < 2e-3);
        assert!((topology.length - 2.0 * pi * 1.2).abs() < 5e-3);
        for vertex in curves.loops.iter().flatten() {
            assert!(Ring.value_and_gradient(vertex).0.abs() < 1e-12, "on f = 0 to rounding");
        }
    }

    #[test]
    fn the_area_of_a_ring_converges() {
        let exact = std::f64::consts::PI * (0.81 - 0.09);
        let errors = [30, 59, 117].map(|count| {
            let samples = LatticeSamples::of(axes(count), &Ring).unwrap();
            (curve(&samples, Some(&Ring), &Options::default()).unwrap().0.topology().area - exact).abs()
        });
        // Second order: a quarter for half the cell; 3 leaves room for where the cuts fall.
        assert!(errors[0] > 3.0 * errors[1] && errors[1] > 3.0 * errors[2], "{errors:?}");
    }

    #[test]
    fn a_saddle_is_decided_by_its_asymptotes() {
        // Two inside corners across a square: one part where the inside is the stronger, two where the outside is.
        for (inside, parts) in [(-2.0, 1), (-0.5, 2)] {
            let values = ArrayD::from_shape_vec(vec![2, 2], vec![inside, 1.0, 1.0, inside]).unwrap();
            let samples = LatticeSamples::new(axes(2), values).unwrap();
            let (curves, report) = curve(&samples, None::<&Ring>, &Options::default()).unwrap();
            let topology = curves.topology();
            assert_eq!((topology.parts, topology.holes, report.ambiguous), (parts, 0, 1));
        }
    }

    #[test]
    fn what_leaves_the_lattice_follows_its_rim() {
        // Only the ring's rim within |x|, |y| < 0.5 is on the lattice, and is closed along the square.
        let axes = axes(41).map(|axis| axis.iter().map(|x| 0.5 * x / 1.03).collect());
        let samples = LatticeSamples::of(axes, &Ring).unwrap();
        let (curves, report) = curve(&samples, Some(&Ring), &Options::default()).unwrap();
        let topology = curves.topology();
        assert_eq!((topology.parts, topology.holes), (1, 1));
        assert!(report.capped > 0 && report.unreached == 0);
        // A square of side 1 less a disc of radius 0.3; caps stick out by 1e-3 of a cell of 0.025 and are chamfered at the
        // corners by as much, chords of 0.025 err by (0.025 / 0.3)² / 6.
        assert!((topology.area - (1.0 - std::f64::consts::PI * 0.09)).abs() < 1e-3, "{topology:?}");
    }

    #[test]
    fn one_sign_is_an_error() {
        let samples = LatticeSamples::new(axes(3), ArrayD::ones(vec![3, 3])).unwrap();
        assert_eq!(curve(&samples, None::<&Ring>, &Options::default()).unwrap_err(), Error::Empty);
    }

    proptest! {
        #[test]
        fn random_samples_give_loops_that_enclose_the_inside(values in proptest::collection::vec(-1.0..1.0f64, 36)) {
            let samples = LatticeSamples::new(axes(6), ArrayD::from_shape_vec(vec![6, 6], values.clone()).unwrap()).unwrap();
            let Ok((curves, _)) = curve(&samples, None::<&Ring>, &Options::default()) else {
                prop_assert!(values.iter().all(|v| *v >= 0.0));
                return Ok(());
            };
            let topology = curves.topology();
            prop_assert!(curves.loops.iter().all(|cycle| cycle.len() >= 3));
            prop_assert!(topology.area > 0.0);
            // Each inside node is wound around once, each outside node not at all.
            let axes = axes(6);
            for (index, value) in values.iter().enumerate() {
                let p = [axes[0][index / 6], axes[1][index % 6]];
                let mut turns = 0.0;
                for cycle in &curves.loops {
                    for (a, b) in cycle.iter().zip(cycle.iter().cycle().skip(1)) {
                        let (u, v) = ([a[0] - p[0], a[1] - p[1]], [b[0] - p[0], b[1] - p[1]]);
                        turns += (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]);
                    }
                }
                let winding = (turns / std::f64::consts::TAU).round() as i32;
                prop_assert_eq!(winding, i32::from(*value < 0.0));
            }
        }
    }
}
