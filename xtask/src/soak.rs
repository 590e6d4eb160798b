//! `cargo xtask soak`: random small reconstructions without end, and what came of them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use zeroset_tests::{Case, EXECUTIONS, soak};

/// So many of the slowest are named.
const SLOWEST: usize = 5;

/// What `soak` is told.
#[derive(Args)]
pub struct Arguments {
    /// Number of runs
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    runs: u64,
    /// Seed of the first run; each has the next one
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Runs at a time [default: one per core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Seconds after which a run hangs: more on a busy machine
    #[arg(long, value_name = "SECONDS", default_value_t = 30)]
    limit: u64,
    /// File for a table with every run: its seed, seconds per execution, outcome, cloud and options
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
}

/// A run that is over.
struct Done {
    seed: u64,
    /// Of all its executions.
    time: Duration,
    outcome: String,
    case: Case,
}

impl Done {
    /// Seconds of one execution.
    fn seconds(&self) -> f64 {
        self.time.as_secs_f64() / EXECUTIONS
    }
}

/// What came of the runs.
#[derive(Default)]
struct Tally {
    violations: Vec<(u64, String)>,
    done: Vec<Done>,
}

/// Makes the runs, says what came of them, and fails if anything happened that must not.
pub fn run(arguments: &Arguments) -> Result<()> {
    let jobs = arguments.jobs.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from)).max(1);
    let end = arguments.seed.saturating_add(arguments.runs);
    let (next, tally, start) = (AtomicU64::new(arguments.seed), Mutex::new(Tally::default()), Instant::now());
    // Panics are told of below, with the seed; what the hook would print helps nobody find it.
    std::panic::set_hook(Box::new(|_| {}));
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        break;
                    }
                    one(seed, Duration::from_secs(arguments.limit), &tally);
                    let done = seed - arguments.seed + 1;
                    if done.is_multiple_of(500) {
                        eprintln!("{done} runs, {:.0} s", start.elapsed().as_secs_f64());
                    }
                }
            });
        }
    });
    let _ = std::panic::take_hook();
    let mut tally = tally.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    println!("{} runs from seed {} in {:.0} s", arguments.runs, arguments.seed, start.elapsed().as_secs_f64());
    let mut outcomes = BTreeMap::<&str, u64>::new();
    tally.done.iter().for_each(|done| *outcomes.entry(&done.outcome).or_default() += 1);
    for (outcome, count) in &outcomes {
        println!("{count:8} {outcome}");
    }
    if let Some(path) = &arguments.table {
        write_table(path, &mut tally.done).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    tally.done.sort_by_key(|done| std::cmp::Reverse(done.time));
    let slowest = |share: f64| tally.done.get((share * tally.done.len() as f64) as usize).map_or(0.0, Done::seconds);
    let mean = tally.done.iter().map(Done::seconds).sum::<f64>() / tally.done.len().max(1) as f64;
    let (median, tenth, hundredth) = (slowest(0.5), slowest(0.1), slowest(0.01));
    println!(
        "each execution: mean {mean:.2} s, median {median:.2} s, one in ten above {tenth:.2} s, one in a hundred above {hundredth:.2} s"
    );
    for done in tally.done.iter().take(SLOWEST) {
        println!("seed {} took {:.1} s: {}", done.seed, done.seconds(), done.case.name);
    }
    if !tally.violations.is_empty() {
        tally.violations.sort();
        for (seed, violation) in &tally.violations {
            println!("seed {seed}: {violation}");
        }
        bail!("{} of {} runs ended as they must not", tally.violations.len(), arguments.runs);
    }
    Ok(())
}

fn one(seed: u64, limit: Duration, tally: &Mutex<Tally>) {
    let (case, start) = (Case::of_seed(seed), Instant::now());
    let verdict = soak(&case, limit);
    let time = start.elapsed();
    // A tally has no state between two others.
    let mut tally = tally.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let outcome = match verdict {
        Ok(outcome) => format!("{outcome:?}"),
        Err(violation) => {
            let text = format!("{violation:?}: {}; {:?}", case.name, case.options);
            eprintln!("seed {seed}: {text}");
            tally.violations.push((seed, text));
            "VIOLATION".into()
        }
    };
    tally.done.push(Done { seed, time, outcome, case });
}

/// One line a run, by their seeds.
fn write_table(path: &Path, runs: &mut [Done]) -> std::io::Result<()> {
    runs.sort_by_key(|done| done.seed);
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "seed\tseconds\toutcome\tcloud\toptions")?;
    for done in &*runs {
        let (seed, seconds, outcome) = (done.seed, done.seconds(), &done.outcome);
        writeln!(file, "{seed}\t{seconds:.3}\t{outcome}\t{}\t{:?}", done.case.name, done.case.options)?;
    }
    file.flush()
}
