//! A run as it is seen from outside: which stage it is in, and a token that calls it off.
//!
//! ```
//! use zeroset_watch::{CancelToken, Progress, Watch};
//!
//! let cancel = CancelToken::new();
//! let print = |progress: Progress| {
//!     if let Progress::Finished { stage, seconds } = progress {
//!         println!("{stage} took {seconds:.1} s");
//!     }
//! };
//! let watch = Watch { cancel: cancel.clone(), progress: Some(&print) };
//! assert_eq!(watch.stage("counting", || (0..10).sum::<i32>()), Ok(45));
//!
//! // Somewhere else, in another thread or a signal's handler:
//! cancel.cancel();
//! assert!(watch.stage("counting", || unreachable!("no stage begins any more")).is_err());
//! ```
//!
//! Guaranteed: a token that was never given to anybody is never cancelled; a cancelled token stays so.
//!
//! Not here: stopping work that does not look at its token.

mod cancel;
mod progress;

pub use cancel::{CancelToken, Cancelled};
pub use progress::{Progress, Watch};
