//! Outlines that are sampled unevenly, have points strewn around them, or more noise than distance between points.

use std::f64::consts::TAU;

use zeroset::{Options, Report, extract_curve, reconstruct};
use zeroset_tests::Random;

/// A gear wheel of radius 1 with a round hole of radius 0.3: its corners.
fn gear(teeth: usize) -> [Vec<[f64; 2]>; 2] {
    let turned = |turn: f64, radius: f64| [radius * (TAU * turn).cos(), radius * (TAU * turn).sin()];
    let corner = |i: usize| turned(i as f64 / (4 * teeth) as f64, if i % 4 < 2 { 1.0 } else { 0.84 });
    [(0..4 * teeth).map(corner).collect(), (0..200).map(|i| turned(f64::from(i) / 200.0, 0.3)).collect()]
}

/// A wavy circle, its corners too close to be seen.
fn flower(petals: f64) -> [Vec<[f64; 2]>; 1] {
    let place = |i: i32| {
        let t = TAU * f64::from(i) / 2000.0;
        let radius = 1.0 + 0.2 * (petals * t).cos();
        [radius * t.cos(), radius * t.sin()]
    };
    [(0..2000).map(place).collect()]
}

/// Random points of some loops, by length, each kept with the `chance` of its place.
fn sampled(loops: &[Vec<[f64; 2]>], count: usize, chance: impl Fn([f64; 2]) -> f64, seed: u64) -> Vec<[f64; 2]> {
    let edges: Vec<[[f64; 2]; 2]> = loops
        .iter()
        .flat_map(|corners| (0..corners.len()).map(move |i| [corners[i], corners[(i + 1) % corners.len()]]))
        .collect();
    let ends: Vec<f64> = edges
        .iter()
        .scan(0.0, |sum, [a, b]| {
            *sum += (a[0] - b[0]).hypot(a[1] - b[1]);
            Some(*sum)
        })
        .collect();
    let mut random = Random(seed);
    let mut points = Vec::new();
    while points.len() < count {
        let along = random.uniform() * ends.last().unwrap();
        let [a, b] = edges[ends.partition_point(|end| *end <= along)];
        let t = random.uniform();
        let place = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
        if random.uniform() < chance(place) {
            points.push(place);
        }
    }
    points
}

fn loops(points: &[[f64; 2]]) -> (usize, Report) {
    let mut result = reconstruct(points, &Options::default()).unwrap();
    let (_, topology) = extract_curve(&mut result).unwrap();
    (topology.loops, result.report)
}

/// Eight times denser on one side than on the other: twelve neighbours among sparse teeth are as round as those of points strewn over an
/// area, and were taken for that.
#[test]
fn the_sparse_side_of_a_gear_is_kept() {
    for seed in 0..3 {
        let points = sampled(&gear(12), 1500, |p| 8f64.powf(0.5 * p[0] - 0.5), seed);
        let (loops, report) = loops(&points);
        assert_eq!((loops, &report.doubt), (2, &None), "seed {seed}: {:?}", report.warnings);
        assert_eq!(report.warnings, [""; 0], "seed {seed}");
        // Where samples are random some stand alone: a percent at most.
        assert!(report.input.outliers <= 15, "seed {seed}: {}", report.input.outliers);
    }
}

/// Points strewn over the box, some of them a few spacings from the curve: each had a loop to itself.
#[test]
fn points_strewn_over_the_box_are_left_out() {
    for (seed, strewn) in [(0, 24), (1, 24), (2, 24), (3, 60)] {
        let mut points = sampled(&flower(7.0), 800, |_| 1.0, seed);
        let mut random = Random(100 + seed);
        points.extend((0..strewn).map(|_| [0; 2].map(|_| 2.8 * random.uniform() - 1.4)));
        let (loops, report) = loops(&points);
        // Within a spacing or two of the curve they may pass for points of it, and some of it for them where it has large gaps.
        let outliers = report.input.outliers;
        assert_eq!(loops, 1, "seed {seed}: {:?}", report.warnings);
        assert!(outliers.abs_diff(strewn) <= 4, "seed {seed}: {outliers} of {strewn}");
        let said = report.warnings.iter().any(|warning| warning.contains("were left out"));
        assert_eq!(said, strewn == 60, "seed {seed}: {:?}", report.warnings);
    }
}

/// Noise of five spacings: all lengths up to twice the one that is enough follow it, and score as random sides do.
#[test]
fn noise_of_many_spacings_is_seen_through() {
    for seed in 0..3 {
        let mut points = sampled(&flower(3.0), 1500, |_| 1.0, seed);
        let spacing = 7.0 / 1500.0;
        let mut random = Random(100 + seed);
        points.iter_mut().flatten().for_each(|x| *x += 5.0 * spacing * random.gaussian());
        let (loops, report) = loops(&points);
        assert_eq!((loops, report.doubt), (1, None), "seed {seed}: {:?}", report.warnings);
    }
}
