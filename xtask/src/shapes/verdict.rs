//! What to think of a run.

use super::dimension::Topology;
use super::sampling::Sampling;

/// What the program said of its result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// Nothing.
    Quiet,
    /// One warning or several.
    Warned,
    /// That it is not to be trusted, or that there is none.
    Doubt,
}

impl Said {
    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Warned => "warned",
            Self::Doubt => "doubt",
        }
    }
}

/// Share of the points that must be on the right side.
pub fn side_wanted(sampling: Sampling) -> f64 {
    match sampling {
        Sampling::Clean | Sampling::Uneven | Sampling::Missing => 0.999,
        Sampling::Noise | Sampling::Outliers => 0.99,
    }
}

/// What is wrong with a result: the share of points on the right side, and its parts. Nothing, if it is right.
pub fn faults(sampling: Sampling, side: f64, found: Topology, truth: Topology) -> Vec<String> {
    let mut faults = Vec::new();
    if side < side_wanted(sampling) {
        faults.push(format!("side {:.2} %", 100.0 * side));
    }
    if found != truth {
        faults.push(format!("parts {found}, expected {truth}"));
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_and_parts_must_both_be_right() {
        let torus = Topology { parts: 1, genus: Some(1), closed: true };
        let none: [String; 0] = [];
        assert_eq!(faults(Sampling::Clean, 0.999, torus, torus), none);
        assert_eq!(faults(Sampling::Noise, 0.99, torus, torus), none);
        assert_eq!(faults(Sampling::Clean, 0.99, torus, torus), ["side 99.00 %"]);
        let ball = Topology { genus: Some(0), ..torus };
        assert_eq!(faults(Sampling::Outliers, 1.0, ball, torus), ["parts 1/0, expected 1/1"]);
        let open = Topology { closed: false, ..torus };
        assert_eq!(faults(Sampling::Missing, 0.5, open, torus), ["side 50.00 %", "parts 1/1 open, expected 1/1"]);
    }
}
