//! Distances: f as a signed distance, its scale and how good it is, and distances from the zero set as it was extracted.

pub(crate) mod calibration;
pub(crate) mod redistancing;
pub(crate) mod signed_distance;
