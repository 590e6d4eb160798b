//! Files that are not what they claim are refused with a sentence that helps.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a panic is how a test fails")]

use std::io::Cursor;

use ndarray::{Array1, Array2, arr0, arr1, arr2};
use ndarray_npy::NpzWriter;
use zeroset_io::{
    Malformed, PointFormat, ReadError, SplineFile, SplineLevel, parse_spline, read_points, read_points_as, read_spline,
};

fn sentence(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let error = if name.ends_with("npz") { read_spline(&path).err() } else { read_points(&path).err() };
    error.expect("the file is damaged").to_string()
}

#[test]
fn paths_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none.xyz");
    assert!(matches!(read_points(&missing), Err(ReadError::Unreadable { ref path, .. }) if *path == missing));
    assert!(read_points(&missing).unwrap_err().to_string().contains("none.xyz"));
    let inner = folder.path().join("inner.ply");
    std::fs::create_dir(&inner).unwrap();
    assert!(matches!(read_points(&inner), Err(ReadError::Folder { .. })));
    assert!(matches!(read_points("points.docx"), Err(ReadError::UnknownExtension(_))));
    assert!(sentence("a.ply", b"").ends_with("a.ply: the file is empty"));
    assert!(sentence("a.obj", b"f 1 2 3\n").contains("no points"));
    assert!(sentence("a.obj", b"v 1 2\n").contains("line 1: 3 coordinates are needed, 2 found"));
    assert!(sentence("a.obj", b"v 1 2 inf\n").contains("line 1: z is inf"));
}

#[test]
#[cfg(target_os = "linux")]
fn files_that_claim_to_be_empty_are_read() {
    let path = "/proc/self/statm";
    assert_eq!(std::fs::metadata(path).unwrap().len(), 0);
    assert_eq!(read_points_as(path, PointFormat::Text).unwrap().len(), 1, "seven numbers");
}

fn npy(header: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16 + 1).to_le_bytes());
    bytes.extend(header.bytes().chain([b'\n']).chain(body.iter().copied()));
    bytes
}

#[test]
fn npy_headers_are_not_believed() {
    let header = |descr: &str, shape: &str| format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}}}");
    for shape in ["(1000000000000, 3)", "(18446744073709551615, 3)", "(99999999999999999999999, 3)"] {
        sentence("a.npy", &npy(&header("<f8", shape), &[0; 48]));
    }
    for shape in ["(0, 3)", "(0, 9223372036854775807, 9223372036854775807)"] {
        assert!(sentence("a.npy", &npy(&header("<f8", shape), &[])).contains("no values"));
    }
    assert!(sentence("a.npy", &npy(&header("<f8", "(3, 4)"), &[0; 96])).contains("shape [3, 4]; N × 2 or N × 3"));
    assert!(sentence("a.npy", &npy(&header("<f8", "(3, 4)"), &[0; 96])).contains("its transpose would do"));
    assert!(sentence("a.npy", &npy(&header("<f2", "(3, 2)"), &[0; 12])).contains("f4 or f8"));
    assert!(sentence("a.npy", &npy(&header("<c8", "(3, 2)"), &[0; 48])).contains("f4 or f8"));
    let large = [i64::MAX - 1; 2].map(i64::to_le_bytes).concat();
    assert!(sentence("a.npy", &npy(&header("<i8", "(1, 2)"), &large)).contains("9223372036854775806 has more digits"));
    assert!(sentence("a.npy", &npy(&header("é8", "(3, 2)"), &[0; 48])).contains("not a NumPy array"));
    let nan = [1.0, 2.0, 3.0, f64::NAN].map(f64::to_le_bytes).concat();
    assert!(sentence("a.npy", &npy(&header("<f8", "(2, 2)"), &nan)).contains("point 1 (counted from 0): y is nan"));
    // Parsers that recurse would overflow their stack here.
    assert!(sentence("a.npy", &npy(&"(".repeat(60_000), &[])).contains("header claims"));
    assert!(sentence("a.npy", &npy(&"(".repeat(4000), &[])).contains("not that of a plain array"));
    let mut long = b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec();
    long.extend([b' '; 100]);
    assert!(sentence("a.npy", &long).contains("claims 4294967295 bytes"));
}

#[test]
fn splines_that_do_not_fit_together_are_refused() {
    type Change = fn(&mut NpzWriter<Cursor<Vec<u8>>>, &str) -> bool;
    let refused = |part: &str, change: Change| {
        let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
        let knots = arr1(&[0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]);
        for name in ["version", "origin", "degree", "knots_x", "knots_y", "coefficients", "remark"] {
            if change(&mut npz, name) {
                continue;
            }
            match name {
                "version" => npz.add_array(name, &arr0(1i64)),
                "origin" => npz.add_array(name, &arr1(&[0.0, 0.0])),
                "degree" => npz.add_array(name, &arr1(&[2i32])),
                "coefficients" => npz.add_array(name, &Array2::<f32>::ones((4, 4))),
                "remark" => npz.add_array(name, &arr1(&[true])),
                _ => npz.add_array(name, &knots),
            }
            .unwrap();
        }
        let bytes = npz.finish().unwrap().into_inner();
        if part.is_empty() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("s.npz");
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read_spline(path).unwrap().coefficients, Array2::<f64>::ones((4, 4)).into_dyn());
        } else {
            let sentence = sentence("s.npz", &bytes);
            assert!(sentence.contains(part), "{sentence}");
        }
    };
    // Compressed, f32, 32-bit and one-element arrays and unknown entries are read.
    refused("", |_, _| false);
    refused("the archive has no entry \"degree\"", |_, name| name == "degree");
    refused("version 3", |npz, name| name == "version" && npz.add_array(name, &arr0(3i64)).is_ok());
    refused("\"level1_index\" but is of version 1", |npz, name| {
        name == "remark" && npz.add_array("level1_index", &arr0(1i64)).is_ok()
    });
    refused("open is 7", |npz, name| name == "remark" && npz.add_array("open", &arr0(7i64)).is_ok());
    refused("degree -1", |npz, name| name == "degree" && npz.add_array(name, &arr0(-1i64)).is_ok());
    refused("degree 9", |npz, name| name == "degree" && npz.add_array(name, &arr0(9i64)).is_ok());
    refused("one number for all axes", |npz, name| name == "degree" && npz.add_array(name, &arr1(&[2i64, 3])).is_ok());
    refused("origin has 4 numbers", |npz, name| name == "origin" && npz.add_array(name, &arr1(&[0.0; 4])).is_ok());
    refused("has no entry \"knots_z\"", |npz, name| name == "origin" && npz.add_array(name, &arr1(&[0.0; 3])).is_ok());
    refused("knots_x falls from 0.5 to 0.25 at entry 4", |npz, name| {
        name == "knots_x" && npz.add_array(name, &arr1(&[0.0, 0.0, 0.0, 0.5, 0.25, 1.0, 1.0])).is_ok()
    });
    refused("knots_x spans no cell", |npz, name| name == "knots_x" && npz.add_array(name, &arr1(&[0.0; 7])).is_ok());
    refused("knots_y has 8 knots, which asks for 5", |npz, name| {
        name == "knots_y" && npz.add_array(name, &arr1(&[0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0])).is_ok()
    });
    refused("knots_y has 2 knots; degree 2 needs at least 6", |npz, name| {
        name == "knots_y" && npz.add_array(name, &arr1(&[0.0, 1.0])).is_ok()
    });
    refused("knots_x holds inf", |npz, name| {
        name == "knots_x" && npz.add_array(name, &arr1(&[0.0, 0.0, 0.0, 0.5, 1.0, 1.0, f64::INFINITY])).is_ok()
    });
    refused("coefficient [0, 0] is NaN", |npz, name| {
        name == "coefficients" && npz.add_array(name, &Array2::from_elem((4, 4), f64::NAN)).is_ok()
    });
    refused("coefficients have 1 axes", |npz, name| {
        name == "coefficients" && npz.add_array(name, &arr1(&[0.0; 16])).is_ok()
    });
    let error: Malformed = SplineFile::new(vec![], vec![], 3, Array2::zeros((1, 1)).into_dyn()).unwrap_err();
    assert_eq!(error.to_string(), "a spline of 0 axes; 2 or 3 are known");
}

#[test]
fn levels_that_do_not_fit_are_refused() {
    /// Entries in place of the sound ones; whether it wrote that entry.
    type Change = fn(&mut NpzWriter<Cursor<Vec<u8>>>, &str) -> bool;
    let bytes = |degree: usize, change: Change| {
        let mut npz = NpzWriter::new_compressed(Cursor::new(Vec::new()));
        // One cell along each axis, two on level 1.
        let knots: Array1<f64> = (0..2 * (degree + 1)).map(|k| k as f64).collect();
        for name in [
            "version",
            "origin",
            "degree",
            "knots_x",
            "knots_y",
            "coefficients",
            "levels",
            "level1_index",
            "level1_coefficients",
        ] {
            if change(&mut npz, name) {
                continue;
            }
            match name {
                "version" => npz.add_array(name, &arr0(2i64)),
                "origin" => npz.add_array(name, &arr1(&[0.0, 0.0])),
                "degree" => npz.add_array(name, &arr0(degree as i64)),
                "coefficients" => npz.add_array(name, &Array2::<f64>::ones((degree + 1, degree + 1))),
                "levels" => npz.add_array(name, &arr0(1i32)),
                "level1_index" => npz.add_array(name, &arr2(&[[4i64, 4], [0, 1]])),
                "level1_coefficients" => npz.add_array(name, &arr1(&[0.5f32, 0.25])),
                _ => npz.add_array(name, &knots),
            }
            .unwrap();
        }
        npz.finish().unwrap().into_inner()
    };
    let refused = |part: &str, degree: usize, change: Change| {
        let sentence = sentence("s.npz", &bytes(degree, change));
        assert!(sentence.contains(part), "{sentence}");
    };
    // 64-bit indices and f32 coefficients, in an order of their own, are read.
    let sound = parse_spline(&bytes(3, |_, _| false)).unwrap();
    assert_eq!(sound.levels, [SplineLevel { index: arr2(&[[4, 4], [0, 1]]), coefficients: vec![0.5, 0.25] }]);

    refused("only those of degree 3", 2, |_, _| false);
    refused("has no entry \"levels\"", 3, |_, name| name == "levels");
    refused("levels is -1", 3, |npz, name| name == "levels" && npz.add_array(name, &arr0(-1i64)).is_ok());
    refused("levels has 2 numbers", 3, |npz, name| name == "levels" && npz.add_array(name, &arr1(&[1i64, 1])).is_ok());
    refused("no entry \"level2_index\"", 3, |npz, name| {
        name == "levels" && npz.add_array(name, &arr0(i64::MAX)).is_ok()
    });
    refused("no entry \"level1_coefficients\"", 3, |_, name| name == "level1_coefficients");
    refused("no entry \"level1_index\"", 3, |_, name| name == "level1_index");
    refused("level1_index holds 5 in row 1; the lattice has functions 0 to 4", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[0i32, 0], [4, 5]])).is_ok()
    });
    refused("level1_index holds -1 in row 0", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[0i32, -1], [4, 4]])).is_ok()
    });
    refused("level1_index: holds 4294967297", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[0i64, (1 << 32) + 1], [4, 4]])).is_ok()
    });
    refused("level1_index names function [2, 3] twice", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[2i32, 3], [2, 3]])).is_ok()
    });
    refused("level1_index has 1 axes; 2 are needed", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr1(&[2i32, 3])).is_ok()
    });
    refused("level1_index has shape [2, 3]; N × 2", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[2i32, 3, 0], [0, 0, 0]])).is_ok()
    });
    refused("no values", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &Array2::<i32>::zeros((0, 2))).is_ok()
    });
    refused("level1_index: the array holds \"<f8\"; i4 or i8", 3, |npz, name| {
        name == "level1_index" && npz.add_array(name, &arr2(&[[2.0, 3.0], [0.0, 0.0]])).is_ok()
    });
    refused("level1_coefficients has 3 numbers for the 2 rows of level1_index", 3, |npz, name| {
        name == "level1_coefficients" && npz.add_array(name, &arr1(&[0.0; 3])).is_ok()
    });
    refused("level1_coefficients holds NaN at entry 1", 3, |npz, name| {
        name == "level1_coefficients" && npz.add_array(name, &arr1(&[0.0, f64::NAN])).is_ok()
    });

    let level = SplineLevel { index: arr2(&[[0, 0]]), coefficients: vec![1.0] };
    let error = sound.with_levels(vec![level; 21]).unwrap_err();
    assert_eq!(error.problem, "level 21 has 2097155 basis functions along an axis; at most 2097152 are known");
}
