//! Curves in the plane: `.json`, `.csv`, `.dxf` and `.svg`.

mod csv;
mod dxf;
mod svg;

use std::io;
use std::path::Path;

use serde::Serialize;

use crate::extension::{CURVE_EXTENSIONS, extension_among};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// Polylines in data units, and the points that they were made from.
#[derive(Debug, Clone, Copy, Default)]
pub struct Curves<'a> {
    /// Each curve runs from its last vertex back to its first, which is not repeated; the inside lies on the left of outer curves.
    pub curves: &'a [Vec<[f64; 2]>],
    /// Open polylines, from their first vertex to their last.
    pub paths: &'a [Vec<[f64; 2]>],
    /// Points to be drawn with the curves (`.svg` only); may be empty.
    pub points: &'a [[f64; 2]],
}

impl<'a> Curves<'a> {
    /// All vertices, of closed and then of open curves.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = &'a [f64; 2]> + use<'a> {
        self.curves.iter().chain(self.paths).flatten()
    }
}

#[derive(Serialize)]
struct CurvesJson<'a> {
    curves: &'a [Vec<[f64; 2]>],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    paths: &'a [Vec<[f64; 2]>],
}

/// Writes curves as `.json`, `{"curves": [[[x, y], …], …]}`, or `.csv`, rows of curve, x, y, both with the first vertex not repeated
/// at the end, and open ones behind `"paths"` in the one, behind the closed ones in the other; as `.dxf`, polylines; or as an `.svg` picture.
///
/// # Errors
/// [`WriteError`]; coordinates that are not finite are refused, and the file at `path` is replaced only when everything was written.
pub fn write_curves(path: impl AsRef<Path>, curves: &Curves<'_>) -> Result<(), WriteError> {
    let path = path.as_ref();
    let extension = extension_among(path, CURVE_EXTENSIONS)?;
    let all = curves.vertices().chain(curves.points).flatten();
    if let Some(bad) = all.copied().find(|c| !c.is_finite()) {
        let problem = format!("a coordinate is {bad}");
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    replace_file(path, |out| match extension {
        "json" => {
            serde_json::to_writer(&mut *out, &CurvesJson { curves: curves.curves, paths: curves.paths })
                .map_err(io::Error::from)?;
            io::Write::write_all(out, b"\n")
        }
        "csv" => csv::write(out, curves),
        "dxf" => dxf::write(out, curves),
        _ => svg::write(out, curves),
    })
}
