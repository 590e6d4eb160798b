//! Points beside the surface, among points of it.

use zeroset::{Options, extract_surface, reconstruct};
use zeroset_tests::Random;

use crate::tori::torus;

/// Three and ten percent of strays in a box half as large again. Those that were no farther than a spacing or two from the surface were
/// fitted, and made specks and handles.
#[test]
fn points_strewn_over_the_box_are_left_out_and_named() {
    const COUNT: usize = 6000;
    for (seed, strays) in [(0, 180), (1, 180), (2, 600)] {
        let mut random = Random(seed);
        let mut points = torus(0.4, COUNT, &mut random);
        points.extend((0..strays).map(|_| [2.1, 2.1, 0.6].map(|half| random.between(-half, half))));
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (_, topology) = extract_surface(&mut result).unwrap();
        assert_eq!((topology.components, topology.genus), (1, 1), "seed {seed}: {:?}", result.report.warnings);

        let spacing = result.report.input.spacing;
        let far = |p: &[f64; 3]| ((p[0].hypot(p[1]) - 1.0).hypot(p[2]) - 0.4).abs() > spacing;
        let places = |wanted: &dyn Fn(usize) -> bool| {
            (0..result.points.len()).filter(|i| wanted(*i)).map(|i| result.frame.to_data(&result.points[i])).collect()
        };
        let named: Vec<[f64; 3]> = places(&|i| result.outliers[i]);
        let fitted: Vec<[f64; 3]> = places(&|i| !result.outliers[i]);
        // What is nearer than a spacing may pass for a point of the surface.
        let missed = fitted.iter().filter(|p| far(p)).count();
        let wrong = named.iter().filter(|p| !far(p)).count();
        assert!(missed <= strays / 50, "seed {seed}: {missed} of {strays} strays were fitted");
        assert!(wrong <= strays / 10, "seed {seed}: {wrong} of {} named ones lie on the surface", named.len());
    }
}
