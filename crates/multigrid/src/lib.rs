//! The normal operator of a B-spline fit, `A = Σ ωᵢ qᵢ qᵢᵀ + w H`, and its solvers.
//!
//! Every fit of the paper leads to this operator: equation (7) with `ωᵢ = θᵢ²`, and the quadratic model of section 2.3
//! with rows that also hold derivatives. Here it is assembled as a sparse symmetric matrix and factored by Cholesky's
//! method with a nested-dissection order, which is cheapest up to about 20 000 coefficients in 3D and a few hundred
//! thousand in 2D.
//!
//! ```
//! use zeroset_bspline::{Collocation, DerivativeEnergy, KnotVector};
//! use zeroset_multigrid::NormalEquations;
//!
//! let knots = [KnotVector::uniform(3, 0.0, 0.25, 4)?, KnotVector::uniform(3, 0.0, 0.25, 4)?];
//! let points = [[0.1, 0.2], [0.9, 0.3], [0.5, 0.8], [0.4, 0.1]];
//! let collocation = Collocation::new(&knots, &points)?;
//! let equations = NormalEquations::new(&DerivativeEnergy::thin_plate(&knots)?);
//!
//! let matrix = equations.weighted(&collocation, &[1.0; 4], 1e-3)?;
//! let factor = equations.factor(&matrix)?;
//! let mut right = vec![0.0; equations.size()];
//! collocation.add_values_transposed(&[1.0, 1.0, 1.0, 1.0], &mut right);
//! let f = factor.solve(&right);
//! // The constant one fits all four data without any energy.
//! assert!(f.iter().all(|c| (c - 1.0).abs() < 1e-8));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** The same bytes for any number of threads: the factorisation is sequential.
//!
//! **Not here.** Choosing weights; solving on lattices too fine for a direct factorisation.

mod band_pattern;
mod cell_kernel;
mod cell_points;
mod cholesky;
mod conjugate_gradients;
mod energy_kernel;
mod multigrid;
mod nested_dissection;
mod normal_matrix;
mod normal_operator;
mod scratch;
mod separable_energy;
mod smoother;
mod spectrum;
mod transfer;
mod vectors;

pub use cholesky::{Factor, FactorError};
pub use conjugate_gradients::{SolveOptions, SolveReport};
pub use multigrid::{Multigrid, MultigridError};
pub use normal_matrix::{AssemblyError, NormalEquations, NormalMatrix};
pub use normal_operator::{NormalOperator, OperatorError};
