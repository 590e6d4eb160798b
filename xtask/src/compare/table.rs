//! The table of a folder: as a page to read, as tab-separated values, and as lines while it goes.

use std::fmt::Write as _;

use super::cases::Topology;
use super::row::Row;
use super::summary::{Share, Summary, by_group};
use super::verdict::{Verdict, quietly_wrong, side_target, topology};

/// Columns of the tab-separated table.
const COLUMNS: &str = "data\tcase\tgroup\tpoints\tnoise\texit\taccepted_doubt\twarnings\tside_pct\tside_target_pct\tchamfer_pct\t\
     components\tgenus\texpected_components\texpected_genus\twatertight\ttopology_right\tnc_signed\tcpu_s\twall_s\tpeak_mb\t\
     verdict\tremarks";

/// The page of a folder, below a heading.
pub fn page(data: &str, rows: &[Row]) -> String {
    let mut page = format!("## {data}\n\n");
    page.push_str(
        "| case | group | points | exit | warnings | side % | Chamfer % | topology | watertight | normals | CPU s | wall s | peak MB |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        page_row(&mut page, row);
    }
    page.push_str(
        "\nSide: points whose normal points out of the ground truth. Topology: components/total genus, in the plane loops. Normals: mean \
         cosine with the ground truth's, −1 is inside out. Exit 4 with *: measured on a second run with `--accept-doubt`.\n",
    );
    list(&mut page, "Warnings", rows, |row| row.warnings.clone());
    list(&mut page, "Notes", rows, |row| row.notes.clone());
    page.push_str("\n### Groups\n\n");
    page.push_str(&groups(&by_group(rows)));
    page
}

fn page_row(page: &mut String, row: &Row) {
    let exit = match (&row.skipped, &row.ending) {
        (Some(why), _) => format!("skipped: {why}"),
        (None, Some(ending)) => format!("{ending}{}", if row.accepted_doubt { "*" } else { "" }),
        (None, None) => "–".into(),
    };
    let ran = row.ending.is_some();
    let cells = [
        row.case.name.clone(),
        row.case.group.clone(),
        row.case.points.map_or("–".into(), |points| points.to_string()),
        exit,
        if ran { row.warnings.len().to_string() } else { "–".into() },
        number(row.measures.side, 3),
        number(row.measures.chamfer, 4),
        topology(row),
        row.measures.watertight.map_or("–", |closed| if closed { "yes" } else { "NO" }).into(),
        number(row.measures.normals, 4),
        number(row.usage.cpu, 2),
        if ran { format!("{:.2}", row.usage.wall) } else { "–".into() },
        number(row.usage.peak, 0),
    ];
    let cells = cells.map(|text| cell(&text));
    page.push_str(&format!("| {} |\n", cells.join(" | ")));
}

/// A bar would begin a new cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn list(page: &mut String, title: &str, rows: &[Row], texts: impl Fn(&Row) -> Vec<String>) {
    let mut lines = String::new();
    for row in rows {
        let texts = texts(row);
        if !texts.is_empty() {
            lines.push_str(&format!("- **{}**: {}\n", row.case.name, texts.join("; ").replace('\n', " ")));
        }
    }
    if !lines.is_empty() {
        page.push_str(&format!("\n{title}:\n\n{lines}"));
    }
}

/// The groups at a glance, then what is quietly wrong.
pub fn groups(summaries: &[Summary]) -> String {
    let mut text = String::from(
        "| group | run | skipped | worst side % | side reached | topology right | of those asked | exit 4 | failed | warned, of right ones | \
         exit 4, of right ones | quietly wrong |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let share = |share: Share| if share.of == 0 { "–".into() } else { format!("{} of {}", share.right, share.of) };
    for group in summaries {
        let worst =
            group.worst_side.as_ref().map_or("–".into(), |(side, name)| format!("{side:.3} ({})", cell(name)));
        text.push_str(&format!(
            "| {} | {} | {} | {worst} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
            cell(&group.group),
            group.run,
            group.skipped,
            share(group.side),
            share(group.topology),
            share(group.topology_asked),
            group.doubted,
            group.failed,
            share(group.warned),
            group.doubted_right,
            group.quiet.len()
        ));
    }
    let Some(all) = summaries.last() else { return text };
    if all.quiet.is_empty() {
        text.push_str("\nNo case is quietly wrong (wrong, with exit code 0 and no warning).\n");
    } else {
        text.push_str("\nQuietly wrong (exit code 0 and no warning):\n\n");
        for (name, why) in &all.quiet {
            text.push_str(&format!("- **{name}**: {why}\n"));
        }
    }
    text
}

/// The heading line of the tab-separated table.
pub fn separated_heading() -> String {
    format!("{COLUMNS}\n")
}

/// The rows of a folder for the tab-separated table; what is not known is `-`.
pub fn separated(data: &str, rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        let measures = &row.measures;
        let expected = row.expected();
        let components = |topology: Option<Topology>| known(topology.map(|topology| topology.components));
        let genus = |topology: Option<Topology>| known(topology.and_then(|topology| topology.genus));
        let remarks: Vec<_> = row.warnings.iter().map(|text| format!("warning: {text}")).collect();
        let remarks = [remarks, row.notes.clone()].concat().join("; ");
        let fields = [
            data.to_owned(),
            row.case.name.clone(),
            row.case.group.clone(),
            known(row.case.points),
            known(row.case.noise),
            row.skipped.as_ref().map_or_else(|| known(row.ending.as_ref()), |why| format!("skipped: {why}")),
            row.accepted_doubt.to_string(),
            row.warnings.len().to_string(),
            known(measures.side),
            side_target(&row.case).to_string(),
            known(measures.chamfer),
            components(measures.found),
            genus(measures.found),
            components(expected),
            genus(expected),
            known(measures.watertight),
            known(row.topology_right()),
            known(measures.normals),
            known(row.usage.cpu),
            known(row.ending.as_ref().map(|_| format!("{:.3}", row.usage.wall))),
            known(row.usage.peak.map(|peak| format!("{peak:.1}"))),
            verdict(row).to_owned(),
            if remarks.is_empty() { "-".into() } else { remarks },
        ];
        text.push_str(&fields.map(|field| field.replace(['\t', '\n', '\r'], " ")).join("\t"));
        text.push('\n');
    }
    text
}

fn verdict(row: &Row) -> &'static str {
    match Verdict::of(row) {
        Verdict::Right => "right",
        Verdict::Wrong(_) if quietly_wrong(row).is_some() => "quietly wrong",
        Verdict::Wrong(_) => "wrong",
        Verdict::Unknown => "unknown",
        Verdict::Failed => "failed",
    }
}

/// A case in one line, as it goes.
pub fn line(row: &Row) -> String {
    let case = &row.case;
    let mut line = format!("{} ({})", case.name, case.group);
    let Some(ending) = &row.ending else {
        return format!("{line}: skipped: {}", row.skipped.as_deref().unwrap_or("not run"));
    };
    // Writing to a string cannot fail.
    let _ = write!(line, ": exit {ending}{}", if row.accepted_doubt { " (accepted)" } else { "" });
    if let Some(side) = row.measures.side {
        let _ = write!(line, ", side {side:.3} %{}", if side < side_target(case) { " WRONG" } else { "" });
    }
    if let Some(chamfer) = row.measures.chamfer {
        let _ = write!(line, ", Chamfer {chamfer:.3} %, {}", topology(row));
    }
    let _ = write!(line, ", {} s CPU, {} MB", number(row.usage.cpu, 2), number(row.usage.peak, 0));
    for warning in &row.warnings {
        let _ = write!(line, "\n    warning: {warning}");
    }
    for note in &row.notes {
        let _ = write!(line, "\n    note: {note}");
    }
    line
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("–".into(), |value| format!("{value:.decimals$}"))
}

fn known(value: Option<impl ToString>) -> String {
    value.map_or("-".into(), |value| value.to_string())
}
