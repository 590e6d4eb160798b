//! Agreement with other programs: every file of `fixtures/golden` is checked.

mod archive;
mod distances;
mod fits;
mod saved_splines;
mod sign;
mod splines;
mod zero_sets;

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

/// One comparison: what was compared, the figure found, and the limit that it must keep.
pub struct Check {
    name: String,
    found: f64,
    limit: Limit,
}

enum Limit {
    AtMost(f64),
    AtLeast(f64),
}

impl Check {
    fn at_most(name: impl Into<String>, found: f64, limit: f64) -> Self {
        Self { name: name.into(), found, limit: Limit::AtMost(limit) }
    }

    fn at_least(name: impl Into<String>, found: f64, limit: f64) -> Self {
        Self { name: name.into(), found, limit: Limit::AtLeast(limit) }
    }

    /// NaN keeps no limit.
    fn holds(&self) -> bool {
        match self.limit {
            Limit::AtMost(limit) => self.found <= limit,
            Limit::AtLeast(limit) => self.found >= limit,
        }
    }
}

/// Checks all golden data.
pub fn check(root: &Path) -> Result<()> {
    let golden = root.join("fixtures/golden");
    let mut checks = splines::check(&golden)?;
    checks.extend(fits::check(&golden)?);
    checks.extend(distances::check(root)?);
    checks.extend(sign::check(root)?);
    checks.extend(zero_sets::check(&golden)?);
    let mut failed = 0;
    for check in &checks {
        let (word, limit) = match check.limit {
            Limit::AtMost(limit) => ("at most", limit),
            Limit::AtLeast(limit) => ("at least", limit),
        };
        let verdict = if check.holds() { "ok" } else { "FAILED" };
        println!("{verdict:6} {:<78} {:>10.3e}  {word} {limit:.1e}", check.name, check.found);
        failed += usize::from(!check.holds());
    }
    println!("{} passed, {failed} failed", checks.len() - failed);
    if failed > 0 {
        bail!("{failed} comparisons with golden data failed");
    }
    Ok(())
}

/// Makes fixtures and golden data anew, in a Python environment of the pinned versions.
pub fn regenerate(root: &Path) -> Result<()> {
    let folder = root.join("fixtures");
    let environment = root.join("target/golden-python");
    let python = environment.join("bin/python");
    run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(folder.join("requirements.txt")))?;
    for script in ["make_fixtures.py", "make_golden.py"] {
        run(Command::new(&python).arg("-B").arg(folder.join(script)))?;
    }
    saved_splines::check(root, &python)?;
    check(root)
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("{command:?} could not be started"))?;
    if !status.success() {
        bail!("{command:?} failed ({status})");
    }
    Ok(())
}
