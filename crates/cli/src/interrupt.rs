//! Ctrl-C, or the end of the time that a run may take: it ends within a second and leaves no half-written file.

use std::sync::{Once, OnceLock};
use std::thread;
use std::time::Duration;

use zeroset::CancelToken;

use crate::progress::Say;

/// Why the run is to end; the first reason counts.
static REASON: OnceLock<Reason> = OnceLock::new();

#[derive(Clone, Copy)]
enum Reason {
    Interrupted,
    OutOfTime(Duration),
}

impl Reason {
    fn exit_code(self) -> i32 {
        match self {
            // What shells expect of a program that SIGINT ended: 128 + 2.
            Self::Interrupted => 130,
            Self::OutOfTime(_) => 6,
        }
    }

    fn message(self) -> String {
        match self {
            Self::Interrupted => "interrupted".into(),
            Self::OutOfTime(limit) => format!(
                "not done within --time {}: allow more, ask for fewer cells with --resolution, or give fewer points",
                limit.as_secs_f64()
            ),
        }
    }
}

/// So long may a stage go on that does not look at its token.
const GRACE: Duration = Duration::from_millis(500);

/// From now on the first Ctrl-C ends the run; a second one at once.
pub fn handle(say: &Say) {
    let say = say.clone();
    let handled = ctrlc::set_handler(move || {
        if say.cancel().is_cancelled() {
            end(&say);
        }
        let say = say.clone();
        begin_to_end(&say, Reason::Interrupted);
        thread::spawn(move || end_after_grace(&say));
    });
    // Where no handler can be set, Ctrl-C still ends the program, though not as tidily.
    if let Err(error) = handled {
        tracing::debug!(%error, "no handler of Ctrl-C");
    }
}

/// Ends the run after this time.
pub fn limit(say: &Say, time: Duration) {
    let say = say.clone();
    thread::spawn(move || {
        thread::sleep(time);
        begin_to_end(&say, Reason::OutOfTime(time));
        end_after_grace(&say);
    });
}

/// Cancels `say`'s token, and keeps files from being replaced.
fn begin_to_end(say: &Say, reason: Reason) {
    // An earlier reason stays.
    let _ = REASON.set(reason);
    say.cancel().cancel();
    zeroset_io::abandon_writes();
}

/// A stage that has not ended by then is ended with the program.
fn end_after_grace(say: &Say) {
    thread::sleep(GRACE);
    end(say);
}

/// Ends the program if it was interrupted, or ran out of time.
pub fn end_if_interrupted(say: &Say, token: &CancelToken) {
    if token.is_cancelled() {
        end(say);
    }
}

fn end(say: &Say) -> ! {
    let reason = REASON.get().copied().unwrap_or(Reason::Interrupted);
    // Two threads may come here.
    static TOLD: Once = Once::new();
    TOLD.call_once(|| say.error(reason.message()));
    std::process::exit(reason.exit_code());
}
