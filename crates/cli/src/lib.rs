//! The `zeroset` command: [`main`] runs it, [`command`] describes it, for manual pages and completions.
//!
//! ```
//! let names: Vec<String> = zeroset_cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
//! assert!(names.contains(&"reconstruct".into()));
//! ```
//!
//! **Not here.** A library to reconstruct with: that is `zeroset`.

// What comes in from outside passes through here: an index that is not there must not end in a panic.
#![warn(clippy::indexing_slicing)]

mod advice;
mod arguments;
mod axis_by_axis;
mod carried;
mod eval;
mod failure;
mod field;
mod info;
mod input;
mod interrupt;
mod lattice;
mod manual;
mod mesh;
mod picture;
mod points;
mod progress;
mod reconstruct;
mod render;
mod report;
mod spline_file;
mod zero_set;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use crate::arguments::{Arguments, Command};
use crate::failure::Failure;
use crate::progress::Say;

pub use crate::manual::{SHELLS, completions, man_pages};

/// Every subcommand with its options.
pub fn command() -> clap::Command {
    Arguments::command()
}

/// Runs the command that the process was started with, and says how it ended.
pub fn main() -> ExitCode {
    let arguments = Arguments::try_parse().unwrap_or_else(|error| advice::on_usage(error).exit());
    let say = Say::new(arguments.quiet);
    let level = if arguments.quiet { tracing::Level::ERROR } else { tracing::Level::WARN };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        // Where nobody reads standard error, there is nobody to tell.
        .log_internal_errors(false)
        .init();
    interrupt::handle(&say);
    let result = run(&arguments, &say);
    interrupt::end_if_interrupted(&say, say.cancel());
    say.end();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            say.error(&failure);
            failure.exit_code()
        }
    }
}

fn run(arguments: &Arguments, say: &Say) -> Result<(), Failure> {
    if let Some(threads) = arguments.threads {
        if threads == 0 {
            return Err(Failure::usage("--threads 0: at least one thread is needed"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::internal)?;
    }
    match &arguments.command {
        Command::Reconstruct(arguments) => reconstruct::run(arguments, say),
        Command::Eval(arguments) => eval::run(arguments, say),
        Command::Mesh(arguments) => mesh::run(arguments, say),
        Command::Field(arguments) => field::run(arguments, say),
        Command::Render(arguments) => render::run(arguments, say),
        Command::Info(arguments) => info::run(arguments),
        Command::Completions(arguments) => manual::run_completions(arguments),
        Command::Man(arguments) => manual::run_man(arguments, say),
    }
}
