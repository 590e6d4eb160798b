//! What is asked of a case, and whether it was met.

use super::cases::Case;
use super::process::Ending;
use super::row::{DOUBT, Row};

/// Share of points on the right side that a case must reach, percent.
pub fn side_target(case: &Case) -> f64 {
    // Noise that nobody knows is taken for much noise.
    let noise = case.noise.unwrap_or(f64::INFINITY);
    match case.group.as_str() {
        "scan" => 97.0,
        _ if noise > 0.01 => 97.0,
        "outliers" => 99.0,
        _ if noise > 0.0 => 99.0,
        _ => 99.9,
    }
}

/// Whether the right topology is asked of a case.
pub fn topology_asked(case: &Case) -> bool {
    let groups = ["clean", "scale", "thin", "topology", "noise", "2D clean", "2D noise"];
    groups.contains(&case.group.as_str()) && case.noise.is_some_and(|noise| noise <= 0.005)
}

/// What to think of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The points are on the right side, and the topology is right where it is known.
    Right,
    /// What is wrong.
    Wrong(Vec<String>),
    /// Not run, nothing to measure against, or not measured.
    Unknown,
    /// The run broke, was refused or took too long.
    Failed,
}

impl Verdict {
    pub fn of(row: &Row) -> Self {
        match &row.ending {
            None => return Self::Unknown,
            Some(ending) if *ending != Ending::Exit(0) && *ending != DOUBT => return Self::Failed,
            Some(_) => {}
        }
        if row.case.truth.is_none() {
            return Self::Unknown;
        }
        let measures = &row.measures;
        let target = side_target(&row.case);
        let mut wrong = Vec::new();
        match measures.side {
            Some(side) if side < target => wrong.push(format!("side {side:.3} % of {target} %")),
            Some(_) => {}
            // Why it is not measured is told in the notes.
            None => return Self::Unknown,
        }
        if row.topology_right() == Some(false) {
            wrong.push(format!("topology {}", topology(row)));
        }
        if measures.normals.is_some_and(|cosine| cosine < 0.0) {
            wrong.push("inside out".into());
        }
        if wrong.is_empty() { Self::Right } else { Self::Wrong(wrong) }
    }
}

/// Wrong, with exit code 0 and without a warning: what must not be.
pub fn quietly_wrong(row: &Row) -> Option<String> {
    match Verdict::of(row) {
        Verdict::Wrong(reasons) if row.ending == Some(Ending::Exit(0)) && row.warnings.is_empty() => {
            Some(reasons.join(", "))
        }
        _ => None,
    }
}

/// Found and expected topology in words: `1/2 ok`, `3/0, expected 1/2 WRONG`.
pub fn topology(row: &Row) -> String {
    let Some(found) = row.measures.found else { return "–".into() };
    let open = if row.measures.watertight == Some(false) { " open" } else { "" };
    match (row.topology_right(), row.expected()) {
        (Some(true), _) => format!("{found} ok"),
        (Some(false), Some(expected)) => format!("{found}{open}, expected {expected} WRONG"),
        _ => format!("{found}{open}"),
    }
}
