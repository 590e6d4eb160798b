//! The benches of the kernels, one after the other.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

/// Package and bench.
const BENCHES: [(&str, &str); 6] = [
    ("zeroset-multigrid", "band"),
    ("zeroset-multigrid", "solver"),
    ("zeroset-eikonal-sweep", "distance"),
    ("zeroset-lsq-init", "least_squares"),
    ("zeroset-isosurface", "extraction"),
    ("zeroset-winding", "winding"),
];

/// What they print.
pub fn section(root: &Path) -> Result<String> {
    let mut text = String::from("## Kernels\n");
    for (package, bench) in BENCHES {
        eprintln!("── {package}, {bench}");
        let mut command = Command::new("cargo");
        command.args(["bench", "--quiet", "--package", package, "--bench", bench]);
        let output =
            command.current_dir(root).stderr(Stdio::inherit()).output().context("cargo could not be started")?;
        if !output.status.success() {
            bail!("{command:?} failed ({})", output.status);
        }
        let lines = lines(&String::from_utf8_lossy(&output.stdout));
        text.push_str(&format!("\n`cargo bench -p {package} --bench {bench}`\n\n```text\n{lines}```\n"));
    }
    Ok(text)
}

/// The lines with results: of criterion's the names and times, of others all.
fn lines(output: &str) -> String {
    let noise = ["Benchmarking", "Found ", "change:", "Performance has", "No change in", "Change within", "Gnuplot"];
    let is_noise = |line: &str| {
        let line = line.trim_start();
        line.is_empty()
            || noise.iter().any(|start| line.starts_with(start))
            || line.split_once('(').is_some_and(|(_, rest)| rest.contains("%) ") && !line.contains("time:"))
    };
    output.lines().filter(|line| !is_noise(line)).fold(String::new(), |text, line| text + line + "\n")
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn results_are_kept() {
        let output = "Benchmarking sweep\nBenchmarking sweep: Warming up\nsweep   time:   [1.0 ms 1.1 ms 1.2 ms]\n\
                      \u{20}       thrpt:  [1 2 3]\nFound 2 outliers among 10 measurements (20.00%)\n  1 (10.00%) high mild\n\n\
                      band  12.0 ms  30.1 million unknowns per second\n";
        let kept = "sweep   time:   [1.0 ms 1.1 ms 1.2 ms]\n        thrpt:  [1 2 3]\nband  12.0 ms  30.1 million unknowns per second\n";
        assert_eq!(lines(output), kept);
    }
}
