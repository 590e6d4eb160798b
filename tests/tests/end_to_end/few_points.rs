//! A few dozen points: what is smooth and round needs no more.

use std::f64::consts::PI;

use zeroset::{Options, extract_curve, extract_surface, reconstruct};
use zeroset_tests::{Random, Shape2, Shape3};

use crate::tori::torus;

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

/// Rings as thick as two spacings at their thickest, and thinner than one over a third of their width: fairness of second order has the sides of
/// some thirty percent of such points right.
#[test]
fn thin_rings_need_few_points() {
    for seed in 0..3 {
        let points: Vec<[f64; 3]> =
            torus(0.4, 400, &mut Random(seed)).iter().map(|[x, y, z]| [*x, *y, 0.2 * z]).collect();
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (mesh, topology) = extract_surface(&mut result).unwrap();
        let what = format!("seed {seed}: {topology:?}, {:?}", result.report.warnings);
        assert!(topology.closed && topology.components == 1 && topology.genus == 1, "{what}");
        assert_eq!(result.report.doubt, None, "{what}");
        // π a b of the section, once round.
        let volume = 0.2 * 0.4 * 0.4 * PI * 2.0 * PI;
        assert!((mesh.enclosed_volume() / volume - 1.0).abs() < 0.2, "{what}: {}", mesh.enclosed_volume() / volume);
    }
}

/// 240 points of a ring, fourteen of which are all that there is of its one half: without these it is mostly a bowl, or random. Winding numbers make
/// nothing of it; unit normals of least energy do.
#[test]
fn a_sparse_half_belongs_to_the_ring() {
    for seed in 0..4 {
        let (there, rest): (Vec<[f64; 3]>, Vec<_>) =
            torus(0.4, 600, &mut Random(seed)).into_iter().partition(|point| point[0] > 0.0);
        let points: Vec<[f64; 3]> = there.into_iter().take(226).chain(rest.into_iter().take(14)).collect();
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (mesh, topology) = extract_surface(&mut result).unwrap();
        let what = format!("seed {seed}: {topology:?}, {:?} {:?}", result.report.warnings, result.report.doubt);
        assert!(topology.closed && topology.components == 1 && topology.genus == 1, "{what}");
        assert_eq!(result.report.doubt, None, "{what}");
        // Between points twice the tube's radius apart a chord takes some of it; a bowl has half the ring's volume, and a block twice as much.
        let volume = mesh.enclosed_volume() / (0.4 * 0.4 * PI * 2.0 * PI);
        assert!((0.9..1.1).contains(&volume), "{what}: {volume}");
    }
}
