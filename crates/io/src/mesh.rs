//! Triangle meshes: `.ply`, `.obj`, `.stl` and `.glb`.

mod glb;
mod obj;
mod stl;

use std::path::Path;

use crate::attributes::{Attribute, colour_columns};
use crate::extension::{MESH_EXTENSIONS, extension_among};
use crate::ply_writer::{self, Vertex};
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// A triangle mesh, borrowed from whoever made it.
#[derive(Debug, Clone, Copy, Default)]
pub struct TriMesh<'a> {
    /// Vertices x, y, z in data units, `N × 3`.
    pub vertices: &'a [[f64; 3]],
    /// Outward unit normals at the vertices, `N × 3`; empty where there are none.
    pub normals: &'a [[f64; 3]],
    /// Corner indices from 0, counter-clockwise seen from outside, `M × 3`.
    pub triangles: &'a [[u32; 3]],
    /// Colours of the vertices: red, green, blue as sRGB bytes, `N × 3`; empty where there are none.
    pub colours: &'a [[u8; 3]],
    /// Distance of each vertex from the nearest sample, in data units; empty where it is not known.
    pub support: &'a [f64],
    /// What else is known of the vertices. Where colours are among it, they are written in place of those above; otherwise one that
    /// has the name of something above, such as `support`, gives way to it.
    pub attributes: &'a [Attribute],
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
        if !self.colours.is_empty() && self.colours.len() != n {
            return Some(format!("{n} vertices but {} colours", self.colours.len()));
        }
        if !self.support.is_empty() && self.support.len() != n {
            return Some(format!("{n} vertices but {} distances from the samples", self.support.len()));
        }
        if let Some(other) = self.attributes.iter().find(|a| a.values.len() != n) {
            return Some(format!("{n} vertices but {} values of {:?}", other.values.len(), other.name));
        }
        if let Some((bad, vertex)) = self.vertices.iter().enumerate().find(|(_, v)| v.iter().any(|c| !c.is_finite())) {
            return Some(format!("vertex {bad} is at {vertex:?}"));
        }
        let corner = self.triangles.iter().flatten().find(|corner| **corner as usize >= n)?;
        Some(format!("a triangle names vertex {corner}, but there are {n}"))
    }
}

/// Writes a mesh as `.ply` (binary little endian; coordinates double, normals and support float,
/// attributes as their kind says; the only format that holds these two), `.obj` (shortest decimals that read back to
/// the same f64), `.stl` (binary; ascii where 32-bit floats would move a corner by more than 1e-5 of the longest side) or `.glb`
/// (binary glTF; 32-bit floats relative to the centre of the bounding box).
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_mesh(path: impl AsRef<Path>, mesh: &TriMesh<'_>) -> Result<(), WriteError> {
    let path = path.as_ref();
    let extension = extension_among(path, MESH_EXTENSIONS)?;
    let problem = mesh.problem().or_else(|| if extension == "glb" { glb::problem(mesh) } else { None });
    if let Some(problem) = problem {
        return Err(WriteError::Invalid { path: path.to_owned(), problem });
    }
    replace_file(path, |out| match extension {
        "obj" => obj::write(out, mesh),
        "stl" => stl::write(out, mesh),
        "glb" => glb::write(out, mesh),
        _ => {
            // The colours' own columns say more than bytes.
            let colours = if colour_columns(mesh.attributes).is_some() { &[] } else { mesh.colours };
            let vertices = mesh.vertices.iter().enumerate().map(|(i, &position)| Vertex {
                position,
                normal: mesh.normals.get(i).copied(),
                colour: colours.get(i).copied(),
                support: mesh.support.get(i).copied(),
                attributes: mesh.attributes,
                index: i,
                ..Vertex::default()
            });
            ply_writer::write(out, vertices, Some(mesh.triangles))
        }
    })
}
