//! Binary little-endian PLY with double coordinates, float normals, byte colours and float confidence.

use std::io::{self, Write};

use ply_rs::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType, Version,
};
use ply_rs::writer::Writer;

/// A vertex row. Which of the optional columns the file has is decided by the first vertex.
#[derive(Clone, Copy)]
pub(crate) struct Vertex {
    pub(crate) position: [f64; 3],
    pub(crate) normal: Option<[f64; 3]>,
    pub(crate) colour: Option<[u8; 3]>,
    pub(crate) confidence: Option<f64>,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [0.0; 3], normal: None, colour: None, confidence: None }
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        let [x, y, z] = self.position;
        match name {
            "x" => Some(x),
            "y" => Some(y),
            "z" => Some(z),
            _ => None,
        }
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        let [red, green, blue] = self.colour?;
        match name {
            "red" => Some(red),
            "green" => Some(green),
            "blue" => Some(blue),
            _ => None,
        }
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let [nx, ny, nz] = self.normal.unwrap_or_default();
        let value = match name {
            "nx" => nx,
            "ny" => ny,
            "nz" => nz,
            "confidence" => self.confidence?,
            _ => return None,
        };
        Some(value as f32)
    }
}

struct Face([i32; 3]);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self([0; 3])
    }

    fn get_list_int(&self, _: &str) -> Option<&[i32]> {
        Some(&self.0)
    }
}

/// Writes the vertices and, where there are any, the triangles (corner indices below 2³¹).
pub(crate) fn write(
    out: &mut impl Write,
    vertices: impl ExactSizeIterator<Item = Vertex>,
    triangles: Option<&[[u32; 3]]>,
) -> io::Result<()> {
    let mut vertices = vertices.peekable();
    let first = vertices.peek().copied().unwrap_or_else(Vertex::new);
    let mut vertex = element("vertex", vertices.len(), &["x", "y", "z"], ScalarType::Double);
    if first.normal.is_some() {
        add(&mut vertex, &["nx", "ny", "nz"], ScalarType::Float);
    }
    if first.colour.is_some() {
        add(&mut vertex, &["red", "green", "blue"], ScalarType::UChar);
    }
    if first.confidence.is_some() {
        add(&mut vertex, &["confidence"], ScalarType::Float);
    }

    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.version = Version { major: 1, minor: 0 };
    header.comments.push(format!("zeroset {}", env!("CARGO_PKG_VERSION")));
    header.elements.add(vertex.clone());
    let mut face = element("face", triangles.map_or(0, <[_]>::len), &[], ScalarType::Int);
    if triangles.is_some() {
        let corners = PropertyType::List(ScalarType::UChar, ScalarType::Int);
        face.properties.add(PropertyDef::new("vertex_indices".into(), corners));
        header.elements.add(face.clone());
    }

    Writer::<Vertex>::new().write_header(out, &header)?;
    let writer = Writer::new();
    for row in vertices {
        writer.write_little_endian_element(out, &row, &vertex)?;
    }
    let writer = Writer::new();
    for corners in triangles.unwrap_or_default() {
        writer.write_little_endian_element(out, &Face(corners.map(|corner| corner as i32)), &face)?;
    }
    Ok(())
}

fn element(name: &str, count: usize, properties: &[&str], scalar: ScalarType) -> ElementDef {
    let mut element = ElementDef::new(name.into());
    element.count = count;
    add(&mut element, properties, scalar);
    element
}

fn add(element: &mut ElementDef, properties: &[&str], scalar: ScalarType) {
    for name in properties {
        element.properties.add(PropertyDef::new((*name).into(), PropertyType::Scalar(scalar.clone())));
    }
}
