//! Surfaces and curves with a boundary: `Options::open` leaves open what the points leave open.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use zeroset::isosurface::{Topology, TriMesh};
use zeroset::{
    Figures, Options, Reconstruction, SamplesAround, StageFigures, extract_curve, extract_surface, reconstruct,
};
use zeroset_io::Points;

use crate::fixtures::fixture;

fn open() -> Options {
    Options { open: true, ..Options::default() }
}

fn bowl(u: f64, v: f64) -> [f64; 3] {
    let (ring, height) = (FRAC_PI_2 * u).sin_cos();
    [ring * (TAU * v).cos(), 0.9 * ring * (TAU * v).sin(), -0.8 * height]
}

fn terrain(u: f64, v: f64) -> [f64; 3] {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    [x, y, 0.2 * (2.5 * x + 0.4).sin() * (2.0 * y).cos() + 0.1 * x * (5.0 * y + 1.0).sin()]
}

fn half_torus(u: f64, v: f64) -> [f64; 3] {
    let r = 1.0 + 0.4 * (TAU * v).cos();
    [r * (PI * u).cos(), r * (PI * u).sin(), 0.4 * (TAU * v).sin()]
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Six places on every triangle, with a sixth of its area each.
fn places(mesh: &TriMesh) -> (Vec<[f64; 3]>, Vec<f64>) {
    const SHARES: [[f64; 3]; 6] =
        [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8], [0.45, 0.45, 0.1], [0.45, 0.1, 0.45], [0.1, 0.45, 0.45]];
    let mut found = (Vec::new(), Vec::new());
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| mesh.vertices[v as usize]);
        let single = TriMesh { vertices: corners.to_vec(), normals: vec![], triangles: vec![[0, 1, 2]] };
        for shares in SHARES {
            found.0.push(std::array::from_fn(|k| (0..3).map(|c| shares[c] * corners[c][k]).sum()));
            found.1.push(single.area() / 6.0);
        }
    }
    found
}

/// Mean distance both ways, halved, between a mesh and a surface with parameters in the unit square, both as dense points.
fn chamfer(mesh: &TriMesh, truth: fn(f64, f64) -> [f64; 3]) -> f64 {
    const STEPS: usize = 500;
    let at = |i: usize, j: usize| truth((i as f64 + 0.5) / STEPS as f64, (j as f64 + 0.5) / STEPS as f64);
    let true_places: Vec<[f64; 3]> = (0..STEPS * STEPS).map(|n| at(n / STEPS, n % STEPS)).collect();
    // The area that a place stands for, from its neighbours in the grid.
    let true_areas: Vec<f64> = (0..STEPS * STEPS)
        .map(|n| {
            let (i, j) = (n / STEPS, n % STEPS);
            distance(&at(i, j), &at(i + 1, j)) * distance(&at(i, j), &at(i, j + 1))
        })
        .collect();
    let (places, areas) = places(mesh);
    let mean = |from: &[[f64; 3]], weights: &[f64], to: &[[f64; 3]]| {
        let distances = SamplesAround::new(to, from).distances();
        distances.iter().zip(weights).map(|(d, w)| d * w).sum::<f64>() / weights.iter().sum::<f64>()
    };
    0.5 * (mean(&places, &areas, &true_places) + mean(&true_places, &true_areas, &places))
}

fn unsupported(result: &Reconstruction<3>) -> (f64, f64) {
    match &result.report.stages.last().unwrap().figures {
        StageFigures::Extraction(report) => match report.zero_set {
            Figures::Surface { unsupported_area, unsupported_share, .. } => (unsupported_area, unsupported_share),
            Figures::Curve { .. } => panic!("a surface"),
        },
        other => panic!("{other:?}"),
    }
}

fn ends_where_its_points_do(name: &str, truth: fn(f64, f64) -> [f64; 3]) {
    let (entry, Points::Three(set)) = fixture(name) else { panic!("{name} is a surface") };
    let mut result = reconstruct(&set.points, &open()).unwrap();
    let (mesh, topology) = extract_surface(&mut result).unwrap();
    assert!(!topology.closed && topology.boundary_edges > 0);
    assert_eq!(topology.boundary_loops as u64, entry["boundary_loops"].as_u64().unwrap(), "{name}: {topology:?}");
    assert_eq!((topology.components, topology.genus), (1, 0), "{name}");
    assert_eq!((topology.non_manifold_edges, topology.non_manifold_vertices), (0, 0), "{name}");
    assert_eq!(
        (&result.report.doubt, &result.report.warnings),
        (&None, &vec![]),
        "{name}: no doubt about a clean sheet"
    );

    let support = SamplesAround::new(&set.points, &mesh.vertices).distances();
    let farthest = support.iter().copied().fold(0.0, f64::max);
    assert!(farthest < 2.0 * result.report.input.spacing, "{name}: {farthest} of {}", result.report.input.spacing);
    assert!(unsupported(&result).1 < 0.01, "{name}: {:?}", unsupported(&result));

    let diagonal = result.frame.sides.iter().map(|s| s * s).sum::<f64>().sqrt() / result.frame.scale;
    let chamfer = chamfer(&mesh, truth);
    assert!(chamfer < 0.003 * diagonal, "{name}: {} % of the diagonal", 100.0 * chamfer / diagonal);

    // On f = 0, the cut too, and with its normals.
    let frame: Vec<[f64; 3]> = mesh.vertices.iter().map(|v| result.frame.to_frame(v)).collect();
    let values = result.spline.evaluate(&frame, zeroset::bspline::Derivatives::Value).values;
    let worst = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6 * result.domain.spacing(result.halvings), "{name}: {worst} off the zero set");
    assert!(mesh.normals.iter().all(|n| (n.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-9), "{name}");
}

#[test]
fn a_bowl_has_a_rim() {
    ends_where_its_points_do("bowl", bowl);
}

#[test]
fn terrain_has_an_edge() {
    ends_where_its_points_do("terrain", terrain);
}

#[test]
fn half_a_torus_has_two_ends() {
    ends_where_its_points_do("half_torus", half_torus);
}

/// Points on a sphere along a spiral, even, but for caps of angular radius `large` at one pole and `small` at a place between.
fn sphere_without(large: f64, small: f64) -> Vec<[f64; 3]> {
    let count = 2000;
    (0..count)
        .map(|i| {
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(count);
            let (s, c) = (f64::from(i) * PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
            [(1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z]
        })
        .filter(|p| p[2].acos() > large && p[0].acos() > small)
        .collect()
}

fn topology_of(points: &[[f64; 3]], options: &Options) -> (Topology, Reconstruction<3>) {
    let mut result = reconstruct(points, options).unwrap();
    let (_, topology) = extract_surface(&mut result).unwrap();
    (topology, result)
}

#[test]
fn large_holes_stay_and_small_ones_do_not() {
    // The points are 0.079 apart: the holes have radii of 6 and 1.5 of that.
    let points = sphere_without(0.5, 0.12);
    let options = Options { resolution: Some(32), ..open() };
    let (topology, _) = topology_of(&points, &options);
    assert_eq!((topology.components, topology.boundary_loops, topology.genus), (1, 1, 0));

    // Closed, the area of the hole is reported: 2π (1 − cos 0.5), less a rim of 1.5 spacings, which its points support.
    let (topology, result) = topology_of(&points, &Options { open: false, ..options });
    assert!(topology.closed);
    let rim = 0.5 - 1.5 * 0.079;
    let (area, share) = unsupported(&result);
    let expected = TAU * (1.0 - f64::cos(rim));
    // The patch is flatter than the sphere.
    assert!((0.7..1.2).contains(&(area / expected)), "{area} of {expected}");
    assert!((share * 4.0 * PI / area - 1.0).abs() < 0.1);
}

#[test]
fn a_closed_surface_stays_closed() {
    let points = sphere_without(0.0, 0.0);
    let options = Options { resolution: Some(32), ..open() };
    let (topology, result) = topology_of(&points, &options);
    assert!(topology.closed && topology.components == 1, "{topology:?}");
    assert_eq!(unsupported(&result), (0.0, 0.0));
}

#[test]
fn dense_and_sparse_parts_have_one_boundary() {
    // A disc, ten times denser in its middle, on a paraboloid.
    let points: Vec<[f64; 3]> = (0..3000)
        .map(|i| {
            let t = (f64::from(i) + 0.5) / 3000.0;
            let r = if t < 0.5 { 0.3 * (2.0 * t).sqrt() } else { (0.09 + 0.91 * (2.0 * t - 1.0)).sqrt() };
            let (s, c) = (f64::from(i) * PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
            [r * c, r * s, 0.4 * r * r]
        })
        .collect();
    let (topology, result) = topology_of(&points, &open());
    assert_eq!((topology.components, topology.boundary_loops), (1, 1), "{topology:?}");
    assert_eq!(result.report.doubt, None);
}

#[test]
fn open_curves_have_ends() {
    let arc = |from: f64, to: f64| -> Vec<[f64; 2]> {
        (0..200).map(|i| from + (to - from) * f64::from(i) / 199.0).map(|t| [3.0 * t.cos(), 2.0 * t.sin()]).collect()
    };
    for (points, paths, loops) in
        [(arc(0.2, 3.9), 1, 0), ([arc(0.2, 2.6), arc(3.3, 5.8)].concat(), 2, 0), (arc(0.0, TAU * 199.0 / 200.0), 0, 1)]
    {
        let mut result = reconstruct(&points, &open()).unwrap();
        let (curves, topology) = extract_curve(&mut result).unwrap();
        assert_eq!((topology.paths, topology.loops), (paths, loops));
        assert_eq!((&result.report.doubt, &result.report.warnings), (&None, &vec![]));
        let all: Vec<[f64; 2]> = curves.loops.iter().chain(&curves.paths).flatten().copied().collect();
        let farthest = SamplesAround::new(&points, &all).distances().into_iter().fold(0.0, f64::max);
        assert!(farthest < 2.0 * result.report.input.spacing, "{farthest} of {}", result.report.input.spacing);
        let uncovered = SamplesAround::new(&all, &points).distances().into_iter().fold(0.0, f64::max);
        assert!(uncovered < result.report.input.spacing, "{uncovered}");
    }
}

#[test]
fn turns_above_each_other_are_torn_and_warned_of() {
    // Two turns of a spiral: what is outside one of them would be inside the next.
    let turn = |i: i32| f64::from(4 + i).sqrt();
    let points: Vec<[f64; 2]> = (0..200).map(turn).map(|t| [0.1 * t * t.cos(), 0.1 * t * t.sin()]).collect();
    let result = reconstruct(&points, &open()).unwrap();
    assert!(result.report.warnings.iter().any(|w| w.contains("two sides of the curve meet")), "{:?}", result.report);
    // One turn has two sides everywhere.
    let one: Vec<[f64; 2]> = points[..60].to_vec();
    let result = reconstruct(&one, &open()).unwrap();
    assert!(result.report.warnings.is_empty() && result.report.doubt.is_none(), "{:?}", result.report);
}
