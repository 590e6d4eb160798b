//! What end-to-end tests and `cargo xtask soak` share: random clouds and options, a run with a time limit, and a count of half-edges
//! that trusts nobody. The tests themselves are in `tests/tests`.
//!
//! ```
//! use zeroset_tests::{Case, soak};
//! // The case of a seed is always the same one.
//! let verdict = soak(&Case::of_seed(1), std::time::Duration::from_secs(30));
//! assert!(verdict.is_ok(), "{verdict:?}");
//! ```
//!
//! Guaranteed: everything follows from its seed, on every machine. Not here: shapes with a known exact answer, see `fixtures/` and `cargo xtask shapes`.

mod case;
mod half_edges;
mod random;
mod shapes;
mod soak;
mod time_limit;

pub use case::{Case, Cloud};
pub use half_edges::{Faults, faults_of_loops, faults_of_mesh};
pub use random::Random;
pub use shapes::{Shape2, Shape3};
pub use soak::{EXECUTIONS, Outcome, Violation, soak, without_seconds};
pub use time_limit::{Ended, within};
