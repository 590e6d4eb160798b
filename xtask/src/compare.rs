//! The release binary over folders of cases, measured against their ground truth. Writes below `target/compare/`.

mod cases;
mod loops;
mod measures;
pub(crate) mod process;
mod row;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod verdict;

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;

use cases::Case;
use measures::{Evaluator, Measures};
use process::{Ending, Usage};
use row::{Bench, Files, Row};

/// What `compare` is told.
#[derive(Args)]
pub struct Arguments {
    /// Folder of cases: one folder each with input.ply, input.xyz or input.xy, and gt.ply or gt.npy where known;
    /// may be given again
    #[arg(long, value_name = "DIR", required = true)]
    data: Vec<PathBuf>,
    /// Folder with eval_side.py, eval.py and eval2d.py [default: `eval` beside each data folder]
    #[arg(long, value_name = "DIR")]
    evaluator: Option<PathBuf>,
    /// Interpreter that has the evaluator's requirements
    #[arg(long, value_name = "PATH", default_value = "python3")]
    python: PathBuf,
    /// Only cases whose name or group contains one of these
    #[arg(long, value_name = "SUBSTRING", value_delimiter = ',')]
    only: Vec<String>,
    /// Larger cases are skipped
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    most_points: usize,
    /// Wall time for one case, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,
    /// The table, with a .tsv beside it [default: target/compare/NAME.md, one per data folder]
    #[arg(long, value_name = "FILE.md")]
    output: Option<PathBuf>,
    /// Cases run side by side; times mean most with 1
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Use this binary instead of building one
    #[arg(long, value_name = "PATH")]
    binary: Option<PathBuf>,
    /// Passed on to `zeroset reconstruct`
    #[arg(last = true, value_name = "OPTIONS")]
    passed: Vec<OsString>,
}

/// Runs all cases of all folders. What happens to a case is told in its row and does not end the command.
pub fn run(root: &Path, arguments: &Arguments) -> Result<()> {
    let mut folders = Vec::new();
    for data in &arguments.data {
        let path = data.canonicalize().with_context(|| format!("{} cannot be found", data.display()))?;
        let mut name = path.file_name().map_or_else(|| "data".into(), |name| name.to_string_lossy().into_owned());
        while folders.iter().any(|(other, _, _)| *other == name) {
            name.push_str("-again");
        }
        let mut cases = cases::find(&path)?;
        cases.retain(|case| chosen(case, &arguments.only));
        if cases.is_empty() {
            bail!(
                "{} holds no cases{}",
                data.display(),
                if arguments.only.is_empty() { "" } else { " of those names" }
            );
        }
        folders.push((name, path, cases));
    }
    let binary = match &arguments.binary {
        Some(binary) => binary.canonicalize().with_context(|| format!("{} cannot be found", binary.display()))?,
        None => build(root)?,
    };
    let work = root.join("target/compare");
    let mut pages = Vec::new();
    for (name, path, cases) in &folders {
        let evaluator = arguments.evaluator.clone().unwrap_or_else(|| path.with_file_name("eval"));
        let evaluator = Evaluator { folder: evaluator, python: arguments.python.clone() };
        if cases.iter().any(|case| case.truth.is_some()) {
            evaluator.check()?;
        }
        let timeout = Duration::from_secs(arguments.timeout);
        let tools = Tools { binary: binary.clone(), timeout, passed: arguments.passed.clone(), evaluator };
        eprintln!("── {name}: {} cases", cases.len());
        let rows = all(cases, &tools, &work.join(name), arguments.most_points, arguments.jobs)?;
        println!("\n{name}\n\n{}", table::groups(&summary::by_group(&rows)));
        pages.push((name.as_str(), table::page(name, &rows), table::separated(name, &rows)));
    }
    let heading = heading(arguments);
    match &arguments.output {
        Some(output) => write(output, &heading, &pages),
        None => pages
            .iter()
            .try_for_each(|page| write(&work.join(format!("{}.md", page.0)), &heading, std::slice::from_ref(page))),
    }
}

fn chosen(case: &Case, only: &[String]) -> bool {
    only.is_empty() || only.iter().any(|part| case.name.contains(part) || case.group.contains(part))
}

fn heading(arguments: &Arguments) -> String {
    let options: Vec<_> = arguments.passed.iter().map(|option| option.to_string_lossy()).collect();
    let options = if options.is_empty() { "default settings".into() } else { format!("`{}`", options.join(" ")) };
    let jobs = if arguments.jobs > 1 { format!(", {} cases side by side", arguments.jobs) } else { String::new() };
    format!(
        "# Comparison with ground truth\n\nMade by `cargo xtask compare`. Machine: {}{jobs}; {options}.\n",
        super::paper::machine()
    )
}

/// Writes the page and, beside it, the tab-separated table.
fn write(output: &Path, heading: &str, pages: &[(&str, String, String)]) -> Result<()> {
    let mut page = heading.to_owned();
    let mut separated = table::separated_heading();
    for (_, markdown, values) in pages {
        page.push('\n');
        page.push_str(markdown);
        separated.push_str(values);
    }
    if let Some(folder) = output.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    for (path, text) in [(output.to_owned(), page), (output.with_extension("tsv"), separated)] {
        fs::write(&path, text).with_context(|| format!("{} cannot be written", path.display()))?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// Builds the release binary and returns its path.
pub(crate) fn build(root: &Path) -> Result<PathBuf> {
    let mut command = Command::new("cargo");
    command.args(["build", "--quiet", "--release", "--bin", "zeroset", "--message-format=json-render-diagnostics"]);
    let output = command.current_dir(root).stderr(Stdio::inherit()).output().context("cargo could not be started")?;
    if !output.status.success() {
        bail!("the binary does not build ({})", output.status);
    }
    let messages = String::from_utf8_lossy(&output.stdout);
    let executable = messages.lines().rev().find_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        Some(PathBuf::from(message.get("executable")?.as_str()?))
    });
    executable.context("cargo does not say where the binary is")
}

/// The rows of all cases, in their order.
fn all(cases: &[Case], bench: &dyn Bench, work: &Path, most_points: usize, jobs: usize) -> Result<Vec<Row>> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                while let Some((place, case)) = {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    cases.get(place).map(|case| (place, case))
                } {
                    let row = Row::of(case, bench, &work.join(&case.name), most_points);
                    if let Ok(row) = &row {
                        eprintln!("[{}/{}] {}", place + 1, cases.len(), table::line(row));
                    }
                    if let Ok(mut done) = done.lock() {
                        done.push((place, row));
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().map_err(|_| anyhow!("a case broke off"))?;
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, row)| row).collect()
}

/// The real thing: the binary and the evaluator's scripts.
struct Tools {
    binary: PathBuf,
    timeout: Duration,
    passed: Vec<OsString>,
    evaluator: Evaluator,
}

impl Bench for Tools {
    fn reconstruct(&self, _: &Case, input: &Path, files: &Files, accept_doubt: bool) -> (Ending, Usage) {
        let mut command = Command::new(&self.binary);
        command.arg("reconstruct").arg(input).arg("-o").arg(&files.result);
        command.arg("--oriented").arg(&files.oriented).arg("--report").arg(&files.report).args(&self.passed);
        if accept_doubt {
            command.arg("--accept-doubt");
        }
        // A file, not a pipe: nobody reads along, and a full pipe would stop the program.
        let log = File::options().create(true).append(true).open(&files.log);
        match log.and_then(|log| Ok((log.try_clone()?, log))) {
            Ok((out, errors)) => {
                command.stdin(Stdio::null()).stdout(out).stderr(errors);
                process::measured(&mut command, self.timeout)
            }
            Err(error) => (Ending::Broken(format!("no log: {error}")), Usage::default()),
        }
    }

    fn measure(&self, case: &Case, truth: &Path, files: &Files) -> Measures {
        self.evaluator.measure(case, truth, files)
    }
}
