//! Unsigned distance from a cloud of points to every node of a box lattice: the distance function
//! d of section 4 of the paper, eq. 11, with |∇d| = 1 and d = 0 at the points.
//!
//! Three ways to the same array of values, chosen by [`Method`]:
//!
//! * [`Method::Godunov`]: the paper's fast sweeping, eqs. 12 and 13 (Zhao 2005). First order in h.
//! * [`Method::ClosestPoint`] (the default): the same sweeps, but each node carries the *index* of the
//!   nearest sample found so far and offers it to its neighbours. Same cost, errors of about
//!   a hundredth of what Godunov's scheme leaves.
//! * [`Method::Exact`]: a kd-tree query per node. The reference for the other two.
//!
//! ```
//! use zeroset_eikonal_sweep::{Lattice, Method, Options, distance};
//!
//! // A lattice over [0, 1] × [0, 2] with h = 1/4: 5 × 9 nodes.
//! let lattice = Lattice::new([0.0, 0.0], 0.25, [5, 9])?;
//! let points = [[0.5, 0.5], [0.5, 1.5]];
//!
//! let found = distance(&points, &lattice, &Options::default())?;
//! assert_eq!(found.values.shape(), &[5, 9]);
//! assert_eq!(found.values[[2, 2]], 0.0); // the node at (0.5, 0.5)
//! assert!((found.values[[0, 8]] - 0.5_f64.hypot(0.5)).abs() < 1e-15); // the corner (0, 2)
//! assert_eq!(found.nearest.unwrap()[[0, 8]], 1); // and its nearest sample
//!
//! let godunov = Options { method: Method::Godunov, ..Options::default() };
//! let coarse = distance(&points, &lattice, &godunov)?;
//! assert!((coarse.values[[0, 8]] - 0.5_f64.hypot(0.5)).abs() < 0.25); // within one cell
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Guaranteed
//!
//! * **Exact near the points**, for every method: a node with a point less than 2h away
//!   ([`Options::exact_radius`]) has the distance to the nearest point of the *whole* cloud (up to rounding), not just of
//!   its own cell. These nodes include all corners of every cell that holds a point (at most √3·h away) and most of
//!   the ring around them; [`Method::Godunov`] never changes them afterwards.
//! * [`Method::ClosestPoint`] gives the distance to a real sample, the one in `nearest`: never
//!   below the true distance.
//! * More rounds never increase a value.
//! * The same bytes for any number of threads. No value is NaN or infinite.
//! * Points may lie outside the box. [`Method::Exact`] does not care; the sweeps start such a point at
//!   the up to 3^D boundary nodes closest to it (see [`distance`]).
//!
//! # Not guaranteed
//!
//! * **One round of 2^D sweeps is not a fixed point** when the cloud has more than one point: the characteristics
//!   of d turn where the regions of two points meet, so a value may still travel in the next round.
//!   [`Report::converged`] says whether the last sweep changed anything, [`Report::last_change`] how much;
//!   [`Options::rounds`] allows more.
//! * A fixed point of closest-point sweeping is still not the exact distance: a sample whose Voronoi cell is so thin that
//!   it reaches a node through no chain of face neighbours is not found there.
//! * Godunov's scheme is not one-sided: it overestimates around a single point, and it
//!   underestimates by a fraction of h where fronts of two points meet at an angle.
//! * There is no sign here: d ≥ 0. Section 5 of the paper takes it from elsewhere.

mod closest_point;
mod distance;
mod exact;
mod ghost;
mod godunov;
mod lattice;
mod local_solution;
mod near_field;
mod rows;
mod sweep;
mod tiles;

pub use distance::{Distance, Error, Method, Options, Report, distance};
pub use lattice::{Lattice, LatticeError};
