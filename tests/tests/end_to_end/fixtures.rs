//! Every fixture comes out right with default options: topology, closed, outward, no stray sheet.

use std::path::{Path, PathBuf};

use serde_json::Value;
use zeroset::{Options, Report, extract_curve, extract_surface, reconstruct};
use zeroset_io::Points;
use zeroset_tests::without_seconds;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures")
}

/// The entry of `fixtures.json`, with the points.
pub fn fixture(name: &str) -> (Value, Points) {
    let text = std::fs::read_to_string(folder().join("fixtures.json")).unwrap();
    let list: Value = serde_json::from_str(&text).unwrap();
    let entry = list["fixtures"].as_array().unwrap().iter().find(|entry| entry["name"] == name).unwrap().clone();
    let points = zeroset_io::read_points(folder().join(entry["file"].as_str().unwrap())).unwrap();
    assert_eq!(points.len() as u64, entry["points"].as_u64().unwrap());
    (entry, points)
}

fn surface_is_right(name: &str) {
    let (entry, Points::Three(set)) = fixture(name) else { panic!("{name} is a surface") };
    let mut result = reconstruct(&set.points, &Options::default()).unwrap();
    let (mesh, topology) = extract_surface(&mut result).unwrap();
    assert!(topology.closed, "{name}: {topology:?}");
    assert_eq!(topology.components as u64, entry["components"].as_u64().unwrap(), "{name}: components");
    assert_eq!(topology.genus, entry["genus"].as_i64().unwrap(), "{name}: genus");
    assert!(mesh.enclosed_volume() > 0.0, "{name}: outward");
    assert_eq!(result.report.warnings, Vec::<String>::new(), "{name}: no doubt about a clean model");
    // On f = 0: the tolerance is rounding, in the unit of the frame, where gradients have length one.
    let frame: Vec<[f64; 3]> = mesh.vertices.iter().map(|v| result.frame.to_frame(v)).collect();
    let values = result.spline.evaluate(&frame, zeroset::bspline::Derivatives::Value).values;
    let worst = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6 * result.domain.spacing(result.halvings), "{name}: {worst} off the zero set");
}

fn curve_is_right(name: &str) {
    let (entry, Points::Two(set)) = fixture(name) else { panic!("{name} is an outline") };
    let mut result = reconstruct(&set.points, &Options::default()).unwrap();
    let (curves, topology) = extract_curve(&mut result).unwrap();
    assert_eq!(topology.parts as u64, entry["components"].as_u64().unwrap(), "{name}: parts");
    assert_eq!(topology.holes as u64, entry["holes"].as_u64().unwrap(), "{name}: holes");
    assert_eq!(result.report.warnings, Vec::<String>::new(), "{name}: no doubt about a clean outline");
    // Close to the true loops everywhere: half a spacing leaves room for corners, which are rounded.
    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(folder().join(entry["reference"].as_str().unwrap())).unwrap())
            .unwrap();
    let truth: Vec<Vec<[f64; 2]>> = serde_json::from_value(truth["curves"].clone()).unwrap();
    let spacing = result.report.input.spacing;
    let to_truth = farthest(&curves.loops, &truth);
    let from_truth = farthest(&truth, &curves.loops);
    assert!(to_truth < 0.5 * spacing && from_truth < 0.5 * spacing, "{name}: {to_truth}, {from_truth} of {spacing}");
}

/// The largest distance from a vertex of one set of loops to the other loops.
fn farthest(from: &[Vec<[f64; 2]>], to: &[Vec<[f64; 2]>]) -> f64 {
    let distance = |p: &[f64; 2]| {
        let sides = to.iter().flat_map(|cycle| cycle.iter().zip(cycle.iter().cycle().skip(1)));
        sides
            .map(|(a, b)| {
                let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
                let t = ((d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
                (e[0] - t * d[0]).hypot(e[1] - t * d[1])
            })
            .fold(f64::INFINITY, f64::min)
    };
    from.iter().flatten().map(distance).fold(0.0, f64::max)
}

#[test]
fn double_torus() {
    surface_is_right("double_torus");
}

#[test]
fn teapot() {
    surface_is_right("teapot");
}

#[test]
fn bunny() {
    surface_is_right("bunny");
}

#[test]
fn annulus_offset() {
    curve_is_right("annulus_offset");
}

#[test]
fn two_blobs() {
    curve_is_right("two_blobs");
}

#[test]
fn hook() {
    curve_is_right("hook");
}

#[test]
fn star() {
    curve_is_right("star");
}

#[test]
fn horse() {
    curve_is_right("horse");
}

/// A report without what the clock said.
fn figures(report: &Report) -> Value {
    let mut figures = serde_json::to_value(report).unwrap();
    without_seconds(&mut figures);
    figures
}

#[test]
fn the_bytes_do_not_depend_on_threads() {
    let (_, Points::Two(outline)) = fixture("annulus_offset") else { panic!("an outline") };
    let (_, Points::Three(torus)) = fixture("double_torus") else { panic!("a surface") };
    // Coarse, to be quick: the code paths are the same. How much memory is free differs from run to run.
    let plane = Options { memory: Some(1 << 30), ..Options::default() };
    let space = Options { resolution: Some(24), ..plane.clone() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut flat = reconstruct(&outline.points, &plane).unwrap();
            let mut solid = reconstruct(&torus.points, &space).unwrap();
            let (curves, mesh) = (extract_curve(&mut flat).unwrap().0, extract_surface(&mut solid).unwrap().0);
            let reports = [&flat.report, &solid.report].map(figures);
            (flat.spline, curves, solid.spline, mesh, reports)
        })
    };
    let one = run(1);
    for threads in [1, 2, 3, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

#[test]
fn units_and_large_coordinates_do_not_matter() {
    let (_, Points::Two(set)) = fixture("annulus_offset") else { panic!("an outline") };
    let mut plain = reconstruct(&set.points, &Options::default()).unwrap();
    let (_, here) = extract_curve(&mut plain).unwrap();
    // Metres on a map: 5 000 km away, a thousand times larger.
    let there: Vec<[f64; 2]> = set.points.iter().map(|p| [1000.0 * p[0] + 5e6, 1000.0 * p[1] - 3e6]).collect();
    let mut moved = reconstruct(&there, &Options::default()).unwrap();
    let (_, topology) = extract_curve(&mut moved).unwrap();
    assert_eq!((topology.parts, topology.holes), (here.parts, here.holes));
    // Coordinates of 5e6 hold 1e-9 each, of a spacing of 24: the fit moves by no more than rounding can explain.
    assert!((topology.area / here.area / 1e6 - 1.0).abs() < 1e-6);
    let (origin, f) = moved.in_data_units().unwrap();
    assert!(f.value(&[5e6 - 700.0 - origin[0], -3e6 - origin[1]]) < 0.0, "inside the ring, in metres");
    assert!(f.value(&[5e6 + 250.0 - origin[0], -3e6 + 100.0 - origin[1]]) > 100.0, "in the hole, metres from its rim");
}

#[test]
fn the_papers_road_runs_as_written() {
    use zeroset::eikonal_sweep::Method;
    let (_, Points::Two(set)) = fixture("two_blobs") else { panic!("an outline") };
    let options =
        Options { topology: zeroset::Topology::Paper, distance: Method::Godunov, refine: false, ..Options::default() };
    let mut result = reconstruct(&set.points, &options).unwrap();
    let (_, topology) = extract_curve(&mut result).unwrap();
    assert_eq!((topology.parts, topology.holes), (2, 0));
    let names: Vec<&str> = result.report.stages.iter().map(|stage| stage.figures.name()).collect();
    assert_eq!(names, ["topology", "distance", "sign", "initial-shape", "extraction"]);
}
