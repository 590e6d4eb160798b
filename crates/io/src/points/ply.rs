//! The vertices of a PLY file, ascii or binary.

mod header;

use ply_rs::parser::Parser;
use ply_rs::ply::{
    Addable, ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType,
    ScalarType,
};

use crate::attributes::NumberKind;
use crate::points::columns::Columns;
use crate::points::lines::Lines;
use crate::points::ply::header::{PlyElement, PlyHeader};
use crate::points::source::Source;
use crate::points::{Points, Rows, attribute_columns};
use crate::read_error::{Malformed, quoted};

/// Reads x, y\[, z\], where all are there nx, ny\[, nz\], and all other numbers of the element `vertex`. What follows the vertices is not read.
pub(crate) fn read(source: &mut Source) -> Result<Points, Malformed> {
    let header = PlyHeader::read(source)?;
    let mut columns = columns(&header.vertex)?;
    let attributes = attributes(&header.vertex);
    columns.slots.extend(attributes.iter().map(|(position, ..)| *position));
    let attributes = attributes.into_iter().map(|(_, name, kind)| (name, kind)).collect();
    let mut rows = Rows::with_attributes(columns.dimension, columns.with_normals, attributes);
    rows.reserve(header.vertex.count);
    match header.encoding {
        Encoding::Ascii => read_ascii(source, &header, &columns, rows),
        Encoding::BinaryLittleEndian => {
            read_binary(source, &header, &columns, rows, |r, d| Parser::new().read_little_endian_element(r, d))
        }
        Encoding::BinaryBigEndian => {
            read_binary(source, &header, &columns, rows, |r, d| Parser::new().read_big_endian_element(r, d))
        }
    }
}

/// The properties that hold coordinates and normals.
fn columns(vertex: &PlyElement) -> Result<Columns, Malformed> {
    Columns::named(|wanted| {
        let mut hits = vertex.properties.iter().enumerate().filter(|(_, (name, _))| name.eq_ignore_ascii_case(wanted));
        match (hits.next(), hits.next()) {
            (_, Some(_)) => Err(Malformed::file(format!("the vertices have two properties {wanted:?}"))),
            (Some((_, (_, PropertyType::List(..)))), None) => {
                Err(Malformed::file(format!("the vertices' property {wanted:?} is a list, not a number")))
            }
            (hit, None) => Ok(hit.map(|(position, _)| position)),
        }
    })?
    .ok_or_else(|| Malformed::file("the vertices need the properties \"x\" and \"y\""))
}

/// The properties that are numbers, and neither coordinates nor normals: position, name, type. At most [`MOST_ATTRIBUTES`].
fn attributes(vertex: &PlyElement) -> Vec<(usize, String, NumberKind)> {
    let names = vertex.properties.iter().map(|(name, _)| name.as_str()).enumerate();
    let numbers =
        attribute_columns(names).into_iter().filter_map(|(position, name)| match vertex.properties.get(position)? {
            (_, PropertyType::Scalar(scalar)) => Some((position, name.to_owned(), kind(scalar))),
            (_, PropertyType::List(..)) => None,
        });
    numbers.take(MOST_ATTRIBUTES).collect()
}

/// More attributes than this are passed over, so that a header of nothing but names takes no more memory than others.
const MOST_ATTRIBUTES: usize = 256;

fn kind(scalar: &ScalarType) -> NumberKind {
    match scalar {
        ScalarType::Char => NumberKind::I8,
        ScalarType::UChar => NumberKind::U8,
        ScalarType::Short => NumberKind::I16,
        ScalarType::UShort => NumberKind::U16,
        ScalarType::Int => NumberKind::I32,
        ScalarType::UInt => NumberKind::U32,
        ScalarType::Float => NumberKind::F32,
        ScalarType::Double => NumberKind::F64,
    }
}

/// The numbers of one binary row that are wanted, by slot; everything else is passed over.
struct Row(Vec<f64>);

/// The definition handed to ply-rs: a property's key is its slot, or its position behind a `-` if it is not wanted.
fn definition(element: &PlyElement, slots: &[usize]) -> ElementDef {
    let mut definition = ElementDef::new(element.name.clone());
    definition.count = element.count;
    for (position, (_, data_type)) in element.properties.iter().enumerate() {
        let key = match slots.iter().position(|slot| *slot == position) {
            Some(slot) => slot.to_string(),
            None => format!("-{position}"),
        };
        definition.properties.add(PropertyDef::new(key, data_type.clone()));
    }
    definition
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, key: &str, property: Property) -> PropertyAccessResult {
        let value = match property {
            Property::Char(v) => v.into(),
            Property::UChar(v) => v.into(),
            Property::Short(v) => v.into(),
            Property::UShort(v) => v.into(),
            Property::Int(v) => v.into(),
            Property::UInt(v) => v.into(),
            Property::Float(v) => v.into(),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        let Ok(slot) = key.parse::<usize>() else { return PropertyAccessResult::Ignored };
        if self.0.len() <= slot {
            self.0.resize(slot + 1, 0.0);
        }
        if let Some(place) = self.0.get_mut(slot) {
            *place = value;
        }
        PropertyAccessResult::Set
    }
}

fn read_binary(
    source: &mut Source,
    header: &PlyHeader,
    columns: &Columns,
    mut rows: Rows,
    read: impl Fn(&mut Source, &ElementDef) -> ply_rs::parser::Result<Row>,
) -> Result<Points, Malformed> {
    let mut row = |element: &PlyElement, definition: &ElementDef, index: usize| {
        read(source, definition).map_err(|error| {
            // Its causes follow on lines of their own.
            let error = error.to_string().replace("\n\t", " ");
            Malformed::file(format!("{} {index} of {}: {error}", quoted(&element.name), element.count))
        })
    };
    // Rows without properties have no bytes, so any number of them passes the size check: do not loop over them.
    for element in header.before.iter().filter(|e| !e.properties.is_empty()) {
        let definition = definition(element, &[]);
        for index in 0..element.count {
            row(element, &definition, index)?;
        }
    }
    let definition = definition(&header.vertex, &columns.slots);
    for index in 0..header.vertex.count {
        let Row(values) = row(&header.vertex, &definition, index)?;
        rows.push(&values).map_err(|problem| Malformed::point(index, problem))?;
    }
    rows.finish()
}

/// Rows are lines; blank ones are passed over. ply-rs does not read `.5`, `1.` or `nan`, so the numbers are parsed here.
fn read_ascii(source: &mut Source, header: &PlyHeader, columns: &Columns, mut rows: Rows) -> Result<Points, Malformed> {
    let mut lines = Lines::new(source)?;
    for element in header.before.iter().filter(|e| !e.properties.is_empty()) {
        for index in 0..element.count {
            advance(&mut lines, element, index)?;
        }
    }
    let mut row = Vec::new();
    let mut values = Vec::new();
    for index in 0..header.vertex.count {
        advance(&mut lines, &header.vertex, index)?;
        let at = |problem: String| Malformed::line(header.lines + lines.number(), problem);
        ascii_row(&lines.text(), &header.vertex, &mut row).map_err(at)?;
        values.clear();
        values.extend(columns.slots.iter().filter_map(|slot| row.get(*slot)));
        rows.push(&values).map_err(at)?;
    }
    rows.finish()
}

/// Goes to the line of the next row.
fn advance(lines: &mut Lines, element: &PlyElement, index: usize) -> Result<(), Malformed> {
    while lines.advance()? {
        if !lines.text().trim().is_empty() {
            return Ok(());
        }
    }
    let (count, name) = (element.count, quoted(&element.name));
    Err(Malformed::file(format!("the file ends after {index} of {count} rows of {name}: it is cut short")))
}

/// The numbers of a line by property; a list counts as one, and its entries are passed over.
fn ascii_row(line: &str, element: &PlyElement, row: &mut Vec<f64>) -> Result<(), String> {
    row.clear();
    let mut fields = line.split_whitespace();
    for (name, data_type) in &element.properties {
        let field = fields.next().ok_or_else(|| format!("the row ends before its property {}", quoted(name)))?;
        let value: f64 = field.parse().map_err(|_| format!("{} is not a number", quoted(field)))?;
        if let PropertyType::List(..) = data_type {
            let length: usize = field.parse().map_err(|_| format!("{} is not the length of a list", quoted(field)))?;
            for _ in 0..length {
                fields.next().ok_or_else(|| format!("a list of {length} entries is cut short"))?;
            }
        }
        row.push(value);
    }
    match fields.next() {
        Some(extra) => Err(format!("{} is left over: the header declares fewer numbers per row", quoted(extra))),
        None => Ok(()),
    }
}
