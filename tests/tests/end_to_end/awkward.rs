//! Awkward data, case by case, with the answer that each must get: a right result, a result with a warning or a doubt, or a refusal
//! that names the reason. Nothing else: no panic, and nothing that hangs.

use std::time::Duration;

use zeroset::isosurface::{CurveTopology, Topology};
use zeroset::{InputError, Options, ReconstructError, Report, extract_curve, extract_surface, reconstruct};
use zeroset_tests::{Random, Shape2, Shape3, faults_of_loops, faults_of_mesh, within};

/// Half a minute, on a machine that has four other things to do.
const LIMIT: Duration = Duration::from_secs(120);

/// A result: its topology, its distances from zero (smallest and largest) and the report.
struct Answer<T> {
    topology: T,
    radii: [f64; 2],
    report: Report,
}

impl<T> Answer<T> {
    fn is_trusted(&self) -> bool {
        self.report.doubt.is_none() && self.report.warnings.is_empty()
    }

    fn warns_of(&self, part: &str) -> bool {
        self.report.doubt.is_none() && self.report.warnings.iter().any(|warning| warning.contains(part))
    }

    fn doubts(&self, part: &str) -> bool {
        self.report.doubt.as_ref().is_some_and(|doubt| doubt.contains(part))
    }
}

fn radii<const D: usize>(vertices: impl Iterator<Item = [f64; D]>) -> [f64; 2] {
    // Without squares, which overflow.
    let radius = |p: [f64; D]| p.into_iter().fold(0.0, f64::hypot);
    vertices.map(radius).fold([f64::MAX, 0.0], |[least, most], r| [r.min(least), r.max(most)])
}

fn surface(points: Vec<[f64; 3]>, open: bool) -> Result<Answer<Topology>, ReconstructError> {
    let work = move || {
        let mut result = reconstruct(&points, &Options { resolution: Some(20), open, ..Options::default() })?;
        let (mesh, topology) = extract_surface(&mut result)?;
        let faults = faults_of_mesh(&mesh.vertices, &mesh.triangles);
        assert!(!topology.closed || faults.none(), "said to be closed: {faults:?}");
        Ok(Answer { topology, radii: radii(mesh.vertices.into_iter()), report: result.report })
    };
    within(LIMIT, work).unwrap_or_else(|ended| panic!("{ended:?}"))
}

fn curve(points: Vec<[f64; 2]>, open: bool) -> Result<Answer<CurveTopology>, ReconstructError> {
    let work = move || {
        let mut result = reconstruct(&points, &Options { open, ..Options::default() })?;
        let (curves, topology) = extract_curve(&mut result)?;
        assert!(faults_of_loops(&curves.loops).none());
        let vertices = curves.loops.into_iter().chain(curves.paths).flatten();
        Ok(Answer { topology, radii: radii(vertices), report: result.report })
    };
    within(LIMIT, work).unwrap_or_else(|ended| panic!("{ended:?}"))
}

/// Why points are refused.
fn refusal<T>(answer: Result<Answer<T>, ReconstructError>) -> InputError {
    match answer {
        Ok(answer) => panic!("a result: {:?}", answer.report),
        Err(ReconstructError::Input(error)) => error,
        Err(error) => panic!("no refusal of the points: {error}"),
    }
}

fn in_space(shape: Shape3, count: usize) -> Vec<[f64; 3]> {
    let mut random = Random(7);
    (0..count).map(|_| shape.point(&mut random)).collect()
}

fn in_the_plane(shape: Shape2, count: usize) -> Vec<[f64; 2]> {
    let mut random = Random(7);
    (0..count).map(|_| shape.point(&mut random)).collect()
}

fn jittered<const D: usize>(points: Vec<[f64; D]>, times: usize, jitter: f64) -> Vec<[f64; D]> {
    let mut random = Random(3);
    let again = points.iter().flat_map(|p| std::iter::repeat_n(p, times));
    again.map(|p| p.map(|x| x + jitter * random.gaussian())).collect()
}

/// Whether it is the unit sphere, as far as 300 random points tell: they are 0.2 apart.
fn is_sphere(answer: &Answer<Topology>, unit: f64) -> bool {
    let t = &answer.topology;
    t.closed && (t.components, t.genus) == (1, 0) && answer.radii[0] > 0.97 * unit && answer.radii[1] < 1.02 * unit
}

fn is_circle(answer: &Answer<CurveTopology>, unit: f64) -> bool {
    let t = &answer.topology;
    (t.parts, t.holes, t.paths) == (1, 0, 0) && answer.radii[0] > 0.99 * unit && answer.radii[1] < 1.01 * unit
}

#[test]
fn two_points() {
    assert_eq!(refusal(surface(vec![[0.0; 3], [1.0; 3]], false)), InputError::TooFew { found: 2, needed: 5 });
    assert_eq!(refusal(curve(vec![[0.0; 2], [1.0; 2]], false)), InputError::TooFew { found: 2, needed: 4 });
    let pairs = vec![[[0.0; 2], [1.0; 2]]; 500].concat();
    assert_eq!(refusal(curve(pairs, false)), InputError::TooFewDistinct { found: 2, needed: 4 });
    assert_eq!(refusal(surface(vec![], false)), InputError::TooFew { found: 0, needed: 5 });
}

#[test]
fn all_points_equal() {
    assert_eq!(refusal(surface(vec![[1.0, 2.0, 3.0]; 100], false)), InputError::AllEqual { count: 100 });
    assert_eq!(refusal(curve(vec![[1e6, -2.0]; 100], true)), InputError::AllEqual { count: 100 });
}

#[test]
fn collinear() {
    let kind = "line or plane";
    assert_eq!(refusal(surface(in_space(Shape3::Segment, 600), false)), InputError::Flat { kind });
    assert_eq!(refusal(surface(jittered(in_space(Shape3::Segment, 600), 1, 1e-9), true)), InputError::Flat { kind });
    assert_eq!(refusal(curve(in_the_plane(Shape2::Segment, 200), false)), InputError::Flat { kind: "line" });
    // No longer exactly so.
    let answer = surface(jittered(in_space(Shape3::Segment, 600), 1, 1e-3), false).unwrap();
    assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
    let answer = curve(jittered(in_the_plane(Shape2::Segment, 200), 1, 1e-3), false).unwrap();
    assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
}

#[test]
fn coplanar() {
    let kind = "line or plane";
    assert_eq!(refusal(surface(in_space(Shape3::Sheet, 600), false)), InputError::Flat { kind });
    assert_eq!(refusal(surface(in_space(Shape3::Sheet, 600), true)), InputError::Flat { kind });
    let answer = surface(jittered(in_space(Shape3::Sheet, 600), 1, 1e-3), false).unwrap();
    assert!(answer.doubts("no trustworthy closed surface"), "{:?}", answer.report);
}

#[test]
fn flat_but_for_a_stray_point() {
    let mut sheet = in_space(Shape3::Sheet, 300);
    sheet.push([0.0, 0.0, 40.0]);
    assert_eq!(refusal(surface(sheet, false)), InputError::Flat { kind: "line or plane" });
}

#[test]
fn duplicates_by_the_thousand() {
    let again = |points: Vec<[f64; 3]>| points.into_iter().flat_map(|p| [p; 1000]).collect::<Vec<_>>();
    let answer = surface(again(in_space(Shape3::Sphere, 300)), false).unwrap();
    assert!(is_sphere(&answer, 1.0) && answer.is_trusted(), "{:?}", answer.report);
    assert_eq!(answer.report.input.repeated, 299_700);
    let circle = in_the_plane(Shape2::Circle, 200).into_iter().flat_map(|p| [p; 1000]).collect();
    let answer = curve(circle, false).unwrap();
    assert!(is_circle(&answer, 1.0) && answer.is_trusted(), "{:?}", answer.report);
}

#[test]
fn duplicates_that_differ_a_little() {
    for jitter in [1e-12, 1e-9, 1e-6, 1e-4] {
        let answer = curve(jittered(in_the_plane(Shape2::Circle, 100), 10, jitter), false).unwrap();
        assert!(is_circle(&answer, 1.0), "{jitter}: {:?} {:?}", answer.radii, answer.report);
    }
    for jitter in [1e-9, 1e-4] {
        let answer = surface(jittered(in_space(Shape3::Sphere, 300), 10, jitter), false).unwrap();
        assert!(is_sphere(&answer, 1.0), "{jitter}: {:?} {:?}", answer.radii, answer.report);
    }
}

#[test]
fn one_far_outlier() {
    for far in [100.0, 1e9, 1e300] {
        let mut points = in_space(Shape3::Sphere, 300);
        points.insert(17, [far, 0.3 * far, -0.2 * far]);
        let answer = surface(points, false).unwrap();
        assert!(is_sphere(&answer, 1.0) && answer.warns_of("1 of the points lie many times farther"), "{far}");
        assert_eq!(answer.report.input.outliers, 1);
        let mut points = in_the_plane(Shape2::Circle, 200);
        points.insert(17, [-far, 0.3 * far]);
        let answer = curve(points, false).unwrap();
        assert!(is_circle(&answer, 1.0) && answer.warns_of("1 of the points lie many times farther"), "{far}");
    }
}

#[test]
fn a_cluster_in_noise() {
    let answer = surface(in_space(Shape3::Cluster, 400), false).unwrap();
    assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
    let answer = curve(in_the_plane(Shape2::Cluster, 150), false).unwrap();
    assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
}

#[test]
fn columns_that_are_no_numbers() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut points = in_space(Shape3::Sphere, 100);
        points[40][2] = bad;
        assert_eq!(refusal(surface(points.clone(), false)), InputError::NotFinite { index: 40 });
        points.iter_mut().for_each(|p| p[0] = bad);
        assert_eq!(refusal(surface(points, false)), InputError::NotFinite { index: 0 });
    }
    assert_eq!(refusal(curve(vec![[f64::NAN, 0.0]; 3], false)), InputError::NotFinite { index: 0 });
}

#[test]
fn a_volume_in_place_of_a_surface() {
    for open in [false, true] {
        let answer = surface(in_space(Shape3::Ball, 400), open).unwrap();
        assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
        let answer = curve(in_the_plane(Shape2::Disc, 200), open).unwrap();
        assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
    }
    let lattice = (0..144).map(|i| [f64::from(i % 12), f64::from(i / 12)]).collect();
    let answer = curve(lattice, false).unwrap();
    assert!(answer.doubts("fill an area"), "{:?}", answer.report);
}

#[test]
fn two_crossing_surfaces() {
    // What is in one of them but not in both: at the rim, where four walls meet, the result may be pierced.
    let answer = surface(in_space(Shape3::CrossingSpheres, 600), false).unwrap();
    assert!(answer.topology.closed && answer.warns_of("hardly told apart"), "{:?}", answer.report);
    let answer = curve(in_the_plane(Shape2::CrossingCircles, 200), false).unwrap();
    assert!(answer.topology.parts == 2 && answer.report.doubt.is_none(), "{:?}", answer.topology);
}

#[test]
fn a_moebius_band() {
    for open in [false, true] {
        let answer = surface(in_space(Shape3::Moebius, 600), open).unwrap();
        assert!(
            answer.doubts(if open { "one side only" } else { "winding numbers contradict" }),
            "{:?}",
            answer.report
        );
    }
}

#[test]
fn a_klein_bottle() {
    // Immersed in space it has an inside, where a ray crosses it an odd number of times, but walls that cross.
    for open in [false, true] {
        let answer = surface(in_space(Shape3::Klein, 600), open).unwrap();
        assert!(answer.report.doubt.is_some() || !answer.report.warnings.is_empty(), "{:?}", answer.report);
    }
}

#[test]
fn a_closed_surface_with_a_boundary_inside() {
    // The sheet has no inside: refinement pierces the walls that f̂ makes of it.
    let answer = surface(in_space(Shape3::SphereWithSheet, 600), false).unwrap();
    assert!(answer.warns_of("joined or pierced"), "{:?}", answer.report);
    let answer = curve(in_the_plane(Shape2::CircleWithChord, 200), false).unwrap();
    assert!(answer.doubts("no trustworthy"), "{:?}", answer.report);
}

#[test]
fn open_data_without_the_option() {
    let answer = surface(in_space(Shape3::Bowl, 600), false).unwrap();
    assert!(answer.warns_of("--open"), "{:?}", answer.report);
    let answer = curve(in_the_plane(Shape2::Arc, 200), false).unwrap();
    assert!(answer.warns_of("--open"), "{:?}", answer.report);
    let answer = surface(in_space(Shape3::Helix, 400), false).unwrap();
    assert!(answer.report.doubt.is_some(), "a curve is no surface: {:?}", answer.report);
}

#[test]
fn small_and_large_scales() {
    for unit in [1e-300, 1e-12, 1e12, 1e300] {
        let answer =
            surface(in_space(Shape3::Sphere, 300).iter().map(|p| p.map(|x| unit * x)).collect(), false).unwrap();
        assert!(is_sphere(&answer, unit) && answer.is_trusted(), "{unit}: {:?} {:?}", answer.radii, answer.report);
        let answer =
            curve(in_the_plane(Shape2::Circle, 200).iter().map(|p| p.map(|x| unit * x)).collect(), false).unwrap();
        assert!(is_circle(&answer, unit) && answer.is_trusted(), "{unit}: {:?} {:?}", answer.radii, answer.report);
    }
    // A span that f64 holds only halved, and one that it does not resolve at its place.
    let huge = in_the_plane(Shape2::Circle, 200).iter().map(|p| p.map(|x| 1.7e308 * x)).collect();
    assert!(matches!(refusal(curve(huge, false)), InputError::AllEqual { .. }));
    let lost = in_the_plane(Shape2::Circle, 200).iter().map(|p| p.map(|x| 1e20 + x)).collect();
    assert!(matches!(refusal(curve(lost, false)), InputError::AllEqual { .. }));
}

#[test]
fn whole_numbers() {
    let answer = surface(in_space(Shape3::Sphere, 2000).iter().map(|p| p.map(|x| (12.0 * x).round())).collect(), false);
    let answer = answer.unwrap();
    // Steps of one, and half a step's rounding in each of three coordinates.
    assert!(answer.topology.closed && answer.topology.genus == 0 && answer.report.doubt.is_none());
    assert!(answer.radii[0] > 11.0 && answer.radii[1] < 13.0, "{:?}", answer.radii);
    let answer =
        curve(in_the_plane(Shape2::Circle, 200).iter().map(|p| p.map(|x| (20.0 * x).round())).collect(), false);
    let answer = answer.unwrap();
    assert!(answer.topology.loops == 1 && answer.radii[0] > 19.0 && answer.radii[1] < 21.0, "{:?}", answer.radii);
}
