//! Triangle meshes from `.ply` and `.npz` files.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use ndarray::{Array2, Ix2, OwnedRepr};
use ndarray_npy::{NpzReader, ReadableElement};
use ply_rs::parser::Parser;
use ply_rs::ply::{Property, PropertyAccess, PropertyAccessResult};

/// Corners in counter-clockwise order seen from outside.
pub type Triangle = [[f64; 3]; 3];

/// Reads the triangles of a mesh; polygons of a `.ply` file are cut into fans.
pub fn read(path: &Path) -> Result<Vec<Triangle>> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let read = match extension.to_str() {
        Some("ply") => ply,
        Some("npz") => npz,
        _ => bail!("meshes are read from .ply and .npz files"),
    };
    let (vertices, polygons) = read(File::open(path).context("cannot be read")?)?;
    if let Some(index) = vertices.iter().position(|vertex| vertex.iter().any(|c| !c.is_finite())) {
        bail!("vertex {index} is at {:?}", vertices[index]);
    }
    let corner = |polygon: usize, index: i64| {
        let vertex = usize::try_from(index).ok().and_then(|index| vertices.get(index));
        vertex
            .copied()
            .with_context(|| format!("face {polygon} names vertex {index}, but there are {}", vertices.len()))
    };
    let mut triangles = Vec::with_capacity(polygons.len());
    for (index, polygon) in polygons.iter().enumerate() {
        let &[first, ref rest @ ..] = polygon.as_slice() else { continue };
        for pair in rest.windows(2) {
            triangles.push([corner(index, first)?, corner(index, pair[0])?, corner(index, pair[1])?]);
        }
    }
    Ok(triangles)
}

/// Vertices, and the vertices of each polygon.
type Polygons = (Vec<[f64; 3]>, Vec<Vec<i64>>);

/// A row of any element: a vertex has a position, a face has corners.
struct Row {
    position: [f64; 3],
    corners: Vec<i64>,
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self { position: [f64::NAN; 3], corners: vec![] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            self.position[axis] = match property {
                Property::Float(value) => value.into(),
                Property::Double(value) => value,
                _ => return PropertyAccessResult::UnsupportedType,
            };
        } else if matches!(name, "vertex_indices" | "vertex_index") {
            self.corners = match property {
                Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
                Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
                Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
                _ => return PropertyAccessResult::UnsupportedType,
            };
        } else {
            return PropertyAccessResult::Ignored;
        }
        PropertyAccessResult::Set
    }
}

fn ply(file: File) -> Result<Polygons> {
    let mut ply = Parser::<Row>::new().read_ply(&mut BufReader::new(file)).context("not a PLY file")?;
    let mut rows = |name: &str| ply.payload.swap_remove(name).ok_or_else(|| anyhow!("there is no element {name:?}"));
    let vertices = rows("vertex")?.into_iter().map(|row| row.position).collect();
    let polygons = rows("face")?.into_iter().map(|row| row.corners).collect();
    Ok((vertices, polygons))
}

fn npz(file: File) -> Result<Polygons> {
    let mut archive = NpzReader::new(BufReader::new(file)).context("not an .npz archive")?;
    let names = archive.names()?;
    let named = |wanted: [&'static str; 2]| {
        wanted
            .into_iter()
            .find(|wanted| names.iter().any(|name| name.strip_suffix(".npy").unwrap_or(name) == *wanted))
            .ok_or_else(|| anyhow!("the archive has no array {:?} or {:?}, only {names:?}", wanted[0], wanted[1]))
    };
    let (vertices, faces) = (named(["verts", "vertices"])?, named(["faces", "triangles"])?);
    let vertices = match three_columns::<f32>(&mut archive, vertices) {
        Ok(array) => array.mapv(f64::from),
        Err(_) => three_columns::<f64>(&mut archive, vertices).context("n × 3 floats are needed")?,
    };
    let faces = match three_columns::<i32>(&mut archive, faces) {
        Ok(array) => array.mapv(i64::from),
        Err(_) => three_columns::<i64>(&mut archive, faces).context("m × 3 signed integers are needed")?,
    };
    let vertices = vertices.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
    Ok((vertices, faces.rows().into_iter().map(|row| row.to_vec()).collect()))
}

fn three_columns<T: ReadableElement>(archive: &mut NpzReader<BufReader<File>>, name: &str) -> Result<Array2<T>> {
    let array = archive.by_name::<OwnedRepr<T>, Ix2>(name).with_context(|| name.to_owned())?;
    if array.ncols() != 3 {
        bail!("{name} has {} columns", array.ncols());
    }
    Ok(array)
}
