//! Runs of the program: what they took, and what their reports say.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::ballast::Ballast;
use crate::compare::process::{self, Ending, Usage};

/// No run may take longer.
const LONGEST: Duration = Duration::from_secs(3 * 3600);

/// The benched program.
#[derive(Clone)]
pub struct Program {
    pub binary: PathBuf,
    pub threads: Option<usize>,
    pub repeat: usize,
    /// Where inputs and outputs go.
    pub work: PathBuf,
}

/// One level of the refinement.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Cells along the longest side of the points' box.
    pub cells: f64,
    /// Active functions.
    pub active: f64,
    /// Products with the operator, all steps together.
    pub products: f64,
    pub seconds: f64,
    /// Whether it brought something.
    pub kept: bool,
}

/// Figures of one input, medians over its runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    pub usage: Usage,
    /// Name and wall time, in the order in which they ran.
    pub stages: Vec<(String, f64)>,
    pub levels: Vec<Level>,
    pub warnings: Vec<String>,
}

impl Program {
    /// The same with another number of threads.
    pub fn with_threads(&self, threads: usize) -> Self {
        Self { threads: Some(threads), ..self.clone() }
    }

    /// Runs `zeroset reconstruct` on a points file, as often as asked for.
    pub fn reconstruct(&self, input: &Path, options: &[&OsStr]) -> Result<Figures> {
        let (mesh, report) = (self.work.join("surface.ply"), self.work.join("report.json"));
        let mut runs: Vec<Figures> = Vec::with_capacity(self.repeat);
        for _ in 0..self.repeat {
            let mut command = Command::new(&self.binary);
            command.arg("reconstruct").arg(input).args(options).arg("-o").arg(&mesh).arg("--report").arg(&report);
            // Doubtful or not, the work is the same.
            command.arg("--accept-doubt");
            if let Some(threads) = self.threads {
                command.arg("--threads").arg(threads.to_string());
            }
            let peak = runs.last().and_then(|run| run.usage.peak);
            let usage = timed(&mut command, &self.work.join("log.txt"), peak)?;
            let text = fs::read_to_string(&report).context("the report cannot be read")?;
            let figures = figures(usage, &serde_json::from_str(&text)?);
            eprintln!("{}: {:.2} s, {:.2} s of CPU", input.display(), usage.wall, usage.cpu.unwrap_or(f64::NAN));
            runs.push(figures);
        }
        Ok(median_of_runs(runs))
    }
}

/// Runs a command with its output in a file, in memory that is warm up to the peak of the run before, if there was one; refuses to
/// go on if it fails.
pub fn timed(command: &mut Command, log: &Path, peak: Option<f64>) -> Result<Usage> {
    let out = File::create(log).with_context(|| format!("{} cannot be written", log.display()))?;
    command.stdin(Stdio::null()).stderr(out.try_clone()?).stdout(out);
    let bytes = |megabytes: Option<f64>| megabytes.map_or(0, |megabytes| (1e6 * megabytes) as usize);
    let mut ballast = Ballast::new(bytes(peak));
    match process::watched(command, LONGEST, |usage| ballast.make_room(bytes(usage.peak))) {
        (Ending::Exit(0), usage) => Ok(usage),
        (ending, _) => bail!("{command:?} ended with {ending}: see {}", log.display()),
    }
}

fn figures(usage: Usage, report: &Value) -> Figures {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let mut figures = Figures { usage, stages: vec![], levels: vec![], warnings: vec![] };
    for stage in list(&report["stages"]) {
        let name = stage["stage"].as_str().unwrap_or_default().to_owned();
        figures.stages.push((name, number(&stage["seconds"])));
        figures.levels.extend(list(&stage["levels"]).iter().map(|level| Level {
            cells: (1.0 / number(&level["cell"])).round(),
            active: number(&level["active"]),
            products: list(&level["steps"]).iter().map(|step| number(&step["cg_steps"])).sum(),
            seconds: number(&level["seconds"]),
            kept: !level["best_step"].is_null(),
        }));
    }
    figures.warnings = list(&report["warnings"]).iter().filter_map(|text| Some(text.as_str()?.to_owned())).collect();
    figures
}

/// Runs of the same input have the same stages and levels: one by one the medians of their figures.
fn median_of_runs(runs: Vec<Figures>) -> Figures {
    let over = |figure: &dyn Fn(&Figures) -> f64| median(runs.iter().map(figure).collect());
    let mut result = runs[0].clone();
    result.usage = Usage {
        wall: over(&|run| run.usage.wall),
        cpu: Some(over(&|run| run.usage.cpu.unwrap_or(f64::NAN))),
        peak: Some(over(&|run| run.usage.peak.unwrap_or(f64::NAN))),
    };
    for (place, stage) in result.stages.iter_mut().enumerate() {
        stage.1 = over(&|run| run.stages.get(place).map_or(f64::NAN, |stage| stage.1));
    }
    for (place, level) in result.levels.iter_mut().enumerate() {
        level.seconds = over(&|run| run.levels.get(place).map_or(f64::NAN, |level| level.seconds));
    }
    result
}

/// The middle one, or the lower of the two in the middle.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn medians_of_what_reports_say() {
        let report = |seconds: f64| {
            json!({"stages": [
                {"stage": "ladder", "seconds": seconds},
                {"stage": "refinement", "seconds": 2.0 * seconds, "levels": [
                    {"cell": 0.015625, "active": 100, "seconds": seconds, "best_step": 2,
                        "steps": [{"cg_steps": 12}, {"cg_steps": 9}]},
                    {"cell": 0.0078125, "active": 400, "seconds": 3.0, "best_step": null}]}],
                "warnings": ["dark"]})
        };
        let usage = |wall| Usage { wall, cpu: Some(wall), peak: Some(1.0) };
        let runs = [3.0, 1.0, 2.0].map(|t| figures(usage(t), &report(t)));
        let found = median_of_runs(runs.to_vec());
        assert_eq!(found.usage, usage(2.0));
        assert_eq!(found.stages, [("ladder".into(), 2.0), ("refinement".into(), 4.0)]);
        let level = |cells, active, products, seconds, kept| Level { cells, active, products, seconds, kept };
        assert_eq!(found.levels, [level(64.0, 100.0, 21.0, 2.0, true), level(128.0, 400.0, 0.0, 3.0, false)]);
        assert_eq!(found.warnings, ["dark"]);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.0);
    }
}
