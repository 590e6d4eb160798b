//! One case run and measured.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use super::cases::{Case, Dimension, Topology};
use super::measures::Measures;
use super::process::{Ending, Usage};

/// Exit code of a run that found no trustworthy closed surface.
pub const DOUBT: Ending = Ending::Exit(4);

/// Where a run of a case writes.
pub struct Files {
    /// The surface or the curves.
    pub result: PathBuf,
    pub oriented: PathBuf,
    pub report: PathBuf,
    /// Everything the program said.
    pub log: PathBuf,
    /// The true loops of an outline as they are measured against.
    pub loops: PathBuf,
}

impl Files {
    /// An empty place for a case; what an earlier run left there is removed.
    fn make(folder: &Path, dimension: Dimension) -> Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
        let result = match dimension {
            Dimension::Plane => "curve.json",
            Dimension::Space => "mesh.ply",
        };
        let [result, oriented, report, log, loops] =
            [result, "oriented.ply", "report.json", "log.txt", "loops.json"].map(|name| folder.join(name));
        for path in [&result, &oriented, &report, &log, &loops] {
            if path.exists() {
                fs::remove_file(path).with_context(|| format!("{} cannot be removed", path.display()))?;
            }
        }
        Ok(Self { result, oriented, report, log, loops })
    }
}

/// Runs a case and measures what came out.
pub trait Bench: Sync {
    /// One run of the program; with `accept_doubt` it writes what it found even where it does not trust it.
    fn reconstruct(&self, case: &Case, input: &Path, files: &Files, accept_doubt: bool) -> (Ending, Usage);
    /// Measures the outputs against the ground truth.
    fn measure(&self, case: &Case, truth: &Path, files: &Files) -> Measures;
}

/// What became of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub case: Case,
    /// Why the case was not run.
    pub skipped: Option<String>,
    /// How the run with default settings ended.
    pub ending: Option<Ending>,
    /// The outputs are those of a second run that was told to accept doubt.
    pub accepted_doubt: bool,
    pub usage: Usage,
    pub warnings: Vec<String>,
    pub measures: Measures,
    pub notes: Vec<String>,
}

impl Row {
    /// Runs and measures a case, unless it has no input or more than `most_points` points; writes into `folder` only.
    pub fn of(case: &Case, bench: &dyn Bench, folder: &Path, most_points: usize) -> Result<Self> {
        let mut row = Self {
            case: case.clone(),
            skipped: None,
            ending: None,
            accepted_doubt: false,
            usage: Usage::default(),
            warnings: Vec::new(),
            measures: Measures::default(),
            notes: case.remark.iter().cloned().collect(),
        };
        let Some(input) = &case.input else {
            row.skipped = Some("no input".into());
            return Ok(row);
        };
        if case.points.is_some_and(|points| points > most_points) {
            row.skipped = Some(format!("more than {most_points} points"));
            return Ok(row);
        }
        let files = Files::make(folder, case.dimension)?;
        let (ending, usage) = bench.reconstruct(case, input, &files, false);
        row.usage = usage;
        if ending != Ending::Exit(0) {
            row.notes.extend(last_line(&files.log));
        }
        let complete = files.result.is_file() && files.oriented.is_file();
        if ending == DOUBT && !complete {
            let (second, _) = bench.reconstruct(case, input, &files, true);
            row.accepted_doubt = files.result.is_file() || files.oriented.is_file();
            if !row.accepted_doubt {
                row.notes.push(format!("nothing written with --accept-doubt either (exit {second})"));
            }
        }
        match warnings(&files.report) {
            Ok(warnings) => row.warnings = warnings,
            // A run that failed has said why.
            Err(error) if ending == Ending::Exit(0) || ending == DOUBT => row.notes.push(format!("{error:#}")),
            Err(_) => {}
        }
        row.ending = Some(ending);
        if let Some(truth) = case.truth.as_ref().filter(|_| files.result.is_file() || files.oriented.is_file()) {
            row.measures = bench.measure(case, truth, &files);
            row.notes.append(&mut row.measures.problems);
        }
        Ok(row)
    }

    /// The topology that the index states, or else that of the ground truth.
    pub fn expected(&self) -> Option<Topology> {
        self.case.expected.or(self.measures.truth)
    }

    /// Whether the surface is closed and has the expected topology; `None` where one of them is not known.
    pub fn topology_right(&self) -> Option<bool> {
        let (found, expected) = (self.measures.found?, self.expected()?);
        Some(self.measures.watertight == Some(true) && found == expected)
    }
}

/// The warnings of a report.
fn warnings(report: &Path) -> Result<Vec<String>> {
    let text = fs::read_to_string(report).context("no report")?;
    let report: Value = serde_json::from_str(&text).context("the report is no JSON")?;
    let warnings = report.get("warnings").and_then(Value::as_array).context("the report has no warnings")?;
    Ok(warnings.iter().map(|text| text.as_str().map_or_else(|| text.to_string(), str::to_owned)).collect())
}

/// What the program said last.
fn last_line(log: &Path) -> Option<String> {
    let text = fs::read_to_string(log).ok()?;
    text.lines().rfind(|line| !line.trim().is_empty()).map(str::to_owned)
}
