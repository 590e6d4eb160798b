/// What cannot be summed, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WindingError {
    /// A point, area vector or query with NaN, infinity or a magnitude beyond [`crate::LARGEST`]: clean the input, or
    /// map it to a frame of about unit size.
    #[error("{what} {index} is {value:?}: components must be finite and at most 1e50 in magnitude")]
    OutOfRange {
        /// "point", "area vector" or "query".
        what: &'static str,
        /// Its place in the input, from 0.
        index: usize,
        /// Its components.
        value: Vec<f64>,
    },
    /// As many area vectors as points are needed, in the same order.
    #[error("{area_vectors} area vectors for {points} points: give one for each point")]
    CountMismatch {
        /// The number of points in the tree.
        points: usize,
        /// The number of area vectors given.
        area_vectors: usize,
    },
    /// An option is out of its range.
    #[error("option `{option}` is {value}: it must be {range}")]
    Option {
        /// The field of [`crate::Options`].
        option: &'static str,
        /// The value given.
        value: f64,
        /// The values that it may have.
        range: &'static str,
    },
    /// Places in the input are numbered by 32 bits.
    #[error("{count} times {what} is more than 2^32 - 1: take a part of them")]
    TooMany {
        /// "point", "area vector" or "query".
        what: &'static str,
        /// How many were given.
        count: usize,
    },
}

/// The largest magnitude of a component of a point, an area vector or a query. Powers of distances stay finite.
pub const LARGEST: f64 = 1e50;

/// Refuses components that are not finite or beyond [`LARGEST`], and more vectors than can be numbered.
pub(crate) fn check<const D: usize>(what: &'static str, vectors: &[[f64; D]]) -> Result<(), WindingError> {
    if vectors.len() > u32::MAX as usize {
        return Err(WindingError::TooMany { what, count: vectors.len() });
    }
    // A NaN fails every comparison.
    let fits = |v: &[f64; D]| v.iter().all(|x| x.abs() <= LARGEST);
    match vectors.iter().position(|v| !fits(v)) {
        Some(index) => Err(WindingError::OutOfRange { what, index, value: vectors[index].to_vec() }),
        None => Ok(()),
    }
}
