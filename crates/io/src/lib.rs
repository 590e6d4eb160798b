//! Reads point sets and writes what a reconstruction makes of them: meshes, curves, splines, fields, tables, pictures and reports.
//!
//! The crate takes and gives plain data and knows nothing of the mathematics. The format follows a path's extension.
//!
//! ```
//! use zeroset_io::{Points, SplineFile, read_points, read_spline, write_spline};
//! let folder = tempfile::tempdir()?;
//!
//! let path = folder.path().join("corner.xy");
//! std::fs::write(&path, "# a triangle\n0 0\n1, 0\n0; 1\n")?;
//! let Points::Two(set) = read_points(&path)? else { panic!("two columns are points in the plane") };
//! assert_eq!(set.points, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
//!
//! let knots = vec![0.0, 0.0, 1.0, 1.0];
//! let coefficients = ndarray::array![[0.0, 1.0], [1.0, 2.0]].into_dyn(); // x + y on the unit square
//! let spline = SplineFile::new(vec![0.0, 0.0], vec![knots.clone(), knots], 1, coefficients)?;
//! write_spline(folder.path().join("plane.npz"), &spline)?;
//! assert_eq!(read_spline(folder.path().join("plane.npz"))?, spline);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Guaranteed: numbers in f64 come back bit for bit through `.ply`, `.npy`, `.npz` and all text formats; no input makes a reader
//! panic or allocate more than a small multiple of the file's size (for `.npz` of its unpacked size, which is bounded); NaN and
//! infinity are refused at the door, with the place; a write that fails leaves the old file; the same data give the same bytes.
//!
//! Not guaranteed: colours and other properties of points are read from `.ply` and from text with a header line only; in an OBJ file only `v` lines are read; EXR images,
//! `.glb` and binary `.stl` files and the normals of meshes hold 32-bit floats.

// What comes in from outside passes through here: an index that is not there must not end in a panic.
#![warn(clippy::indexing_slicing)]

mod attributes;
mod axis_by_axis;
mod curve;
mod extension;
mod field;
mod mesh;
mod npy;
mod npz;
mod oriented;
mod picture;
mod ply_cloud;
mod ply_writer;
mod points;
mod read_error;
mod replace_file;
mod report;
mod spline;
mod table;
mod write_error;

pub use attributes::{Attribute, NumberKind, colour_columns, colour_range};
pub use curve::{Curves, write_curves};
pub use extension::{
    CURVE_EXTENSIONS, FIELD_EXTENSIONS, MESH_EXTENSIONS, ORIENTED_EXTENSIONS, OutputKind, PICTURE_EXTENSIONS,
    POINT_EXTENSIONS, REPORT_EXTENSIONS, SPLINE_EXTENSIONS, TABLE_EXTENSIONS, UnknownExtension, extension_among,
};
pub use field::{Field, write_field};
pub use mesh::{TriMesh, write_mesh};
pub use oriented::write_oriented;
pub use picture::{Picture, encode_png, write_picture};
pub use ply_cloud::write_points;
pub use points::format::{PointFormat, parse_points};
pub use points::selection::Plane;
pub use points::{Dimension, PointSet, Points, read_points, read_points_as};
pub use read_error::{Malformed, Place, ReadError};
pub use replace_file::{abandon_writes, check_writable};
pub use report::{write_page, write_report};
pub use spline::level::SplineLevel;
pub use spline::{SPLINE_VERSION, SplineFile, parse_spline, read_spline, write_spline};
pub use table::{EvaluationTable, write_table};
pub use write_error::WriteError;
