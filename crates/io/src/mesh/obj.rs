//! Triangle meshes as Wavefront OBJ.

use std::io::{self, Write};

use crate::mesh::TriMesh;

/// Writes `v`, `vn` and `f` lines; colours, as many readers know them, behind the coordinates as numbers from 0 to 1.
pub(crate) fn write(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    writeln!(out, "# zeroset {}", env!("CARGO_PKG_VERSION"))?;
    for (i, [x, y, z]) in mesh.vertices.iter().enumerate() {
        write!(out, "v {x:?} {y:?} {z:?}")?;
        if let Some(colour) = mesh.colours.get(i) {
            // Three digits tell the 256 values apart.
            let [r, g, b] = colour.map(|c| f64::from(c) / 255.0);
            write!(out, " {r:.3} {g:.3} {b:.3}")?;
        }
        writeln!(out)?;
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
