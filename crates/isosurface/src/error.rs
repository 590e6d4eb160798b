//! What can go wrong.

use thiserror::Error;
use zeroset_bspline::BandError;

/// Why a zero set could not be extracted.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
    /// Values and coordinates do not belong together.
    #[error("samples of shape {values:?} do not fit axes of {axes:?} coordinates: at least two per axis are needed")]
    Shape {
        /// Shape of the values.
        values: Vec<usize>,
        /// Number of coordinates per axis.
        axes: Vec<usize>,
    },
    /// The coordinates of an axis do not increase, or are not finite.
    #[error("axis {axis}: coordinate {index} is not finite, or not larger than the one before it")]
    Axis {
        /// The axis.
        axis: usize,
        /// The coordinate.
        index: usize,
    },
    /// An axis is longer than arithmetic can hold.
    #[error("axis {axis} is longer than 9e307: scale the coordinates")]
    Extent {
        /// The axis.
        axis: usize,
    },
    /// A sample is NaN or infinite.
    #[error("the sample at node {0:?} is not a finite number: does the lattice leave the function's box?")]
    NotFinite(Vec<usize>),
    /// A spline's cells cannot be halved as often as asked for.
    #[error(transparent)]
    TooFine(#[from] BandError),
    /// No sample is negative, so nothing is inside.
    #[error(
        "no sample on the lattice is negative, so there is no zero set: is the inside f < 0, and does the lattice cover it?"
    )]
    Empty,
    /// More vertices than an index can name.
    #[error("the mesh would have more than 2 147 483 647 vertices: use a coarser lattice")]
    TooLarge,
}
