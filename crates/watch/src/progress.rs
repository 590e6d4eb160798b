//! Who is told how far a run is.

use std::fmt;
use std::time::Instant;

use crate::cancel::{CancelToken, Cancelled};

/// Something that happened in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Progress {
    /// A stage begins.
    Started {
        /// Its name.
        stage: &'static str,
    },
    /// The stage that began last has ended.
    Finished {
        /// Its name.
        stage: &'static str,
        /// Wall time that it took, in seconds.
        seconds: f64,
    },
}

/// How a run is watched: who is told of its progress, and who may call it off. By default nobody.
#[derive(Clone, Default)]
pub struct Watch<'a> {
    /// Looked at between stages and inside the long ones.
    pub cancel: CancelToken,
    /// Called from the thread that the run was started on.
    pub progress: Option<&'a dyn Fn(Progress)>,
}

impl Watch<'_> {
    /// Runs a stage: tells of its begin and its end.
    ///
    /// # Errors
    /// [`Cancelled`] if the token was cancelled before the stage, which is then left out, or during it, when its result may not be
    /// the whole one.
    pub fn stage<T>(&self, stage: &'static str, work: impl FnOnce() -> T) -> Result<T, Cancelled> {
        self.cancel.check()?;
        let start = Instant::now();
        self.tell(Progress::Started { stage });
        let result = work();
        self.cancel.check()?;
        self.tell(Progress::Finished { stage, seconds: start.elapsed().as_secs_f64() });
        Ok(result)
    }

    fn tell(&self, progress: Progress) {
        if let Some(told) = self.progress {
            told(progress);
        }
    }
}

impl fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch").field("cancel", &self.cancel).field("progress", &self.progress.is_some()).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[test]
    fn a_stage_that_was_called_off_does_not_finish() {
        let seen = RefCell::new(Vec::new());
        let note = |progress| {
            seen.borrow_mut().push(match progress {
                Progress::Started { stage } => format!("{stage} …"),
                Progress::Finished { stage, seconds } => format!("{stage} {}", seconds >= 0.0),
            });
        };
        let watch = Watch { progress: Some(&note), ..Watch::default() };
        assert_eq!(watch.stage("one", || 1), Ok(1));
        assert_eq!(watch.stage("two", || watch.cancel.cancel()), Err(Cancelled));
        assert_eq!(watch.stage("three", || 3), Err(Cancelled));
        assert_eq!(*seen.borrow(), ["one …", "one true", "two …"]);
    }
}
