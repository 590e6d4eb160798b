//! Gaps that dense points tell, and that are narrower than the cells of the dense lattice.

use std::f64::consts::TAU;

use zeroset::{Options, extract_surface, reconstruct};
use zeroset_tests::Random;

/// Random points of a rod with round ends, along the first axis, around `centre`.
fn rod(radius: f64, length: f64, centre: [f64; 3], count: usize, random: &mut Random) -> Vec<[f64; 3]> {
    // The side has the area of a cylinder over the length, both ends together that of one twice their radius long.
    let along = |random: &mut Random| (length + 2.0 * radius) * (random.uniform() - 0.5);
    std::iter::repeat_with(|| (along(random), TAU * random.uniform()))
        .map(|(x, angle)| {
            let beyond = (x.abs() - 0.5 * length).max(0.0);
            let ring = (radius * radius - beyond * beyond).sqrt();
            [centre[0] + x, centre[1] + ring * angle.cos(), centre[2] + ring * angle.sin()]
        })
        .take(count)
        .collect()
}

/// Two rods 2.3 spacings apart, on cells twice as wide as the gap: they were one part, in some clouds without a word.
#[test]
fn rods_beside_each_other_stay_apart() {
    let (radius, gap, length) = (0.02, 0.0045, 0.6);
    let mut random = Random(3);
    let mut rods = rod(radius, length, [0.0, -radius - 0.5 * gap, 0.0], 20_000, &mut random);
    rods.extend(rod(radius, length, [0.0, radius + 0.5 * gap, 0.0], 20_000, &mut random));
    // Not along the lattice.
    let (s, c) = 0.4f64.sin_cos();
    let points: Vec<[f64; 3]> = rods.iter().map(|[x, y, z]| [c * x - s * y, s * x + c * y, *z]).collect();
    let mut result = reconstruct(&points, &Options::default()).unwrap();
    let (_, topology) = extract_surface(&mut result).unwrap();
    assert!(topology.closed, "{topology:?}");
    assert_eq!((topology.components, topology.genus), (2, 0), "{:?}", result.report.warnings);
}
