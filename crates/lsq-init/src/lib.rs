//! Least-squares B-spline through values on a lattice: the initial shape of equation (15),
//!
//! ```text
//! min Σ (f(X_ijk) − φ(X_ijk))² + w Eng(f).
//! ```
//!
//! The data fill a lattice, so the normal operator is `⊗(CᵀC) + w H` with one small banded collocation matrix C per axis.
//! It is solved by conjugate gradients with fast diagonalisation as the preconditioner.
//!
//! ```
//! use ndarray::ArrayD;
//! use zeroset_bspline::KnotVector;
//! use zeroset_lsq_init::{Fairness, Options, fit};
//!
//! // A signed distance on 21 × 21 nodes, and 10 × 10 cubic cells.
//! let nodes: Vec<f64> = (0..=20).map(|i| -1.0 + 0.1 * f64::from(i)).collect();
//! let phi = ArrayD::from_shape_fn(vec![21, 21], |i| nodes[i[0]].hypot(nodes[i[1]]) - 0.6);
//! let knots = [KnotVector::uniform(3, -1.0, 0.2, 10)?, KnotVector::uniform(3, -1.0, 0.2, 10)?];
//! let options = Options { fairness: Fairness::Length(0.05), ..Options::default() };
//!
//! let (f, report) = fit(phi.view(), &[nodes.clone(), nodes], &knots, &options)?;
//! assert!(f.value(&[0.6, 0.0]).abs() < 0.01);
//! assert!(report.residual <= options.tolerance);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** The minimum to the tolerance asked for; the same bytes for any number of threads.
//!
//! **Not here.** Scattered data, and weights per node.

mod axis_factors;
mod conjugate_gradients;
mod eigenbasis;
mod error;
mod fit;
mod lattice_data;
mod normal_operator;
mod preconditioner;

pub use error::Error;
pub use fit::{Fairness, Options, Report, fit};
