//! Two hundred random small runs, in four parts so that cores share them; `cargo xtask soak` makes as many as one likes.

use std::time::Duration;

use zeroset_tests::{Case, Outcome, soak};

/// Half a minute, on a machine that has four other things to do.
const LIMIT: Duration = Duration::from_secs(120);

fn fifty_random_runs_end_as_they_may(first: u64) {
    let mut sound = 0;
    for seed in first..first + 50 {
        let case = Case::of_seed(seed);
        match soak(&case, LIMIT) {
            Ok(outcome) => sound += usize::from(matches!(outcome, Outcome::Closed | Outcome::Open)),
            Err(violation) => panic!("seed {seed}: {violation:?}: {}; {:?}", case.name, case.options),
        }
    }
    // It is not that everything is refused.
    assert!(sound >= 10, "{sound}");
}

#[test]
fn random_runs_1() {
    fifty_random_runs_end_as_they_may(1_000_000);
}

#[test]
fn random_runs_2() {
    fifty_random_runs_end_as_they_may(1_000_050);
}

#[test]
fn random_runs_3() {
    fifty_random_runs_end_as_they_may(1_000_100);
}

#[test]
fn random_runs_4() {
    fifty_random_runs_end_as_they_may(1_000_150);
}
