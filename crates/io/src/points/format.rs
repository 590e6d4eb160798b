//! The formats that points are read from.

use std::io::Cursor;
use std::path::Path;

use crate::extension::{POINT_EXTENSIONS, UnknownExtension, extension_among};
#[cfg(feature = "e57")]
use crate::points::e57;
#[cfg(feature = "las")]
use crate::points::las;
use crate::points::source::Source;
use crate::points::{Dimension, Points, npy, obj, ply, stl, text};
use crate::read_error::Malformed;

/// A format that points are read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PointFormat {
    /// Rows of text of 2 or more columns: `.xyz .txt .csv .asc .pts`.
    Text,
    /// Rows of text of which x and y are read: `.xy`.
    PlaneText,
    /// The vertices of a PLY file: `.ply`.
    Ply,
    /// The vertices of a Wavefront OBJ file: `.obj`.
    Obj,
    /// The corners of the triangles of an STL file, each once: `.stl`.
    Stl,
    /// A NumPy array: `.npy`.
    Npy,
    /// Laser scans, compressed or not: `.las`, `.laz`.
    #[cfg(feature = "las")]
    Las,
    /// The scans of an E57 file, all in its frame: `.e57`.
    #[cfg(feature = "e57")]
    E57,
}

impl PointFormat {
    /// The format that the extension of `path` tells, upper and lower case alike.
    ///
    /// # Errors
    /// [`UnknownExtension`] with the known ones and a close match.
    pub fn of(path: &Path) -> Result<Self, UnknownExtension> {
        let extension = extension_among(path, POINT_EXTENSIONS)?;
        Ok(Self::named(extension).unwrap_or(Self::Text))
    }

    /// The format whose files have this extension (without the dot, lower case), one of [`POINT_EXTENSIONS`].
    ///
    /// ```
    /// use zeroset_io::PointFormat;
    /// assert_eq!(PointFormat::named("csv"), Some(PointFormat::Text));
    /// assert_eq!(PointFormat::named("docx"), None);
    /// ```
    pub fn named(extension: &str) -> Option<Self> {
        Some(match extension {
            "xyz" | "txt" | "csv" | "asc" | "pts" => Self::Text,
            "xy" => Self::PlaneText,
            "ply" => Self::Ply,
            "obj" => Self::Obj,
            "stl" => Self::Stl,
            "npy" => Self::Npy,
            #[cfg(feature = "las")]
            "las" | "laz" => Self::Las,
            #[cfg(feature = "e57")]
            "e57" => Self::E57,
            _ => return None,
        })
    }
}

/// Reads points from the bytes of a whole file: from standard input, say, or an archive.
///
/// # Errors
/// [`Malformed`], as [`crate::read_points`] has it, without a path.
///
/// ```
/// use zeroset_io::{PointFormat, parse_points};
/// let points = parse_points(b"1,5;2\n3;4,5\n", PointFormat::Text)?;
/// assert_eq!(points.len(), 2);
/// # Ok::<(), zeroset_io::Malformed>(())
/// ```
pub fn parse_points(bytes: &[u8], format: PointFormat) -> Result<Points, Malformed> {
    let mut cursor = Cursor::new(bytes);
    read_source(&mut Source::new(&mut cursor, bytes.len() as u64), format)
}

/// Reads points piece by piece.
pub(crate) fn read_source(source: &mut Source, format: PointFormat) -> Result<Points, Malformed> {
    if source.length() == 0 {
        return Err(Malformed::file("the file is empty"));
    }
    match format {
        PointFormat::Text => text::read(source, None),
        PointFormat::PlaneText => text::read(source, Some(Dimension::Two)),
        PointFormat::Ply => ply::read(source),
        PointFormat::Obj => obj::read(source),
        PointFormat::Stl => stl::read(source),
        PointFormat::Npy => npy::read(source),
        #[cfg(feature = "las")]
        PointFormat::Las => las::read(source),
        #[cfg(feature = "e57")]
        PointFormat::E57 => e57::read(source),
    }
}
