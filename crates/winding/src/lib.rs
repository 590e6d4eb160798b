//! The winding number of oriented points: 1 inside, 0 outside, where the normals are outward.
//!
//! For points `Pᵢ` with unit normals `nᵢ` that stand for areas `aᵢ` (lengths in 2D), and `q = ‖Pᵢ − X‖² + ε²`,
//!
//! `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (4π q^{3/2})` in 3D, `W(X) = Σ aᵢ nᵢ·(Pᵢ − X) / (2π q)` in 2D.
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
