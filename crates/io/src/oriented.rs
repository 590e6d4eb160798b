//! Points with outward normals and confidence: `.ply`.

use std::path::Path;

use crate::attributes::{Attribute, NumberKind};
use crate::extension::{ORIENTED_EXTENSIONS, extension_among};
use crate::ply_writer::{self, Vertex};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// Writes the points (data units), their outward unit normals and a confidence in \[0, 1\] each, as a binary little-endian PLY
/// with the properties x y z (double), nx ny nz confidence (float), outlier (uchar, 1 for points that lie on no part of the
/// surface). In the plane z and nz are 0.
///
/// # Errors
/// [`WriteError`]; lengths that differ are refused, and the file at `path` is replaced only when everything was written.
pub fn write_oriented<const D: usize>(
    path: impl AsRef<Path>,
    points: &[[f64; D]],
    normals: &[[f64; D]],
    confidence: &[f64],
    outlier: &[bool],
) -> Result<(), WriteError> {
    const { assert!(D == 2 || D == 3, "points lie in the plane or in space") }
    let path = path.as_ref();
    extension_among(path, ORIENTED_EXTENSIONS)?;
    let n = points.len();
    if normals.len() != n || confidence.len() != n || outlier.len() != n {
        let (normals, confidence, outlier) = (normals.len(), confidence.len(), outlier.len());
        let problem = format!("{n} points, {normals} normals, {confidence} confidences and {outlier} outlier flags");
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    let values = outlier.iter().map(|outlier| f64::from(u8::from(*outlier))).collect();
    let outlier = [Attribute { name: "outlier".into(), kind: NumberKind::U8, values }];
    let oriented = points.iter().zip(normals).zip(confidence).enumerate();
    let vertices = oriented.map(|(index, ((point, normal), confidence))| Vertex {
        position: in_space(point),
        normal: Some(in_space(normal)),
        confidence: Some(*confidence),
        attributes: &outlier,
        index,
        ..Vertex::default()
    });
    replace_file(path, |out| ply_writer::write(out, vertices, None))
}

fn in_space<const D: usize>(point: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|axis| point.get(axis).copied().unwrap_or(0.0))
}
