//! Triangle meshes as STL.

use std::io::{self, Write};

use crate::axis_by_axis::axis_by_axis;
use crate::mesh::TriMesh;

/// The most, as a share of the longest side, by which rounding to 32-bit floats may move a corner.
const LARGEST_SHIFT: f64 = 1e-5;

/// Writes a binary file. Its 32-bit floats have no origin of their own, so where they would move a corner visibly, as far from 0
/// they do, an ascii file with full decimals takes its place.
pub(crate) fn write(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    let corners = || mesh.vertices.iter().flatten();
    let shift = corners().map(|&c| (f64::from(c as f32) - c).abs()).fold(0.0, f64::max);
    let bound = |start, pick: fn(f64, f64) -> f64| {
        mesh.vertices.iter().fold([start; 3], |bound, v| axis_by_axis(bound, *v, pick))
    };
    let (low, high) = (bound(f64::INFINITY, f64::min), bound(f64::NEG_INFINITY, f64::max));
    let sides = axis_by_axis(high, low, |high, low| high - low);
    if shift <= LARGEST_SHIFT * sides.into_iter().fold(0.0, f64::max) {
        write_binary(out, mesh)
    } else {
        write_ascii(out, mesh)
    }
}

fn write_binary(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    let count = u32::try_from(mesh.triangles.len()).map_err(io::Error::other)?;
    // Not "solid": that is how ascii files begin.
    let mut title = format!("zeroset {}: binary STL", env!("CARGO_PKG_VERSION")).into_bytes();
    title.resize(80, b' ');
    out.write_all(&title)?;
    out.write_all(&count.to_le_bytes())?;
    for (normal, corners) in facets(mesh) {
        for number in [normal].iter().chain(&corners).flatten() {
            out.write_all(&(*number as f32).to_le_bytes())?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}

fn write_ascii(out: &mut impl Write, mesh: &TriMesh<'_>) -> io::Result<()> {
    writeln!(out, "solid zeroset")?;
    for ([nx, ny, nz], corners) in facets(mesh) {
        writeln!(out, "facet normal {:?} {:?} {:?}\n outer loop", nx as f32, ny as f32, nz as f32)?;
        for [x, y, z] in corners {
            writeln!(out, "  vertex {x:?} {y:?} {z:?}")?;
        }
        writeln!(out, " endloop\nendfacet")?;
    }
    writeln!(out, "endsolid zeroset")
}

/// The unit normal and the corners of each triangle; the normal is 0 where a triangle has no area.
#[expect(clippy::indexing_slicing, reason = "meshes with corners that are no vertices were refused before")]
fn facets(mesh: &TriMesh<'_>) -> impl Iterator<Item = ([f64; 3], [[f64; 3]; 3])> {
    mesh.triangles.iter().map(|triangle| {
        let corners = triangle.map(|corner| mesh.vertices[corner as usize]);
        (normal(&corners), corners)
    })
}

fn normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| axis_by_axis(*p, *a, |p, a| p - a));
    // Scaled first, so that products neither overflow nor vanish.
    let scale = u.iter().chain(&v).fold(0.0, |largest: f64, c| largest.max(c.abs()));
    let [u, v] = [u, v].map(|w| w.map(|c| c / scale));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 { cross.map(|c| c / length) } else { [0.0; 3] }
}
