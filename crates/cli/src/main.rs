//! The `zeroset` command.

mod arguments;
mod carried;
mod eval;
mod failure;
mod field;
mod info;
mod interrupt;
mod lattice;
mod mesh;
mod picture;
mod points;
mod progress;
mod reconstruct;
mod render;
mod spline_file;
mod zero_set;

use std::process::ExitCode;

use clap::Parser;

use crate::arguments::{Arguments, Command};
use crate::failure::Failure;
use crate::progress::Say;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let say = Say::new(arguments.quiet);
    let level = match (arguments.quiet, say.has_bar()) {
        (true, _) => tracing::Level::ERROR,
        (_, true) => tracing::Level::WARN,
        _ => tracing::Level::INFO,
    };
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
    }
}
