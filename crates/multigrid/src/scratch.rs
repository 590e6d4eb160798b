//! Buffers that are kept from one call to the next, so that iterations do not allocate.

use std::sync::{Mutex, PoisonError};

/// Buffers handed out to whoever asks, as many as there are callers at the same time. Their contents are arbitrary.
#[derive(Debug)]
pub(crate) struct Scratch<T>(Mutex<Vec<T>>);

impl<T> Default for Scratch<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Scratch<T> {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// Runs `work` with a buffer that was used before, or a new one.
    pub(crate) fn with<R>(&self, new: impl FnOnce() -> T, work: impl FnOnce(&mut T) -> R) -> R {
        // A list of idle buffers is in order even if a caller panicked.
        let idle = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = idle().pop();
        let mut buffer = taken.unwrap_or_else(new);
        let result = work(&mut buffer);
        idle().push(buffer);
        result
    }
}
