//! The normal operator of a B-spline fit, `A = Σ ωᵢ qᵢ qᵢᵀ + w H`, and its solvers.
//!
//! Every fit of the paper leads to this operator: equation (7) with `ωᵢ = θᵢ²`, and the quadratic model of section 2.3
//! with rows that also hold derivatives. There are two ways to it.
//!
//! [`Multigrid`] applies the operator without a matrix and solves by conjugate gradients with a V-cycle on nested
//! lattices as preconditioner, on lattices of any size:
//!
//! ```
//! use zeroset_bspline::{Collocation, KnotVector};
//! use zeroset_multigrid::{Multigrid, SolveOptions};
//!
//! // 8 × 8 cells, halved twice.
//! let coarse = [KnotVector::uniform(3, -1.0, 0.25, 8)?, KnotVector::uniform(3, -1.0, 0.25, 8)?];
//! let points: Vec<[f64; 2]> = (0..60).map(|i| 0.105 * f64::from(i)).map(|t| [0.7 * t.cos(), 0.5 * t.sin()]).collect();
//! let solver = Multigrid::new(&coarse, 2, &points, &[1.0; 60], 1e-3)?;
//!
//! // The spline that vanishes on the ellipse nearly, and has gradients away from its centre.
//! let mut right = vec![0.0; solver.size()];
//! let collocation = Collocation::new(solver.knots(), &points)?;
//! collocation.add_gradients_transposed(&points, &mut right);
//! let mut f = vec![0.0; solver.size()];
//! let report = solver.solve(&right, &mut f, &SolveOptions { tolerance: 1e-6, ..SolveOptions::default() });
//! assert!(report.converged && report.iterations < 20);
//! let outwards = |(p, g): (&[f64; 2], &[f64; 2])| p[0] * g[0] + p[1] * g[1] > 0.0;
//! assert!(points.iter().zip(&collocation.gradients(&f)).all(outwards));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`NormalEquations`] assemble it as a sparse symmetric matrix, which [`Factor`] factors by Cholesky's method with a
//! nested-dissection order: the coarsest level of the above, the cheaper way for many solves with one matrix up to about
//! 10 000 coefficients in 3D and a few hundred thousand in 2D, and what the above is tested against.
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
//! **Guaranteed.** The same bytes for any number of threads: factorisations are sequential, sums run in a fixed order.
//! Operator and V-cycle are symmetric and positive definite, so that a spectral method may use them.
//!
//! **Not here.** Choosing weights. Iterations grow where the smoothing length is far below the cells (`w = ρ ℓ³`,
//! ℓ < h / 10), for then the points alone decide about single coefficients.

mod assembly_error;
mod band_collocation;
mod band_energy;
mod band_kernel;
mod band_operator;
mod band_pattern;
mod band_solver;
mod band_tasks;
mod bits;
mod cell_kernel;
mod cell_points;
mod cholesky;
mod conjugate_gradients;
mod cubic_kernel;
mod energy_kernel;
mod multigrid;
mod nested_dissection;
mod normal_matrix;
mod normal_operator;
mod scratch;
mod separable_energy;
mod smoother;
mod spectrum;
mod step_norm;
mod stiff_points;
mod transfer;
mod vectors;

pub use assembly_error::AssemblyError;
pub use band_collocation::BandCollocation;
pub use band_energy::{BandEnergy, Fairness};
pub use band_operator::{BandOperator, BandRows};
pub use band_solver::{BandStep, StepEnd, Truncation, solve_truncated};
pub use cholesky::{Factor, FactorError};
pub use conjugate_gradients::{SolveOptions, SolveReport};
pub use multigrid::{Multigrid, MultigridError};
pub use normal_matrix::{NormalEquations, NormalMatrix};
pub use normal_operator::{NormalOperator, OperatorError};
pub use step_norm::StepNorm;
pub use vectors::inner_product;
