//! What can go wrong.

use thiserror::Error;
use zeroset_bspline::{CollocationError, EnergyError, SplineError};
use zeroset_multigrid::{AssemblyError, FactorError, MultigridError};

/// Why a refinement failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
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
    /// An area weight is negative, NaN or infinite, or all are zero.
    #[error("area weight {0} is not a finite number of at least zero, or all weights are zero")]
    BadArea(usize),
    /// Not one normal per point.
    #[error("{normals} normals were given for {points} points")]
    Normals {
        /// Normals given.
        normals: usize,
        /// Points there are.
        points: usize,
    },
    /// A normal is NaN or infinite.
    #[error("normal {index} is not finite; give zero where none is known")]
    NormalNotFinite {
        /// Which.
        index: usize,
    },
    /// Not one distance per place.
    #[error("{distances} distances were given for {places} places off the surface")]
    Distances {
        /// Distances given.
        distances: usize,
        /// Places there are.
        places: usize,
    },
    /// A place off the surface, or what is said of it, is NaN or infinite, or out of its range.
    #[error(
        "place {index} off the surface is not possible: numbers have to be finite, distances not negative, weights positive"
    )]
    Place {
        /// Which.
        index: usize,
    },
    /// Not one stiffness per control coefficient.
    #[error("{found} stiffnesses were given for {needed} control coefficients")]
    Stiffness {
        /// Stiffnesses given.
        found: usize,
        /// Coefficients there are.
        needed: usize,
    },
    /// An option lies outside its range.
    #[error("option {name} = {value}: {range}")]
    Option {
        /// Name of the field.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// The exact sub-problem was asked for on too many unknowns.
    #[error("the exact sub-problem is dense: {found} coefficients are more than its {most}; use Steihaug's method")]
    TooLargeForExact {
        /// Coefficients there are.
        found: usize,
        /// Most that are solved.
        most: usize,
    },
    /// The dense eigenvalue decomposition of the exact sub-problem did not converge.
    #[error("the dense eigenvalue decomposition of the model did not converge: use Steihaug's method")]
    Eigenvalues,
    /// No function with gradients at the points is left.
    #[error("the gradients vanish at the points or overflow: start from a function that changes across the data")]
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
    /// The V-cycle could not be set up.
    #[error(transparent)]
    Multigrid(#[from] MultigridError),
    /// The result is not a valid spline.
    #[error(transparent)]
    Spline(#[from] SplineError),
}

/// An option's name and value, whether it is in its range, and the range in words.
pub(crate) type Rule = (&'static str, f64, bool, &'static str);

/// Refuses the first option that is out of range.
pub(crate) fn check_rules(rules: impl IntoIterator<Item = Rule>) -> Result<(), Error> {
    match rules.into_iter().find(|rule| !rule.2) {
        Some((name, value, _, range)) => Err(Error::Option { name, value, range }),
        None => Ok(()),
    }
}
