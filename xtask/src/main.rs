//! Project tasks: `cargo xtask bench`, `cargo xtask ci`, `cargo xtask compare`, `cargo xtask coverage`, `cargo xtask faults`,
//! `cargo xtask foreign`, `cargo xtask golden`, `cargo xtask guide`, `cargo xtask manual`, `cargo xtask paper`, `cargo xtask sample`,
//! `cargo xtask shapes`, `cargo xtask soak`.

mod bench;
mod ci;
mod compare;
mod coverage;
mod faults;
mod foreign;
mod golden;
mod guide;
mod manual;
mod paper;
mod sample;
mod shapes;
mod soak;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
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
    /// Time the whole road and its stages, from 2500 points on; with a table and plots.
    Bench(bench::Arguments),
    /// Run everything that a change must pass: format, lints, all tests, documentation, golden data.
    Ci,
    /// Run the release binary over folders of cases and write a table of what came out.
    Compare(compare::Arguments),
    /// Run the tests of the numerical crates and print how many of their lines they reach; needs cargo-llvm-cov.
    Coverage(coverage::Arguments),
    /// Open every format that is written with other programs; those that checks/setup.sh has not installed are skipped.
    Foreign,
    /// Plant faults in a copy of the numerical crates, one at a time, and see whether their tests fail.
    Faults(faults::Arguments),
    /// Compare with the golden data of SciPy, trimesh and scikit-image.
    Golden {
        /// Make fixtures and golden data anew first (needs Python and npm).
        #[arg(long)]
        regenerate: bool,
    },
    /// Run the commands of docs/guide.md, and see whether they print what it says.
    Guide,
    /// Write the manual pages and completions of the command line anew: docs/man, docs/completions.
    Manual,
    /// Redo the paper: Table 1, the figures, its claim measured. Writes docs/paper.
    Paper,
    /// Draw random points from a triangle mesh, uniform by area: inputs of known shape, of any size.
    Sample(sample::Arguments),
    /// Reconstruct random shapes that are known exactly, and see whether what comes out is right, or said not to be.
    Shapes(shapes::Arguments),
    /// Make random small reconstructions, and look for what must not happen: panics, hangs, faulty meshes, results that differ.
    Soak(soak::Arguments),
}

fn main() -> ExitCode {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let result = match Arguments::parse().task {
        Task::Bench(arguments) => bench::run(&root, &arguments),
        Task::Ci => ci::run(),
        Task::Compare(arguments) => compare::run(&root, &arguments),
        Task::Coverage(arguments) => coverage::run(&root, &arguments),
        Task::Foreign => foreign::run(&root),
        Task::Faults(arguments) => faults::run(&root, &arguments),
        Task::Golden { regenerate: false } => golden::check(&root),
        Task::Golden { regenerate: true } => golden::regenerate(&root),
        Task::Guide => guide::run(&root),
        Task::Manual => manual::run(&root),
        Task::Paper if cfg!(debug_assertions) => in_release("paper"),
        Task::Paper => paper::run(&root),
        Task::Sample(arguments) => sample::run(&arguments),
        Task::Shapes(arguments) => shapes::run(&arguments),
        Task::Soak(arguments) => soak::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Builds the program, with such options of cargo; the target folder that it is in.
fn target_with_program(root: &Path, options: &[&str]) -> Result<PathBuf> {
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet", "--package", "zeroset-cli"]).args(options).current_dir(root);
    if !build.status().context("cargo could not be started")?.success() {
        bail!("the program could not be built");
    }
    Ok(std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from))
}

/// Times are only worth something with optimisation: the same task again, built for release.
fn in_release(task: &str) -> Result<()> {
    let mut command = Command::new("cargo");
    command.args(["run", "--quiet", "--release", "--package", "xtask", "--", task]);
    let status = command.status().context("cargo could not be started")?;
    if !status.success() {
        bail!("{task} failed ({status})");
    }
    Ok(())
}
