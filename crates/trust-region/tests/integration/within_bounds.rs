//! Places that are brought to a given side.

use zeroset_bspline::{CellBand, Derivatives, HierarchicalSpline, KnotVector, Spline};
use zeroset_trust_region::{Error, LevelError, LevelOptions, Place, refine_levels, within_bounds};

/// 400 points on a circle, and a function fitted to them on two levels.
fn circle() -> (Vec<[f64; 2]>, CellBand<2>, HierarchicalSpline<2>) {
    let points: Vec<[f64; 2]> = (0..400)
        .map(|i| (f64::from(i) / 400.0 * std::f64::consts::TAU).sin_cos())
        .map(|(s, c)| [0.5 * c, 0.5 * s])
        .collect();
    let knots = KnotVector::uniform(3, -0.8, 0.1, 16).unwrap();
    let at = |r: usize| -0.8 + (r as f64 - 1.0) * 0.1;
    let distance = (0..19 * 19).map(|i| at(i / 19).hypot(at(i % 19)) - 0.45).collect();
    let initial = Spline::from_flat([knots.clone(), knots], distance).unwrap();
    let band = CellBand::new(initial.knots(), &points, &[2; 400], [3, 3]).unwrap();
    let f = refine_levels(&points, None, None, &initial, &band, &LevelOptions::for_spacing::<2>(0.008)).unwrap().0;
    (points, band, f)
}

#[test]
fn places_change_sides_and_little_else_does() {
    let (points, band, f) = circle();
    let areas = vec![1.0; points.len()];
    let bring = |places: &[Place<2>]| {
        within_bounds(&f, band.near(), (&points, &areas), places, (400.0 / std::f64::consts::PI, 0.03)).unwrap()
    };
    let place = |at, bound| Place { at, bound, weight: 1.0 };
    // Just inside, and to be outside; one that is where it is to be.
    let (moved, stays) = ([0.49, 0.0], place([0.0, 0.53], 0.01));
    assert!(f.value(&moved) < -0.008);
    let g = bring(&[place(moved, 0.002), stays]);
    // The last step weighs a place as 10⁵ points.
    assert!(g.value(&moved) > 0.0019, "{}", g.value(&moved));
    let values = |f: &HierarchicalSpline<2>| f.evaluate(&points, Derivatives::Value).values;
    let change: Vec<f64> = values(&g).iter().zip(&values(&f)).map(|(g, f)| (g - f).abs()).collect();
    // Points next to it give way by no more than it moves; cells are 0.025, and nothing beyond eight of them changes.
    assert!(change.iter().all(|change| *change < 0.012));
    for (x, change) in points.iter().zip(&change) {
        assert!((x[0] - moved[0]).hypot(x[1] - moved[1]) < 0.3 || *change == 0.0, "{x:?} {change}");
    }
    assert_eq!(bring(&[stays]), f);
    assert_eq!(bring(&[]), f);
}

#[test]
fn far_from_the_points_a_coarser_level_is_corrected() {
    let (points, band, f) = circle();
    // Within the dense level's functions near the points, but not in the finest cells.
    let at = [0.5 - 0.22, 0.0];
    let place = Place { at, bound: 0.001, weight: 1.0 };
    let g = within_bounds(&f, band.near(), (&points, &[1.0; 400]), &[place], (100.0, 0.03)).unwrap();
    assert!(g.value(&at) > 0.0 && f.value(&at) < -0.1, "{} from {}", g.value(&at), f.value(&at));
}

#[test]
fn what_does_not_fit_is_refused() {
    let (points, band, f) = circle();
    let of = |areas: &[f64], bound: f64| {
        let place = Place { at: [0.4, 0.0], bound, weight: 1.0 };
        within_bounds(&f, band.near(), (&points, areas), &[place], (100.0, 0.03)).unwrap_err()
    };
    assert_eq!(of(&[1.0], 0.1), LevelError::Refine(Error::Areas { found: 1, needed: 400 }));
    assert_eq!(of(&[1.0; 400], f64::NAN), LevelError::Refine(Error::Place { index: 0 }));
}
