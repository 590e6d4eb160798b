//! The zero set of a function as a closed manifold mesh (3D) or closed polylines (2D).
//!
//! The function is sampled on a lattice; its topology there is that of the multilinear interpolant, with ambiguous faces and
//! cell interiors decided (what MC33 aims at: Chernyaev 1995, Lewiner et al. 2003), and its vertices are then moved onto the
//! function's own zero set.
//!
//! ```
//! use ndarray::ArrayD;
//! use zeroset_isosurface::{ImplicitFunction, LatticeSamples, Options, surface};
//!
//! struct Ball;
//! impl ImplicitFunction<3> for Ball {
//!     fn value_and_gradient(&self, x: &[f64; 3]) -> (f64, [f64; 3]) {
//!         let r = x.iter().map(|x| x * x).sum::<f64>().sqrt();
//!         (r - 1.0, x.map(|x| x / r))
//!     }
//! }
//!
//! let axis: Vec<f64> = (0..24).map(|i| -1.15 + 0.1 * f64::from(i)).collect();
//! let axes = [axis.clone(), axis.clone(), axis];
//! let samples = LatticeSamples::of(axes, &Ball)?;
//! let (mesh, _) = surface(&samples, Some(&Ball), &Options::default())?;
//!
//! let topology = mesh.topology();
//! assert!(topology.closed && topology.genus == 0 && topology.components == 1);
//! assert!((mesh.enclosed_volume() - 4.0 / 3.0 * std::f64::consts::PI).abs() < 0.02, "outward, so positive");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A spline with levels has cells of many sizes. It is sampled on one lattice, the finest ([`surface_of`]), or on several, where its own
//! cells are larger ([`graded_surface_of`]), but only in cells that the spline's bounds do not rule out:
//!
//! ```
//! use ndarray::ArrayD;
//! use zeroset_bspline::{HierarchicalSpline, KnotVector, Spline};
//! use zeroset_isosurface::{LatticeSamples, Options, surface_of};
//!
//! let knots = KnotVector::uniform(3, -1.2, 0.15, 16)?;
//! let at = |k: usize| -1.2 + 0.15 * (k as f64 - 1.0);
//! let distance = |i: ndarray::IxDyn| at(i[0]).hypot(at(i[1])).hypot(at(i[2])) - 1.0;
//! let root = Spline::new([knots.clone(), knots.clone(), knots], ArrayD::from_shape_fn(vec![19; 3], distance))?;
//! let f = HierarchicalSpline::new(root)?;
//! // Cells halved three times: 128 along each side, of which less than a tenth are looked at.
//! let (mesh, report) = surface_of(&f, 3, &Options::default())?;
//! assert!(mesh.topology().closed && report.cells > 50_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Sign.** f < 0 inside, f ≥ 0 outside; triangles are counter-clockwise seen from outside, and polylines have the inside
//! on their left.
//!
//! **Guaranteed.**
//!
//! * Closed, 2-manifold, oriented, for any samples: ambiguous faces are decided alike from both sides to the last bit, and no
//!   cell draws a chord on a face that its neighbour could draw too.
//! * The topology of the multilinear interpolant of the samples, tunnels included; exact arithmetic aside, no case is
//!   guessed. [`Report::unclear`] counts the cells where rounding left a contradiction.
//! * With a function, vertices on f = 0 to [`Options::tolerance`], as [`Report::unreached`] confirms. They keep a millionth
//!   of an edge away from the nodes, so that none fall together.
//! * Where the zero set would leave the lattice it is capped a thousandth of a cell outside, and [`Report::capped`] says so.
//! * [`surface_of`], [`curve_of`] and [`LatticeSamples::crossed`] leave out no cell that the zero set on the whole lattice
//!   passes through: the mesh is closed, and the whole lattice's up to rounding, at a cost that grows with its area.
//! * The mesh of [`graded_surface_of`] is closed too. Its topology is that of the multilinear interpolants in the cells and, on faces between
//!   two sizes, of the smaller ones'; every loop on a larger cell with other loops than its own corners show bounds a disc.
//! * The same bytes for any number of threads.
//!
//! A mesh or curves can be cut: [`TriMesh::clipped`] and [`Curves::clipped`] keep the part where a function of the vertices
//! is not positive, with a clean boundary; a manifold stays one.
//!
//! **Not guaranteed.**
//!
//! * Features thinner than a cell, between nodes of one sign, are missed: the samples do not show them.
//! * Triangles may be slivers, where the zero set passes close to a node.
//! * A mesh may touch or cross itself within a cell where several sheets or a tunnel share it, though it is connected as it
//!   should be.

mod cell;
mod cell_mesh;
mod clip;
mod curve;
mod error;
mod function;
mod interior;
mod mesh;
mod options;
mod polylines;
mod regions;
mod root;
mod runs;
mod samples;
mod seam;
mod surface;
mod union_find;

pub use curve::{curve, curve_of};
pub use error::Error;
pub use function::ImplicitFunction;
pub use mesh::{Topology, TriMesh};
pub use options::{Options, Report};
pub use polylines::{CurveTopology, Curves};
pub use regions::{Region, Rim};
pub use samples::LatticeSamples;
pub use surface::{graded_surface_of, surface, surface_of};
