//! The dynamic reconstruction: a given implicit curve or surface is deformed until it fits the points.
//!
//! Section 2.3 of the paper. From an initial shape `V(f⁰)` a trust-region method lowers
//!
//! ```text
//! R(f) = Σ aᵢ f(Pᵢ)² / ‖∇f(Pᵢ)‖² + w_k Eng(f),      w_k = σᵏ w₀,
//! ```
//!
//! the Sampson error of equations (4) and (5) plus the thin-plate energy of equation (3), over the control coefficients.
//! [`Options::stiffness`] ties f to the initial shape where that knows more than fairness does: away from the points.
//!
//! ```
//! use zeroset_bspline::{KnotVector, Spline};
//! use zeroset_trust_region::{Options, refine, sampson_distances};
//!
//! // 120 points on an ellipse; the initial shape is a circle.
//! let points: Vec<[f64; 2]> = (0..120)
//!     .map(|i| (f64::from(i) / 120.0 * std::f64::consts::TAU).sin_cos())
//!     .map(|(s, c)| [0.5 * c, 0.3 * s])
//!     .collect();
//! let knots = KnotVector::uniform(3, -0.7, 0.1, 14)?;
//! let at = |r: usize| -0.7 + (r as f64 - 1.0) * 0.1;
//! let circle = (0..17 * 17).map(|i| at(i / 17).hypot(at(i % 17)) - 0.4).collect();
//! let initial = Spline::from_flat([knots.clone(), knots], circle)?;
//!
//! let (f, report) = refine(&points, None, &initial, &Options::for_spacing::<2>(0.02))?;
//! assert!(report.result.sampson_rms < 1e-3 * report.initial.sampson_rms);
//! assert!(sampson_distances(&f, &points).iter().all(|r| r.abs() < 1e-3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`refine_levels`] goes on from there to cells of any size near the points: it takes one level of a
//! [`HierarchicalSpline`](zeroset_bspline::HierarchicalSpline) after the other, everything coarser being fixed.
//!
//! ```
//! use zeroset_bspline::{CellBand, KnotVector, Spline};
//! use zeroset_trust_region::{LevelOptions, refine_levels};
//!
//! let points: Vec<[f64; 2]> = (0..120)
//!     .map(|i| (f64::from(i) / 120.0 * std::f64::consts::TAU).sin_cos())
//!     .map(|(s, c)| [0.5 * c, 0.4 * s])
//!     .collect();
//! let knots = KnotVector::uniform(3, -0.8, 0.2, 8)?;
//! let at = |r: usize| -0.8 + (r as f64 - 1.0) * 0.2;
//! let circle = (0..11 * 11).map(|i| at(i / 11).hypot(at(i % 11)) - 0.45).collect();
//! let initial = Spline::from_flat([knots.clone(), knots], circle)?;
//!
//! // Two levels: cells of 0.05 within three cells of the points.
//! let band = CellBand::new(initial.knots(), &points, &[2; 120], [3, 3])?;
//! let (f, report) = refine_levels(&points, None, None, &initial, &band, &LevelOptions::for_spacing::<2>(0.024))?;
//! assert_eq!(f.levels().len(), 2);
//! assert!(report.result.sampson_rms < 1e-2 * report.initial.sampson_rms);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **Guaranteed.** `R` never rises over an accepted step at its weight; the report names the rule that ended the
//! iteration; the result keeps the sign of the initial shape (negative inside) and `‖∇f‖` averages 1 at the points; the
//! same bytes for any number of threads.
//!
//! **Not here.** A global minimum: the method is local, and topology changes only where the descent happens to cross it.
//! Energies of other orders on a dense lattice.

mod anchor;
mod cascade;
mod deviation;
mod error;
mod holdout;
mod iteration;
mod level_objective;
mod level_options;
mod level_report;
mod merged;
mod more_sorensen;
mod objective;
mod options;
mod preconditioner;
mod quadratic_model;
mod redistance;
mod refine;
mod refine_levels;
mod report;
mod rows;
mod sampson;
mod sides;
mod steihaug;
mod twicing;
mod within_bounds;

pub use deviation::normal_deviation;
pub use error::Error;
pub use holdout::lots;
pub use level_options::{LevelError, LevelOptions};
pub use level_report::{LevelErrors, LevelStep, LevelSummary, LevelsReport, Twicing};
pub use more_sorensen::MOST_EXACT;
pub use options::{Normalisation, Options, Preconditioner, SubProblem};
pub use redistance::{KnownDistances, RedistanceOptions, RedistanceReport, redistance};
pub use refine::{refine, refine_with};
pub use refine_levels::refine_levels;
pub use report::{Errors, Iteration, Report, StoppingRule, SubProblemEnd};
pub use sampson::sampson_distances;
pub use sides::{Place, Sides};
pub use twicing::{Increment, twice};
pub use within_bounds::within_bounds;
