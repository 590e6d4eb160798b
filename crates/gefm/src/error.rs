//! What can go wrong.

use thiserror::Error;
use zeroset_bspline::{CollocationError, EnergyError, SplineError};
use zeroset_multigrid::{AssemblyError, FactorError, MultigridError};
use zeroset_watch::Cancelled;
use zeroset_winding::WindingError;

/// Why a generalized eigenvector fit failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GefmError {
    /// Nothing to fit.
    #[error("there are no points to fit")]
    NoPoints,
    /// Not one area weight per point.
    #[error("{found} area weights were given for {needed} points")]
    Areas {
        /// Weights given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// Not one known normal per point.
    #[error("{found} normals were given for {needed} points")]
    Normals {
        /// Normals given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// The smoothing length or the density is not positive and finite.
    #[error("the smoothing length {length} and the density {density} must be positive, finite numbers")]
    Smoothing {
        /// Smoothing length in frame units.
        length: f64,
        /// Points per unit length or area.
        density: f64,
    },
    /// An exponent lies outside `[1, 2]`.
    #[error("the exponent {0} is outside [1, 2], where the continuation is monotone")]
    Exponent(f64),
    /// No function with gradients at the points was found.
    #[error("all gradients vanish at the points: the lattice is too coarse for these data, use a finer one")]
    NoGradient,
    /// The points do not lie in the box of the knots.
    #[error(transparent)]
    Collocation(#[from] CollocationError),
    /// The knots do not admit the thin-plate energy.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The normal matrix could not be assembled.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// The normal matrix could not be factored.
    #[error(transparent)]
    Factor(#[from] FactorError),
    /// The result is not a valid spline.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// The solver on nested lattices could not be set up.
    #[error(transparent)]
    Multigrid(#[from] MultigridError),
    /// Winding numbers could not be computed.
    #[error(transparent)]
    Winding(#[from] WindingError),
    /// Somebody cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
