//! The winding number of oriented points in 2D and 3D by a tree code: 1 inside, 0 outside, where the normals are outward.
//!
//! For points `Pᵢ` with unit normals `nᵢ` that stand for areas `aᵢ` (lengths in 2D), and `q = ‖Pᵢ − X‖² + ε²`,
//!
//! `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (4π q^{3/2})` in 3D, `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (2π q)` in 2D:
//!
//! the sum that Gauss' integral of a closed surface becomes, with a kernel that [`Options::regularisation`] ε keeps finite at the
//! points. ε = 0 is the plain kernel; then a point adds nothing at its own place.
//!
//! ```
//! use zeroset_winding::{Options, Tree};
//!
//! let count = 1000;
//! let circle: Vec<[f64; 2]> =
//!     (0..count).map(|i| std::f64::consts::TAU * f64::from(i) / f64::from(count)).map(|t| [t.cos(), t.sin()]).collect();
//! let length = std::f64::consts::TAU / f64::from(count);
//!
//! let tree = Tree::new(&circle, Options::default())?;
//! let outward: Vec<[f64; 2]> = circle.iter().map(|n| n.map(|x| length * x)).collect();
//! let winding = tree.with_normals(&outward)?;
//! assert!((winding.at(&[0.3, -0.5])? - 1.0).abs() < 1e-3);
//! let outside = winding.evaluate(&[[1.1, 0.0], [-3.0, 4.0]])?;
//! assert!(outside.iter().all(|w| w.abs() < 1e-3));
//!
//! // The same tree with the normals turned round.
//! let inward: Vec<[f64; 2]> = outward.iter().map(|n| n.map(|x| -x)).collect();
//! assert!((tree.with_normals(&inward)?.at(&[0.3, -0.5])? + 1.0).abs() < 1e-3);
//! # Ok::<(), zeroset_winding::WindingError>(())
//! ```
//!
//! **How.** Points are halved by number across the longest side of their box down to 32 (after J. Barnes and P. Hut,
//! *A hierarchical O(N log N) force-calculation algorithm*, 1986). Each box has the moments of its oriented points about its
//! centre up to hexadecapoles, one order above G. Barill, N. Dickson, R. Schmidt, D. Levin and A. Jacobson, *Fast winding
//! numbers for soups and clouds*, 2018, of the regularised kernel itself, which is the gradient of `−1 / (4π √q)` (3D) and
//! of `ln q / 4π` (2D). A box is taken as a whole where a bound on what its expansion leaves out says so, rather than by its
//! angle alone: boxes that weigh much are opened from farther. Up to 32 queries that lie together share one walk through the
//! tree, and vector registers run over them.
//!
//! [`Tree`] knows the points only; [`Tree::with_normals`] costs a tenth of what evaluation at as many places does. For
//! 160 000 points and as many queries all takes about 0.5 s of CPU (`cargo bench -p zeroset-winding`), memory is about 200 bytes
//! per point and 100 per query at the most.
//!
//! **Guaranteed.** No box that is taken as a whole errs by more than an eighth of [`Options::tolerance`], whatever the normals
//! and areas are. The same bytes for any number of threads, and for any order of distinct points and queries; scaling by a
//! power of two (areas to match) changes no bit. Equal points, coplanar ones, one or none are as good as others: the depth
//! of the tree is at most log₂ N. What is not finite is refused.
//!
//! **Not guaranteed.** The tolerance for the whole sum: it could be exceeded if the errors of many boxes had one sign and came near
//! their bounds. For oriented and disoriented surfaces and curves, even and uneven, for plates, lines and unit normals without
//! areas, the worst error that was found is a seventh of it. Rounding comes on top where W is huge, beside a point without
//! regularisation. Lengths below 1e-30 of the unit may underflow.
//!
//! **Not here.** Normals and areas are the caller's, and so is the verdict: beside the points, nearer than their spacing, W is
//! rough even when it is exact.

mod batch;
mod direct_sum;
mod multi_index;
mod multipole;
mod opening;
mod partition;
mod tree;
mod winding;
mod winding_error;

pub use tree::{Options, Tree};
pub use winding::Winding;
pub use winding_error::{LARGEST, WindingError};
