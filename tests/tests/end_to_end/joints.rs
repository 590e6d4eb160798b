//! Where thick parts meet, the middle is far from all points.

use zeroset::{Options, extract_surface, reconstruct};
use zeroset_tests::Random;

/// Random points of the surface of three square bars of `width` and `length` that cross at right angles in their middle.
fn jack(width: f64, length: f64, count: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let half = 0.5 * width;
    let mut points = Vec::new();
    while points.len() < count {
        let axis = (3.0 * random.uniform()) as usize;
        let along = length * (random.uniform() - 0.5);
        // Once around the bar: its sides and, in proportion, its ends.
        let (across, other) = (width * (random.uniform() - 0.5), if random.uniform() < 0.5 { half } else { -half });
        let is_end = random.uniform() < width / (width + 2.0 * length);
        let local = match (is_end, random.uniform() < 0.5) {
            (true, _) => [other.signum() * 0.5 * length, across, width * (random.uniform() - 0.5)],
            (false, true) => [along, across, other],
            (false, false) => [along, other, across],
        };
        // Not inside of the others.
        if is_end || local[0].abs() > half {
            points.push(std::array::from_fn(|i| local[(i + 3 - axis) % 3]));
        }
    }
    points
}

/// Refinement hollowed out the middle, two spacings and more from all points, mostly with a warning.
#[test]
fn joints_are_not_hollow() {
    for seed in [1, 4, 9] {
        let ((s, c), (t, d)) = (0.5f64.sin_cos(), 0.8f64.sin_cos());
        // Not along the lattice.
        let turned = |[x, y, z]: [f64; 3]| {
            let (x, y) = (c * x - s * y, s * x + c * y);
            [d * x - t * z, y, t * x + d * z]
        };
        let points: Vec<[f64; 3]> = jack(0.1, 2.0, 4000, &mut Random(seed)).into_iter().map(turned).collect();
        let mut result = reconstruct(&points, &Options::default()).unwrap();
        let (_, topology) = extract_surface(&mut result).unwrap();
        assert!(topology.closed, "{topology:?}");
        assert_eq!((topology.components, topology.genus), (1, 0), "{seed}: {:?}", result.report.warnings);
        assert!(result.report.warnings.is_empty(), "{seed}: {:?}", result.report.warnings);
    }
}
