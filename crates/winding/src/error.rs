//! What can go wrong.

use thiserror::Error;

/// Largest magnitude of any input number: powers of larger ones, in the expansions, could overflow.
pub(crate) const LARGEST: f64 = 1e40;

/// Why a winding number cannot be computed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WindingError {
    /// A coordinate is NaN, infinite or too large to be raised to the powers that are needed.
    #[error("point {index} has the coordinate {value} on axis {axis}: remove the point, or scale the data below 1e40")]
    Point {
        /// Which point, from 0.
        index: usize,
        /// Which axis: 0, 1 or 2.
        axis: usize,
        /// The coordinate.
        value: f64,
    },
    /// A component of an area vector is NaN, infinite or too large.
    #[error("area vector {index} has the component {value} on axis {axis}: give it zero length, or scale below 1e40")]
    AreaVector {
        /// Which point, from 0.
        index: usize,
        /// Which axis: 0, 1 or 2.
        axis: usize,
        /// The component.
        value: f64,
    },
    /// Not one area vector per point.
    #[error("{found} area vectors were given for {needed} points")]
    Count {
        /// Area vectors given.
        found: usize,
        /// Points there are.
        needed: usize,
    },
    /// The regularising length is negative, NaN, infinite or too large.
    #[error("the regularising length {0} must be zero or positive, and below 1e40")]
    Epsilon(f64),
    /// The opening ratio is below 1, or NaN.
    #[error("the opening ratio {0} must be 1 or larger: the expansions do not converge inside a node")]
    OpeningRatio(f64),
    /// More points than the tree can number.
    #[error("{0} points are too many: at most 2^31 can be held")]
    TooMany(usize),
}

/// The first number that is not finite or too large: its row, axis and value.
fn first_bad<const D: usize>(rows: &[[f64; D]]) -> Option<(usize, usize, f64)> {
    // Negated, so that NaN is bad.
    let bad = |value: &f64| !matches!(value.abs(), magnitude if magnitude <= LARGEST);
    rows.iter().enumerate().find_map(|(index, row)| {
        let axis = row.iter().position(bad)?;
        Some((index, axis, row[axis]))
    })
}

pub(crate) fn check_points<const D: usize>(points: &[[f64; D]]) -> Result<(), WindingError> {
    if points.len() >= 1 << 31 {
        return Err(WindingError::TooMany(points.len()));
    }
    first_bad(points).map_or(Ok(()), |(index, axis, value)| Err(WindingError::Point { index, axis, value }))
}

pub(crate) fn check_sources<const D: usize>(
    needed: usize,
    area_vectors: &[[f64; D]],
    epsilon: f64,
) -> Result<(), WindingError> {
    if area_vectors.len() != needed {
        return Err(WindingError::Count { found: area_vectors.len(), needed });
    }
    if !(0.0..=LARGEST).contains(&epsilon) {
        return Err(WindingError::Epsilon(epsilon));
    }
    first_bad(area_vectors).map_or(Ok(()), |(index, axis, value)| Err(WindingError::AreaVector { index, axis, value }))
}
