//! The last line of defence around decoders that other crates bring.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::read_error::Malformed;

/// Runs `read`; a panic in it means that the file is damaged in a way that its decoder did not foresee.
///
/// Everything that is known to make them panic or ask for too much memory is refused before.
pub(crate) fn refuse_panic<T>(read: impl FnOnce() -> Result<T, Malformed>) -> Result<T, Malformed> {
    catch_unwind(AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(Malformed::file("the file is damaged: its decoder could not go on")))
}
