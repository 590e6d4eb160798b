//! What can go wrong.

use thiserror::Error;
use zeroset_bspline::{EnergyError, SplineError};

/// Why a least-squares fit failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
    /// Values and coordinates do not belong together.
    #[error("values of shape {values:?} do not fit axes of {axes:?} coordinates")]
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
    /// A node has no basis functions.
    #[error("axis {axis}: coordinate {index} lies outside the domain of the knot vector")]
    Outside {
        /// The axis.
        axis: usize,
        /// The coordinate.
        index: usize,
    },
    /// A value is NaN or infinite.
    #[error("the value at node {0:?} is not a finite number")]
    NotFinite(Vec<usize>),
    /// The fairness is negative or not finite.
    #[error("the fairness {0} must be a finite number of at least zero")]
    Fairness(f64),
    /// A smoothing length was given for nodes without a common spacing.
    #[error("a smoothing length needs nodes of one spacing: give the weight itself")]
    Uneven,
    /// The tolerance is out of range.
    #[error("the tolerance {0} must lie between 0 and 1, both excluded")]
    Tolerance(f64),
    /// Some coefficient is determined by nothing: with fairness an axis needs two nodes, without it every basis function
    /// a node of its own (Schoenberg and Whitney 1953).
    #[error(
        "axis {axis}: the nodes do not determine the spline: use more nodes (at least two), fewer cells, or a positive \
         fairness"
    )]
    Undetermined {
        /// The axis.
        axis: usize,
    },
    /// Nodes and knots determine the spline in theory, but not in f64.
    #[error(
        "the normal equations are singular to rounding: use more nodes, more even knots, or a fairness that is neither \
         0 nor vast"
    )]
    Singular,
    /// The iteration did not reach its tolerance.
    #[error(
        "the residual is still {residual:.1e} after {iterations} iterations: loosen the tolerance or raise the fairness"
    )]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Relative residual.
        residual: f64,
    },
    /// The knots do not admit the energy.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The result is not a valid spline.
    #[error(transparent)]
    Spline(#[from] SplineError),
}
