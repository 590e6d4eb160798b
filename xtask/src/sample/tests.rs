//! What is drawn from small meshes.

use std::fs;
use std::path::{Path, PathBuf};

use ndarray::{Array2, array};
use ndarray_npy::NpzWriter;
use zeroset_io::{Points, read_points};

use super::surface::{length, normal};
use super::triangles::Triangle;
use super::*;

/// Two triangles of area 1 and 3 that share no plane, a third without area, and a square of area 4 far away.
const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n\
    element face 4\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n2 0 0\n0 1 0\n0 0 3\n0 2 0\n10 10 10\n10 12 10\n10 12 12\n10 10 12\n\
    3 0 1 2\n3 0 4 3\n3 0 1 1\n4 5 6 7 8\n";

fn arguments(mesh: PathBuf, points: usize, seed: u64, noise: f64) -> Arguments {
    let output = mesh.with_file_name(format!("{points}-{seed}-{noise}.ply"));
    Arguments { mesh, points, seed, noise, strays: 0, lines: None, voxels: false, output }
}

fn file(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("mesh.ply");
    fs::write(&path, text).unwrap();
    path
}

fn sampled(arguments: &Arguments) -> Vec<[f64; 3]> {
    run(arguments).unwrap();
    match read_points(&arguments.output).unwrap() {
        Points::Three(set) => set.points,
        Points::Two(_) => panic!("three coordinates were written"),
    }
}

/// Weights of the corners, and the height above the plane.
fn place(point: &[f64; 3], triangle: &Triangle) -> ([f64; 3], f64) {
    let whole = normal(triangle);
    let dot = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
    let weights = std::array::from_fn(|k| {
        let mut part = *triangle;
        part[k] = *point;
        dot(&normal(&part), &whole) / dot(&whole, &whole)
    });
    let from = std::array::from_fn(|k| point[k] - triangle[0][k]);
    (weights, dot(&from, &whole) / length(&whole))
}

#[test]
fn strays_are_strewn_over_a_larger_box() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = file(folder.path(), MESH);
    let corners: Vec<[f64; 3]> = triangles::read(&mesh).unwrap().into_iter().flatten().collect();
    let points = sampled(&Arguments { strays: 4000, ..arguments(mesh, 10, 3, 0.0) });
    assert_eq!(points.len(), 4010);
    for k in 0..3 {
        let ends = |all: &[[f64; 3]]| {
            let values = || all.iter().map(|p| p[k]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        };
        let ([low, high], [least, most]) = (ends(&corners), ends(&points[10..]));
        let beyond = 0.1 * (high - low);
        // The chance that none of 4000 lies in the last hundredth of a side is 4e-18.
        let near = 0.012 * (high - low);
        assert!(low - beyond <= least && least <= low - beyond + near, "{k}: {least}");
        assert!(high + beyond - near <= most && most <= high + beyond, "{k}: {most}");
    }
}

#[test]
fn points_lie_on_the_triangles_in_proportion_to_area() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = file(folder.path(), MESH);
    let triangles = triangles::read(&mesh).unwrap();
    let surface = Surface::new(triangles).unwrap();
    assert_eq!((surface.triangles().len(), surface.area()), (4, 8.0), "the square is two triangles");
    let count = 40_000;
    let points = sampled(&arguments(mesh, count, 7, 0.0));
    assert_eq!(points.len(), count);
    let (mut hits, mut sums) = ([0.0; 4], [[0.0; 3]; 4]);
    for point in &points {
        // Rounding of coordinates up to 12.
        let on = |triangle: &Triangle| {
            let (weights, height) = place(point, triangle);
            weights.iter().all(|w| *w > -1e-12) && height.abs() < 1e-12
        };
        let k = surface.triangles().iter().position(on).expect("on a triangle");
        hits[k] += 1.0;
        let (weights, _) = place(point, &surface.triangles()[k]);
        (0..3).for_each(|corner| sums[k][corner] += weights[corner]);
    }
    for (k, area) in [1.0, 3.0, 2.0, 2.0].into_iter().enumerate() {
        let share: f64 = area / 8.0;
        let deviation = (share * (1.0 - share) / count as f64).sqrt();
        // Four standard deviations.
        assert!((hits[k] / count as f64 - share).abs() < 4.0 * deviation, "{hits:?}");
        // Uniform weights have mean 1/3 and variance 1/18.
        assert!(
            sums[k].iter().all(|sum| (sum / hits[k] - 1.0 / 3.0).abs() < 4.0 / (18.0 * hits[k]).sqrt()),
            "{sums:?}"
        );
    }
}

#[test]
fn noise_is_gaussian_along_the_normal() {
    let folder = tempfile::tempdir().unwrap();
    let one = MESH.replace("element face 4", "element face 1");
    let mesh = file(folder.path(), one.split_inclusive("3 0 1 2\n").next().unwrap());
    let triangle = triangles::read(&mesh).unwrap()[0];
    let (count, sigma) = (20_000, 0.25);
    let heights: Vec<f64> = sampled(&arguments(mesh, count, 3, sigma))
        .iter()
        .map(|point| {
            let (weights, height) = place(point, &triangle);
            assert!(weights.iter().all(|w| *w > -1e-12), "above the triangle, up to rounding");
            height / sigma
        })
        .collect();
    let n = count as f64;
    let moment = |power: i32| heights.iter().map(|h| h.powi(power)).sum::<f64>() / n;
    // Four standard deviations of the moments of a Gaussian: variances 1, 2, 96 over n.
    assert!(moment(1).abs() < 4.0 / n.sqrt());
    assert!((moment(2) - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
    assert!((moment(4) - 3.0).abs() < 4.0 * (96.0 / n).sqrt());
}

#[test]
fn the_seed_decides_every_byte() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = file(folder.path(), MESH);
    let bytes = |seed: u64, noise: f64| {
        let arguments = arguments(mesh.clone(), 500, seed, noise);
        run(&arguments).unwrap();
        fs::read(&arguments.output).unwrap()
    };
    assert_eq!(bytes(1, 0.1), bytes(1, 0.1));
    assert_ne!(bytes(1, 0.1), bytes(2, 0.1));
    assert_ne!(bytes(1, 0.1), bytes(1, 0.0));
}

#[test]
fn archives_are_read_in_both_precisions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.npz");
    let vertices: Array2<f64> = array![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let expected = vec![[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]];
    let mut npz = NpzWriter::new_compressed(fs::File::create(&path).unwrap());
    npz.add_array("verts", &vertices.mapv(|c| c as f32)).unwrap();
    npz.add_array("faces", &array![[0i32, 1, 2]]).unwrap();
    npz.finish().unwrap();
    assert_eq!(triangles::read(&path).unwrap(), expected);
    let mut npz = NpzWriter::new(fs::File::create(&path).unwrap());
    // Columns first.
    npz.add_array("vertices", &vertices.t().as_standard_layout().t()).unwrap();
    npz.add_array("triangles", &array![[0i64, 1, 2]]).unwrap();
    npz.finish().unwrap();
    assert_eq!(triangles::read(&path).unwrap(), expected);

    let refused = |vertices: Array2<f64>, name: &str, faces: Array2<i64>, part: &str| {
        let mut npz = NpzWriter::new(fs::File::create(&path).unwrap());
        npz.add_array("verts", &vertices).unwrap();
        npz.add_array(name, &faces).unwrap();
        npz.finish().unwrap();
        let text = format!("{:#}", run(&arguments(path.clone(), 5, 1, 0.0)).unwrap_err());
        assert!(text.contains("mesh.npz") && text.contains(part), "{text}");
    };
    refused(vertices.clone(), "triangle", array![[0, 1, 2]], "no array \"faces\"");
    refused(vertices.clone(), "faces", array![[0, 1]], "m × 3");
    refused(vertices.clone(), "faces", array![[0, 1, -1]], "face 0 names vertex -1, but there are 3");
    refused(vertices.t().to_owned() * 1e200, "faces", array![[0, 1, 2]], "not a finite number");
    refused(array![[0.0, 0.0]], "faces", array![[0, 0, 0]], "n × 3");
}

#[test]
fn what_gives_no_points_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: Arguments, part: &str| {
        let text = format!("{:#}", run(&arguments).unwrap_err());
        assert!(text.contains(part) && !arguments.output.exists(), "{text}");
    };
    let mesh = file(folder.path(), MESH);
    refused(arguments(mesh.clone(), 0, 1, 0.0), "between 1 and 100000000");
    refused(arguments(mesh.clone(), 100_000_001, 1, 0.0), "between 1 and 100000000");
    refused(arguments(mesh.clone(), 5, 1, -0.1), "--noise -0.1");
    refused(arguments(mesh.clone(), 5, 1, f64::NAN), "--noise NaN");
    refused(arguments(mesh.with_file_name("none.ply"), 5, 1, 0.0), "none.ply: cannot be read");
    refused(arguments(mesh.with_file_name("mesh.xyz"), 5, 1, 0.0), ".ply and .npz");
    let wrong = Arguments { output: mesh.with_extension("xyz"), ..arguments(mesh, 5, 1, 0.0) };
    refused(wrong, "known: .ply");
    let changed = |from: &str, to: &str, part: &str| {
        assert!(MESH.contains(from));
        refused(arguments(file(folder.path(), &MESH.replace(from, to)), 5, 1, 0.0), part);
    };
    changed("face 4", "face 0", "no triangles");
    changed("element face", "element side", "no element \"face\"");
    changed("3 0 1 2\n3 0 4 3\n3 0 1 1\n4 5 6 7 8\n", "3 0 1 0\n3 0 0 3\n3 0 1 1\n2 5 6\n", "no area");
    changed("3 0 4 3", "3 0 9 3", "face 1 names vertex 9, but there are 9");
    changed("property float z\n", "property float w\n", "vertex 0 is at");
    changed("ply\n", "plx\n", "not a PLY file");
}

#[test]
fn lines_lie_on_planes_and_points_along_them() {
    let folder = tempfile::tempdir().unwrap();
    // A square of side 2 at x = 10.
    let mesh = file(folder.path(), &MESH.replace("face 4", "face 1").replace("3 0 1 2\n3 0 4 3\n3 0 1 1\n", ""));
    let points = sampled(&Arguments { lines: Some(10.0), ..arguments(mesh, 4000, 1, 0.0) });
    let (along, across) = (0.01, 0.1);
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    // Of the square's normal the planes' direction has a share, and lines are that much farther apart in it.
    let neighbours =
        |p: &[f64; 3], within: f64| points.iter().filter(|q| (1e-12..within).contains(&distance(p, q))).count();
    assert!(points.len() > 1000 && points.iter().all(|p| (p[0] - 10.0).abs() < 1e-12));
    let inner: Vec<_> = points.iter().filter(|p| (1..3).all(|k| (p[k] - 11.0).abs() < 0.8)).collect();
    assert!(inner.len() > 500);
    for p in inner {
        // In the line: both neighbours and the next two, but where the two triangles of the square meet. No other line is near.
        let near = neighbours(p, 2.5 * along);
        assert!((3..=6).contains(&near), "{near}");
        assert!(neighbours(p, 0.9 * across) <= 20);
    }
}

#[test]
fn voxels_are_those_that_the_mesh_passes_through() {
    let folder = tempfile::tempdir().unwrap();
    let one = MESH.replace("element face 4", "element face 1");
    let mesh = file(folder.path(), one.split_inclusive("3 0 1 2\n").next().unwrap());
    let triangle = triangles::read(&mesh).unwrap()[0];
    let count = 2000;
    let points = sampled(&Arguments { voxels: true, ..arguments(mesh, count, 4, 0.0) });
    // 1 to √3 for a plane that is turned any way, where 3/2 is taken; and the rim.
    assert!((count * 2 / 3..count * 5 / 4).contains(&points.len()), "{}", points.len());
    let side = (1.5 / count as f64).sqrt();
    let apart = |a: &[f64; 3], b: &[f64; 3]| length(&std::array::from_fn(|k| a[k] - b[k]));
    for point in &points {
        // A plane is at most √3/2 sides from the centre of a cube that it passes through.
        assert!(place(point, &triangle).1.abs() < 0.8661 * side);
        // One lattice: the nearest other centre is a side away, or where the plane cuts a corner off a diagonal.
        let nearest = points.iter().map(|other| apart(point, other)).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        assert!((nearest / side - 1.0).abs() < 1e-9 || (nearest / side - 2f64.sqrt()).abs() < 1e-9, "{nearest}");
    }
}
