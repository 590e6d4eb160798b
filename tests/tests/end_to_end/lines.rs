//! Points in lines much closer along than across, as slices, scan lines and strokes leave them.

use std::f64::consts::TAU;

use zeroset::isosurface::{Topology, TriMesh};
use zeroset::{Options, Report, extract_surface, reconstruct};
use zeroset_tests::Random;

const SMALL: f64 = 0.4;
const RINGS: usize = 40;
/// In each ring: a tenth as far apart as the rings are on the outer side.
const AROUND: usize = 120;

/// Rings around the tube of a torus with large radius 1, with Gaussian noise in all directions.
fn rings(noise: f64) -> Vec<[f64; 3]> {
    let mut random = Random(5);
    let mut points = Vec::new();
    for ring in 0..RINGS {
        let (s, c) = (TAU * ring as f64 / RINGS as f64).sin_cos();
        let shift = random.uniform();
        for i in 0..AROUND {
            let v = TAU * (i as f64 + shift) / AROUND as f64;
            let from_axis = 1.0 + SMALL * v.cos();
            let exact = [from_axis * c, from_axis * s, SMALL * v.sin()];
            points.push(exact.map(|x| x + noise * random.gaussian()));
        }
    }
    points
}

fn reconstructed(points: &[[f64; 3]]) -> (TriMesh, Topology, Report) {
    let mut result = reconstruct(points, &Options::default()).unwrap();
    let (mesh, topology) = extract_surface(&mut result).unwrap();
    (mesh, topology, result.report)
}

/// Root mean square distance of the vertices from the torus.
fn error(mesh: &TriMesh) -> f64 {
    let off = |[x, y, z]: &[f64; 3]| (x.hypot(*y) - 1.0).hypot(*z) - SMALL;
    (mesh.vertices.iter().map(|v| off(v).powi(2)).sum::<f64>() / mesh.vertices.len() as f64).sqrt()
}

#[test]
fn between_lines_the_surface_is_as_smooth_as_along_them() {
    let (mesh, topology, report) = reconstructed(&rings(0.0));
    assert!(topology.closed && topology.components == 1 && topology.genus == 1, "{topology:?}");
    assert!(report.warnings.is_empty() && report.doubt.is_none(), "{:?} {:?}", report.warnings, report.doubt);
    // The rings are 0.09 to 0.22 apart, the points in them 0.021.
    assert!((0.04..0.2).contains(&report.input.spacing), "{}", report.input.spacing);
    let apart = report.input.in_lines.unwrap();
    assert!((RINGS * AROUND / 10..RINGS * AROUND / 2).contains(&apart), "{apart}");
    // 0.00005; where the distance along the rings was taken for the spacing, 0.0017, and a warning of forty bridges in gaps.
    assert!(error(&mesh) < 2e-4, "{}", error(&mesh));
}

#[test]
fn all_points_of_a_line_count_against_noise() {
    let noise = 0.01;
    let (mesh, topology, report) = reconstructed(&rings(noise));
    assert!(topology.closed && topology.components == 1 && topology.genus == 1, "{topology:?}");
    assert!(report.warnings.is_empty() && report.doubt.is_none(), "{:?} {:?}", report.warnings, report.doubt);
    assert!(report.input.in_lines.is_some());
    // 0.22; of the thinned points alone, half as many, more would be left.
    assert!(error(&mesh) < 0.3 * noise, "{}", error(&mesh));
}

#[test]
fn scan_lines_over_open_ground_are_one_sheet() {
    let height = |x: f64, y: f64| 0.15 * (3.0 * x).sin() * (2.5 * y).cos();
    let place = |i: u32| (0.05 * f64::from(i / 400), 0.005 * f64::from(i % 400));
    let points: Vec<[f64; 3]> = (0..16_000).map(place).map(|(x, y)| [x, y, height(x, y)]).collect();
    let mut result = reconstruct(&points, &Options { open: true, ..Options::default() }).unwrap();
    let (mesh, topology) = extract_surface(&mut result).unwrap();
    // Forty strips where the distance along the lines was taken for the spacing.
    assert!(topology.components == 1 && topology.boundary_loops == 1, "{topology:?}");
    let inner = mesh.vertices.iter().filter(|v| (0..2).all(|k| (0.1..1.9).contains(&v[k])));
    let off = inner.map(|v| (v[2] - height(v[0], v[1])).abs()).fold(0.0, f64::max);
    assert!(off < 0.002, "{off}");
}
