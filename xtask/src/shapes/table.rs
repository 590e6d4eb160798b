//! What came of all runs, as tab-separated values and as a page.

use std::fmt::Write as _;

use super::sampling::Sampling;
use super::trial::Trial;
use super::verdict::Said;

/// Classes of the thinnest part, in spacings: below each, and the rest.
const THIN: [f64; 3] = [1.5, 2.5, 4.0];
/// Characters of a message in the table.
const MESSAGE: usize = 120;

/// One line a run.
pub fn values(trials: &[Trial]) -> String {
    let mut table = String::from(
        "seed\tfamily\tsampling\tdetail\tpoints\tspacing\tthin\tverdict\tsaid\tside_pct\tparts\texpected_parts\tdistance_pct\tseconds\tmessage\n",
    );
    let number = |value: Option<f64>, digits: usize| value.map_or("–".into(), |value| format!("{value:.digits$}"));
    for trial in trials {
        let cells = [
            trial.seed.to_string(),
            trial.family.into(),
            trial.sampling.to_string(),
            trial.detail.clone(),
            trial.points.to_string(),
            format!("{:.4}", trial.spacing),
            format!("{:.2}", trial.thin),
            if trial.faults.is_empty() { "right".into() } else { "WRONG".into() },
            trial.said.name().into(),
            number(trial.side.map(|side| 100.0 * side), 3),
            trial.found.map_or("–".into(), |found| found.to_string()),
            trial.truth.to_string(),
            number(trial.distance, 4),
            format!("{:.2}", trial.seconds),
            short(&trial.message),
        ];
        table.push_str(&cells.join("\t"));
        table.push('\n');
    }
    table
}

/// One line while it goes.
pub fn line(trial: &Trial) -> String {
    let verdict = if trial.faults.is_empty() { "right".into() } else { format!("WRONG ({})", trial.faults.join(", ")) };
    let mut line = format!("{}: {verdict}, {}", named(trial), trial.said.name());
    if !trial.message.is_empty() {
        _ = write!(line, ": {}", short(&trial.message));
    }
    line
}

fn named(trial: &Trial) -> String {
    let detail = if trial.detail.is_empty() { String::new() } else { format!(" {}", trial.detail) };
    let Trial { seed, family, sampling, points, thin, .. } = trial;
    format!("seed {seed}: {family}, {sampling}{detail}, {points} points, thin {thin:.2} s")
}

fn short(message: &str) -> String {
    let line = message.replace(['\n', '\t'], " ");
    match line.char_indices().nth(MESSAGE) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}

/// Counts by sampling and by thinness, and what was wrong.
pub fn page(trials: &[Trial]) -> String {
    let mut page = String::new();
    let header = |page: &mut String, group: &str| {
        page.push_str(&format!(
            "| {group} | runs | right, quiet | right, warned | right, doubt | wrong, warned | wrong, doubt | wrong, QUIET |\n\
             |---|---|---|---|---|---|---|---|\n"
        ));
    };
    header(&mut page, "sampling");
    for sampling in Sampling::ALL {
        row(&mut page, sampling.name(), trials, &|trial| trial.sampling == sampling);
    }
    row(&mut page, "all", trials, &|_| true);
    page.push('\n');
    header(&mut page, "thinnest part");
    let edges = [&[0.0], THIN.as_slice(), &[f64::INFINITY]].concat();
    for edge in edges.windows(2) {
        let name = match edge[1] {
            high if edge[0] == 0.0 => format!("below {high} s"),
            f64::INFINITY => format!("{} s and more", edge[0]),
            high => format!("{} to {high} s", edge[0]),
        };
        row(&mut page, &name, trials, &|trial| (edge[0]..edge[1]).contains(&trial.thin));
    }
    for (title, said) in
        [("Wrong and quiet", Said::Quiet), ("Wrong and warned", Said::Warned), ("Wrong and in doubt", Said::Doubt)]
    {
        let wrong: Vec<&Trial> = trials.iter().filter(|trial| !trial.faults.is_empty() && trial.said == said).collect();
        if !wrong.is_empty() {
            _ = write!(page, "\n{title}:\n\n");
            wrong.iter().for_each(|trial| _ = writeln!(page, "- {}: {}", named(trial), trial.faults.join(", ")));
        }
    }
    page
}

fn row(page: &mut String, name: &str, trials: &[Trial], belongs: &dyn Fn(&Trial) -> bool) {
    let count = |counts: &dyn Fn(&Trial) -> bool| trials.iter().filter(|trial| belongs(trial) && counts(trial)).count();
    let of = |right: bool, said: Said| count(&|trial| trial.faults.is_empty() == right && trial.said == said);
    _ = writeln!(
        page,
        "| {name} | {} | {} | {} | {} | {} | {} | {} |",
        count(&|_| true),
        of(true, Said::Quiet),
        of(true, Said::Warned),
        of(true, Said::Doubt),
        of(false, Said::Warned),
        of(false, Said::Doubt),
        of(false, Said::Quiet),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::dimension::Topology;

    fn trial(seed: u64, thin: f64, fault: &str, said: Said) -> Trial {
        let ball = Topology { parts: 1, genus: Some(0), closed: true };
        Trial {
            seed,
            family: "blobs",
            sampling: Sampling::Clean,
            detail: String::new(),
            points: 2000,
            spacing: 0.05,
            thin,
            truth: ball,
            found: Some(ball),
            side: Some(1.0),
            distance: Some(0.01),
            faults: Some(fault.to_string()).filter(|fault| !fault.is_empty()).into_iter().collect(),
            said,
            message: "ä".repeat(200),
            seconds: 1.0,
        }
    }

    #[test]
    fn every_run_is_counted_in_its_place() {
        let trials = [
            trial(1, 1.2, "", Said::Quiet),
            trial(2, 1.2, "side 50.00 %", Said::Quiet),
            trial(3, 3.0, "side 50.00 %", Said::Doubt),
            trial(4, 4.0, "", Said::Warned),
        ];
        let page = page(&trials);
        for line in [
            "| clean | 4 | 1 | 1 | 0 | 0 | 1 | 1 |",
            "| noise | 0 | 0 | 0 | 0 | 0 | 0 | 0 |",
            "| below 1.5 s | 2 | 1 | 0 | 0 | 0 | 0 | 1 |",
            "| 2.5 to 4 s | 1 | 0 | 0 | 0 | 0 | 1 | 0 |",
            "| 4 s and more | 1 | 0 | 1 | 0 | 0 | 0 | 0 |",
            "Wrong and quiet:",
            "- seed 2: blobs, clean, 2000 points, thin 1.20 s: side 50.00 %",
        ] {
            assert!(page.lines().any(|other| other == line), "{line}\n{page}");
        }
        let table = values(&trials);
        let columns: Vec<usize> = table.lines().map(|line| line.split('\t').count()).collect();
        assert_eq!(columns, [15; 5]);
    }
}
