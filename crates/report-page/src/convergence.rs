//! Plots of the stages that iterate.

use zeroset::gefm::LadderReport;
use zeroset::trust_region::LevelsReport;
use zeroset::{NO_TRUST, Report, StageFigures, gefm, trust_region};

use crate::markup::{count, figure};
use crate::plot::{Plot, Series};

/// Figures in the order of the stages, with a word on each kind.
pub(crate) fn plots(report: &Report) -> String {
    // Lengths in the frame are those of the data times this.
    let scale = report.frame.scale;
    let mut html = String::new();
    for stage in &report.stages {
        let (words, plots) = match &stage.figures {
            StageFigures::Ladder(ladder) => (
                "Inside and outside: functions on finer and finer lattices, each judged by winding numbers. Smaller is better; the one that \
                 was kept has large dots. Below each: how many coefficients it has, and its smoothing length ℓ in spacings.",
                vec![candidates(ladder)],
            ),
            StageFigures::Topology(topology) => (
                "Inside and outside, as the paper tells them apart: each eigenvector is kept if it comes closer to the points than the last.",
                vec![eigenvectors(topology, scale), continuation(topology)],
            ),
            StageFigures::Refinement(levels) => (
                "Refinement: each step follows the points more closely. Points that are held out say where following them becomes \
                 following their noise; the steps that were kept have large dots.",
                refinement(levels, scale),
            ),
            StageFigures::DenseRefinement(dense) => (
                "Refinement: each step follows the points more closely. Points that are held out say where following them becomes \
                 following their noise; the step that was kept has the large dot.",
                dense_refinement(dense, scale),
            ),
            _ => continue,
        };
        let figures: String = plots.iter().map(Plot::html).collect();
        if !figures.is_empty() {
            html += &format!("<p>{words}</p>\n<div class=\"plots\">\n{figures}</div>\n");
        }
    }
    html
}

fn candidates(ladder: &LadderReport) -> Plot<'_> {
    let of = |value: fn(&gefm::Judgement) -> f64| ladder.candidates.iter().map(|c| Some(value(&c.judgement))).collect();
    let score = ladder.choice().map_or(f64::NAN, |choice| choice.judgement.score);
    // Candidates on one lattice differ in their smoothing length.
    let name = |c: &gefm::Candidate| format!("{}, ℓ {}", count(c.unknowns), figure(c.ratio));
    Plot {
        title: "Score of each candidate",
        description: format!("{} candidates; the one that was kept scored {}.", ladder.candidates.len(), figure(score)),
        logarithmic: true,
        steps: ladder.candidates.iter().map(name).collect(),
        series: vec![
            Series { name: "score", values: of(|judgement| judgement.score) },
            Series { name: "error at the points", values: of(|judgement| judgement.principal) },
        ],
        sections: Vec::new(),
        limit: Some((NO_TRUST, "no trust above, less noise")),
        chosen: vec![ladder.chosen],
    }
}

fn eigenvectors(topology: &gefm::Report, scale: f64) -> Plot<'_> {
    let iterations = &topology.eigenvector.iterations;
    let error = |i: &gefm::EigenvectorIteration| Some(i.sampson_error.sqrt() / scale);
    let kept = iterations.iter().enumerate().filter(|(_, i)| i.accepted).map(|(k, _)| k);
    Plot {
        title: "Error of each eigenvector, in the unit of the file",
        description: format!("{} iterations.", iterations.len()),
        logarithmic: true,
        steps: (1..=iterations.len()).map(|k| k.to_string()).collect(),
        series: vec![Series { name: "all points together", values: iterations.iter().map(error).collect() }],
        sections: Vec::new(),
        limit: None,
        chosen: kept.collect(),
    }
}

fn continuation(topology: &gefm::Report) -> Plot<'_> {
    let stages = &topology.continuation.stages;
    let objective: Vec<Option<f64>> = stages.iter().flat_map(|stage| &stage.objective).map(|j| Some(*j)).collect();
    let mut first = 0;
    let begin = |stage: &gefm::ContinuationStage| {
        let at = first;
        first += stage.objective.len();
        (at, format!("p = {}", figure(stage.exponent)))
    };
    Plot {
        title: "Objective of each iteration: the larger the better",
        description: format!("{} iterations with {} exponents.", objective.len(), stages.len()),
        logarithmic: true,
        steps: (1..=objective.len()).map(|k| k.to_string()).collect(),
        sections: stages.iter().map(begin).collect(),
        series: vec![Series { name: "J of p", values: objective }],
        limit: None,
        chosen: Vec::new(),
    }
}

fn refinement(report: &LevelsReport, scale: f64) -> Vec<Plot<'_>> {
    let mut errors = vec![report.initial];
    let (mut sections, mut chosen) = (Vec::new(), Vec::new());
    for level in &report.levels {
        sections.push((errors.len(), format!("cells {}", figure(level.cell / scale))));
        chosen.extend(level.best_step.map(|step| errors.len() + step));
        errors.extend(level.steps.iter().map(|step| step.errors));
    }
    let fitted = errors.iter().map(|e| Some(e.sampson_rms / scale)).collect();
    let held_out = errors.iter().map(|e| e.held_out.map(|error| error / scale)).collect();
    let energy = errors.iter().map(|e| Some(e.energy)).collect();
    let ends = [report.initial.sampson_rms / scale, report.result.sampson_rms / scale];
    two_plots(errors.len(), [fitted, held_out, energy], ends, sections, chosen)
}

fn dense_refinement(report: &trust_region::Report, scale: f64) -> Vec<Plot<'_>> {
    let errors: Vec<_> = std::iter::once(report.initial).chain(report.iterations.iter().map(|i| i.errors)).collect();
    let fitted = errors.iter().map(|e| Some(e.sampson_rms / scale)).collect();
    let held_out = errors.iter().map(|e| e.held_out_rms.map(|error| error / scale)).collect();
    let energy = errors.iter().map(|e| Some(e.energy)).collect();
    let ends = [report.initial.sampson_rms / scale, report.result.sampson_rms / scale];
    let chosen = report.best_iteration.map(|step| step + 1).into_iter().collect();
    two_plots(errors.len(), [fitted, held_out, energy], ends, Vec::new(), chosen)
}

/// Errors in the data's unit, and the energy, from the initial function on.
fn two_plots<'a>(
    steps: usize,
    [fitted, held_out, energy]: [Vec<Option<f64>>; 3],
    [before, after]: [f64; 2],
    sections: Vec<(usize, String)>,
    chosen: Vec<usize>,
) -> Vec<Plot<'a>> {
    let names: Vec<String> = (0..steps).map(|k| if k == 0 { "start".into() } else { k.to_string() }).collect();
    vec![
        Plot {
            title: "Distance of the points after each step, in the unit of the file",
            description: format!(
                "From {} at the start to {} for the points that were fitted.",
                figure(before),
                figure(after)
            ),
            logarithmic: true,
            steps: names.clone(),
            series: vec![Series { name: "fitted", values: fitted }, Series { name: "held out", values: held_out }],
            sections: sections.clone(),
            limit: None,
            chosen: chosen.clone(),
        },
        Plot {
            title: "Bending energy after each step: the rougher, the higher",
            description: "It rises where detail is taken up.".into(),
            logarithmic: true,
            steps: names,
            series: vec![Series { name: "energy", values: energy }],
            sections,
            limit: None,
            chosen,
        },
    ]
}
