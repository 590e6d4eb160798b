//! Work that must end.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// How work ended that should have ended well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// With a panic that said this.
    Panicked(String),
    /// Not within its time; its thread was left behind.
    Hung,
}

/// Runs `work` in a thread of its own and waits so long for it.
///
/// # Errors
/// If it panics, or is not done in time.
pub fn within<T: Send + 'static>(limit: Duration, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Ended> {
    let (done, wait) = mpsc::channel();
    thread::spawn(move || {
        // Nothing of the work is looked at after a panic.
        let result = catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
            let text = payload.downcast_ref::<String>().cloned();
            Ended::Panicked(text.or_else(|| payload.downcast_ref::<&str>().map(|s| (*s).into())).unwrap_or_default())
        });
        // Nobody waits any more if time is over.
        let _ = done.send(result);
    });
    wait.recv_timeout(limit).unwrap_or(Err(Ended::Hung))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_ends_well_or_is_told_of() {
        // Printing a panic takes long on a busy machine.
        let limit = Duration::from_secs(60);
        assert_eq!(within(limit, || 7), Ok(7));
        let panicked: Result<(), _> = within(limit, || panic!("at {}", 3));
        assert_eq!(panicked, Err(Ended::Panicked("at 3".into())));
        let short = Duration::from_millis(50);
        assert_eq!(within(short, move || thread::sleep(100 * short)), Err(Ended::Hung));
    }
}
