//! `cargo xtask faults`: do the tests see faults? Each is planted alone in a copy of the work tree, where its crate's tests must fail.

mod planted;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use planted::{FAULTS, Fault};

/// A crate's tests that take longer run in circles, which is seen too.
const LIMIT: Duration = Duration::from_secs(600);
/// At least this share must be caught.
const WANTED: f64 = 0.9;

/// What `faults` is told.
#[derive(Args)]
pub struct Arguments {
    /// Where to copy the work tree to, with a target folder of its own; an existing copy is used again
    #[arg(long, value_name = "FOLDER")]
    copy: PathBuf,
    /// Only the faults of this crate, by its folder; repeatable
    #[arg(long, value_name = "CRATE")]
    only: Vec<String>,
}

/// What came of a fault.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Caught,
    Missed,
    OutOfTime,
    DoesNotCompile,
}

/// Plants every fault, prints what came of it, and fails if too many are missed.
pub fn run(root: &Path, arguments: &Arguments) -> Result<()> {
    copy_tree(root, &arguments.copy)?;
    let wanted = |fault: &&Fault| arguments.only.is_empty() || arguments.only.iter().any(|only| only == fault.folder);
    let (mut caught, mut all, mut sound) = (0, 0, "");
    println!("| crate | file | fault | tests |");
    println!("|---|---|---|---|");
    for fault in FAULTS.iter().filter(wanted) {
        if sound != fault.folder {
            if tests(&arguments.copy, fault.folder)? != Verdict::Missed {
                bail!("the tests of {} fail, or do not compile, without any fault", fault.folder);
            }
            sound = fault.folder;
        }
        let verdict = planted(&arguments.copy, fault)?;
        let said = match verdict {
            Verdict::Caught => "caught",
            Verdict::OutOfTime => "caught: they never end",
            Verdict::Missed => "**missed**",
            Verdict::DoesNotCompile => bail!("{}: `{}` does not compile", fault.file, fault.wrong),
        };
        all += 1;
        caught += usize::from(verdict != Verdict::Missed);
        println!(
            "| {} | {} | `{}` → `{}` | {said} |",
            fault.folder,
            fault.file,
            fault.right,
            fault.wrong.replace('\n', " ")
        );
    }
    let share = f64::from(caught as u32) / f64::from(all.max(1));
    println!("\n{caught} of {all} caught: {:.0} %", 100.0 * share);
    if share < WANTED {
        bail!("fewer than {:.0} % are caught", 100.0 * WANTED);
    }
    Ok(())
}

/// Copies what git knows, as it stands in the work tree.
fn copy_tree(root: &Path, copy: &Path) -> Result<()> {
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(root).output().context("git is needed")?;
    for name in String::from_utf8_lossy(&listed.stdout).split_terminator('\0') {
        let (from, to) = (root.join(name), copy.join(name));
        let content = fs::read(&from).with_context(|| format!("{} cannot be read", from.display()))?;
        // A file that has not changed keeps its time, so that it is not built again.
        if fs::read(&to).is_ok_and(|there| there == content) {
            continue;
        }
        fs::create_dir_all(to.parent().unwrap_or(copy))?;
        fs::write(&to, content).with_context(|| format!("{} cannot be written", to.display()))?;
    }
    Ok(())
}

fn planted(copy: &Path, fault: &Fault) -> Result<Verdict> {
    let path = copy.join("crates").join(fault.folder).join("src").join(fault.file);
    let text = fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()))?;
    if text.matches(fault.right).count() != 1 {
        bail!("{}: `{}` does not stand there exactly once", path.display(), fault.right);
    }
    fs::write(&path, text.replace(fault.right, fault.wrong))?;
    let verdict = tests(copy, fault.folder);
    fs::write(&path, text)?;
    verdict
}

/// Builds and runs the tests of a crate: missed means that all pass.
fn tests(copy: &Path, folder: &str) -> Result<Verdict> {
    let package = if folder == "pipeline" { "zeroset".into() } else { format!("zeroset-{folder}") };
    let cargo = |last: &[&str]| {
        let mut command = Command::new("cargo");
        command.args(["test", "--quiet", "--package", &package, "--lib", "--tests"]).args(last).current_dir(copy);
        command.env("CARGO_TARGET_DIR", copy.join("target")).stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    if !cargo(&["--no-run"]).status().context("cargo could not be started")?.success() {
        return Ok(Verdict::DoesNotCompile);
    }
    let (mut child, start) = (cargo(&[]).spawn()?, Instant::now());
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(if status.success() { Verdict::Missed } else { Verdict::Caught });
        }
        if start.elapsed() > LIMIT {
            child.kill()?;
            child.wait()?;
            return Ok(Verdict::OutOfTime);
        }
        thread::sleep(Duration::from_millis(50));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_still_has_its_place() {
        let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
        assert!(FAULTS.len() >= 40);
        for fault in FAULTS {
            let text = fs::read_to_string(crates.join(fault.folder).join("src").join(fault.file)).unwrap();
            assert_eq!(text.matches(fault.right).count(), 1, "{}: {}", fault.file, fault.right);
            assert_ne!(fault.right, fault.wrong);
        }
    }
}
