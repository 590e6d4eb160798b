//! Why a normal matrix could not be assembled.

use thiserror::Error;

/// Why a normal matrix could not be assembled.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum AssemblyError {
    /// Collocation and energy belong to different knot vectors.
    #[error("the points were collocated on {found:?} coefficients, the energy has {needed:?}")]
    Shape {
        /// Shape of the collocation.
        found: Vec<usize>,
        /// Shape of the energy.
        needed: Vec<usize>,
    },
    /// Not one weight (or row) per point.
    #[error("{found} weights were given for {needed} points")]
    Weights {
        /// Weights given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("weight {0} is not a finite number of at least zero")]
    BadWeight(usize),
}
