//! One random run, and everything about it that must hold.

use std::time::Duration;

use zeroset::{
    Normals, Options, Point, ReconstructError, Reconstruction, Watch, extract_curve, extract_surface, reconstruct,
    reconstruct_with_normals,
};

use crate::case::{Case, Cloud};
use crate::half_edges::{Faults, faults_of_loops, faults_of_mesh};
use crate::time_limit::{Ended, within};

/// A right end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// A closed result without a doubt.
    Closed,
    /// A result with a boundary, as was wished, without a doubt.
    Open,
    /// A result with a doubt.
    Doubt,
    /// No surface was found.
    NoSurface,
    /// The points were refused.
    Refused,
    /// The options were refused: too little memory.
    Limited,
}

/// What must not happen.
#[derive(Debug, Clone, PartialEq)]
pub enum Violation {
    /// A panic, or a hang.
    Ended(Ended),
    /// A result that is said to be closed has faults.
    NotClosed(Faults),
    /// Another number of threads gave something else.
    Different(&'static str),
    /// A result, or a report, with numbers that are none.
    NotFinite(&'static str),
    /// An error that is neither the points' nor the options', nor that there is no surface.
    Failed(String),
}

/// Threads of the two executions of a case.
const THREADS: [usize; 2] = [1, 3];
/// How many these are.
pub const EXECUTIONS: f64 = THREADS.len() as f64;

/// Runs a case with one thread and with three, and looks at what comes out; it hangs if it is not done within `limit`. The runs
/// themselves take a fraction of a second, or a few at worst, but share a busy machine with others.
///
/// # Errors
/// What must not happen.
pub fn soak(case: &Case, limit: Duration) -> Result<Outcome, Violation> {
    let case = case.clone();
    within(limit, move || {
        let [one, other] = THREADS.map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map(|pool| pool.install(|| run(&case)))
                .unwrap_or_else(|error| Err(Violation::Failed(format!("{threads} threads cannot be had: {error}"))))
        });
        let (one, other) = (one?, other?);
        for (same, what) in [
            (one.coefficients == other.coefficients, "coefficients"),
            (one.vertices == other.vertices, "vertices"),
            (one.indices == other.indices, "triangles or loops"),
            (one.report == other.report, "report"),
            (one.outcome == other.outcome, "outcome"),
        ] {
            if !same {
                return Err(Violation::Different(what));
            }
        }
        Ok(one.outcome)
    })
    .unwrap_or_else(|ended| Err(Violation::Ended(ended)))
}

/// What a run leaves, as bits.
struct Run {
    outcome: Outcome,
    coefficients: Vec<u64>,
    vertices: Vec<u64>,
    indices: Vec<u32>,
    report: serde_json::Value,
}

fn run(case: &Case) -> Result<Run, Violation> {
    match &case.cloud {
        Cloud::Two(points) => {
            reconstructed(points, &case.options, |result| match extract_curve(result) {
                Err(error) => Err(error),
                Ok((curves, _)) => {
                    let lines = || curves.loops.iter().chain(&curves.paths);
                    let vertices = lines().flatten().copied().collect();
                    let indices = lines().map(|line| line.len() as u32).collect();
                    // A curve of loops alone claims to be closed.
                    let closed = curves.paths.is_empty();
                    Ok(Extracted { vertices, indices, closed, faults: faults_of_loops(&curves.loops) })
                }
            })
        }
        Cloud::Three(points) => reconstructed(points, &case.options, |result| match extract_surface(result) {
            Err(error) => Err(error),
            Ok((mesh, topology)) => Ok(Extracted {
                closed: topology.closed,
                faults: faults_of_mesh(&mesh.vertices, &mesh.triangles),
                indices: mesh.triangles.concat(),
                vertices: mesh.vertices,
            }),
        }),
    }
}

struct Extracted<const D: usize> {
    vertices: Vec<[f64; D]>,
    indices: Vec<u32>,
    /// Whether it is said to be.
    closed: bool,
    faults: Faults,
}

fn reconstructed<const D: usize>(
    points: &[[f64; D]],
    options: &Options,
    extract: impl FnOnce(&mut Reconstruction<D>) -> Result<Extracted<D>, ReconstructError>,
) -> Result<Run, Violation>
where
    [f64; D]: Point<D>,
{
    let made = match options.normals {
        Normals::Ignore => reconstruct(points, options),
        Normals::Hint | Normals::Trust => reconstruct_with_normals(points, points, options, &Watch::default()),
    };
    let mut result = match made {
        Ok(result) => result,
        Err(error) => return refused(&error),
    };
    let extracted = match extract(&mut result) {
        Ok(extracted) => extracted,
        Err(error) => return refused(&error),
    };
    if (extracted.closed || !options.open) && !extracted.faults.none() {
        return Err(Violation::NotClosed(extracted.faults));
    }
    let oriented = result.oriented(points);
    if oriented.iter().any(|p| !(p.normal.iter().all(|n| n.is_finite()) && (0.0..=1.0).contains(&p.confidence))) {
        return Err(Violation::NotFinite("normals or confidences"));
    }
    let coefficients: Vec<f64> = match result.in_data_units() {
        Ok((_, spline)) => {
            let levels = spline.levels().iter().flat_map(|level| level.corrections());
            spline.root().as_flat().iter().chain(levels).copied().collect()
        }
        Err(error) => return refused(&error),
    };
    if coefficients.iter().any(|c| !c.is_finite()) {
        return Err(Violation::NotFinite("coefficients"));
    }
    // JSON has no word for them.
    let said = format!("{:?}", result.report);
    if [": NaN", ": inf", ": -inf", "[NaN", "[inf", ", NaN", ", inf"].iter().any(|part| said.contains(part)) {
        return Err(Violation::NotFinite("report"));
    }
    let mut report = serde_json::to_value(&result.report).map_err(|error| Violation::Failed(error.to_string()))?;
    without_seconds(&mut report);
    let outcome = match (result.report.doubt.is_some(), options.open) {
        (true, _) => Outcome::Doubt,
        (false, true) if !extracted.closed => Outcome::Open,
        (false, _) => Outcome::Closed,
    };
    Ok(Run {
        outcome,
        coefficients: coefficients.into_iter().map(f64::to_bits).collect(),
        vertices: extracted.vertices.into_iter().flatten().map(f64::to_bits).collect(),
        indices: extracted.indices,
        report,
    })
}

fn refused(error: &ReconstructError) -> Result<Run, Violation> {
    let outcome = match error {
        error if error.is_input() => Outcome::Refused,
        error if error.is_option() => Outcome::Limited,
        error if error.is_doubt() => Outcome::NoSurface,
        error => return Err(Violation::Failed(error.to_string())),
    };
    let report = serde_json::Value::String(error.to_string());
    Ok(Run { outcome, coefficients: vec![], vertices: vec![], indices: vec![], report })
}

/// Takes wall times, the only thing in a report that may differ from run to run, out of it.
pub fn without_seconds(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(object) => {
            object.remove("seconds");
            object.values_mut().for_each(without_seconds);
        }
        serde_json::Value::Array(array) => array.iter_mut().for_each(without_seconds),
        _ => {}
    }
}
