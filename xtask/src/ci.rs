//! Everything that a change must pass.

use std::collections::BTreeSet;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// Runs the checks in order and stops at the first that fails.
pub fn run() -> Result<()> {
    let nextest = has("nextest");
    step("format", cargo(&["fmt", "--all", "--check"]))?;
    check_features()?;
    step("lints", cargo(&["clippy", "--quiet", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    // Examples have been checked with the lints: to build them too takes minutes.
    let tests: &[&str] = if nextest { &["nextest", "run"] } else { &["test", "--quiet"] };
    step("tests", cargo(&[tests, &["--workspace", "--lib", "--bins", "--tests"]].concat()))?;
    step("documentation tests", cargo(&["test", "--quiet", "--workspace", "--doc"]))?;
    let mut doc = cargo(&["doc", "--quiet", "--workspace", "--no-deps"]);
    doc.env("RUSTDOCFLAGS", "-D warnings");
    step("documentation", doc)?;
    step("golden data", cargo(&["xtask", "golden"]))?;
    if has("deny") {
        step("dependencies", cargo(&["deny", "--log-level", "error", "check", "licenses", "bans", "sources"]))?;
    } else {
        eprintln!("── dependencies: not checked, for there is no cargo-deny");
    }
    eprintln!("everything passed");
    Ok(())
}

/// Whether cargo has a command that is installed by itself.
pub fn has(name: &str) -> bool {
    cargo(&[name, "--version"]).output().is_ok_and(|output| output.status.success())
}

/// Tasks and tests are to share what is compiled, which takes most of the time: that a dependency has a feature fewer for `cargo xtask`
/// than for the tests makes it, and all that is above it, another crate.
fn check_features() -> Result<()> {
    let (tasks, tests) =
        (dependencies(&["--package", "xtask", "-e", "normal,build"])?, dependencies(&["--workspace"])?);
    let twice: Vec<&str> = tasks.difference(&tests).map(String::as_str).collect();
    if !twice.is_empty() {
        bail!(
            "compiled once more for tests than for tasks, with other features: {}; see `either` in Cargo.toml",
            twice.join("; ")
        );
    }
    Ok(())
}

/// The dependencies of packages, each with its version and features.
fn dependencies(packages: &[&str]) -> Result<BTreeSet<String>> {
    let layout = ["--prefix", "none", "--no-dedupe", "--format", "{p} {f}"];
    let output = cargo(&[&["tree", "--quiet"], packages, &layout[..]].concat())
        .output()
        .context("cargo tree could not be started")?;
    if !output.status.success() {
        bail!("cargo tree failed ({}): {}", output.status, String::from_utf8_lossy(&output.stderr));
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect())
}

fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command.args(arguments);
    command
}

fn step(name: &str, mut command: Command) -> Result<()> {
    eprintln!("── {name}");
    let start = Instant::now();
    let status = command.status().with_context(|| format!("{name}: cargo could not be started"))?;
    if !status.success() {
        bail!("{name} failed ({status}); run it alone with: {command:?}");
    }
    eprintln!("   {name}: {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
