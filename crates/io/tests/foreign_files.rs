//! Files that other programs wrote hold the points that these programs put in.

#![allow(clippy::panic, reason = "a panic is how a test fails")]

use std::path::PathBuf;

use zeroset_io::{Points, read_points};

fn read(name: &str) -> Vec<[f64; 3]> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "../../fixtures/foreign", name].iter().collect();
    match read_points(path) {
        Ok(Points::Three(set)) => set.points,
        other => panic!("{name} gave {other:?}"),
    }
}

#[track_caller]
fn agree(name: &str, expected: &[[f64; 3]], tolerance: f64) {
    let points = read(name);
    assert_eq!(points.len(), expected.len(), "{name}");
    for (point, wanted) in points.iter().zip(expected) {
        assert!((0..3).all(|axis| (point[axis] - wanted[axis]).abs() <= tolerance), "{name}: {point:?}, {wanted:?}");
    }
}

#[test]
fn tables_of_numpy() {
    agree("points.csv", &read("points.npy"), 0.0);
}

#[test]
#[cfg(feature = "las")]
fn scans_of_laspy() {
    let points = read("points.npy");
    for name in ["v12_format0", "v12_format3", "v14_format7"] {
        // Thousandths, from integers by one product and one sum of f64: some units in the last place of 5.4e6.
        agree(&format!("{name}.las"), &points, 4e-9);
        assert_eq!(read(&format!("{name}.las")), read(&format!("{name}.laz")));
    }
}

#[test]
#[cfg(feature = "e57")]
fn scans_of_libe57format() {
    // pye57 stores 32-bit floats: 1e-5 at values of 120.
    agree("posed.e57", &read("points.npy"), 1e-5);
}

#[test]
fn meshes_of_trimesh() {
    let vertices = read("icosahedron.npy");
    // The ascii forms have eight digits.
    for name in ["icosahedron_binary.ply", "icosahedron_ascii.ply", "icosahedron.obj"] {
        agree(name, &vertices, 1e-7);
    }
    // Corners come in the order of the triangles.
    let sorted = |mut points: Vec<[f64; 3]>| {
        points.sort_by_key(|p| p.map(|c| (c * 1e6).round() as i64));
        points
    };
    for name in ["icosahedron_binary.stl", "icosahedron_ascii.stl"] {
        let (corners, vertices) = (sorted(read(name)), sorted(vertices.clone()));
        assert_eq!(corners.len(), 12, "{name}");
        for (corner, vertex) in corners.iter().zip(&vertices) {
            assert!((0..3).all(|axis| (corner[axis] - vertex[axis]).abs() <= 1e-7), "{name}: {corner:?}, {vertex:?}");
        }
    }
}
