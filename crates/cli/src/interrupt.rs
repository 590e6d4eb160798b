//! Ctrl-C: the run ends within a second and leaves no half-written file.

use std::sync::Once;
use std::thread;
use std::time::Duration;

use zeroset::CancelToken;

use crate::progress::Say;

/// What shells expect of a program that SIGINT ended: 128 + 2.
const EXIT_CODE: i32 = 130;
/// So long may a stage go on that does not look at its token.
const GRACE: Duration = Duration::from_millis(500);

/// From now on the first Ctrl-C cancels `say`'s token, and keeps files from being replaced; a stage that has not ended soon after,
/// or a second Ctrl-C, ends the program from here.
pub fn handle(say: &Say) {
    let (token, say) = (say.cancel().clone(), say.clone());
    let handled = ctrlc::set_handler(move || {
        if token.is_cancelled() {
            end(&say);
        }
        token.cancel();
        zeroset_io::abandon_writes();
        let say = say.clone();
        thread::spawn(move || {
            thread::sleep(GRACE);
            end(&say);
        });
    });
    // Where no handler can be set, Ctrl-C still ends the program, though not as tidily.
    if let Err(error) = handled {
        tracing::debug!(%error, "no handler of Ctrl-C");
    }
}

/// Ends the program if it was interrupted.
pub fn end_if_interrupted(say: &Say, token: &CancelToken) {
    if token.is_cancelled() {
        end(say);
    }
}

fn end(say: &Say) -> ! {
    // Two threads may come here.
    static TOLD: Once = Once::new();
    TOLD.call_once(|| say.error("interrupted"));
    std::process::exit(EXIT_CODE);
}
