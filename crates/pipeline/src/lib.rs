//! Raw points in, a smooth implicit B-spline curve or surface out: no normals needed.
//!
//! (front page follows with the road)

mod domain;
mod error;
mod frame;
mod spacing;

pub use domain::Domain;
pub use error::InputError;
pub use frame::Frame;
pub use spacing::Spacing;
