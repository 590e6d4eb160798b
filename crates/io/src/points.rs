//! Point sets, and reading them from any of the formats.

mod columns;
#[cfg(feature = "e57")]
mod e57;
pub(crate) mod format;
#[cfg(feature = "las")]
mod las;
mod lines;
mod npy;
mod obj;
mod ply;
#[cfg(any(feature = "las", feature = "e57"))]
mod refuse_panic;
pub(crate) mod selection;
#[cfg(test)]
mod short_reads;
mod source;
mod stl;
mod text;

use std::collections::HashSet;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use crate::attributes::{Attribute, NumberKind, is_geometry};
use crate::points::format::{PointFormat, read_source};
use crate::points::source::{ReadSeek, Source};
use crate::read_error::{Malformed, ReadError};

/// Points in the plane or in space, as the file tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Points {
    /// Two coordinates per point: a curve is wanted.
    Two(PointSet<2>),
    /// Three coordinates per point: a surface is wanted.
    Three(PointSet<3>),
}

/// `N ≥ 1` points in the file's own units and order, all finite.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSet<const D: usize> {
    /// The coordinates x, y\[, z\], `N × D`.
    pub points: Vec<[f64; D]>,
    /// The normals nx, ny\[, nz\] as the file has them (of any length and orientation), `N × D`; `None` where it has none.
    pub normals: Option<Vec<[f64; D]>>,
    /// What else the file says of each point in numbers; one with a value that is not finite is left out.
    pub attributes: Vec<Attribute>,
}

/// The dimension of the space that points lie in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// The plane.
    Two,
    /// Space.
    Three,
}

impl Points {
    /// Plane or space.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Two(_) => Dimension::Two,
            Self::Three(_) => Dimension::Three,
        }
    }

    /// The number of points, at least 1 when they were read from a file.
    pub fn len(&self) -> usize {
        match self {
            Self::Two(set) => set.points.len(),
            Self::Three(set) => set.points.len(),
        }
    }

    /// Whether there are no points; never so when they were read from a file.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What else the file says of each point.
    pub fn attributes(&self) -> &[Attribute] {
        match self {
            Self::Two(set) => &set.attributes,
            Self::Three(set) => &set.attributes,
        }
    }

    pub(crate) fn attributes_mut(&mut self) -> &mut [Attribute] {
        match self {
            Self::Two(set) => &mut set.attributes,
            Self::Three(set) => &mut set.attributes,
        }
    }

    /// Whether the file had a normal for each point.
    pub fn has_normals(&self) -> bool {
        match self {
            Self::Two(set) => set.normals.is_some(),
            Self::Three(set) => set.normals.is_some(),
        }
    }
}

/// Reads points; the format follows the extension (any case), one of [`crate::POINT_EXTENSIONS`].
///
/// A regular file is read piece by piece: what is held are the points and some 100 KiB, with the longest line of a text, the largest chunk of a
/// `.laz` file, the XML part of an `.e57` file, and the corners of an `.stl` file once more. What has no size that could be asked for,
/// such as a pipe, is read into memory first: every count is checked against the number of bytes before anything is allocated.
///
/// # Errors
/// [`ReadError`]: unknown extension, folder, unreadable, or malformed with the line, the byte or the point. NaN and infinity are
/// refused, and so is a file without points.
pub fn read_points(path: impl AsRef<Path>) -> Result<Points, ReadError> {
    let path = path.as_ref();
    read_points_as(path, PointFormat::of(path)?)
}

/// Reads points in the given format, whatever the extension is.
///
/// # Errors
/// As [`read_points`].
pub fn read_points_as(path: impl AsRef<Path>, format: PointFormat) -> Result<Points, ReadError> {
    let path = path.as_ref();
    let unreadable = |source| ReadError::Unreadable { path: path.to_owned(), source };
    let mut file = open(path)?;
    let metadata = file.metadata().map_err(unreadable)?;
    let mut spooled;
    // The files of `/proc` are regular ones of no bytes.
    let (bytes, length): (&mut dyn ReadSeek, u64) = if metadata.is_file() && metadata.len() > 0 {
        (&mut file, metadata.len())
    } else {
        let mut all = Vec::new();
        file.read_to_end(&mut all).map_err(unreadable)?;
        let length = all.len() as u64;
        spooled = Cursor::new(all);
        (&mut spooled, length)
    };
    let mut source = Source::new(bytes, length);
    let points = read_source(&mut source, format);
    match source.failure() {
        Some(failure) => Err(unreadable(failure)),
        None => points.map_err(|malformed| ReadError::Malformed { path: path.to_owned(), malformed }),
    }
}

/// The file, or a sentence that says why not.
fn open(path: &Path) -> Result<File, ReadError> {
    if path.is_dir() {
        return Err(ReadError::Folder { path: path.to_owned() });
    }
    File::open(path).map_err(|source| ReadError::Unreadable { path: path.to_owned(), source })
}

/// The bytes of a file.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    let read = open(path)?.read_to_end(&mut bytes);
    read.map_err(|source| ReadError::Unreadable { path: path.to_owned(), source })?;
    Ok(bytes)
}

/// Collects rows of coordinates, followed or not by normals, and refuses what is not finite.
pub(crate) enum Rows {
    Two(PointSet<2>),
    Three(PointSet<3>),
}

impl Rows {
    pub(crate) fn new(dimension: Dimension, with_normals: bool) -> Self {
        Self::with_attributes(dimension, with_normals, Vec::new())
    }

    /// Rows with so many more numbers, which have these names and types.
    pub(crate) fn with_attributes(
        dimension: Dimension,
        with_normals: bool,
        attributes: Vec<(String, NumberKind)>,
    ) -> Self {
        match dimension {
            Dimension::Two => Self::Two(PointSet::empty(with_normals, attributes)),
            Dimension::Three => Self::Three(PointSet::empty(with_normals, attributes)),
        }
    }

    /// Makes room for so many rows: a number that was checked against the bytes that are there.
    pub(crate) fn reserve(&mut self, rows: usize) {
        match self {
            Self::Two(set) => set.reserve(rows),
            Self::Three(set) => set.reserve(rows),
        }
    }

    /// Appends `x y [z]`, when there are normals `nx ny [nz]`, and the attributes from the front of `row`; the error says which
    /// coordinate is not finite.
    pub(crate) fn push(&mut self, row: &[f64]) -> Result<(), String> {
        match self {
            Self::Two(set) => set.push(row),
            Self::Three(set) => set.push(row),
        }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Two(set) => set.points.len(),
            Self::Three(set) => set.points.len(),
        }
    }

    pub(crate) fn finish(self) -> Result<Points, Malformed> {
        if self.len() == 0 {
            return Err(Malformed::file("the file has no points"));
        }
        Ok(match self {
            Self::Two(set) => Points::Two(set.finished()),
            Self::Three(set) => Points::Three(set.finished()),
        })
    }
}

/// Which names, with their positions, are attributes: no coordinates or normals, and of those that are alike the first.
pub(crate) fn attribute_columns<'a>(names: impl Iterator<Item = (usize, &'a str)>) -> Vec<(usize, &'a str)> {
    let mut seen = HashSet::new();
    names.filter(|(_, name)| !is_geometry(name) && seen.insert(name.to_ascii_lowercase())).collect()
}

impl<const D: usize> PointSet<D> {
    fn empty(with_normals: bool, attributes: Vec<(String, NumberKind)>) -> Self {
        let attributes =
            attributes.into_iter().map(|(name, kind)| Attribute { name, kind, values: Vec::new() }).collect();
        Self { points: Vec::new(), normals: with_normals.then(Vec::new), attributes }
    }

    /// Without attributes that miss a value.
    fn finished(mut self) -> Self {
        let count = self.points.len();
        self.attributes.retain(|a| a.values.len() == count && a.values.iter().all(|v| v.is_finite()));
        self
    }

    fn reserve(&mut self, rows: usize) {
        self.points.reserve_exact(rows);
        if let Some(normals) = &mut self.normals {
            normals.reserve_exact(rows);
        }
        for attribute in &mut self.attributes {
            attribute.values.reserve_exact(rows);
        }
    }

    fn push(&mut self, row: &[f64]) -> Result<(), String> {
        const NAMES: [&str; 3] = ["x", "y", "z"];
        let Some((point, rest)) = row.split_first_chunk::<D>() else {
            return Err(format!("{D} coordinates are needed, {} found", row.len()));
        };
        let not_finite = |numbers: &[f64; D]| NAMES.into_iter().zip(*numbers).find(|(_, c)| !c.is_finite());
        if let Some((name, c)) = not_finite(point) {
            return Err(format!("{name} is {}; remove the point or repair it", c.to_string().to_lowercase()));
        }
        let mut rest = rest;
        if let Some(normals) = &mut self.normals {
            let Some((normal, behind)) = rest.split_first_chunk::<D>() else {
                return Err(format!("a normal of {D} components is needed, {} found", rest.len()));
            };
            if let Some((name, c)) = not_finite(normal) {
                return Err(format!("n{name} is {}", c.to_string().to_lowercase()));
            }
            normals.push(*normal);
            rest = behind;
        }
        for (attribute, value) in self.attributes.iter_mut().zip(rest) {
            attribute.values.push(*value);
        }
        self.points.push(*point);
        Ok(())
    }
}
