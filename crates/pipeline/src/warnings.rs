//! What else is to be known of a result besides whether it can be [trusted](crate::trust).

use crate::report::{StageFigures, StageReport};
use crate::trust::shape_name;

/// Above this share of points that were left out a warning is given: what strays there are among points of one surface are fewer, and more
/// are often a part of it that is far sparser than the rest.
const MOST_LEFT_OUT: f64 = 0.04;
/// Below this share of zero-set edges with data nearby, a warning is given.
const SUPPORT_EXPECTED: f64 = 0.7;

/// Of the stages. That a surface is open is no news where an `open` one is wanted.
pub fn of_stages(stages: &[StageReport], open: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    for stage in stages {
        match &stage.figures {
            StageFigures::Topology(report) if report.continuation.stages.iter().any(|stage| !stage.settled) => {
                warnings.push(
                    "the orientation of the points did not settle: some may be on the wrong side; try another \
                     --resolution"
                        .into(),
                );
            }
            StageFigures::Sign(report) if report.supported < SUPPORT_EXPECTED && !open => {
                warnings.push(format!(
                    "only {:.0} % of the surface runs where points are: the data have large holes, or the shape is open \
                     (--open)",
                    100.0 * report.supported
                ));
            }
            StageFigures::Sign(report) if report.nodes_clipped > 0 && !open => {
                warnings.push(format!(
                    "{} lattice nodes on the faces of the box were inside and were cut off: the shape may be open (--open)",
                    report.nodes_clipped
                ));
            }
            _ => {}
        }
    }
    warnings
}

/// Where there was too little memory to fill holes with what follows the curvature round them.
pub fn of_flat_holes() -> String {
    "holes of the data are closed more flatly than what is around them: there is too little memory for the fit that follows its curvature; \
     allow more (--memory)"
        .into()
}

/// Where so many of the points were left out that they may belong to the shape.
pub fn of_left_out<const D: usize>(left_out: usize, points: usize) -> Option<String> {
    (left_out as f64 > MOST_LEFT_OUT * points as f64).then(|| {
        format!(
            "{:.1} % of the points were left out, for they lie on no {} with others: if they belong to the shape (--oriented names \
             them), it is sampled too sparsely there",
            100.0 * left_out as f64 / points as f64,
            shape_name(D)
        )
    })
}

/// Where so many points lie so far away that they were left out before anything else.
pub fn of_far_off(points: usize) -> Option<String> {
    (points > 0).then(|| {
        format!("{points} of the points lie many times farther away than the others reach: they were left out")
    })
}
