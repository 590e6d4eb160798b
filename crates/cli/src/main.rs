//! The `zeroset` command.

mod arguments;
mod carried;
mod eval;
mod failure;
mod field;
mod info;
mod lattice;
mod mesh;
mod points;
mod reconstruct;
mod spline_file;
mod zero_set;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

use crate::arguments::{Arguments, Command};
use crate::failure::Failure;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let level = if arguments.quiet { tracing::Level::ERROR } else { tracing::Level::INFO };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        // Where nobody reads standard error, there is nobody to tell.
        .log_internal_errors(false)
        .init();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            tell(format_args!("error: {failure}"));
            failure.exit_code()
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(threads) = arguments.threads {
        if threads == 0 {
            return Err(Failure::usage("--threads 0: at least one thread is needed"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(Failure::internal)?;
    }
    let say = Say { quiet: arguments.quiet };
    match &arguments.command {
        Command::Reconstruct(arguments) => reconstruct::run(arguments, say),
        Command::Eval(arguments) => eval::run(arguments, say),
        Command::Mesh(arguments) => mesh::run(arguments, say),
        Command::Field(arguments) => field::run(arguments, say),
        Command::Info(arguments) => info::run(arguments),
    }
}

/// Lines for the user on standard error, unless the run is quiet.
#[derive(Clone, Copy)]
pub struct Say {
    quiet: bool,
}

impl Say {
    fn line(self, text: impl std::fmt::Display) {
        if !self.quiet {
            tell(text);
        }
    }
}

/// A line on standard error; nothing where that is closed.
fn tell(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
