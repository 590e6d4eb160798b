//! Generalized eigenvector fitting: a B-spline whose *sign* tells inside from outside, from points without normals.
//!
//! Section 3 of the paper: minimise the Sampson error plus fairness, equation (6), by successive quadratic problems (7)
//! under the constraint (8). Each is a generalized eigenproblem (10), `A f = λ B f`, with
//!
//! ```text
//! A = Σ aᵢ θᵢ² qᵢ qᵢᵀ + w H,      B = Σ aᵢ (uᵢ uᵢᵀ + vᵢ vᵢᵀ + wᵢ wᵢᵀ),
//! ```
//!
//! and the pair with the smallest λ is wanted. [`eigenvector_fit`] is the paper's method, steps (a) to (d).
//! [`continue_exponent`] makes its result robust, and [`fit`] runs both and settles the global sign.
//!
//! ```
//! use zeroset_bspline::KnotVector;
//! use zeroset_gefm::{Options, fit};
//!
//! // Sixty points on a circle of radius 0.4, and 8 × 8 cubic cells around it.
//! let points: Vec<[f64; 2]> = (0..60)
//!     .map(|i| (f64::from(i) / 60.0 * std::f64::consts::TAU).sin_cos())
//!     .map(|(s, c)| [0.4 * c, 0.4 * s])
//!     .collect();
//! let knots = [KnotVector::uniform(3, -0.6, 0.15, 8)?, KnotVector::uniform(3, -0.6, 0.15, 8)?];
//! let spacing = 0.4 * std::f64::consts::TAU / 60.0;
//! let options = Options { smoothing_length: 0.5 * spacing, density: 1.0 / spacing, ..Options::default() };
//! let (f, report) = fit(&points, &[1.0; 60], &knots, &options)?;
//!
//! assert!(f.value(&[0.0, 0.0]) < 0.0 && f.value(&[0.55, 0.0]) > 0.0);
//! assert!(report.eigenvector.iterations[0].residual < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** Negative inside and positive outside as far as the enclosed volume can tell; `J_p` never falls during
//! the continuation; the same bytes for any number of threads.
//!
//! **Not here.** Accuracy: the zero set follows the data only roughly, and far from the data the function may curl up.
//! The stages after this one use nothing but its sign.

mod descent;
mod eigenvector_fit;
mod error;
mod fit;
mod gradient_form;
mod hermite_fit;
mod ladder;
mod ladder_options;
mod ladder_report;
mod lanczos;
mod lattice_nodes;
mod noise;
mod normal_solver;
mod orientation;
mod p_continuation;
mod patches;
mod pieces;
mod pulled_points;
mod quasi_interpolation;
mod referee;
mod rung;
mod third_order;
mod tridiagonal;
mod unit_normals;
mod verdict;

pub use eigenvector_fit::{EigenvectorIteration, EigenvectorOptions, EigenvectorReport, eigenvector_fit};
pub use error::GefmError;
pub use fit::{Options, Report, fit};
pub use gradient_form::area_vectors;
pub use hermite_fit::{HermiteOptions, hermite_fit};
pub use ladder::{MOST_FACTORED, climb};
pub use ladder_options::{KnownNormals, LadderOptions, ThirdOrderOptions};
pub use ladder_report::{Candidate, LadderReport, Start, UnitNormals};
pub use lanczos::EigenpairSummary;
pub use noise::{LAYERED, layers, noise_deviation};
pub use normal_solver::NormalSolver;
pub use p_continuation::{ContinuationOptions, ContinuationReport, ContinuationStage, continue_exponent};
pub use patches::Patches;
pub use referee::{Judgement, Referee};

pub use zeroset_multigrid::NormalEquations;
