//! Project tasks: `cargo xtask ci`, `cargo xtask golden`, `cargo xtask paper`.

mod ci;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Project tasks of zeroset.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run everything that a change must pass: format, lints, all tests, documentation, golden data.
    Ci,
}

fn main() -> ExitCode {
    let result = match Arguments::parse().task {
        Task::Ci => ci::run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
