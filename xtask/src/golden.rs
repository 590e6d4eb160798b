//! Agreement with other programs: every file of `fixtures/golden` is checked.

mod archive;
mod distances;
mod fits;
mod sign;
mod splines;
mod zero_sets;

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use zeroset_io::Points;

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
    check_saved_splines(root, &python)?;
    check(root)
}

/// SciPy evaluates what the program saves, at map coordinates too.
fn check_saved_splines(root: &Path, python: &Path) -> Result<()> {
    let folder = root.join("target/golden-npz");
    std::fs::create_dir_all(&folder)?;
    for (name, offset) in [("annulus_offset.xy", 0.0), ("annulus_offset.xy", 5e6), ("double_torus.ply", 0.0)] {
        let (points, queries) = (folder.join("points.txt"), folder.join("queries.npy"));
        let (spline, values) = (folder.join("spline.npz"), folder.join("values.npy"));
        let rows: Vec<Vec<f64>> = match zeroset_io::read_points(root.join("fixtures/points").join(name))? {
            Points::Two(set) => set.points.iter().map(|p| p.iter().map(|x| x + offset).collect()).collect(),
            Points::Three(set) => set.points.iter().map(|p| p.iter().map(|x| x + offset).collect()).collect(),
        };
        let text: String =
            rows.iter().map(|row| row.iter().map(|x| format!("{x} ")).collect::<String>() + "\n").collect();
        std::fs::write(&points, text)?;
        let columns = rows[0].len();
        let flat = ndarray::Array2::from_shape_vec((rows.len(), columns), rows.into_iter().flatten().collect())?;
        ndarray_npy::write_npy(&queries, &flat)?;
        let zeroset = || {
            let mut command = Command::new("cargo");
            command.args(["run", "--quiet", "--release", "-p", "zeroset-cli", "--", "--quiet"]).current_dir(root);
            command
        };
        run(zeroset().args(["reconstruct", "--resolution", "32"]).arg(&points).arg("-o").arg(&spline))?;
        run(zeroset().arg("eval").arg(&spline).arg(&queries).arg("-o").arg(&values))?;
        println!("{name} at {offset:e}, saved and evaluated by SciPy:");
        run(Command::new(python).arg("-B").arg(root.join("fixtures/check_npz.py")).args([&spline, &queries, &values]))?;
    }
    Ok(())
}

fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("{command:?} could not be started"))?;
    if !status.success() {
        bail!("{command:?} failed ({status})");
    }
    Ok(())
}
