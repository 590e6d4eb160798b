//! Measures against the ground truth, by the evaluator's scripts.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::cases::{Case, Dimension, Topology};
use super::loops::write_oriented;
use super::row::Files;

/// Points farther from the truth than this are outliers, in percent of its diagonal; for the group `outliers` only.
const OUTLIER_TOLERANCE: &str = "5";

/// What the evaluator found; `None` where it found nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measures {
    /// Share of the points whose normal points to the truth's outside, percent.
    pub side: Option<f64>,
    /// Mean of both mean distances, percent of the truth's diagonal.
    pub chamfer: Option<f64>,
    pub found: Option<Topology>,
    /// In the plane every curve is closed.
    pub watertight: Option<bool>,
    /// The truth's own topology.
    pub truth: Option<Topology>,
    /// Mean cosine between the normals of both surfaces; −1 is inside out.
    pub normals: Option<f64>,
    /// What could not be measured, and why.
    pub problems: Vec<String>,
}

/// The evaluator's folder and the interpreter that runs it.
pub struct Evaluator {
    pub folder: PathBuf,
    pub python: PathBuf,
}

impl Evaluator {
    /// Fails with a sentence if the scripts cannot run.
    pub fn check(&self) -> Result<()> {
        for script in ["eval_side.py", "eval.py", "eval2d.py"] {
            let path = self.folder.join(script);
            if !path.is_file() {
                bail!("{} is not there: give the evaluator's folder with --evaluator", path.display());
            }
        }
        self.run("eval.py", &["--help".as_ref()])
            .context("the evaluator does not run: give an interpreter that has its requirements with --python")?;
        Ok(())
    }

    /// All measures of what a run wrote; outputs that are missing are problems.
    pub fn measure(&self, case: &Case, truth: &Path, files: &Files) -> Measures {
        let mut measures = Measures::default();
        let mut truth = truth;
        if case.dimension == Dimension::Plane {
            match write_oriented(truth, &files.loops) {
                Ok(()) => truth = &files.loops,
                Err(error) => measures.problems.push(format!("the true loops are taken as they run: {error:#}")),
            }
        }
        let outliers = case.group == "outliers";
        let tolerance: &[&Path] = if outliers { &["--tol".as_ref(), OUTLIER_TOLERANCE.as_ref()] } else { &[] };
        match self.ask("eval_side.py", truth, "--oriented", &files.oriented, tolerance) {
            Ok(answer) => measures.side = number(&answer, "side").map(|share| 100.0 * share),
            Err(error) => measures.problems.push(format!("side: {error:#}")),
        }
        let (script, option) = match case.dimension {
            Dimension::Plane => ("eval2d.py", "--curve"),
            Dimension::Space => ("eval.py", "--mesh"),
        };
        match self.ask(script, truth, option, &files.result, &[]) {
            Ok(answer) => read_shape(&answer, case.dimension, &mut measures),
            Err(error) => measures.problems.push(format!("shape: {error:#}")),
        }
        measures
    }

    fn ask(&self, script: &str, truth: &Path, option: &str, output: &Path, more: &[&Path]) -> Result<Value> {
        if !output.is_file() {
            bail!("no {}", output.file_name().unwrap_or_default().display());
        }
        let mut arguments = vec!["--json".as_ref(), "--gt".as_ref(), truth, option.as_ref(), output];
        arguments.extend(more);
        let answer = self.run(script, &arguments)?;
        // Python writes numbers that JSON does not know.
        let answer = answer.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null");
        let last = answer.lines().last().unwrap_or_default();
        serde_json::from_str(last).with_context(|| format!("{script} gave no JSON"))
    }

    fn run(&self, script: &str, arguments: &[&Path]) -> Result<String> {
        let mut command = Command::new(&self.python);
        // The evaluator's folder may be read-only, and is not ours to write into.
        command.env("PYTHONDONTWRITEBYTECODE", "1").arg(self.folder.join(script)).args(arguments);
        let output = command.output().with_context(|| format!("{} cannot be started", self.python.display()))?;
        if !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            bail!("{script}: {}", errors.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("failed"));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }
}

fn number(answer: &Value, key: &str) -> Option<f64> {
    answer.get(key).and_then(Value::as_f64)
}

fn read_shape(answer: &Value, dimension: Dimension, measures: &mut Measures) {
    measures.chamfer = number(answer, "chamfer_l1");
    match dimension {
        Dimension::Plane => {
            let loops = |key| {
                let components = answer.get(key).and_then(Value::as_u64);
                components.map(|components| Topology { components, genus: None })
            };
            measures.found = loops("loops");
            measures.truth = loops("gt_loops");
            measures.watertight = measures.found.map(|_| true);
        }
        Dimension::Space => {
            measures.normals = number(answer, "nc_signed");
            if let Some(mesh) = answer.get("mesh") {
                measures.found = surface(mesh);
                measures.watertight = mesh.get("watertight").and_then(Value::as_bool);
            }
            let truth = answer.get("gt").filter(|gt| gt.get("watertight").and_then(Value::as_bool) == Some(true));
            measures.truth = truth.and_then(surface);
        }
    }
    if let Some(error) = answer.get("error").and_then(Value::as_str) {
        measures.problems.push(format!("shape: {error}"));
    }
}

/// Components and genus; a surface that is not closed has no genus.
fn surface(figures: &Value) -> Option<Topology> {
    let components = figures.get("components").and_then(Value::as_u64)?;
    Some(Topology { components, genus: figures.get("genus").and_then(Value::as_u64) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_the_evaluator() {
        let answer = r#"{"ok": true, "chamfer_l1": 0.125, "nc_signed": 0.98,
            "mesh": {"components": 2, "genus": null, "watertight": false}, "gt": {"components": 1, "genus": 3, "watertight": true}}"#;
        let mut measures = Measures::default();
        read_shape(&serde_json::from_str(answer).expect("JSON"), Dimension::Space, &mut measures);
        assert_eq!(measures.chamfer, Some(0.125));
        assert_eq!(measures.normals, Some(0.98));
        assert_eq!(measures.found, Some(Topology { components: 2, genus: None }));
        assert_eq!(measures.watertight, Some(false));
        assert_eq!(measures.truth, Some(Topology { components: 1, genus: Some(3) }));

        // No curve at all: the evaluator then states loops only.
        let mut measures = Measures::default();
        let answer = r#"{"ok": false, "loops": 0, "gt_loops": 2}"#;
        read_shape(&serde_json::from_str(answer).expect("JSON"), Dimension::Plane, &mut measures);
        assert_eq!(measures.chamfer, None);
        assert_eq!(measures.found, Some(Topology { components: 0, genus: None }));
        assert_eq!(measures.truth, Some(Topology { components: 2, genus: None }));
    }
}
