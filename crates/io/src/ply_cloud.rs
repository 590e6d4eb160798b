//! Points alone: `.ply`.

use std::path::Path;

use crate::extension::{ORIENTED_EXTENSIONS, extension_among};
use crate::ply_writer::{self, Vertex};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// Writes points x, y, z (data units, `N × 3`) as a binary little-endian PLY of doubles.
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_points(path: impl AsRef<Path>, points: &[[f64; 3]]) -> Result<(), WriteError> {
    let path = path.as_ref();
    extension_among(path, ORIENTED_EXTENSIONS)?;
    let bare = |position: &[f64; 3]| Vertex { position: *position, ..Vertex::default() };
    replace_file(path, |out| ply_writer::write(out, points.iter().map(bare), None))
}
