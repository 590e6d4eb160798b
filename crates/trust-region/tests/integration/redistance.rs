//! Redistancing: unit slopes, and zeros that stay.

use std::f64::consts::TAU;

use zeroset_bspline::{CellBand, Derivatives, HierarchicalSpline, KnotVector, Spline};
use zeroset_trust_region::{KnownDistances, LevelError, RedistanceOptions, redistance};

const RADIUS: f64 = 0.5;
const ZEROS: usize = 180;

fn circle(radius: f64) -> Vec<[f64; 2]> {
    (0..ZEROS).map(|i| (i as f64 / ZEROS as f64 * TAU).sin_cos()).map(|(s, c)| [radius * c, radius * s]).collect()
}

/// A function with the zeros of a circle and slopes from 0.5 to 1.1 there, on cells of 0.1 and a level of 0.05 around it.
fn uneven() -> (HierarchicalSpline<2>, CellBand<2>) {
    let knots = KnotVector::uniform(3, -1.0, 0.1, 20).unwrap();
    let at = |k: usize| -1.0 + (k as f64 - 1.0) * 0.1;
    let value = |x: f64, y: f64| (x.hypot(y) - RADIUS) * (0.8 + 0.6 * x);
    let coefficients = (0..23 * 23).map(|i| value(at(i / 23), at(i % 23))).collect();
    let root = Spline::from_flat([knots.clone(), knots], coefficients).unwrap();
    let band = CellBand::new(root.knots(), &circle(RADIUS), &[1; ZEROS], [4, 3]).unwrap();
    let mut f = HierarchicalSpline::new(root).unwrap();
    f.push_level(band.active()[0].clone()).unwrap();
    (f, band)
}

/// Where Newton steps lead from the circle.
fn zeros(f: &HierarchicalSpline<2>) -> Vec<[f64; 2]> {
    let mut places = circle(RADIUS);
    for _ in 0..8 {
        let at = f.evaluate(&places, Derivatives::Gradient);
        for ((place, value), g) in places.iter_mut().zip(at.values).zip(at.gradients) {
            let square = g[0] * g[0] + g[1] * g[1];
            *place = [place[0] - value / square * g[0], place[1] - value / square * g[1]];
        }
    }
    places
}

fn options() -> RedistanceOptions {
    let spacing = TAU * RADIUS / ZEROS as f64;
    RedistanceOptions {
        density: 1.0 / spacing,
        smoothing: 0.15,
        third_order: 4.0 * spacing,
        slope_length: spacing,
        distance_share: 0.2,
        cg_steps: 60,
        cancel: Default::default(),
    }
}

#[test]
fn slopes_become_one_and_zeros_stay() {
    let (f, band) = uneven();
    let zeros = zeros(&f);
    let off: Vec<[f64; 2]> = [0.35, 0.65].into_iter().flat_map(circle).collect();
    let known = KnownDistances {
        areas: vec![1.0; zeros.len()],
        distances: off.iter().map(|x| (x[0].hypot(x[1]) - RADIUS).abs()).collect(),
        zeros,
        places: off,
    };
    let wrong = |f: &HierarchicalSpline<2>| {
        let values = f.evaluate(&known.places, Derivatives::Value).values;
        values.iter().zip(&known.distances).map(|(f, d)| (f.abs() - d).abs()).fold(0.0, f64::max)
    };
    let before = wrong(&f);
    let (f, report) = redistance(f, band.near(), &known, &options()).unwrap();
    // From 0.5 to 1.1 they are 0.29 off in the root mean square.
    assert!(report.slope_rms[0] > 0.2 && report.slope_rms[1] < 0.02, "{report:?}");
    // A thousandth of a cell.
    assert!(report.zero_rms[0] < 1e-12 && report.zero_rms[1] < 5e-5, "{report:?}");
    // In the middle between the band's edge, where nothing changes, and the zeros.
    assert!(before > 0.05 && wrong(&f) < 0.01, "{before} {}", wrong(&f));
    assert_eq!(report.cg_steps.len(), 2);
}

#[test]
fn a_distance_stays_as_it_is() {
    // A plane, which the spline holds exactly.
    let knots = KnotVector::uniform(3, -1.0, 0.25, 8).unwrap();
    let at = |k: usize| -1.0 + (k as f64 - 1.0) * 0.25;
    let root = Spline::from_flat([knots.clone(), knots], (0..121).map(|i| at(i / 11)).collect()).unwrap();
    let zeros: Vec<[f64; 2]> = (0..40).map(|i| [0.0, -0.4 + 0.02 * f64::from(i)]).collect();
    let band = CellBand::new(root.knots(), &zeros, &[0; 40], [3, 3]).unwrap();
    let f = HierarchicalSpline::new(root).unwrap();
    let known = KnownDistances { areas: vec![1.0; 40], zeros, ..KnownDistances::default() };
    let (same, report) = redistance(f.clone(), band.near(), &known, &options()).unwrap();
    let change = same.root().as_flat().iter().zip(f.root().as_flat()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(change < 1e-12 && report.slope_rms[0] < 1e-12, "rounding: {change} {report:?}");
}

#[test]
fn what_does_not_fit_is_refused() {
    let (f, band) = uneven();
    let of = |areas: usize, distances: Vec<f64>| KnownDistances {
        zeros: vec![[0.5, 0.0]; 2],
        areas: vec![1.0; areas],
        places: vec![[0.0, 0.0]; 1],
        distances,
    };
    let refused = |known: &KnownDistances<2>, options: &RedistanceOptions| {
        matches!(redistance(f.clone(), band.near(), known, options), Err(LevelError::Refine(_)))
    };
    assert!(!refused(&of(2, vec![0.5]), &options()));
    assert!(refused(&of(1, vec![0.5]), &options()));
    assert!(refused(&of(2, vec![]), &options()));
    assert!(refused(&of(2, vec![f64::NAN]), &options()));
    assert!(refused(&of(2, vec![0.5]), &RedistanceOptions { smoothing: 0.0, ..options() }));
    assert!(refused(&of(2, vec![0.5]), &RedistanceOptions { cg_steps: 0, ..options() }));
}
