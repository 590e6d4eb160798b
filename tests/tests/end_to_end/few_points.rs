//! A few dozen points: what is smooth and round needs no more.

use std::f64::consts::PI;

use zeroset::{Options, extract_curve, extract_surface, reconstruct};
use zeroset_tests::{Random, Shape2, Shape3};

/// Four clouds of each size, with what each is called.
fn clouds<P>(sizes: [u64; 3], point: impl Fn(&mut Random) -> P) -> Vec<(String, Vec<P>)> {
    let cloud = |count, seed| {
        let mut random = Random(1000 * count + seed);
        (format!("{count} points, cloud {seed}"), (0..count).map(|_| point(&mut random)).collect())
    };
    sizes.into_iter().flat_map(|count| (0..4).map(move |seed| (count, seed))).map(|(c, s)| cloud(c, s)).collect()
}

#[test]
fn random_points_of_a_sphere_are_one_sphere() {
    let mut right = 0;
    for (name, points) in clouds([24, 36, 60], |random| Shape3::Sphere.point(random)) {
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (mesh, topology) = extract_surface(&mut result).unwrap();
        let sphere = topology.closed && topology.components == 1 && topology.genus == 0;
        let what = format!("{name}: {topology:?}, {:?}", result.report.warnings);
        assert!(sphere || !result.report.warnings.is_empty(), "{what}");
        assert!(points.len() < 60 || sphere && result.report.warnings.is_empty(), "{what}");
        right += usize::from(sphere);
        // A plane patch over a gap of chord c is c²/8 too low at most; c = 2 spacings is wider than most gaps of random points.
        let spacing = (4.0 * PI / points.len() as f64).sqrt();
        let off = |vertex: &[f64; 3]| (vertex.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs();
        let mean = mesh.vertices.iter().map(off).sum::<f64>() / mesh.vertices.len() as f64;
        assert!(mean < (2.0 * spacing).powi(2) / 8.0, "{what}: {mean}");
    }
    // A cell of a third of the spacing made ten components of them; one cloud in twelve may have a hole as wide as the sphere.
    assert!(right >= 11, "{right}");
}

#[test]
fn random_points_of_a_circle_are_one_circle() {
    for (name, points) in clouds([16, 24, 40], |random| Shape2::Circle.point(random)) {
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (curves, topology) = extract_curve(&mut result).unwrap();
        assert_eq!((topology.parts, topology.holes), (1, 0), "{name}: {topology:?}");
        assert_eq!(curves.loops.len(), 1);
    }
}
