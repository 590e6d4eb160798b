//! Values on a lattice: `.npy`, `.npz`, `.exr` and `.vti`.

mod exr;
mod vti;

use std::io;
use std::path::Path;

use ndarray::{ArrayViewD, aview1};
use ndarray_npy::{NpzWriter, WriteNpyExt};

use crate::extension::{FIELD_EXTENSIONS, extension_among};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// A function's values on the nodes `origin + index · spacing` of a lattice. NaN stands for nodes outside the function's box.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    /// The values, axis order x, y\[, z\].
    pub values: ArrayViewD<'a, f64>,
    /// The node with index 0, data units, `D`.
    pub origin: &'a [f64],
    /// The distance between neighbours along each axis, data units, `D`.
    pub spacing: &'a [f64],
    /// How sure the sides are, from 0 to 1, on the same nodes, where that is known; `.vti` files have it beside the values, the
    /// others do not.
    pub confidence: Option<ArrayViewD<'a, f64>>,
}

impl Field<'_> {
    fn problem(&self) -> Option<String> {
        let d = self.values.ndim();
        if !matches!(d, 2 | 3) || self.origin.len() != d || self.spacing.len() != d {
            let (origin, spacing) = (self.origin.len(), self.spacing.len());
            return Some(format!("a field of {d} axes with an origin of {origin} and a spacing of {spacing} numbers"));
        }
        if let Some(bad) = self.origin.iter().chain(self.spacing).find(|number| !number.is_finite()) {
            return Some(format!("a field with {bad} in its origin or spacing"));
        }
        if self.confidence.as_ref().is_some_and(|confidence| confidence.shape() != self.values.shape()) {
            return Some("a field whose confidence has other nodes".into());
        }
        self.values.is_empty().then(|| "a field without values".into())
    }
}

/// Writes a field as `.npy` (the values), `.npz` (`values`, `origin`, `spacing`), `.exr` (f32; in space one layer per z) or `.vti`
/// (VTK ImageData, f64).
///
/// # Errors
/// [`WriteError`]; shapes that do not fit are refused, and the file at `path` is replaced only when everything was written.
pub fn write_field(path: impl AsRef<Path>, field: &Field<'_>) -> Result<(), WriteError> {
    let path = path.as_ref();
    let extension = extension_among(path, FIELD_EXTENSIONS)?;
    if let Some(problem) = field.problem() {
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    // In standard order, so that NumPy sees C order whatever view was given.
    let values = field.values.as_standard_layout();
    replace_file(path, |out| match extension {
        "npy" => values.write_npy(out).map_err(io::Error::other),
        "npz" => {
            let mut npz = NpzWriter::new(out);
            npz.add_array("values", &values).map_err(io::Error::other)?;
            npz.add_array("origin", &aview1(field.origin)).map_err(io::Error::other)?;
            npz.add_array("spacing", &aview1(field.spacing)).map_err(io::Error::other)?;
            npz.finish().map(drop).map_err(io::Error::other)
        }
        "vti" => vti::write(out, field),
        _ => exr::write(out, field),
    })
}
