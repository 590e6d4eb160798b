//! What the distance promises, for all methods, in the plane and in space.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::TAU;

use ndarray::{ArrayD, Axis};
use proptest::prelude::*;
use zeroset_eikonal_sweep::{Distance, Error, Lattice, Method, Options, distance};

const METHODS: [Method; 3] = [Method::Godunov, Method::ClosestPoint, Method::Exact];

fn with(method: Method) -> Options {
    Options { method, ..Options::default() }
}

fn solve<const D: usize>(points: &[[f64; D]], lattice: &Lattice<D>, method: Method) -> Distance {
    distance(points, lattice, &with(method)).unwrap()
}

/// Mean of |a − b|.
fn mean_error(a: &ArrayD<f64>, b: &ArrayD<f64>) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64
}

/// Largest difference between neighbouring nodes.
fn steepest(values: &ArrayD<f64>) -> f64 {
    let mut steepest = 0.0_f64;
    for axis in (0..values.ndim()).map(Axis) {
        let lanes = values.lanes(axis);
        for lane in lanes {
            steepest = lane.windows(2).into_iter().map(|pair| (pair[1] - pair[0]).abs()).fold(steepest, f64::max);
        }
    }
    steepest
}

fn circle(count: usize) -> Vec<[f64; 2]> {
    (0..count)
        .map(|n| {
            let angle = TAU * n as f64 / count as f64;
            [0.5 + 0.3 * angle.cos(), 0.5 + 0.3 * angle.sin()]
        })
        .collect()
}

/// A torus in the unit cube with radii 0.28 and 0.1, evenly covered.
fn torus(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|n| {
            let around = TAU * (n as f64 * 0.618_033_988_749_895).fract();
            let tube = TAU * (n as f64 + 0.5) / count as f64;
            let radius = 0.28 + 0.1 * tube.cos();
            [0.5 + radius * around.cos(), 0.5 + radius * around.sin(), 0.5 + 0.1 * tube.sin()]
        })
        .collect()
}

fn unit_lattice<const D: usize>(cells: usize) -> Lattice<D> {
    Lattice::new([0.0; D], 1.0 / cells as f64, [cells + 1; D]).unwrap()
}

/// Scattered points from a fixed quasi-random sequence (Roberts' generalised golden ratio), in the unit box.
fn cloud<const D: usize>(count: usize) -> Vec<[f64; D]> {
    let ratio = [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    (1..=count).map(|n| std::array::from_fn(|axis| (n as f64 * ratio[axis]).fract())).collect()
}

/// Mean error of Godunov's scheme on `cells` cells, the start values reaching 1/8 of the box.
fn godunov_error<const D: usize>(points: &[[f64; D]], cells: usize) -> f64 {
    let lattice = unit_lattice(cells);
    let options = Options { exact_radius: cells / 8, ..with(Method::Godunov) };
    let swept = distance(points, &lattice, &options).unwrap();
    mean_error(&swept.values, &solve(points, &lattice, Method::Exact).values)
}

#[test]
fn godunovs_error_is_of_first_order() {
    // 2 is first order; 1.7 leaves room for terms of higher order at these cell sizes.
    let halves = |coarse: f64, fine: f64| assert!(coarse / fine > 1.7, "{coarse} {fine}");
    let point = [[0.41, 0.53]];
    halves(godunov_error(&point, 32), godunov_error(&point, 64));
    halves(godunov_error(&point, 64), godunov_error(&point, 128));
    let point = [[0.41, 0.53, 0.47]];
    halves(godunov_error(&point, 16), godunov_error(&point, 32));
    halves(godunov_error(&point, 32), godunov_error(&point, 64));
    // A curve, whose distance also has kinks at its centre.
    halves(godunov_error(&circle(5000), 64), godunov_error(&circle(5000), 128));
}

#[test]
fn one_point_is_never_underestimated_and_closest_point_is_exact() {
    let lattice = Lattice::new([-1.0, 0.3, 2.0], 0.1, [20, 31, 12]).unwrap();
    // Inside, on a node, and outside next to a face, a corner and far away.
    for point in [[-0.33, 1.7, 2.6], [-1.0, 0.3, 2.0], [-1.05, 1.0, 2.5], [1.0, 3.4, 3.2], [-900.0, 1.0, 2.5]] {
        let exact = solve(&[point], &lattice, Method::Exact).values;
        let closest = solve(&[point], &lattice, Method::ClosestPoint).values;
        let godunov = solve(&[point], &lattice, Method::Godunov).values;
        let rounding = 1e-14 * exact.iter().fold(1.0, |a: f64, &b| a.max(b));
        for ((&exact, &closest), &godunov) in exact.iter().zip(&closest).zip(&godunov) {
            assert!((closest - exact).abs() <= rounding);
            // d is convex, so its upwind differences never exceed its slope (Godunov is monotone). The sums of
            // up to 60 steps round, and a node may stop 1e-12 h short.
            assert!(godunov >= exact - 1e-12 - rounding);
        }
    }
}

#[test]
fn closest_point_errs_by_less_than_a_twentieth_of_a_cell() {
    fn check<const D: usize>(points: &[[f64; D]], cells: usize) {
        let lattice = unit_lattice(cells);
        let exact = solve(points, &lattice, Method::Exact).values;
        let closest = solve(points, &lattice, Method::ClosestPoint).values;
        assert!(mean_error(&closest, &exact) < 0.05 * lattice.spacing());
        assert!(closest.iter().zip(&exact).all(|(closest, exact)| closest >= &(exact - 1e-14)));
    }
    for cells in [16, 64, 128] {
        check(&circle(40), cells);
        check(&circle(5000), cells);
        check(&cloud::<2>(300), cells);
    }
    for cells in [16, 48] {
        check(&torus(1000), cells);
        check(&torus(40_000), cells);
        check(&cloud::<3>(500), cells);
    }
}

#[test]
fn the_papers_lattices_work() {
    let points: Vec<[f64; 3]> = torus(4352).iter().map(|p| [p[0], p[1], p[2] - 0.4]).collect();
    let lattice = Lattice::new([0.0; 3], 1.0 / 70.0, [71, 71, 13]).unwrap();
    let exact = solve(&points, &lattice, Method::Exact);
    assert_eq!(exact.report.sweeps, 0);
    for method in [Method::Godunov, Method::ClosestPoint] {
        let swept = solve(&points, &lattice, method);
        assert_eq!(swept.values.shape(), &[71, 71, 13]);
        assert!(swept.values.is_standard_layout());
        assert!(swept.report.sweeps <= 8 && swept.report.last_change.is_finite());
        assert!(mean_error(&swept.values, &exact.values) < 0.5 * lattice.spacing());
    }
}

#[test]
fn more_rounds_never_increase_a_value() {
    let points = torus(700);
    let lattice = unit_lattice(40);
    for method in [Method::Godunov, Method::ClosestPoint] {
        let rounds = |rounds| distance(&points, &lattice, &Options { rounds, ..with(method) }).unwrap();
        let (one, two, many) = (rounds(1), rounds(2), rounds(20));
        assert!(!one.report.converged, "one round is not a fixed point of this cloud");
        assert!(many.report.converged && many.report.last_change == 0.0);
        assert!(one.values.iter().zip(&two.values).all(|(one, two)| two <= one));
        assert!(two.values.iter().zip(&many.values).all(|(two, many)| many <= two));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    // Above the 262 144 points from which the tree is built in parallel.
    let points = cloud::<3>(300_000);
    let lattice = unit_lattice(20);
    for method in METHODS {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found = pool.install(|| solve(&points, &lattice, method));
            (found.values.mapv(f64::to_bits), found.nearest)
        };
        assert!(run(1) == run(4), "{method:?}");
    }
}

#[test]
fn refusals_name_the_cause_and_the_place() {
    let lattice = unit_lattice::<2>(4);
    let refused = |points: &[[f64; 2]], options| distance(points, &lattice, &options).unwrap_err();
    for method in METHODS {
        let options = with(method);
        assert_eq!(refused(&[], options), Error::NoPoints);
        for bad in [f64::NAN, f64::INFINITY] {
            let error = refused(&[[0.0; 2], [0.5, bad]], options);
            assert!(matches!(error, Error::NotFinite { index: 1, axis: 1, .. }));
            assert!(error.to_string().starts_with("point 1 has the coordinate"));
        }
        assert_eq!(refused(&[[0.0; 2], [0.0; 2], [-1e200, 0.0]], options), Error::TooFar { index: 2 });
        assert_eq!(refused(&[[0.0; 2]], Options { rounds: 0, ..options }), Error::NoRounds);
        assert_eq!(refused(&[[0.0; 2]], Options { exact_radius: 0, ..options }), Error::NoRadius);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Points in and around the box, on an oblong lattice.
    #[test]
    fn distance_is_1_lipschitz_along_the_edges(
        points in prop::collection::vec((-1.0..4.0_f64, -1.0..2.0_f64, -1.0..3.0_f64), 1..50),
    ) {
        let points: Vec<[f64; 3]> = points.into_iter().map(|(x, y, z)| [x, y, z]).collect();
        let lattice = Lattice::new([0.0; 3], 0.2, [16, 6, 11]).unwrap();
        let exact = solve(&points, &lattice, Method::Exact);
        prop_assert!(steepest(&exact.values) <= 0.2 + 1e-14);
        // A node asked its neighbour when last visited; since then the neighbour fell by at most the last change.
        let closest = solve(&points, &lattice, Method::ClosestPoint);
        prop_assert!(steepest(&closest.values) <= 0.2 + closest.report.last_change + 1e-14);
    }

    #[test]
    fn distance_scales_with_the_data(
        points in prop::collection::vec((0.0..3.0_f64, 0.0..1.0_f64), 1..50),
        power in -40_i32..40,
        factor in 0.01..100.0_f64,
    ) {
        let points: Vec<[f64; 2]> = points.into_iter().map(|(x, y)| [x, y]).collect();
        let at_scale = |scale: f64, method| {
            let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(|x| x * scale)).collect();
            let lattice = Lattice::new([0.0, -0.5 * scale], 0.125 * scale, [25, 17]).unwrap();
            solve(&points, &lattice, method).values
        };
        for method in METHODS {
            let unit = at_scale(1.0, method);
            // A power of two rounds nothing.
            let scale = 2.0_f64.powi(power);
            prop_assert_eq!(at_scale(scale, method), &unit * scale);
        }
        let unit = at_scale(1.0, Method::Exact);
        let scaled = at_scale(factor, Method::Exact);
        // A point on a node may come to lie a rounding error beside it; lengths are up to 4.
        prop_assert!(mean_error(&(scaled / factor), &unit) < 1e-14);
    }

    /// Whatever the cloud, the values are finite and the index belongs to the value.
    #[test]
    fn nearest_is_the_sample_that_the_value_measures(
        points in prop::collection::vec((-1e3..1e3_f64, -1e3..1e3_f64), 1..20),
        shrink in 1e-6..1.0_f64,
    ) {
        let points: Vec<[f64; 2]> = points.into_iter().map(|(x, y)| [x * shrink, y * shrink]).collect();
        let lattice = Lattice::new([-1.0, -2.0], 0.25, [9, 17]).unwrap();
        for method in METHODS {
            let found = solve(&points, &lattice, method);
            prop_assert!(found.values.iter().all(|value| value.is_finite() && *value >= 0.0));
            let Some(nearest) = found.nearest else {
                prop_assert_eq!(method, Method::Godunov);
                continue;
            };
            for i in 0..9 {
                for j in 0..17 {
                    let (node, p) = (lattice.node([i, j]), points[nearest[[i, j]] as usize]);
                    let length = (node[0] - p[0]).hypot(node[1] - p[1]);
                    // Coordinates up to 1e3 are rounded to 1e-13 when they are put into lattice units.
                    prop_assert!((found.values[[i, j]] - length).abs() < 1e-12);
                }
            }
        }
    }
}
