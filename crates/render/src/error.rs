//! What can go wrong.

use thiserror::Error;

/// Why there is no picture.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// Neither triangles nor points, or no view of them.
    #[error("there is nothing to draw: no triangles, and no points")]
    Empty,
    /// The picture would have no pixels, or too many.
    #[error(
        "a picture of {width} x {height} pixels is not possible: sides of 1 to {most_side}, and at most {most} in all"
    )]
    Size {
        /// Pixels along a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Longest side.
        most_side: usize,
        /// Most pixels.
        most: usize,
    },
    /// A triangle names a vertex that there is not.
    #[error("a triangle names vertex {corner}, but there are {vertices}")]
    Corner {
        /// The number that it names, from 0.
        corner: u32,
        /// Vertices there are.
        vertices: usize,
    },
    /// Not one normal per vertex.
    #[error("{normals} normals were given for {vertices} vertices: one each, or none at all")]
    Normals {
        /// Normals given.
        normals: usize,
        /// Vertices there are.
        vertices: usize,
    },
    /// A coordinate is NaN or infinite, or so large that extents are.
    #[error("a coordinate or the extent of the {what} is not a finite number")]
    NotFinite {
        /// `vertices`, `points` and so on.
        what: &'static str,
    },
    /// A view from no direction.
    #[error("a view from direction {0:?} is not possible: a finite direction is needed that is not zero")]
    Direction([f64; 3]),
}
