//! Every format that the program writes, opened by somebody else's program. What `checks/setup.sh` has not installed is skipped.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::target_with_program;

/// Drawings and report pages among the outputs of `checks/formats.py`, and what the browser is told that they are.
const DRAWN: [(&str, &str); 6] = [
    ("svg", "annulus.svg"),
    ("svg", "arc.svg"),
    ("svg", "annulus_levels.svg"),
    ("curve", "annulus.html"),
    ("surface", "ring.html"),
    ("surface", "bowl.html"),
];

pub fn run(root: &Path) -> Result<()> {
    let root = root.canonicalize()?;
    let target = target_with_program(&root, &[])?;
    let (folder, checks) = (target.join("checks"), root.join("checks"));
    let outputs = folder.join("outputs");
    // Outputs are made by the checks in Python; without it there is nothing to open.
    let python = folder.join("python/bin/python");
    if !python.exists() {
        println!("skipped  everything: no {}; checks/setup.sh installs it", python.display());
        return Ok(());
    }
    let mut command = Command::new(&python);
    command.arg("-B").arg(checks.join("formats.py")).arg(target.join("debug/zeroset")).arg(&outputs);
    let mut failed = usize::from(!command.status().with_context(|| python.display().to_string())?.success());

    let glb: Vec<PathBuf> = ["ring.glb", "far.glb", "bowl.glb"].map(|name| outputs.join(name)).to_vec();
    let mut command = node(&checks.join("gltf.mjs"), &folder);
    failed += judged("glb by gltf-validator", &folder.join("node_modules/gltf-validator"), command.args(glb))?;

    let chromium =
        ["/usr/bin/chromium", "/usr/bin/chromium-browser"].map(Path::new).into_iter().find(|path| path.exists());
    for (kind, name) in DRAWN {
        let title = format!("{name} in chromium");
        let Some(chromium) = chromium else {
            println!("skipped  {title}: no chromium; checks/setup.sh installs it");
            continue;
        };
        let mut command = node(&checks.join("browser.mjs"), &folder);
        command.arg(chromium).arg(kind).arg(outputs.join(name)).arg(outputs.join(format!("seen-{name}")));
        failed += judged(&title, &folder.join("node_modules/playwright-core"), &mut command)?;
    }
    if failed > 0 {
        bail!("{failed} checks by other programs failed");
    }
    Ok(())
}

fn node(script: &Path, packages: &Path) -> Command {
    let mut command = Command::new("node");
    command.arg(script).arg(packages);
    command
}

/// Runs a check that ends with a line of JSON; the number of failures.
fn judged(title: &str, package: &Path, command: &mut Command) -> Result<usize> {
    if !package.exists() {
        println!("skipped  {title}: no {}; checks/setup.sh installs it", package.display());
        return Ok(0);
    }
    let output = command.output().with_context(|| format!("{title}: node could not be started"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let found: Value = match text.lines().last().map(serde_json::from_str) {
        Some(Ok(found)) => found,
        _ => bail!("{title}: {}", String::from_utf8_lossy(&output.stderr)),
    };
    let problems = found["problems"].as_array().map(Vec::as_slice).unwrap_or_default();
    for problem in problems {
        println!("FAILED   {title}: {}", problem.as_str().unwrap_or_default());
    }
    if problems.is_empty() {
        let mut said = found.clone();
        said.as_object_mut().map(|said| said.remove("problems"));
        println!("ok       {title}: {said}");
    }
    Ok(usize::from(!problems.is_empty()))
}
