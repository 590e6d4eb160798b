//! Triangle meshes as binary glTF 2.0.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use crate::axis_by_axis::axis_by_axis;
use crate::mesh::TriMesh;

const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BINARY_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");
/// Component types and buffer targets by their numbers in the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// What of a mesh the format cannot hold.
pub(crate) fn problem(mesh: &TriMesh<'_>) -> Option<String> {
    if mesh.triangles.is_empty() {
        return Some("the mesh has no triangles, and a .glb cannot be without; write .ply or .obj".into());
    }
    let (center, half) = center_and_half(mesh.vertices);
    if !center.iter().chain(&half).all(|c| (*c as f32).is_finite()) {
        return Some("the mesh is too large for the 32-bit floats of a .glb; write .ply or .obj".into());
    }
    // The file's length is a 32-bit number; per vertex 36 bytes at most, per triangle 12.
    let bytes = 36 * mesh.vertices.len() as u64 + 12 * mesh.triangles.len() as u64 + (1 << 16);
    (bytes > u64::from(u32::MAX)).then(|| "a .glb holds at most 4 GiB; write .ply".into())
}

/// Writes one node that carries the mesh to its place, positions relative to the centre of the bounding box, normals, colours
/// where there are some, all in one buffer.
pub(crate) fn write(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    let (center, _) = center_and_half(mesh.vertices);
    let positions: Vec<[f32; 3]> =
        mesh.vertices.iter().map(|v| axis_by_axis(*v, center, |v, center| (v - center) as f32)).collect();
    let mut buffer = Buffer::default();
    let mut attributes = Map::new();
    attributes.insert("POSITION".into(), buffer.vectors(&positions, true).into());
    if !mesh.normals.is_empty() {
        let normals: Vec<[f32; 3]> = mesh.normals.iter().map(|n| unit(*n)).collect();
        attributes.insert("NORMAL".into(), buffer.vectors(&normals, false).into());
    }
    if !mesh.colours.is_empty() {
        let colours: Vec<[f32; 3]> = mesh.colours.iter().map(|rgb| rgb.map(linear)).collect();
        attributes.insert("COLOR_0".into(), buffer.vectors(&colours, false).into());
    }
    let indices = buffer.indices(mesh.triangles.as_flattened());
    // With colours the material multiplies them, so it is white then.
    let base = if mesh.colours.is_empty() { [0.6, 0.65, 0.7, 1.0] } else { [1.0; 4] };
    let document = json!({
        "asset": { "version": "2.0", "generator": format!("zeroset {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "zero set", "translation": center }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }],
        "materials": [{ "doubleSided": true, "pbrMetallicRoughness": {
            "baseColorFactor": base, "metallicFactor": 0.0, "roughnessFactor": 0.7
        } }],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{ "byteLength": buffer.bytes.len() }],
    });
    let mut text = serde_json::to_vec(&document).map_err(io::Error::from)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + buffer.bytes.len();
    out.write_all(b"glTF")?;
    for number in [2, length(total)?, length(text.len())?, JSON_CHUNK] {
        out.write_all(&number.to_le_bytes())?;
    }
    out.write_all(&text)?;
    for number in [length(buffer.bytes.len())?, BINARY_CHUNK] {
        out.write_all(&number.to_le_bytes())?;
    }
    out.write_all(&buffer.bytes)
}

fn length(bytes: usize) -> io::Result<u32> {
    u32::try_from(bytes).map_err(io::Error::other)
}

/// The one buffer, with its views and accessors; all entries have a multiple of four bytes, so that everything is aligned.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends vectors; returns the accessor's index. Positions need their bounds, and exactly.
    fn vectors(&mut self, vectors: &[[f32; 3]], with_bounds: bool) -> usize {
        let mut accessor = accessor(FLOAT, "VEC3", vectors.len());
        if with_bounds {
            let bound = |pick: fn(f32, f32) -> f32| vectors.iter().copied().reduce(|a, b| axis_by_axis(a, b, pick));
            accessor.insert("min".into(), json!(bound(f32::min)));
            accessor.insert("max".into(), json!(bound(f32::max)));
        }
        self.append(ARRAY_BUFFER, accessor, vectors.as_flattened().iter().flat_map(|c| c.to_le_bytes()))
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let accessor = accessor(UNSIGNED_INT, "SCALAR", indices.len());
        self.append(ELEMENT_ARRAY_BUFFER, accessor, indices.iter().flat_map(|i| i.to_le_bytes()))
    }

    fn append(&mut self, target: u32, mut accessor: Map<String, Value>, bytes: impl Iterator<Item = u8>) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        accessor.insert("bufferView".into(), self.views.len().into());
        let length = self.bytes.len() - start;
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": target }));
        self.accessors.push(accessor.into());
        self.accessors.len() - 1
    }
}

fn accessor(component: u32, kind: &str, count: usize) -> Map<String, Value> {
    [("componentType", component.into()), ("type", kind.into()), ("count", count.into())]
        .map(|(key, value): (_, Value)| (key.to_owned(), value))
        .into_iter()
        .collect()
}

/// The centre of the bounding box, and half its sides.
fn center_and_half(vertices: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let bound = |pick: fn(f64, f64) -> f64| {
        vertices.iter().copied().reduce(|a, b| axis_by_axis(a, b, pick)).unwrap_or_default()
    };
    let (low, high) = (bound(f64::min), bound(f64::max));
    let half = axis_by_axis(high, low, |high, low| high / 2.0 - low / 2.0);
    (axis_by_axis(low, half, |low, half| low + half), half)
}

/// The format wants length 1, and has no way to say that there is none.
fn unit(normal: [f64; 3]) -> [f32; 3] {
    let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() { normal.map(|c| (c / length) as f32) } else { [0.0, 0.0, 1.0] }
}

/// From an sRGB byte to the linear share of light that the format stores (IEC 61966-2-1).
fn linear(byte: u8) -> f32 {
    let c = f32::from(byte) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
