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
    /// More points than can be numbered.
    #[error("{found} points are given, and 4 294 967 296 at most can be taken: thin them out")]
    TooMany {
        /// Points given.
        found: usize,
    },
    /// Too few points are left once repeated ones are dropped.
    #[error(
        "only {found} of the points are different from each other, to a millionth of their extent: at least {needed} are needed; if \
         some lie far from all others, remove those"
    )]
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
    /// An array has not one column per coordinate.
    #[error("the array has {found} columns: one for each of {needed} coordinates is needed")]
    Columns {
        /// Columns given.
        found: usize,
        /// Coordinates.
        needed: usize,
    },
    /// Not one normal per point.
    #[error("{found} normals were given for {needed} points: give one per point, or none")]
    Normals {
        /// Normals given.
        found: usize,
        /// Points given.
        needed: usize,
    },
    /// A component of a normal is NaN or infinite.
    #[error("the normal of point {index} (counting from 0) is not finite: mend the export, or do without normals")]
    NormalNotFinite {
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

/// Why a reconstruction failed.
#[derive(Debug, Error)]
pub enum ReconstructError {
    /// The points have no shape to reconstruct.
    #[error(transparent)]
    Input(#[from] InputError),
    /// An option is out of range.
    #[error("{0}")]
    Option(String),
    /// Not even the dense lattice fits into memory.
    #[error(
        "{} of memory are needed without any finer level, but only {} may be used: allow more with --memory, ask for fewer cells \
         with --resolution, or give fewer points",
        crate::memory::said(*.need), crate::memory::said(*.limit)
    )]
    Memory {
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The points describe no surface that could be found.
    #[error(
        "no surface was found: {0}. The points may lie in clusters or far apart, fill a volume, or be too few: try a more even or \
         denser sampling, another --resolution, or a shorter --smooth if it was given"
    )]
    NoSurface(String),
    /// The topology stage failed.
    #[error("topology (section 3): {0}")]
    Topology(zeroset_gefm::GefmError),
    /// The levels above the dense lattice were refused.
    #[error("levels: {0}")]
    Band(#[from] zeroset_bspline::BandError),
    /// The function on levels could not be made, or mapped to the data's unit.
    #[error("levels: {0}")]
    Hierarchy(#[from] zeroset_bspline::HierarchyError),
    /// The refinement level by level failed.
    #[error("refinement (section 2.3): {0}")]
    Levels(#[from] zeroset_trust_region::LevelError),
    /// The lattice for the distance was refused.
    #[error("distance (section 4): {0}")]
    Lattice(#[from] zeroset_eikonal_sweep::LatticeError),
    /// The distance stage failed.
    #[error("distance (section 4): {0}")]
    Distance(#[from] zeroset_eikonal_sweep::Error),
    /// The least-squares stage failed.
    #[error("initial shape (equation 15): {0}")]
    InitialShape(#[from] zeroset_lsq_init::Error),
    /// The refinement failed.
    #[error("dynamic reconstruction (section 2.3): {0}")]
    Refinement(zeroset_trust_region::Error),
    /// The zero set could not be extracted.
    #[error("extraction: {0}")]
    Extraction(zeroset_isosurface::Error),
    /// Winding numbers could not be computed.
    #[error("sign (equation 14): {0}")]
    Winding(#[from] zeroset_winding::WindingError),
    /// Knot vectors could not be laid out.
    #[error("the lattice cannot be laid out: {0}")]
    Knots(#[from] zeroset_bspline::KnotError),
    /// The function cannot be expressed in the data's unit.
    #[error("the function cannot be expressed in the data's unit: {0}")]
    Spline(#[from] zeroset_bspline::SplineError),
    /// Somebody cancelled.
    #[error(transparent)]
    Cancelled(#[from] zeroset_watch::Cancelled),
}

impl ReconstructError {
    /// Whether the points themselves are the cause, rather than the program or its options.
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Input(_))
    }

    /// Whether options are the cause: out of range, or more memory needed than allowed.
    pub fn is_option(&self) -> bool {
        matches!(self, Self::Option(_) | Self::Memory { .. })
    }

    /// Whether there is no surface to be found, though neither the points nor the options were refused.
    pub fn is_doubt(&self) -> bool {
        matches!(self, Self::NoSurface(_))
    }

    /// Whether the reconstruction was called off.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Cancelled(_) | Self::Topology(zeroset_gefm::GefmError::Cancelled(_)))
    }
}

impl From<zeroset_gefm::GefmError> for ReconstructError {
    fn from(error: zeroset_gefm::GefmError) -> Self {
        use zeroset_gefm::GefmError::{Factor, Multigrid, NoGradient};
        match &error {
            // Which points make a factorisation fail cannot be told before it.
            NoGradient | Factor(_) | Multigrid(zeroset_multigrid::MultigridError::Factor(_)) => {
                Self::NoSurface(error.to_string())
            }
            _ => Self::Topology(error),
        }
    }
}

impl From<zeroset_trust_region::Error> for ReconstructError {
    fn from(error: zeroset_trust_region::Error) -> Self {
        match error {
            zeroset_trust_region::Error::Factor(factor) => Self::NoSurface(factor.to_string()),
            error => Self::Refinement(error),
        }
    }
}

impl From<zeroset_isosurface::Error> for ReconstructError {
    fn from(error: zeroset_isosurface::Error) -> Self {
        match error {
            zeroset_isosurface::Error::Empty => Self::NoSurface("the function is positive everywhere".into()),
            error => Self::Extraction(error),
        }
    }
}
