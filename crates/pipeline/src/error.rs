//! What can go wrong.

use thiserror::Error;

/// Why a point set was refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum InputError {
    /// Fewer points than any shape needs.
    #[error("{found} points are too few to have a shape: at least {needed} are needed")]
    TooFew {
        /// Points given.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// Too few points are left once repeated ones are dropped.
    #[error("only {found} of the points are different from each other: at least {needed} are needed")]
    TooFewDistinct {
        /// Different points.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error(
        "point {index} (counting from 0) has a coordinate that is not a finite number: remove it or mend the export"
    )]
    NotFinite {
        /// Index of the point.
        index: usize,
    },
    /// No extent, or one that f64 cannot scale to 1.
    #[error(
        "all {count} points are equal, or their extent is beyond what f64 can scale to 1: there is no shape to fit"
    )]
    AllEqual {
        /// Points given.
        count: usize,
    },
    /// The points have no inside.
    #[error("all points lie on one {kind}: there is no inside to find (for points in a plane give two columns)")]
    Flat {
        /// `line`, or `line or plane`.
        kind: &'static str,
    },
}
