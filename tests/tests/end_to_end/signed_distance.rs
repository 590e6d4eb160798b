//! The function as a signed distance, against the exact one.

use zeroset::{Options, reconstruct};
use zeroset_tests::Random;

use crate::tori::torus;

fn exact_distance(p: &[f64; 3]) -> f64 {
    (p[0].hypot(p[1]) - 1.0).hypot(p[2]) - 0.35
}

#[test]
fn of_a_torus() {
    let mut random = Random(1);
    let points = torus(0.35, 4000, &mut random);
    let result = reconstruct(&points, &Options::default()).unwrap();
    let (cell, spacing) = (result.report.frame.cell, result.report.input.spacing);
    let (origin, f) = result.in_data_units().unwrap();
    let place = |random: &mut Random| [2.9, 2.9, 0.9].map(|side| side * (random.uniform() - 0.5));
    let places: Vec<[f64; 3]> = (0..20_000).map(|_| place(&mut random)).collect();
    let (mut slope, mut near) = (0.0, 0.0);
    for x in &places {
        let (value, gradient) = f.value_and_gradient(&std::array::from_fn(|axis| x[axis] - origin[axis]));
        let exact = exact_distance(x);
        // What is asked of the function: one cell. On the tube's axis, where a distance has a kink, it is 0.4.
        assert!((value - exact).abs() < cell, "{value} where the distance is {exact}, at {x:?}");
        // 3e-4 of the size is what fitting leaves between the points.
        assert!(
            exact.abs() < 1e-3 || (value < 0.0) == (exact < 0.0),
            "{value} where the distance is {exact}, at {x:?}"
        );
        if exact.abs() < 2.0 * spacing {
            slope += gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            near += 1.0;
        }
    }
    let slope = slope / near;
    assert!(near > 1000.0 && (slope - 1.0).abs() < 0.05, "{slope}");
    // The report knows without the exact distance.
    let figures = &result.report.distance;
    assert!((figures.slope - slope).abs() < 0.02, "{figures:?}, {slope}");
    assert!(figures.nodes > 1000 && figures.error < 0.1 && figures.largest_error < 1.0, "{figures:?}");
}
