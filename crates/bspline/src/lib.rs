//! Tensor-product B-spline functions in two and three dimensions.
//!
//! The functions of this crate are those of equation (1) of the paper,
//!
//! ```text
//! f(x, y, z) = Σ c_rst M_r(x) N_s(y) O_t(z),
//! ```
//!
//! over any non-decreasing knot vectors of degree 1 to 5, for `D` = 2 or 3 axes. The crate evaluates them (value,
//! gradient, Hessian) at points and on lattices, refines them exactly, bounds them per cell, and gives the quadratic
//! form of their thin-plate energy, equation (3).
//!
//! [`HierarchicalSpline`] adds finer levels to a uniform cubic spline where they are needed, so that its cost grows with the area of
//! a surface and not with the volume around it; [`HierarchicalSpline::crossed_cells`] finds where the zero set can be, at that
//! cost too. [`Implicit`] is what both have in common.
//!
//! ```
//! use ndarray::ArrayD;
//! use zeroset_bspline::{KnotVector, Spline};
//!
//! // Cubic in x and y, 8 × 8 cells of side 0.25 over [-1, 1]².
//! let knots = KnotVector::uniform(3, -1.0, 0.25, 8)?;
//! // The control coefficients of x² + y² − ½: products of the blossom of x² at each basis function's inner knots.
//! let square = |knots: &KnotVector, r: usize| {
//!     let t = &knots.knots()[r + 1..r + 4];
//!     (t[0] * t[1] + t[1] * t[2] + t[0] * t[2]) / 3.0
//! };
//! let coefficients = ArrayD::from_shape_fn(vec![11, 11], |i| square(&knots, i[0]) + square(&knots, i[1]) - 0.5);
//! let f = Spline::new([knots.clone(), knots], coefficients)?;
//!
//! let jet = f.jet(&[0.3, -0.6]);
//! assert!((jet.value - (0.09 + 0.36 - 0.5)).abs() < 1e-14);
//! assert!((jet.gradient[0] - 0.6).abs() < 1e-14);
//! assert!((jet.hessian[1][1] - 2.0).abs() < 1e-13);
//! assert!(f.value(&[1.5, 0.0]).is_nan(), "outside its box a spline has no value");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! ```
//! use std::sync::Arc;
//! use zeroset_bspline::{CellBand, HierarchicalSpline, KnotVector, Spline};
//!
//! let knots = KnotVector::uniform(3, 0.0, 0.25, 8)?;
//! let root = Spline::from_flat([knots.clone(), knots], vec![1.0; 11 * 11])?;
//! // Cells of a fourth of the side around one point.
//! let band = CellBand::new(root.knots(), &[[0.7, 1.2]], &[2], [3, 3])?;
//! let mut f = HierarchicalSpline::new(root)?;
//! for active in band.active() {
//!     f.push_level(Arc::clone(active))?;
//!     f.correct_finest(vec![1.0; active.len()])?;
//! }
//! assert!((f.value(&[0.7, 1.2]) - 3.0).abs() < 1e-14, "all functions that act here are active");
//! assert!((f.value(&[1.9, 0.1]) - 1.0).abs() < 1e-14, "further away nothing has changed");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** Evaluation is exact up to rounding; refinement and knot insertion change the representation and not
//! the function; the energy is integrated exactly; a cell that [`HierarchicalSpline::crossed_cells`] leaves out has one sign,
//! at its corners also as rounded; parallel results do not depend on the number of threads.
//!
//! **Not here.** Rational splines, extrapolation (outside the box the value is NaN, and counted), and fitting, which is
//! the work of the crates above.
//!
//! **Conventions.** Axes come in the order x, y\[, z\], arrays are in C order (last axis fastest), and the sign of an
//! implicit function is negative inside.

mod basis;
mod block_field;
mod block_mask;
mod bounds;
mod cell_band;
mod coefficient_window;
mod collocation;
mod critical_points;
mod crossed_cells;
mod dilation;
mod edge_cubic;
mod energy;
mod evaluation;
mod gauss_legendre;
mod graded_cells;
mod gram;
mod hierarchical_evaluation;
mod hierarchical_spline;
mod implicit;
mod index_set;
mod knot_vector;
mod lattice;
mod leaf_cells;
mod local;
mod refinement;
mod spline;
mod tensor;
mod two_scale;

pub use basis::{Basis, MAX_DERIVATIVE, cubic_cardinals};
pub use block_field::BlockField;
pub use bounds::CellBounds;
pub use cell_band::{BandError, CellBand, levels_for_spacing};
pub use collocation::{Collocation, CollocationError};
pub use critical_points::CriticalPoint;
pub use crossed_cells::CrossedCells;
pub use edge_cubic::EdgeCubic;
pub use energy::{DerivativeEnergy, EnergyError};
pub use evaluation::{Derivatives, Evaluation};
pub use graded_cells::{Grading, graded_halving};
pub use gram::BandedMatrix;
pub use hierarchical_spline::{HierarchicalSpline, HierarchyError, Level};
pub use implicit::Implicit;
pub use index_set::IndexSet;
pub use knot_vector::{KnotError, KnotVector, MAX_DEGREE};
pub use lattice::AxisCollocation;
pub use leaf_cells::LeafCell;
pub use refinement::{Refinement, RefinementError};
pub use spline::{Jet, Spline, SplineError};
pub use tensor::apply_along;
