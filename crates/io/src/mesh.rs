//! Triangle meshes: `.ply` and `.obj`.

use std::io::{self, Write};
use std::path::Path;

use crate::extension::{MESH_EXTENSIONS, extension_among};
use crate::ply_writer::{self, Vertex};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// A triangle mesh, borrowed from whoever made it.
#[derive(Debug, Clone, Copy)]
pub struct TriMesh<'a> {
    /// Vertices x, y, z in data units, `N × 3`.
    pub vertices: &'a [[f64; 3]],
    /// Outward unit normals at the vertices, `N × 3`; empty where there are none.
    pub normals: &'a [[f64; 3]],
    /// Corner indices from 0, counter-clockwise seen from outside, `M × 3`.
    pub triangles: &'a [[u32; 3]],
}

impl TriMesh<'_> {
    fn problem(&self) -> Option<String> {
        let n = self.vertices.len();
        if n > i32::MAX as usize {
            return Some(format!("{n} vertices are more than the format's 32-bit indices reach"));
        }
        if !self.normals.is_empty() && self.normals.len() != n {
            return Some(format!("{n} vertices but {} normals", self.normals.len()));
        }
        let corner = self.triangles.iter().flatten().find(|corner| **corner as usize >= n)?;
        Some(format!("a triangle names vertex {corner}, but there are {n}"))
    }
}

/// Writes a mesh as `.ply` (binary little endian; coordinates double, normals float) or `.obj` (shortest decimals that read back
/// to the same f64).
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_mesh(path: impl AsRef<Path>, mesh: &TriMesh<'_>) -> Result<(), WriteError> {
    let path = path.as_ref();
    let extension = extension_among(path, MESH_EXTENSIONS)?;
    if let Some(problem) = mesh.problem() {
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    replace_file(path, |out| match extension {
        "ply" => {
            let vertices = mesh.vertices.iter().enumerate().map(|(i, &position)| Vertex {
                position,
                normal: mesh.normals.get(i).copied(),
                confidence: None,
            });
            ply_writer::write(out, vertices, Some(mesh.triangles))
        }
        _ => write_obj(out, mesh),
    })
}

fn write_obj(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    writeln!(out, "# zeroset {}", env!("CARGO_PKG_VERSION"))?;
    for [x, y, z] in mesh.vertices {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for [x, y, z] in mesh.normals {
        writeln!(out, "vn {:?} {:?} {:?}", *x as f32, *y as f32, *z as f32)?;
    }
    for t in mesh.triangles {
        let [a, b, c] = t.map(|corner| u64::from(corner) + 1);
        if mesh.normals.is_empty() {
            writeln!(out, "f {a} {b} {c}")?;
        } else {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    Ok(())
}
