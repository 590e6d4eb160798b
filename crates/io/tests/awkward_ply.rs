//! PLY files on which readers in the wild fail, each as a test.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::time::{Duration, Instant};

use zeroset_io::{Attribute, NumberKind, PointSet, Points, ReadError, read_points};

fn read(bytes: impl AsRef<[u8]>) -> Result<Points, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    std::fs::write(&path, bytes).unwrap();
    read_points(path)
}

fn space(bytes: impl AsRef<[u8]>) -> PointSet<3> {
    match read(bytes) {
        Ok(Points::Three(set)) => set,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(bytes: impl AsRef<[u8]>, part: &str) {
    let sentence = read(bytes).unwrap_err().to_string();
    assert!(sentence.contains("points.ply: ") && sentence.contains(part), "{sentence}");
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

fn ascii(vertices: usize, properties: &str, body: &str) -> String {
    format!("ply\nformat ascii 1.0\nelement vertex {vertices}\n{properties}end_header\n{body}")
}

#[test]
fn nan_and_infinity_in_ascii_are_refused_by_line() {
    refused(ascii(2, XYZ, "0 0 0\n1 nan 2\n"), "line 9: y is nan");
    refused(ascii(2, XYZ, "0 0 0\n1 2 -inf\n"), "line 9: z is -inf");
}

#[test]
fn nan_in_binary_is_refused_by_point() {
    let mut bytes = format!("ply\nformat binary_big_endian 1.0\nelement vertex 2\n{XYZ}end_header\n").into_bytes();
    for value in [0.0f32, 0.0, 0.0, 1.0, f32::NAN, 2.0] {
        bytes.extend(value.to_be_bytes());
    }
    refused(bytes, "point 1 (counted from 0): y is nan");
}

#[test]
fn blank_lines_crlf_and_bare_decimals_are_read() {
    let text = ascii(2, XYZ, "\n .5 1. +2 \n\n\t3 4e0 -5\n\n").replace('\n', "\r\n");
    assert_eq!(space(text).points, [[0.5, 1.0, 2.0], [3.0, 4.0, -5.0]]);
}

#[test]
fn headers_may_end_their_lines_as_they_like_even_before_a_binary_body() {
    let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{XYZ}end_header\n");
    // A body that begins with line ends: 0x0a0d0a0d as a float.
    let body = [[13, 10, 13, 10], 2.0f32.to_le_bytes(), 3.0f32.to_le_bytes()].concat();
    let x = f64::from(f32::from_le_bytes([13, 10, 13, 10]));
    for end in ["\n", "\r\n", "\r"] {
        let bytes = [header.replace('\n', end).as_bytes(), &body].concat();
        assert_eq!(space(bytes).points, [[x, 2.0, 3.0]], "{end:?}");
    }
    assert_eq!(space(ascii(2, XYZ, "1 2 3\n4 5 6\n").replace('\n', "\r")).points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}

#[test]
fn property_names_with_dots_and_blanks_are_read() {
    let properties = format!("property uchar scalar.Intensity\n{XYZ}property float Scan Angle (deg)\n");
    assert_eq!(space(ascii(1, &properties, "9 1 2 3 45\n")).points, [[1.0, 2.0, 3.0]]);
}

#[test]
fn comments_in_any_encoding_are_passed_over() {
    let mut bytes = b"ply\nformat ascii 1.0\ncomment M\xfcller\nobj_info \xff\xfe\n".to_vec();
    bytes.extend(format!("element vertex 1\n{XYZ}end_header\n1 2 3\n").bytes());
    assert_eq!(space(bytes).points, [[1.0, 2.0, 3.0]]);
}

#[test]
fn coordinates_may_be_of_any_number_type() {
    let properties = "property double x\nproperty int y\nproperty uint8 z\n";
    let mut little =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{properties}end_header\n").into_bytes();
    let mut big = format!("ply\nformat binary_big_endian 1.0\nelement vertex 1\n{properties}end_header\n").into_bytes();
    little.extend(5_000_000.1f64.to_le_bytes().into_iter().chain((-7i32).to_le_bytes()).chain([200]));
    big.extend(5_000_000.1f64.to_be_bytes().into_iter().chain((-7i32).to_be_bytes()).chain([200]));
    for bytes in [little, big, ascii(1, properties, "5000000.1 -7 200").into_bytes()] {
        assert_eq!(space(bytes).points, [[5_000_000.1, -7.0, 200.0]]);
    }
}

#[test]
fn lists_before_and_inside_the_vertices_are_passed_over() {
    let elements = format!(
        "element camera 2\nproperty list uchar float matrix\nproperty short id\n\
         element vertex 2\nproperty list ushort int neighbours\n{XYZ}"
    );
    let text = format!("ply\nformat ascii 1.0\n{elements}end_header\n2 0.5 0.5 1\n0 2\n1 9 1 2 3\n0 4 5 6\n");
    let mut binary = format!("ply\nformat binary_little_endian 1.0\n{elements}end_header\n").into_bytes();
    binary.extend([2].into_iter().chain(0.5f32.to_le_bytes()).chain(0.5f32.to_le_bytes()).chain([1, 0]));
    binary.extend([0, 2, 0]);
    binary.extend([1, 0, 9, 0, 0, 0].into_iter().chain([1.0f32, 2.0, 3.0].into_iter().flat_map(f32::to_le_bytes)));
    binary.extend([0, 0].into_iter().chain([4.0f32, 5.0, 6.0].into_iter().flat_map(f32::to_le_bytes)));
    for bytes in [text.into_bytes(), binary] {
        assert_eq!(space(bytes).points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }
}

#[test]
fn duplicate_properties_shift_nothing_and_duplicate_coordinates_are_refused() {
    let properties = format!("property uchar red\nproperty uchar red\n{XYZ}");
    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{properties}end_header\n").into_bytes();
    bytes.extend([255, 255].into_iter().chain([1.0f32, 2.0, 3.0].into_iter().flat_map(f32::to_le_bytes)));
    assert_eq!(space(bytes).points, [[1.0, 2.0, 3.0]]);
    refused(ascii(1, &format!("{XYZ}property float X\n"), "1 2 3 4\n"), "two properties \"x\"");
}

#[test]
fn truncated_bodies_are_refused_with_what_is_missing() {
    refused(ascii(1000, XYZ, "0 0 0\n"), "claims 1000 × \"vertex\", which needs at least 5000 bytes, but 6 follow it");
    refused(ascii(3, XYZ, "0.125 0.125 0.125\n1 1 1\n"), "the file ends after 2 of 3 rows of \"vertex\"");
    refused(ascii(2, XYZ, "0.125 0.125 0.125\n1 1"), "line 9: the row ends before its property \"z\"");
    refused(ascii(1, XYZ, "0 0 0 0\n"), "is left over");
}

#[test]
fn counts_that_the_file_cannot_hold_are_refused_at_once() {
    let start = Instant::now();
    for properties in ["", XYZ, "property list uint double x\n"] {
        for encoding in ["ascii", "binary_little_endian"] {
            for count in ["300000000", "18446744073709551615", "99999999999999999999"] {
                let header = format!("ply\nformat {encoding} 1.0\nelement vertex {count}\n{properties}end_header\n");
                assert!(read(header).is_err());
                let empty_rows =
                    format!("ply\nformat {encoding} 1.0\nelement thing {count}\nelement vertex 1\n{XYZ}end_header\n");
                assert!(read(empty_rows).is_err());
            }
        }
    }
    let mut long_list = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n".to_vec();
    long_list.extend(format!("property list uint double l\n{XYZ}end_header\n").bytes());
    long_list.extend([0xff; 20]);
    refused(long_list, "\"vertex\" 0 of 1");
    // A loop over any of these counts would take longer; reading a refused header takes microseconds.
    assert!(start.elapsed() < Duration::from_secs(2));
}

#[test]
fn what_else_is_said_of_the_points_comes_along() {
    let properties = "property uchar red\nproperty float scalar Intensity\nproperty list uchar int where\nproperty float nx\n\
                      property short depth\nproperty float broken\nproperty double RED\n";
    let set = space(ascii(2, &format!("{XYZ}{properties}"), "0 1 2 255 0.25 1 7 0 -3 1 9\n3 4 5 0 1e3 0 0 12 nan 9\n"));
    let attribute = |name: &str, kind, values: [f64; 2]| Attribute { name: name.into(), kind, values: values.to_vec() };
    let expected = [
        attribute("red", NumberKind::U8, [255.0, 0.0]),
        attribute("scalar Intensity", NumberKind::F32, [0.25, 1e3]),
        attribute("depth", NumberKind::I16, [-3.0, 12.0]),
    ];
    // Lists, lone components of normals, what is not finite and what has a name again are left out.
    assert_eq!(set.attributes, expected);
    assert_eq!((set.points.len(), set.normals), (2, None));
    let mut bytes = format!(
        "ply\nformat binary_big_endian 1.0\nelement vertex 1\n{XYZ}property uint n\nproperty char s\nproperty double t\nend_header\n"
    )
    .into_bytes();
    bytes.extend([0.0f32; 3].iter().flat_map(|v| v.to_be_bytes()));
    bytes.extend([4_000_000_000u32.to_be_bytes().as_slice(), &[0xff], &0.1f64.to_be_bytes()].concat());
    let values: Vec<f64> = space(bytes).attributes.iter().map(|a| a.values[0]).collect();
    assert_eq!(values, [4e9, -1.0, 0.1]);
}

#[test]
fn headers_without_end_are_refused() {
    let mut endless = b"ply\nformat ascii 1.0\n".to_vec();
    endless.extend(b"comment and so on\n".repeat(100_000));
    refused(endless, "no end_header line in its first 1048576 bytes");
    refused("ply\nformat ascii 1.0\nelement vertex 1\n", "no end_header");
    refused("solid cube\n", "a PLY file begins with the line \"ply\"");
    refused([0u8; 100], "a PLY file begins with the line \"ply\"");
    refused(ascii(0, XYZ, ""), "no points");
    refused("ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no element \"vertex\"");
    refused(ascii(1, "property float x\nproperty float z\n", "1 2\n"), "need the properties \"x\" and \"y\"");
    refused(ascii(1, "property quad x\n", "1\n"), "line 4: unknown PLY type \"quad\"");
    refused(ascii(1, "property list float float x\n", "1\n"), "line 4: the length of a list");
}

#[test]
fn without_z_the_points_are_plane_and_with_equal_z_they_are_not() {
    let plane =
        read(ascii(1, "property float x\nproperty float y\nproperty float nx\nproperty float ny\n", "1 2 0 1\n"));
    let expected = PointSet { points: vec![[1.0, 2.0]], normals: Some(vec![[0.0, 1.0]]), attributes: Vec::new() };
    assert_eq!(plane.unwrap(), Points::Two(expected));
    assert_eq!(space(ascii(2, XYZ, "1 2 0\n3 4 0\n")).points, [[1.0, 2.0, 0.0], [3.0, 4.0, 0.0]]);
}
