//! The iteration as a whole.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use proptest::prelude::*;
use zeroset_bspline::{CollocationError, EnergyError, KnotVector, Spline};
use zeroset_trust_region::{
    Error, Normalisation, Options, Preconditioner, Report, StoppingRule, SubProblem, SubProblemEnd, refine,
    refine_with, sampson_distances,
};

/// A function sampled at the Greville abscissae of a cubic lattice over the unit box and three cells around it.
fn rough<const D: usize>(cells: usize, value: impl Fn([f64; D]) -> f64) -> Spline<D> {
    let h = 1.0 / cells as f64;
    let knots = KnotVector::uniform(3, -0.5 - 3.0 * h, h, cells + 6).unwrap();
    let count = knots.basis_count();
    let coefficients = (0..count.pow(D as u32))
        .map(|flat| {
            value(std::array::from_fn(|axis| {
                -0.5 - 4.0 * h + (flat / count.pow((D - 1 - axis) as u32) % count) as f64 * h
            }))
        })
        .collect();
    Spline::from_flat(std::array::from_fn(|_| knots.clone()), coefficients).unwrap()
}

fn circle(cells: usize) -> Spline<2> {
    rough(cells, |[x, y]| x.hypot(y) - 0.35)
}

/// Noise of mean zero and about unit deviation, by a fixed hash.
fn noise(seed: usize) -> f64 {
    let one = |k: usize| {
        let z = ((seed * 16 + k) as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(one).sum::<f64>() - 6.0
}

fn flower_radius(t: f64) -> f64 {
    0.35 + 0.1 * (5.0 * t).cos()
}

fn outline(count: usize, deviation: f64, radius: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    (0..count)
        .map(|i| (i, i as f64 / count as f64 * TAU))
        .map(|(i, t)| {
            [radius(t) * t.cos() + deviation * noise(2 * i), radius(t) * t.sin() + deviation * noise(2 * i + 1)]
        })
        .collect()
}

fn rms(distances: &[f64]) -> f64 {
    (distances.iter().map(|d| d * d).sum::<f64>() / distances.len() as f64).sqrt()
}

fn spread(count: usize) -> Vec<[f64; 3]> {
    // A Fibonacci lattice on a sphere of radius 0.4.
    (0..count)
        .map(|i| (1.0 - (2.0 * i as f64 + 1.0) / count as f64, i as f64 * 2.399_963))
        .map(|(z, a)| [0.4 * (1.0 - z * z).sqrt() * a.cos(), 0.4 * (1.0 - z * z).sqrt() * a.sin(), 0.4 * z])
        .collect()
}

/// One weight to the end, everything converged: the minimum itself is asked for.
fn converged() -> Options {
    Options {
        smoothing_length: 0.02,
        smallest_smoothing_length: 0.02,
        density: 100.0,
        holdout: 0.0,
        most_iterations: 200,
        relative_decrease: 1e-11,
        cg_tolerance: 1e-8,
        most_cg_steps: 2000,
        ..Options::default()
    }
}

#[test]
fn sampson_errors_fall_by_orders_of_magnitude() {
    let points = outline(400, 0.0, flower_radius);
    let (f, report) = refine(&points, None, &circle(24), &Options::for_spacing::<2>(0.0085)).unwrap();
    // A lattice of 24 cells resolves the flower to a few 1e-6: fourth order in h = 0.04.
    assert!(report.result.sampson_rms < 2e-5 && report.initial.sampson_rms > 5e-2, "{report:?}");
    let between = outline(399, 0.0, flower_radius);
    assert!(rms(&sampson_distances(&f, &between)) < 2e-5);
    assert!(f.value(&[0.0, 0.0]) < 0.0 && f.value(&[0.5, 0.5]) > 0.0);

    let points = spread(1500);
    let ellipsoid = rough::<3>(8, |[x, y, z]| (x * x + y * y + 0.7 * z * z).sqrt() - 0.3);
    let (_, report) = refine(&points, None, &ellipsoid, &Options::for_spacing::<3>(0.037)).unwrap();
    assert!(report.result.sampson_rms < 1e-3 * report.initial.sampson_rms, "{report:?}");
}

#[test]
fn noise_is_not_followed() {
    // Noise of 1.6 times the spacing; small ℓ would make a sheet through every point.
    let points = outline(400, 0.01, |_| 0.4);
    let (f, report) = refine(&points, None, &circle(32), &Options::for_spacing::<2>(0.0063)).unwrap();
    assert_eq!(report.stopping_rule, StoppingRule::HoldOut);
    assert!(report.held_out_points > 10);
    // Averaging over a few ℓ leaves well below half of the noise.
    let truth = rms(&sampson_distances(&f, &outline(399, 0.0, |_| 0.4)));
    assert!(truth < 0.005, "{truth}");
    let best = report.best_iteration.unwrap();
    assert_eq!(report.result, report.iterations[best].errors);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn descent(
        deviation in 0.0..0.02f64,
        petals in 0usize..6,
        length in 0.0005..0.05f64,
        choice in 0usize..5,
        by_norm in any::<bool>(),
    ) {
        let points = outline(150, deviation, |t| 0.35 + 0.08 * (petals as f64 * t).cos());
        let preconditioner = [
            Preconditioner::Cholesky,
            Preconditioner::Chebyshev,
            Preconditioner::Jacobi,
            Preconditioner::None,
            Preconditioner::Multigrid,
        ][choice];
        let options = Options {
            density: 70.0,
            smoothing_length: length,
            smallest_smoothing_length: 0.2 * length,
            preconditioner,
            // 13 × 13 coefficients, of which 8 × 8 are left on cells twice as wide.
            direct_limit: 64,
            normalisation: if by_norm { Normalisation::CoefficientNorm } else { Normalisation::MeanGradient },
            most_iterations: 12,
            ..Options::default()
        };
        let (f, report) = refine(&points, None, &circle(10), &options).unwrap();
        for (k, step) in report.iterations.iter().enumerate() {
            prop_assert_eq!(step.iteration, k);
            if step.accepted {
                prop_assert!(step.objective < step.objective_before && step.gain_ratio > 0.1);
            } else {
                prop_assert_eq!(step.objective, step.objective_before);
            }
            if let Some(radius) = step.radius {
                prop_assert!(step.step_norm <= radius * (1.0 + 1e-9));
            }
        }
        for pair in report.iterations.windows(2) {
            prop_assert!(pair[1].weight <= pair[0].weight);
            // In either normalisation the weight means the same at the scale of equation (8): rounding only.
            let errors = pair[0].errors;
            let objective = errors.sampson_error + pair[1].weight * errors.energy;
            prop_assert!((objective / pair[1].objective_before - 1.0).abs() < 1e-9);
            if !pair[0].accepted && pair[0].sub_problem == SubProblemEnd::Boundary {
                prop_assert_eq!(pair[1].weight, pair[0].weight);
                prop_assert!(pair[1].radius < pair[0].radius);
            }
        }
        let gradients: f64 = points.iter().map(|p| f.value_and_gradient(p).1).map(|g| g[0].hypot(g[1])).sum();
        prop_assert!((gradients / 150.0 - 1.0).abs() < 1e-12, "‖∇f‖ averages 1 up to rounding");
    }
}

#[test]
fn the_scale_of_the_initial_function_does_not_matter() {
    let points = outline(300, 0.002, flower_radius);
    let options = Options::for_spacing::<2>(0.011);
    let (f, _) = refine(&points, None, &circle(12), &options).unwrap();
    let (g, _) = refine(&points, None, &circle(12).scaled(1e4).unwrap(), &options).unwrap();
    for (a, b) in f.as_flat().iter().zip(g.as_flat()) {
        // Rounding, magnified by the condition of a few solves (about 1e6).
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
}

#[test]
fn areas_count_by_their_ratios() {
    let points = outline(200, 0.01, flower_radius);
    let options = Options { holdout: 0.0, ..Options::for_spacing::<2>(0.017) };
    let run = |areas: Option<&[f64]>| refine(&points, areas, &circle(12), &options).unwrap().1.result;
    assert_eq!(run(None), run(Some(&[4.0; 200])));
    let uneven: Vec<f64> = (0..200).map(|i| if i < 100 { 1.0 } else { 3.0 }).collect();
    assert_ne!(run(None), run(Some(&uneven)));
}

#[test]
fn all_methods_reach_the_same_minimum() {
    let points = outline(200, 0.002, flower_radius);
    let run = |change: &dyn Fn(&mut Options)| -> Report {
        let mut options = converged();
        change(&mut options);
        refine(&points, None, &circle(8), &options).unwrap().1
    };
    let reference = run(&|o| o.preconditioner = Preconditioner::Cholesky);
    let objective = |report: &Report| report.iterations.last().unwrap().objective;
    let others: [(&str, Report); 6] = [
        // 11 × 11 coefficients, and a lattice of 7 × 7.
        (
            "multigrid",
            run(&|o| {
                o.preconditioner = Preconditioner::Multigrid;
                o.direct_limit = 49;
            }),
        ),
        ("chebyshev", run(&|o| o.preconditioner = Preconditioner::Chebyshev)),
        ("jacobi", run(&|o| o.preconditioner = Preconditioner::Jacobi)),
        ("none", run(&|o| o.preconditioner = Preconditioner::None)),
        ("exact", run(&|o| o.sub_problem = SubProblem::Exact)),
        ("automatic", run(&|_| ())),
    ];
    for (name, report) in &others {
        // Stopped when an iteration gains 1e-11: linear convergence leaves a few of these.
        let gap = objective(report) / objective(&reference) - 1.0;
        assert!(gap.abs() < 1e-7, "{name}: {gap}");
    }
    assert!(reference.factorisations > 0 && others[1].1.factorisations == 0);
}

#[test]
fn the_papers_form_runs() {
    let points = outline(200, 0.0, flower_radius);
    let options = Options {
        density: 60.0,
        smoothing_length: 0.03,
        radius: Some(0.1),
        target_error: Some(1e-3),
        most_iterations: 60,
        ..Options::paper()
    };
    let (_, report) = refine(&points, None, &circle(12), &options).unwrap();
    assert_eq!(report.stopping_rule, StoppingRule::SampsonErrorReached);
    assert!(report.iterations.iter().all(|i| i.radius.is_some()));
    assert_eq!(report.held_out_points, 0);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    // Enough points for the parallel sums to split.
    let points = outline(6000, 0.003, flower_radius);
    for preconditioner in [Preconditioner::Cholesky, Preconditioner::Chebyshev, Preconditioner::Multigrid] {
        let options =
            Options { preconditioner, direct_limit: 200, most_iterations: 4, ..Options::for_spacing::<2>(0.0006) };
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| refine(&points, None, &circle(16), &options).unwrap().0)
        };
        let one = run(1);
        for threads in [2, 5] {
            let bits = |f: &Spline<2>| f.as_flat().iter().map(|c| c.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&one), bits(&run(threads)));
        }
    }
}

#[test]
fn every_stopping_rule_names_itself() {
    let clean = outline(200, 0.0, flower_radius);
    let options = Options { holdout: 0.0, ..Options::for_spacing::<2>(0.017) };
    let rule = |points: &[[f64; 2]], options: &Options| {
        let report = refine(points, None, &circle(12), options).unwrap().1;
        (report.stopping_rule, report)
    };

    let (stopped, report) = rule(&clean, &Options { target_error: Some(1e-3), ..options.clone() });
    assert_eq!(stopped, StoppingRule::SampsonErrorReached);
    assert!(report.result.sampson_rms <= 1e-3);
    let before = report.iterations.len().checked_sub(2).map(|i| report.iterations[i].errors.sampson_rms);
    assert!(before.is_none_or(|rms| rms > 1e-3), "not one iteration too many");
    let (stopped, report) = rule(&clean, &Options { target_error: Some(1.0), ..options.clone() });
    assert_eq!((stopped, report.iterations.len()), (StoppingRule::SampsonErrorReached, 0));

    let (stopped, report) = rule(&clean, &options);
    assert_eq!(stopped, StoppingRule::RelativeDecrease);
    let last = report.iterations.last().unwrap();
    assert!((last.smoothing_length - options.smallest_smoothing_length).abs() < 1e-12, "only at the floor");

    let (stopped, report) = rule(&clean, &Options { most_iterations: 2, ..options.clone() });
    assert_eq!((stopped, report.iterations.len()), (StoppingRule::IterationLimit, 2));

    let noisy = outline(400, 0.01, |_| 0.4);
    let (stopped, _) = rule(&noisy, &Options::for_spacing::<2>(0.0063));
    assert_eq!(stopped, StoppingRule::HoldOut);

    // Without smoothing, noisy points soon make the model fail; the first rejected step is then enough.
    let hard =
        Options { smoothing_length: 0.002, smallest_radius: 0.9, density: 160.0, holdout: 0.0, ..options.clone() };
    let (stopped, report) = rule(&noisy, &hard);
    assert_eq!(stopped, StoppingRule::RadiusTooSmall);
    assert!(report.iterations.last().unwrap().gain_ratio < 0.25);

    let observer = |i: &zeroset_trust_region::Iteration| {
        if i.iteration == 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let report = refine_with(&clean, None, &circle(12), &options, &observer).unwrap().1;
    assert_eq!((report.stopping_rule, report.iterations.len()), (StoppingRule::Cancelled, 2));
}

#[test]
fn bad_input_is_refused() {
    let f = circle(8);
    let options = Options::default();
    let points = outline(60, 0.0, |_| 0.4);
    let fail = |points: &[[f64; 2]], areas: Option<&[f64]>, f: &Spline<2>, options: &Options| {
        refine(points, areas, f, options).unwrap_err()
    };
    assert_eq!(fail(&[], None, &f, &options), Error::NoPoints);
    assert_eq!(fail(&points, Some(&[1.0; 3]), &f, &options), Error::Areas { found: 3, needed: 60 });
    let mut areas = vec![1.0; 60];
    areas[7] = f64::NAN;
    assert_eq!(fail(&points, Some(&areas), &f, &options), Error::BadArea(7));
    assert_eq!(fail(&points, Some(&[0.0; 60]), &f, &options), Error::BadArea(0));
    for (place, axis) in [([f64::NAN, 0.0], 0), ([0.0, f64::INFINITY], 1), ([0.0, 3.0], 1)] {
        let mut outside = points.clone();
        outside[5] = place;
        let expected = Error::Collocation(CollocationError::Outside { index: 5, axis });
        assert_eq!(fail(&outside, None, &f, &options), expected);
    }
    let linear = KnotVector::uniform(1, -1.0, 0.25, 8).unwrap();
    let linear = Spline::from_flat([linear.clone(), linear], (0..81).map(f64::from).collect()).unwrap();
    let expected = Error::Energy(EnergyError::Degree { axis: 0, degree: 1, order: 2 });
    assert_eq!(fail(&points, None, &linear, &options), expected);
    assert_eq!(fail(&points, None, &rough(8, |_| 1.0), &Options { decay: 0.5, ..options.clone() }), Error::NoGradient);
    assert_eq!(fail(&points, None, &rough(8, |_| 0.0), &options), Error::NoGradient);
    let decay = fail(&points, None, &f, &Options { decay: 0.0, ..options.clone() });
    assert!(matches!(decay, Error::Option { name: "decay", .. }));
    let holdout = fail(&points, None, &f, &Options { holdout: f64::NAN, ..options.clone() });
    assert!(matches!(holdout, Error::Option { name: "holdout", .. }));
    let exact = Options { sub_problem: SubProblem::Exact, ..options };
    assert!(matches!(fail(&points, None, &circle(40), &exact), Error::TooLargeForExact { .. }));
}

#[test]
fn an_anchor_keeps_what_no_point_holds() {
    // Points on a circle; in the middle the initial shape has a hole that they say nothing of.
    let points = outline(300, 0.0, |_| 0.35);
    let initial = rough::<2>(24, |[x, y]| {
        let r = x.hypot(y);
        (r - 0.35).max(0.1 - r)
    });
    let at = |stiffness: f64| {
        let far = |c: &f64| if *c > -0.08 && *c < 0.08 { 0.0 } else { stiffness };
        let mut kept: Vec<f64> = initial.as_flat().iter().map(far).collect();
        // The hole is held as well, where the values are small.
        let count = initial.shape()[0];
        for (flat, k) in kept.iter_mut().enumerate() {
            let h = 1.0 / 24.0;
            let r = (-0.5 - 4.0 * h + (flat / count) as f64 * h).hypot(-0.5 - 4.0 * h + (flat % count) as f64 * h);
            *k = if r < 0.2 { stiffness } else { *k };
        }
        let options = Options { stiffness: kept, holdout: 0.0, ..Options::for_spacing::<2>(0.0073) };
        refine(&points, None, &initial, &options).unwrap().0
    };
    // The middle of the initial shape is at 0.1, less what the smoothing of a spline takes from the tip.
    let (free, held) = (at(0.0).value(&[0.0, 0.0]), at(100.0 * 24f64.powi(2)));
    assert!((held.value(&[0.0, 0.0]) - 0.08).abs() < 0.02, "{} {free}", held.value(&[0.0, 0.0]));
    assert!((free - 0.08).abs() > 0.04, "{free}");
    // And the points are fitted as without it: to a hundredth of a cell.
    assert!(rms(&sampson_distances(&held, &points)) < 4e-4);
    let options = Options { stiffness: vec![1.0], ..Options::for_spacing::<2>(0.0073) };
    assert!(matches!(refine(&points, None, &initial, &options), Err(Error::Stiffness { found: 1, .. })));
}
