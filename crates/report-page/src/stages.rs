//! The stages with their times: a table whose last column is a bar chart.

use std::fmt::Write;

use zeroset::{Report, StageFigures};

use crate::facts::total_seconds;
use crate::markup::{Text, along, count, counted, figure, seconds};

pub(crate) fn table(report: &Report) -> String {
    let total = total_seconds(report);
    let longest = report.stages.iter().map(|stage| stage.seconds).fold(0.0, f64::max);
    let mut html = String::from(
        "<table class=\"stages\"><thead><tr><th scope=\"col\">Stage</th><th scope=\"col\">What it did</th><th scope=\"col\">Time</th>\
         <th scope=\"col\">Share</th></tr></thead><tbody>\n",
    );
    for stage in &report.stages {
        let share = |of: f64| if of > 0.0 { 100.0 * stage.seconds / of } else { 0.0 };
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"number\">{}</td><td><span class=\"bar\" style=\"width:{:.1}%\"></span>\
             <span class=\"share\">{:.0} %</span></td></tr>",
            stage.figures.name(),
            Text(&told(&stage.figures)),
            seconds(stage.seconds),
            // The rest of the cell is for the number.
            0.7 * share(longest),
            share(total)
        );
    }
    let _ = writeln!(
        html,
        "</tbody><tfoot><tr><th scope=\"row\">together</th><td></td><td class=\"number\">{}</td><td></td></tr></tfoot></table>",
        seconds(total)
    );
    html
}

fn told(figures: &StageFigures) -> String {
    match figures {
        StageFigures::Topology(topology) => format!(
            "told inside from outside as the paper does, with {} coefficients",
            count(topology.eigenvector.unknowns)
        ),
        StageFigures::Ladder(ladder) => {
            let tried = counted(ladder.candidates.len(), "candidate");
            let chosen = ladder.choice().map_or_else(String::new, |choice| {
                format!(
                    "; the best scored {} with {} coefficients",
                    figure(choice.judgement.score),
                    count(choice.unknowns)
                )
            });
            let agreed = if ladder.has_agreed() { "; two searches for its normals came to the same" } else { "" };
            format!("told inside from outside: {tried}{chosen}{agreed}")
        }
        StageFigures::Distance(distance) => {
            format!(
                "distance from the points on {} nodes, {}",
                along(&distance.nodes),
                counted(distance.sweeps, "sweep")
            )
        }
        StageFigures::Sign(sign) => format!(
            "gave the distance its sign: {}, {} removed",
            counted(sign.regions_found, "region"),
            count(sign.regions_removed)
        ),
        StageFigures::InitialShape(initial) => {
            format!("a first spline through that, {}", counted(initial.iterations, "iteration"))
        }
        StageFigures::Refinement(refinement) => format!(
            "moved it onto the points: {}, {} of the points held out to judge by",
            counted(refinement.levels.len(), "level"),
            count(refinement.held_out_points)
        ),
        StageFigures::DenseRefinement(refinement) => format!(
            "moved it onto the points: {}, {} of the points held out to judge by",
            counted(refinement.iterations.len(), "iteration"),
            count(refinement.held_out_points)
        ),
        StageFigures::Redistancing(redistancing) => format!(
            "made it a distance around its zero set: slopes off 1 by {} there, {} before",
            figure(redistancing.slope_rms[1]),
            figure(redistancing.slope_rms[0])
        ),
        StageFigures::Simplification(simplification) => {
            match (simplification.handles, simplification.specks, simplification.strays) {
                (0, 0, 0) => "found no handle or speck that hangs on little".to_owned(),
                (handles, specks, 0) => {
                    format!("undid what hung on little: {}, {}", counted(handles, "handle"), counted(specks, "speck"))
                }
                (handles, specks, strays) => format!(
                    "undid what hung on little, or on one point alone: {}, {}",
                    counted(handles, "handle"),
                    counted(specks + strays, "speck")
                ),
            }
        }
        StageFigures::Extraction(extraction) => {
            format!("found the zero set in {} cells", count(extraction.found.cells))
        }
    }
}
