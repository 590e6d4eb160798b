//! Binary little-endian PLY with double coordinates, float normals, byte colours, float confidence and support, and whatever else
//! is said of the vertices in numbers.

use std::collections::HashSet;
use std::io::{self, Write};

use ply_rs::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType, Version,
};
use ply_rs::writer::Writer;

use crate::attributes::{Attribute, NumberKind};

/// A vertex row. Which of the optional columns the file has is decided by the first vertex.
#[derive(Clone, Copy, Default)]
pub(crate) struct Vertex<'a> {
    pub(crate) position: [f64; 3],
    pub(crate) normal: Option<[f64; 3]>,
    pub(crate) colour: Option<[u8; 3]>,
    pub(crate) confidence: Option<f64>,
    pub(crate) support: Option<f64>,
    /// Of all vertices, with the place of this one among them.
    pub(crate) attributes: &'a [Attribute],
    pub(crate) index: usize,
}

impl Vertex<'_> {
    fn attribute(&self, name: &str) -> Option<f64> {
        self.attributes.iter().find(|a| a.name == name)?.values.get(self.index).copied()
    }

    /// For writing as an integer: the nearest one; what is out of range is written as the end of it.
    fn rounded(&self, name: &str) -> Option<f64> {
        self.attribute(name).map(f64::round)
    }
}

impl PropertyAccess for Vertex<'_> {
    fn new() -> Self {
        Self::default()
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        let [x, y, z] = self.position;
        match name {
            "x" => Some(x),
            "y" => Some(y),
            "z" => Some(z),
            _ => self.attribute(name),
        }
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        match (name, self.colour) {
            ("red", Some([red, _, _])) => Some(red),
            ("green", Some([_, green, _])) => Some(green),
            ("blue", Some([_, _, blue])) => Some(blue),
            _ => self.rounded(name).map(|v| v as u8),
        }
    }

    fn get_char(&self, name: &str) -> Option<i8> {
        self.rounded(name).map(|v| v as i8)
    }

    fn get_short(&self, name: &str) -> Option<i16> {
        self.rounded(name).map(|v| v as i16)
    }

    fn get_ushort(&self, name: &str) -> Option<u16> {
        self.rounded(name).map(|v| v as u16)
    }

    fn get_int(&self, name: &str) -> Option<i32> {
        self.rounded(name).map(|v| v as i32)
    }

    fn get_uint(&self, name: &str) -> Option<u32> {
        self.rounded(name).map(|v| v as u32)
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let [nx, ny, nz] = self.normal.unwrap_or_default();
        let value = match name {
            "nx" => nx,
            "ny" => ny,
            "nz" => nz,
            "confidence" if self.confidence.is_some() => self.confidence?,
            "support" if self.support.is_some() => self.support?,
            _ => self.attribute(name)?,
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
pub(crate) fn write<'a>(
    out: &mut impl Write,
    vertices: impl ExactSizeIterator<Item = Vertex<'a>>,
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
    if first.support.is_some() {
        add(&mut vertex, &["support"], ScalarType::Float);
    }
    // What has the name of a column that is there already gives way to it.
    let mut names: HashSet<String> = vertex.properties.iter().map(|(name, _)| name.clone()).collect();
    for attribute in first.attributes {
        if names.insert(attribute.name.to_ascii_lowercase()) {
            add(&mut vertex, &[&attribute.name], scalar(attribute.kind));
        }
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

fn scalar(kind: NumberKind) -> ScalarType {
    match kind {
        NumberKind::I8 => ScalarType::Char,
        NumberKind::U8 => ScalarType::UChar,
        NumberKind::I16 => ScalarType::Short,
        NumberKind::U16 => ScalarType::UShort,
        NumberKind::I32 => ScalarType::Int,
        NumberKind::U32 => ScalarType::UInt,
        NumberKind::F32 => ScalarType::Float,
        NumberKind::F64 => ScalarType::Double,
    }
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
