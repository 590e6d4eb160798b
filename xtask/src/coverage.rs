//! `cargo xtask coverage`: how many lines of each numerical crate do its tests reach? Needs cargo-llvm-cov.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::ci::has;

/// Folders of the numerical crates; their packages are named after them, but for the pipeline.
const CRATES: [&str; 9] =
    ["bspline", "eikonal-sweep", "gefm", "isosurface", "lsq-init", "multigrid", "pipeline", "trust-region", "winding"];
/// At least this share of a crate's lines must be reached.
const WANTED: f64 = 0.9;

/// What `coverage` is told.
#[derive(Args)]
pub struct Arguments {
    /// Also name the lines that no test reaches
    #[arg(long)]
    missed: bool,
}

/// Runs the tests of the numerical crates, and those from end to end; prints which share of each crate's lines they reach, and
/// fails if one is too small.
///
/// The lines of tests do not count: they would raise the share by their own number. A short function that only other crates call
/// may be taken for not reached, where the compiler has put it into the caller's place.
pub fn run(root: &Path, arguments: &Arguments) -> Result<()> {
    let root = root.canonicalize()?;
    if !has("llvm-cov") {
        bail!(
            "cargo-llvm-cov is not installed: `cargo install cargo-llvm-cov --locked`, and `rustup component add llvm-tools` or, \
             in LLVM_COV and LLVM_PROFDATA, the paths of both programs of the LLVM that `rustc --version --verbose` names"
        );
    }
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let found = target.join("coverage.lcov");
    let tests = if has("nextest") { "nextest" } else { "test" };
    let mut command = Command::new("cargo");
    command.args(["llvm-cov", tests, "--lib", "--tests", "--package", "zeroset-tests"]);
    for folder in CRATES {
        let package = if folder == "pipeline" { "zeroset".into() } else { format!("zeroset-{folder}") };
        command.args(["--package", &package]);
    }
    command.args(["--lcov", "--output-path"]).arg(&found).current_dir(&root);
    if !command.status().context("cargo could not be started")?.success() {
        bail!("without all tests passed there is nothing to count; run them alone with: {command:?}");
    }
    let text = fs::read_to_string(&found).with_context(|| format!("{} cannot be read", found.display()))?;
    let (files, mut missed, mut low) = (files(&text), String::new(), Vec::new());
    println!("| crate | lines | covered | share |");
    println!("|---|---|---|---|");
    for folder in CRATES {
        let (mut lines, mut covered) = (0, 0);
        for (path, counts) in &files {
            let Ok(inside) = path.strip_prefix(root.join("crates").join(folder).join("src")) else { continue };
            let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
            let end = text.lines().position(|line| line == "#[cfg(test)]").unwrap_or(usize::MAX);
            let own: Vec<_> = counts.iter().filter(|(line, _)| *line <= end).collect();
            let zero: Vec<usize> = own.iter().filter(|(_, count)| *count == 0).map(|(line, _)| *line).collect();
            lines += own.len();
            covered += own.len() - zero.len();
            if !zero.is_empty() {
                writeln!(missed, "{folder}/{}: {}", inside.display(), spans(&zero))?;
            }
        }
        let share = f64::from(covered as u32) / f64::from((lines as u32).max(1));
        println!("| {folder} | {lines} | {covered} | {:.1} % |", 100.0 * share);
        if share < WANTED {
            low.push(folder);
        }
    }
    if arguments.missed {
        print!("\nNot reached:\n{missed}");
    }
    if !low.is_empty() {
        bail!("tests reach fewer than {:.0} % of the lines of {}", 100.0 * WANTED, low.join(", "));
    }
    Ok(())
}

/// From lcov's text: for every file its lines, counted from 1, and how often each was run.
fn files(text: &str) -> Vec<(PathBuf, Vec<(usize, u64)>)> {
    let mut files: Vec<(PathBuf, Vec<(usize, u64)>)> = Vec::new();
    for line in text.lines() {
        if let Some(path) = line.strip_prefix("SF:") {
            files.push((path.into(), Vec::new()));
        } else if let (Some((line, count)), Some((_, lines))) =
            (line.strip_prefix("DA:").and_then(|pair| pair.split_once(',')), files.last_mut())
        {
            lines.extend(line.parse().ok().zip(count.parse().ok()));
        }
    }
    files
}

/// Line numbers in order, as `3, 7-9`.
fn spans(lines: &[usize]) -> String {
    let runs = lines.chunk_by(|a, b| a + 1 == *b);
    let runs =
        runs.map(|run| if run.len() > 1 { format!("{}-{}", run[0], run[run.len() - 1]) } else { run[0].to_string() });
    runs.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_file_by_file() {
        let text = "SF:/a.rs\nFN:1,f\nDA:1,4\nDA:2,0\nLF:2\nend_of_record\nSF:/b.rs\nDA:7,1\nend_of_record\n";
        assert_eq!(files(text), [("/a.rs".into(), vec![(1, 4), (2, 0)]), ("/b.rs".into(), vec![(7, 1)])]);
    }

    #[test]
    fn neighbouring_lines_are_one_span() {
        assert_eq!(spans(&[3, 7, 8, 9, 12]), "3, 7-9, 12");
    }
}
