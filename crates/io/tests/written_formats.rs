//! Files for other programs hold what their formats ask for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::path::Path;

use ndarray::{Array2, Array3};
use serde_json::Value;
use zeroset_io::{
    Attribute, Curves, Field, NumberKind, PointSet, Points, TriMesh, WriteError, read_points, write_curves,
    write_field, write_mesh,
};

const NORMALS: [[f64; 3]; 4] = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]];
const COLOURS: [[u8; 3]; 4] = [[0, 0, 0], [255, 255, 255], [255, 0, 0], [1, 128, 254]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

fn tetrahedron(at: [f64; 3]) -> [[f64; 3]; 4] {
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.75, 0.0], [0.0, 0.0, 0.5]]
        .map(|v: [f64; 3]| std::array::from_fn(|axis| v[axis] + at[axis]))
}

fn written(name: &str, write: impl Fn(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path);
    std::fs::read(path).unwrap()
}

fn mesh_bytes(name: &str, vertices: &[[f64; 3]], colours: &[[u8; 3]]) -> Vec<u8> {
    let mesh = TriMesh { vertices, normals: &NORMALS, triangles: &FACES, colours, ..Default::default() };
    written(name, |path| write_mesh(path, &mesh).unwrap())
}

fn refusal(name: &str, mesh: &TriMesh<'_>) -> String {
    let folder = tempfile::tempdir().unwrap();
    match write_mesh(folder.path().join(name), mesh).unwrap_err() {
        WriteError::Invalid { problem, .. } => problem,
        other => panic!("{other:?}"),
    }
}

fn number(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// The document and the buffer of a `.glb`, with everything the container prescribes checked.
fn glb(bytes: &[u8]) -> (Value, &[u8]) {
    assert_eq!((&bytes[..4], number(bytes, 4), number(bytes, 8) as usize), (&b"glTF"[..], 2, bytes.len()));
    let json_length = number(bytes, 12) as usize;
    assert_eq!((&bytes[16..20], json_length % 4), (&b"JSON"[..], 0));
    let at = 20 + json_length;
    let document: Value = serde_json::from_slice(&bytes[20..at]).unwrap();
    assert_eq!((number(bytes, at) as usize, &bytes[at + 4..at + 8]), (bytes.len() - at - 8, &b"BIN\0"[..]));
    let buffer = &bytes[at + 8..];
    assert_eq!((buffer.len() % 4, document["buffers"][0]["byteLength"].as_u64()), (0, Some(buffer.len() as u64)));
    (document, buffer)
}

/// The 4-byte numbers of an accessor, with its view checked.
fn accessor<T>(document: &Value, buffer: &[u8], index: &Value, kind: &str, read: fn([u8; 4]) -> T) -> Vec<T> {
    let accessor = &document["accessors"][index.as_u64().unwrap() as usize];
    let width = if accessor["type"] == "VEC3" { 3 } else { 1 };
    assert_eq!(accessor["type"], kind);
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let (start, length) =
        (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize);
    assert_eq!((start % 4, length), (0, accessor["count"].as_u64().unwrap() as usize * width * 4));
    buffer[start..start + length].as_chunks::<4>().0.iter().map(|b| read(*b)).collect()
}

#[test]
fn a_glb_has_its_parts_at_their_place() {
    // A centre that f32 cannot hold: relative to it everything is exact.
    let vertices = tetrahedron([5_000_000.125, -3.0, 0.0]);
    let bytes = mesh_bytes("a.glb", &vertices, &COLOURS);
    let (document, buffer) = glb(&bytes);
    assert_eq!(document["asset"]["version"], "2.0");
    let translation: [f64; 3] = serde_json::from_value(document["nodes"][0]["translation"].clone()).unwrap();
    assert_eq!(translation, [5_000_000.625, -2.625, 0.25]);
    let primitive = &document["meshes"][0]["primitives"][0];
    let floats = |name: &str| accessor(&document, buffer, &primitive["attributes"][name], "VEC3", f32::from_le_bytes);
    let positions = floats("POSITION");
    for (vertex, position) in vertices.iter().zip(positions.as_chunks::<3>().0) {
        for axis in 0..3 {
            assert_eq!(f64::from(position[axis]) + translation[axis], vertex[axis]);
        }
    }
    let bounds = &document["accessors"][primitive["attributes"]["POSITION"].as_u64().unwrap() as usize];
    assert_eq!(
        (&bounds["min"], &bounds["max"]),
        (&serde_json::json!([-0.5, -0.375, -0.25]), &serde_json::json!([0.5, 0.375, 0.25]))
    );
    for normal in floats("NORMAL").as_chunks::<3>().0 {
        // The validator of the format allows 5e-4.
        assert!((normal.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-6, "{normal:?}");
    }
    let colours = floats("COLOR_0");
    assert_eq!(colours[..6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert!((colours[10] - 0.2158605).abs() < 1e-6, "128 in sRGB is 21.6 % of the light");
    let indices = accessor(&document, buffer, &primitive["indices"], "SCALAR", u32::from_le_bytes);
    assert_eq!(indices, FACES.as_flattened());
    let plain = mesh_bytes("a.glb", &vertices, &[]);
    assert!(glb(&plain).0["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].is_null());
}

#[test]
fn what_a_glb_cannot_hold_is_refused() {
    let vertices = tetrahedron([0.0; 3]);
    assert!(refusal("a.glb", &TriMesh { vertices: &vertices, ..Default::default() }).contains("no triangles"));
    let huge = vertices.map(|v| v.map(|c| c * 1e308));
    assert!(
        refusal("a.glb", &TriMesh { vertices: &huge, triangles: &FACES, ..Default::default() }).contains("too large")
    );
}

fn corners(name: &str, bytes: &[u8]) -> Vec<[f64; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    match read_points(path) {
        Ok(Points::Three(PointSet { points, .. })) => points,
        other => panic!("{other:?}"),
    }
}

#[test]
fn stl_is_binary_where_that_is_exact_enough_and_ascii_elsewhere() {
    let near = tetrahedron([0.0; 3]);
    let bytes = mesh_bytes("a.stl", &near, &[]);
    assert_eq!((bytes.len(), number(&bytes, 80)), (84 + 50 * 4, 4));
    assert!(!bytes.starts_with(b"solid"));
    assert_eq!(corners("a.stl", &bytes), [near[0], near[2], near[1], near[3]]);
    // The first triangle lies in z = 0 and is seen from below.
    let normal: Vec<f32> = (0..3).map(|i| f32::from_bits(number(&bytes, 84 + 4 * i))).collect();
    assert_eq!(normal, [0.0, 0.0, -1.0]);

    let far = tetrahedron([5_000_000.1, 0.0, 0.0]);
    let bytes = mesh_bytes("a.stl", &far, &[]);
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.starts_with("solid zeroset\nfacet normal 0.0 0.0 -1.0\n outer loop\n  vertex 5000000.1 0.0 0.0\n"));
    assert_eq!(corners("a.stl", &bytes), [far[0], far[2], far[1], far[3]]);
    let huge = near.map(|v| v.map(|c| c * 1e308));
    assert_eq!(corners("a.stl", &mesh_bytes("a.stl", &huge, &[])).len(), 4);
    let flat = [[1.0, 2.0, 3.0]; 4];
    assert!(!String::from_utf8_lossy(&mesh_bytes("a.stl", &flat, &[])).contains("NaN"));
}

#[test]
fn colours_go_into_ply_and_obj() {
    let vertices = tetrahedron([0.0; 3]);
    let ply = mesh_bytes("a.ply", &vertices, &COLOURS);
    let end = ply.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(ply[..end].to_vec()).unwrap();
    assert!(header.contains("property uchar red\nproperty uchar green\nproperty uchar blue\n"), "{header}");
    let row = 3 * 8 + 3 * 4 + 3;
    assert_eq!(ply[end + 4 * row - 3..end + 4 * row], COLOURS[3]);
    assert_eq!(corners("a.ply", &ply), vertices);
    let obj = mesh_bytes("a.obj", &vertices, &COLOURS);
    assert!(String::from_utf8_lossy(&obj).contains("v 0.0 0.0 0.5 0.004 0.502 0.996\n"));
    assert_eq!(corners("a.obj", &obj), vertices);
    let mesh = TriMesh { vertices: &vertices, colours: &COLOURS[..1], ..Default::default() };
    assert_eq!(refusal("a.ply", &mesh), "4 vertices but 1 colours");
    let bad = TriMesh { vertices: &[[0.0, f64::NAN, 0.0]], ..Default::default() };
    assert!(refusal("a.obj", &bad).contains("vertex 0 is at [0.0, NaN, 0.0]"));
}

fn two_curves() -> [Vec<[f64; 2]>; 2] {
    let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    [square, vec![[5_000_000.1, -1e-7], [1.0, 3.0], [3.0, 3.0]]]
}

#[test]
fn curves_in_csv_can_be_read_as_points() {
    let curves = two_curves();
    let bytes = written("a.csv", |path| write_curves(path, &Curves { curves: &curves, ..Default::default() }).unwrap());
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.starts_with("curve,x,y\n0,0.0,0.0\n") && text.contains("\n1,5000000.1,-1e-7\n"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::fs::write(&path, bytes).unwrap();
    let number = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0].to_vec();
    let number = Attribute { name: "curve".into(), kind: NumberKind::F64, values: number };
    let expected = PointSet { points: curves.concat(), normals: None, attributes: vec![number] };
    assert_eq!(read_points(path).unwrap(), Points::Two(expected));
}

#[test]
fn curves_in_dxf_are_closed_polylines() {
    let curves = [two_curves().to_vec(), vec![vec![]]].concat();
    let bytes = written("a.dxf", |path| write_curves(path, &Curves { curves: &curves, ..Default::default() }).unwrap());
    let text = String::from_utf8(bytes).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let groups: Vec<(u32, &str)> = lines.chunks(2).map(|pair| (pair[0].trim().parse().unwrap(), pair[1])).collect();
    assert_eq!(groups.last(), Some(&(0, "EOF")));
    assert_eq!(groups[2..4], [(9, "$ACADVER"), (1, "AC1009")]);
    let entities = groups.iter().position(|g| *g == (2, "ENTITIES")).unwrap();
    let mut read: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut kind = "";
    for (i, &(code, value)) in groups.iter().enumerate().skip(entities) {
        match (code, kind) {
            (0, _) => {
                kind = value;
                if kind == "POLYLINE" {
                    read.push(Vec::new());
                    assert_eq!(groups[i + 2], (66, "1"), "vertices follow");
                    assert_eq!(groups[i + 6], (70, "1"), "closed");
                }
            }
            (10, "VERTEX") => {
                let y = groups[i + 1];
                assert_eq!(y.0, 20);
                read.last_mut().unwrap().push([value.parse().unwrap(), y.1.parse().unwrap()]);
            }
            _ => {}
        }
    }
    assert_eq!(read, two_curves());
    assert_eq!(text.matches("SEQEND").count(), 2);
    let empty = written("a.dxf", |path| write_curves(path, &Curves::default()).unwrap());
    assert!(String::from_utf8(empty).unwrap().ends_with("ENTITIES\n  0\nENDSEC\n  0\nEOF\n"));
}

/// The header of a `.vti` and its values.
fn vti(bytes: &[u8]) -> (String, Vec<f64>) {
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let start = bytes.windows(marker.len()).position(|w| w == marker).unwrap() + marker.len();
    let length = u64::from_le_bytes(bytes[start..start + 8].try_into().unwrap()) as usize;
    let end = start + 8 + length;
    assert_eq!(&bytes[end..], b"\n</AppendedData>\n</VTKFile>\n");
    let values = bytes[start + 8..end].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    (String::from_utf8(bytes[..start].to_vec()).unwrap(), values)
}

#[test]
fn fields_in_vti_have_x_fastest() {
    let values = Array3::from_shape_fn((2, 3, 4), |(i, j, k)| (i + 10 * j + 100 * k) as f64);
    let field = Field {
        values: values.view().into_dyn(),
        origin: &[0.5, 1e-7, 5e6],
        spacing: &[0.25, 0.5, 1.0],
        confidence: None,
    };
    let (header, read) = vti(&written("a.vti", |path| write_field(path, &field).unwrap()));
    let whole = r#"WholeExtent="0 1 0 2 0 3" Origin="0.5 1e-7 5000000.0" Spacing="0.25 0.5 1.0""#;
    assert!(header.contains(whole), "{header}");
    let expected: Vec<f64> = (0..24).map(|n| (n % 2 + 10 * (n / 2 % 3) + 100 * (n / 6)) as f64).collect();
    assert_eq!(read, expected);

    let plane = Array2::from_shape_fn((2, 3), |(i, j)| (i + 10 * j) as f64);
    let field = Field { values: plane.view().into_dyn(), origin: &[0.0; 2], spacing: &[0.5; 2], confidence: None };
    let (header, read) = vti(&written("a.vti", |path| write_field(path, &field).unwrap()));
    assert!(header.contains(r#"WholeExtent="0 1 0 2 0 0" Origin="0.0 0.0 0.0" Spacing="0.5 0.5 1.0""#), "{header}");
    assert_eq!(read, [0.0, 1.0, 10.0, 11.0, 20.0, 21.0]);
}

#[test]
fn fields_in_vti_have_their_confidence_beside_them() {
    let values = Array2::from_shape_fn((2, 3), |(i, j)| (i + 10 * j) as f64);
    let confidence = values.mapv(|value| value / 21.0);
    let field = |confidence| Field {
        values: values.view().into_dyn(),
        origin: &[0.0; 2],
        spacing: &[0.5; 2],
        confidence: Some(confidence),
    };
    let bytes = written("a.vti", |path| write_field(path, &field(confidence.view().into_dyn())).unwrap());
    let text = String::from_utf8_lossy(&bytes);
    // Six values and their length come before it.
    assert!(text.contains(r#"<DataArray type="Float64" Name="confidence" format="appended" offset="56"/>"#), "{text}");
    let start = bytes.windows(2).position(|w| w == b"\n_").unwrap() + 2 + 56;
    let numbers = bytes[start + 8..start + 56].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
    assert_eq!(u64::from_le_bytes(bytes[start..start + 8].try_into().unwrap()), 48);
    assert!(numbers.eq([0.0, 1.0, 10.0, 11.0, 20.0, 21.0].map(|value| value / 21.0)));
    assert_eq!(&bytes[start + 56..], b"\n</AppendedData>\n</VTKFile>\n");

    let folder = tempfile::tempdir().unwrap();
    let other = Array2::<f64>::zeros((3, 2));
    assert!(write_field(folder.path().join("b.vti"), &field(other.view().into_dyn())).is_err());
}

#[test]
fn what_is_known_of_the_vertices_can_be_read_again() {
    let attribute = |name: &str, kind, values: [f64; 4]| Attribute { name: name.into(), kind, values: values.to_vec() };
    let attributes = [
        attribute("green", NumberKind::U8, [0.0, 254.6, 300.0, -1.0]),
        attribute("scalar Intensity", NumberKind::F64, [0.1, 1e300, -0.0, 2.0]),
        attribute("label", NumberKind::U32, [0.0, 1.0, 4e9, 7.0]),
        attribute("Support", NumberKind::F32, [9.0; 4]),
    ];
    let support = [0.5, 0.25, 0.0, 1.0];
    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mesh = TriMesh { vertices: &vertices, support: &support, attributes: &attributes, ..Default::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    write_mesh(&path, &mesh).unwrap();
    let points = read_points(path).unwrap();
    // Integers are rounded and kept in range; a second column of the same name is not written.
    let expected = [
        attribute("support", NumberKind::F32, support),
        attribute("green", NumberKind::U8, [0.0, 255.0, 255.0, 0.0]),
        attribute("scalar Intensity", NumberKind::F64, [0.1, 1e300, -0.0, 2.0]),
        attribute("label", NumberKind::U32, [0.0, 1.0, 4e9, 7.0]),
    ];
    assert_eq!(points.attributes(), expected);
    assert!(refusal("a.ply", &TriMesh { support: &support[..3], ..mesh }).contains("3 distances"));
    let short = [Attribute { values: vec![0.0], ..attributes[0].clone() }];
    assert!(refusal("a.ply", &TriMesh { attributes: &short, ..mesh }).contains("1 values of \"green\""));
}

#[test]
fn open_curves_stay_open() {
    let paths = [vec![[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]]];
    let text = |name: &str| {
        let bytes = written(name, |path| write_curves(path, &Curves { paths: &paths, ..Default::default() }).unwrap());
        String::from_utf8(bytes).unwrap()
    };
    assert_eq!(text("a.json"), "{\"curves\":[],\"paths\":[[[0.0,0.0],[1.0,0.5],[2.0,0.0]]]}\n");
    assert_eq!(text("a.csv"), "curve,x,y\n0,0.0,0.0\n0,1.0,0.5\n0,2.0,0.0\n");
    // Group 70 is 1 where a polyline is closed.
    assert!(text("a.dxf").contains(" 70\n0\n") && !text("a.dxf").contains(" 70\n1\n"));
    let svg = text("a.svg");
    assert!(svg.contains("fill=\"none\"") && !svg.contains('Z'), "{svg}");
}
