//! Calling off work that runs elsewhere.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wish that whoever looks at it should stop. Clones are one token: cancelling one cancels all.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<AtomicBool>);

/// The work was called off before it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("called off before it was done")]
pub struct Cancelled;

impl CancelToken {
    /// A token that nobody has cancelled yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks whoever looks at this token to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether somebody did.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// For `?`.
    ///
    /// # Errors
    /// [`Cancelled`] if somebody cancelled.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// Tokens are equal when they are the same, or when neither has been cancelled: so that options which hold one are equal as far as
/// their results are.
impl PartialEq for CancelToken {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.is_cancelled() == other.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_cancelled_together_and_others_are_not() {
        let (token, other) = (CancelToken::new(), CancelToken::new());
        let clone = token.clone();
        assert_eq!(token.check(), Ok(()));
        assert_eq!(token, other);
        std::thread::spawn(move || clone.cancel()).join().unwrap();
        assert_eq!(token.check(), Err(Cancelled));
        assert!(!other.is_cancelled());
        assert_ne!(token, other);
    }
}
