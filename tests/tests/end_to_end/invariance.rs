//! What must not matter: the unit, the place, the order of the points, the axes.

use std::path::Path;

use proptest::prelude::*;
use zeroset::bspline::Derivatives;
use zeroset::{Options, Reconstruction, extract_curve, extract_surface, reconstruct};
use zeroset_io::Points;

fn fixture(name: &str) -> Points {
    zeroset_io::read_points(Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/points").join(name)).unwrap()
}

/// A signed permutation of the axes, a scale, a shift, and another order of the points.
#[derive(Debug, Clone)]
struct Change<const D: usize> {
    axes: [usize; D],
    signs: [f64; D],
    scale: f64,
    shift: f64,
    stride: usize,
}

impl<const D: usize> Change<D> {
    fn place(&self, p: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|k| self.signs[k] * self.scale * p[self.axes[k]] + self.shift)
    }

    /// Every point, in strides that are prime to their number.
    fn points(&self, points: &[[f64; D]]) -> Vec<[f64; D]> {
        let n = points.len();
        let stride = (self.stride..).find(|s| gcd(*s, n) == 1).unwrap();
        (0..n).map(|i| self.place(&points[i * stride % n])).collect()
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn change<const D: usize>() -> impl Strategy<Value = Change<D>> {
    let scales =
        prop_oneof![Just((1.0, 0.0)), Just((1e-3, 0.0)), Just((1e6, 0.0)), Just((1.0, 1e7)), Just((0.37, -3.0))];
    let axes = Just((0..D).collect::<Vec<usize>>()).prop_shuffle();
    (axes, proptest::collection::vec(any::<bool>(), D), scales, 1usize..100).prop_map(
        |(axes, flips, (scale, shift), stride)| Change {
            axes: std::array::from_fn(|k| axes[k]),
            signs: std::array::from_fn(|k| if flips[k] { -1.0 } else { 1.0 }),
            scale,
            shift,
            stride,
        },
    )
}

/// The largest distance of places on the plain zero set from the changed one, in cells.
fn apart<const D: usize>(places: &[[f64; D]], change: &Change<D>, changed: &Reconstruction<D>) -> f64 {
    let there: Vec<[f64; D]> = places.iter().map(|p| changed.frame.to_frame(&change.place(p))).collect();
    let found = changed.spline.evaluate(&there, Derivatives::Gradient);
    assert_eq!(found.outside, 0);
    let steps = found.values.iter().zip(&found.gradients);
    let worst = steps.map(|(f, g)| f.abs() / g.iter().map(|g| g * g).sum::<f64>().sqrt()).fold(0.0, f64::max);
    worst / changed.domain.spacing(changed.halvings)
}

/// Whether every point has the same side, by the normals of the two.
fn same_sides<const D: usize>(plain: &Reconstruction<D>, change: &Change<D>, changed: &Reconstruction<D>) -> bool {
    let points: Vec<[f64; D]> = plain.points.iter().map(|p| plain.frame.to_data(p)).collect();
    let there: Vec<[f64; D]> = points.iter().map(|p| changed.frame.to_frame(&change.place(p))).collect();
    let before = plain.spline.evaluate(&plain.points, Derivatives::Gradient).gradients;
    let after = changed.spline.evaluate(&there, Derivatives::Gradient).gradients;
    before
        .iter()
        .zip(&after)
        .all(|(b, a)| (0..D).map(|k| change.signs[k] * b[change.axes[k]] * a[k]).sum::<f64>() > 0.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn outlines_move_with_their_points(change in change::<2>()) {
        let Points::Two(set) = fixture("annulus_offset.xy") else { panic!("an outline") };
        let mut plain = reconstruct(&set.points, &Options::default()).unwrap();
        let mut changed = reconstruct(&change.points(&set.points), &Options::default()).unwrap();
        let (curves, here) = extract_curve(&mut plain).unwrap();
        let (_, there) = extract_curve(&mut changed).unwrap();
        prop_assert_eq!((here.parts, here.holes), (there.parts, there.holes));
        prop_assert!(same_sides(&plain, &change, &changed));
        // Other points are held out, and iterations end a step earlier or later.
        let places: Vec<[f64; 2]> = curves.loops.concat();
        prop_assert!(apart(&places, &change, &changed) < 0.05);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]
    #[test]
    fn surfaces_move_with_their_points(change in change::<3>()) {
        let Points::Three(set) = fixture("double_torus.ply") else { panic!("a surface") };
        let options = Options { resolution: Some(32), ..Options::default() };
        let mut plain = reconstruct(&set.points, &options).unwrap();
        let mut changed = reconstruct(&change.points(&set.points), &options).unwrap();
        let (mesh, here) = extract_surface(&mut plain).unwrap();
        let (_, there) = extract_surface(&mut changed).unwrap();
        prop_assert_eq!((here.components, here.genus), (there.components, there.genus));
        prop_assert!(same_sides(&plain, &change, &changed));
        let far = apart(&mesh.vertices, &change, &changed);
        prop_assert!(far < 0.05, "{far} cells");
    }
}

#[test]
fn powers_of_two_change_no_bit() {
    let Points::Two(set) = fixture("annulus_offset.xy") else { panic!("an outline") };
    let plain = reconstruct(&set.points, &Options::default()).unwrap();
    for power in [-40, -3, 1, 60] {
        let scale = 2f64.powi(power);
        let scaled: Vec<[f64; 2]> = set.points.iter().map(|p| p.map(|x| scale * x)).collect();
        let changed = reconstruct(&scaled, &Options::default()).unwrap();
        assert_eq!(changed.spline, plain.spline, "2^{power}");
        assert_eq!(changed.frame.scale * scale, plain.frame.scale);
    }
}

/// All coefficients of f, and where the points are, to the bit.
fn bits<const D: usize>(result: &Reconstruction<D>) -> Vec<u64> {
    let levels = result.spline.levels().iter().flat_map(|level| level.corrections());
    let numbers = result.spline.root().as_flat().iter().chain(levels).chain(result.points.as_flattened());
    numbers.map(|x| x.to_bits()).collect()
}

#[test]
fn the_order_of_the_points_changes_no_bit() {
    let order = |stride| Change { axes: [0, 1], signs: [1.0; 2], scale: 1.0, shift: 0.0, stride };
    let Points::Two(set) = fixture("star.xy") else { panic!("an outline") };
    let found = |stride| bits(&reconstruct(&order(stride).points(&set.points), &Options::default()).unwrap());
    assert_eq!(found(1), found(37));
    let order = |stride| Change { axes: [0, 1, 2], signs: [1.0; 3], scale: 1.0, shift: 0.0, stride };
    let Points::Three(set) = fixture("double_torus.ply") else { panic!("a surface") };
    let options = Options { resolution: Some(32), ..Options::default() };
    let found = |stride| bits(&reconstruct(&order(stride).points(&set.points), &options).unwrap());
    assert_eq!(found(1), found(1001));
}
