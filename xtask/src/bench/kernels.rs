//! The benches of the kernels, one after the other.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use super::reference::Core;

/// Package, bench, and what the bench is told.
const BENCHES: [(&str, &str, &[&str]); 8] = [
    ("zeroset-multigrid", "band", &["256"]),
    ("zeroset-multigrid", "band", &["512"]),
    ("zeroset-multigrid", "band", &["1024"]),
    ("zeroset-multigrid", "solver", &[]),
    ("zeroset-eikonal-sweep", "distance", &[]),
    ("zeroset-lsq-init", "least_squares", &[]),
    ("zeroset-isosurface", "extraction", &[]),
    ("zeroset-winding", "winding", &[]),
];

/// What they print with one thread, but where they have pools of their own, and how much of what a core can do they reach.
pub fn section(root: &Path, core: &Core) -> Result<String> {
    let (mut text, mut kernels) = (String::new(), Vec::new());
    for (package, bench, told) in BENCHES {
        eprintln!("── {package}, {bench} {}", told.join(" "));
        let mut command = Command::new("cargo");
        command.args(["bench", "--quiet", "--package", package, "--bench", bench, "--"]).args(told);
        command.env("RAYON_NUM_THREADS", "1");
        let output =
            command.current_dir(root).stderr(Stdio::inherit()).output().context("cargo could not be started")?;
        if !output.status.success() {
            bail!("{command:?} failed ({})", output.status);
        }
        let lines = lines(&String::from_utf8_lossy(&output.stdout));
        let told = told.join(" ");
        kernels.extend(kernels_of(&lines).into_iter().map(|kernel| (told.clone(), kernel)));
        let told = if told.is_empty() { told } else { format!(" -- {told}") };
        text.push_str(&format!(
            "\n`RAYON_NUM_THREADS=1 cargo bench -p {package} --bench {bench}{told}`\n\n```text\n{lines}```\n"
        ));
    }
    let mut page = String::from(
        "## Kernels\n\nOn one thread. Shares are of the triad's bandwidth and of the multiply-adds that one core does, if every number \
         had to be moved, and every product of the formula made, only once; where the number of products depends on the data there \
         is none.\n\n| kernel | units per second | of the bandwidth | of the arithmetic |\n|---|---|---|---|\n",
    );
    for (told, Kernel { name, rate, bytes, multiplications }) in kernels {
        let share = |least: f64, most: f64| match rate * least / most {
            share if share > 0.0 => format!("{:.1} %", 100.0 * share),
            _ => "–".into(),
        };
        let told = if told.is_empty() { told } else { format!(", {told} cells") };
        page.push_str(&format!(
            "| {name}{told} | {rate:.3e} | {} | {} |\n",
            share(bytes, core.bandwidth),
            share(multiplications, core.arithmetic)
        ));
    }
    Ok(page + &text)
}

/// How fast a kernel is, and the least that it has to do for each of its units.
#[derive(Debug, PartialEq)]
struct Kernel {
    name: String,
    /// Units per second.
    rate: f64,
    bytes: f64,
    multiplications: f64,
}

/// The kernels of which a bench tells the least that they have to do: "at least B bytes and M multiplications each", after their rate in
/// millions per second, or, where criterion tells that, after their name.
fn kernels_of(lines: &str) -> Vec<Kernel> {
    let number =
        |text: &str, after: &str| -> Option<f64> { text.split_once(after)?.1.split_whitespace().next()?.parse().ok() };
    let kernel = |line: &str| {
        let (found, least) = line.split_once(" at least ")?;
        let bytes = least.split_whitespace().next()?.parse().ok()?;
        let multiplications = number(least, "bytes and ")?;
        let (name, rate) = match found.split_once(" million ") {
            Some((before, _)) => {
                let (rest, rate) = before.rsplit_once(' ')?;
                let name = rest.split_once("  ").map_or(rest, |(name, _)| name);
                (name.trim(), 1e6 * rate.parse::<f64>().ok()?)
            }
            None => {
                let name = found.trim_end_matches(':');
                (name, criterion_rate(lines, name)?)
            }
        };
        Some(Kernel { name: name.into(), rate, bytes, multiplications })
    };
    lines.lines().filter_map(kernel).collect()
}

/// Elements per second of one of criterion's benches, the middle of its three numbers.
fn criterion_rate(lines: &str, name: &str) -> Option<f64> {
    let (_, after) = lines.split_once(name).filter(|(_, after)| !after.starts_with(':'))?;
    let mut numbers = after.split_once("thrpt:")?.1.split_whitespace().skip(2);
    let (middle, unit) = (numbers.next()?, numbers.next()?);
    let factor = match unit {
        "elem/s" => 1.0,
        "Kelem/s" => 1e3,
        "Melem/s" => 1e6,
        "Gelem/s" => 1e9,
        _ => return None,
    };
    Some(factor * middle.parse::<f64>().ok()?)
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
    use super::*;

    #[test]
    fn results_are_kept() {
        let output = "Benchmarking sweep\nBenchmarking sweep: Warming up\nsweep   time:   [1.0 ms 1.1 ms 1.2 ms]\n\
                      \u{20}       thrpt:  [1 2 3]\nFound 2 outliers among 10 measurements (20.00%)\n  1 (10.00%) high mild\n\n\
                      band  12.0 ms  30.1 million unknowns per second\n";
        let kept = "sweep   time:   [1.0 ms 1.1 ms 1.2 ms]\n        thrpt:  [1 2 3]\nband  12.0 ms  30.1 million unknowns per second\n";
        assert_eq!(lines(output), kept);
    }
    #[test]
    fn rates_are_found_with_the_least_that_is_done() {
        let output = "2 points, 1 thread\n\
                      thin-plate energy            12.34 ms     44.5 million unknowns per second and thread, at least 16 bytes and 48 multiplications each\n\
                      dense energy, 64 cells     31.0 million unknowns per second and thread, at least 16 bytes and 48 multiplications each\n\
                      128x128x128/Godunov     time:   [90.1 ms 91.2 ms 92.3 ms]\n\
                      \u{20}                       thrpt:  [22.1 Melem/s 22.6 Melem/s 22.9 Melem/s]\n\
                      128x128x128/Godunov: at least 128 bytes and 56 multiplications each\n";
        let kernel =
            |name: &str, rate, bytes, multiplications| Kernel { name: name.into(), rate, bytes, multiplications };
        let wanted = [
            kernel("thin-plate energy", 44.5e6, 16.0, 48.0),
            kernel("dense energy, 64 cells", 31e6, 16.0, 48.0),
            kernel("128x128x128/Godunov", 22.6e6, 128.0, 56.0),
        ];
        assert_eq!(kernels_of(output), wanted);
    }
}
