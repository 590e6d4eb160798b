//! What closed curves and surfaces do where the points leave a gap: there they do not tell what hangs together.

use crate::points::frame::Frame;
use crate::trust::{and_others, place};

pub(crate) mod curve;
pub(crate) mod surface;

/// A warning of `what` happens at such places of the frame, of which the first one is named; none if there is no place.
fn warning<const D: usize>(places: &[[f64; D]], what: &str, unknown: &str, frame: &Frame<D>) -> Option<String> {
    Some(format!(
        "{what} at {}{}: they do not tell {unknown}; try a denser scan there",
        place(&frame.to_data(places.first()?)),
        and_others(places.len())
    ))
}
