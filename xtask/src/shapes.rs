//! `cargo xtask shapes`: random shapes that are known exactly, reconstructed, and whether what came out is right, or said not to be.

mod dimension;
mod families;
mod outlines;
mod sampling;
mod solid;
mod table;
mod trial;
mod truth;
mod verdict;

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;

use dimension::Dimension;
use sampling::Sampling;
use trial::{Draw, Trial};

/// What `shapes` is told.
#[derive(Args)]
pub struct Arguments {
    /// Seed of the first run; each has the next one
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Number of runs
    #[arg(long, value_name = "N", default_value_t = 40)]
    runs: usize,
    /// Outlines in the plane instead of solids in space
    #[arg(long)]
    plane: bool,
    /// Only seeds whose family or sampling has this in its name; repeatable, or several with commas between them
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// Runs at a time, which share the cores [default: one per core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Seconds after which a run hangs: more on a busy machine
    #[arg(long, value_name = "SECONDS", default_value_t = 900)]
    limit: u64,
    /// File for a table with a line per run, tab-separated
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Folder for the truth, the result and the oriented points of all runs that are not both right and quiet
    #[arg(long, value_name = "FOLDER")]
    save: Option<PathBuf>,
}

/// Makes the runs and says what came of them; fails if any panics, hangs or has no shape.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.plane { run_in::<2>(arguments) } else { run_in::<3>(arguments) }
}

fn run_in<const D: usize>(arguments: &Arguments) -> Result<()>
where
    [f64; D]: Dimension<D>,
{
    let draws = draws::<D>(arguments)?;
    if let Some(folder) = &arguments.save {
        std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let jobs = arguments.jobs.unwrap_or(cores).max(1);
    let (threads, limit) = (cores.div_ceil(jobs), Duration::from_secs(arguments.limit));
    let (next, done, start) = (AtomicUsize::new(0), Mutex::new((Vec::new(), Vec::new())), Instant::now());
    // Panics are told of below, with the seed; what the hook would print helps nobody find it.
    std::panic::set_hook(Box::new(|_| {}));
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(draw) = draws.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let trial = Trial::run::<D>(*draw, threads, limit, arguments.save.clone());
                    // Nothing is between two states.
                    let mut done = done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    let count = done.0.len() + done.1.len() + 1;
                    let said = match trial {
                        Ok(trial) => {
                            let line = table::line(&trial);
                            done.0.push(trial);
                            line
                        }
                        Err(error) => {
                            let (family, sampling) = (draw.family::<D>(), draw.sampling);
                            let line = format!("seed {}: {family}, {sampling}: {error:#}", draw.seed);
                            done.1.push((draw.seed, line.clone()));
                            line
                        }
                    };
                    eprintln!("{count} of {}, {:.0} s: {said}", draws.len(), start.elapsed().as_secs_f64());
                }
            });
        }
    });
    let _ = std::panic::take_hook();
    let (mut trials, mut broken) = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    trials.sort_by_key(|trial: &Trial| trial.seed);
    broken.sort();
    if let Some(path) = &arguments.table {
        std::fs::write(path, table::values(&trials))
            .with_context(|| format!("{} cannot be written", path.display()))?;
    }
    print!("{}", table::page(&trials));
    if !broken.is_empty() {
        println!("\nBroken:\n");
        broken.iter().for_each(|(_, line)| println!("- {line}"));
        bail!("{} of {} runs ended as they must not", broken.len(), draws.len());
    }
    Ok(())
}

/// The first seeds that are wanted.
fn draws<const D: usize>(arguments: &Arguments) -> Result<Vec<Draw>>
where
    [f64; D]: Dimension<D>,
{
    let names = || <[f64; D]>::FAMILIES.iter().map(|(name, _)| *name).chain(Sampling::ALL.map(Sampling::name));
    if let Some(only) = arguments.only.iter().find(|only| !names().any(|name| name.contains(only.as_str()))) {
        bail!("--only {only}: known are {}", names().collect::<Vec<_>>().join(", "));
    }
    let wanted = |draw: &Draw| {
        let names = [draw.family::<D>(), draw.sampling.name()];
        arguments.only.is_empty()
            || arguments.only.iter().any(|only| names.iter().any(|name| name.contains(only.as_str())))
    };
    Ok((arguments.seed..=u64::MAX).map(Draw::of::<D>).filter(wanted).take(arguments.runs).collect())
}
