//! Folders of cases made up, with a program and an evaluator made up.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use super::cases::{Case, Dimension, Topology, find};
use super::measures::Measures;
use super::process::{Ending, Usage};
use super::row::{Bench, DOUBT, Files, Row};
use super::summary::{Share, Summary, by_group};
use super::verdict::{Verdict, quietly_wrong, side_target, topology_asked};
use super::{all, table};

fn put(folder: &TempDir, path: &str, text: &str) {
    let path = folder.path().join(path);
    fs::create_dir_all(path.parent().expect("inside the folder")).expect("folder made");
    fs::write(path, text).expect("file written");
}

fn case(name: &str, group: &str, noise: f64) -> Case {
    Case {
        name: name.into(),
        group: group.into(),
        dimension: Dimension::Space,
        points: Some(100),
        noise: Some(noise),
        input: Some("input.ply".into()),
        truth: Some("gt.ply".into()),
        expected: Some(Topology { components: 1, genus: Some(0) }),
        remark: None,
    }
}

/// A row of a case with the given exit code, number of warnings, side in percent and genus.
fn row(case: Case, exit: i32, warnings: usize, side: f64, genus: u64) -> Row {
    let measures = Measures {
        side: Some(side),
        chamfer: Some(0.1),
        found: Some(Topology { components: 1, genus: Some(genus) }),
        watertight: Some(true),
        normals: Some(0.9),
        ..Measures::default()
    };
    Row {
        case,
        skipped: None,
        ending: Some(Ending::Exit(exit)),
        accepted_doubt: false,
        usage: Usage { wall: 1.5, cpu: Some(1.25), peak: Some(80.0) },
        warnings: vec!["be | careful".into(); warnings],
        measures,
        notes: Vec::new(),
    }
}

#[test]
fn targets_of_groups() {
    let targets = [
        ("clean", 0.0, 99.9, true),
        ("sparse", 0.0, 99.9, false),
        ("noise", 0.005, 99.0, true),
        ("noise", 0.01, 99.0, false),
        ("noise", 0.02, 97.0, false),
        ("outliers", 0.0, 99.0, false),
        ("scan", 0.001, 97.0, false),
        ("2D clean", 0.0, 99.9, true),
        ("2D noise", 0.01, 99.0, false),
    ];
    for (group, noise, target, asked) in targets {
        let case = case("a", group, noise);
        assert_eq!((side_target(&case), topology_asked(&case)), (target, asked), "{group} with noise {noise}");
    }
}

#[test]
fn right_wrong_and_quiet() {
    let clean = || case("a", "clean", 0.0);
    assert_eq!(Verdict::of(&row(clean(), 0, 0, 99.9, 0)), Verdict::Right);
    assert!(quietly_wrong(&row(clean(), 0, 0, 99.8, 0)).is_some_and(|why| why.contains("side")));
    assert!(quietly_wrong(&row(clean(), 0, 0, 100.0, 1)).is_some_and(|why| why.contains("topology")));
    // Said aloud, by a warning or by the exit code.
    assert!(quietly_wrong(&row(clean(), 0, 1, 50.0, 0)).is_none());
    assert!(quietly_wrong(&row(clean(), 4, 0, 50.0, 0)).is_none());
    assert_eq!(Verdict::of(&row(clean(), 3, 0, 100.0, 0)), Verdict::Failed);
    let inside_out = {
        let mut row = row(clean(), 0, 0, 100.0, 0);
        row.measures.normals = Some(-0.9);
        row
    };
    assert_eq!(quietly_wrong(&inside_out).as_deref(), Some("inside out"));
    let unmeasured = Row { case: Case { truth: None, ..clean() }, ..row(clean(), 0, 0, 0.0, 0) };
    assert_eq!(Verdict::of(&unmeasured), Verdict::Unknown);
}

#[test]
fn groups_are_counted() {
    let rows = [
        row(case("a", "clean", 0.0), 0, 0, 100.0, 0),
        row(case("b", "clean", 0.0), 0, 2, 99.95, 0),
        row(case("c", "noise", 0.02), 0, 0, 90.0, 3),
        row(case("d", "clean", 0.0), 4, 1, 99.0, 0),
        row(case("e", "clean", 0.0), 4, 0, 100.0, 0),
        Row { skipped: Some("no input".into()), ending: None, ..row(case("f", "clean", 0.0), 0, 0, 0.0, 0) },
        Row {
            ending: Some(Ending::TimedOut),
            measures: Measures::default(),
            ..row(case("g", "clean", 0.0), 0, 0, 0.0, 0)
        },
    ];
    let summaries = by_group(&rows);
    let groups: Vec<_> = summaries.iter().map(|summary| summary.group.as_str()).collect();
    assert_eq!(groups, ["clean", "noise", "all"]);
    let clean = Summary {
        group: "clean".into(),
        run: 5,
        skipped: 1,
        worst_side: Some((99.0, "d".into())),
        side: Share { right: 3, of: 4 },
        topology: Share { right: 4, of: 4 },
        topology_asked: Share { right: 4, of: 4 },
        doubted: 2,
        failed: 1,
        warned: Share { right: 1, of: 3 },
        doubted_right: 1,
        quiet: Vec::new(),
    };
    assert_eq!(summaries[0], clean);
    assert_eq!(summaries[1].topology_asked, Share::default());
    assert_eq!(
        summaries[2].quiet,
        [("c".to_owned(), "side 90.000 % of 97 %, topology 1/3, expected 1/0 WRONG".to_owned())]
    );
}

#[test]
fn form_of_the_tables() {
    let doubted = Row { accepted_doubt: true, ..row(case("a|b", "clean", 0.0), 4, 1, 98.0, 2) };
    let skipped = Row {
        skipped: Some("no input".into()),
        ending: None,
        measures: Measures::default(),
        ..row(case("c", "clean", 0.0), 0, 0, 0.0, 0)
    };
    let rows = [doubted, skipped];
    let page = table::page("data", &rows);
    let expected = "| a\\|b | clean | 100 | 4* | 1 | 98.000 | 0.1000 | 1/2, expected 1/0 WRONG | yes | 0.9000 | 1.25 | 1.50 | 80 |";
    assert!(page.lines().any(|line| line == expected), "{page}");
    assert!(page.contains("- **a|b**: be | careful\n"), "{page}");
    // Every line of a table has as many cells as its heading.
    let bars = |line: &str| line.replace("\\|", "").matches('|').count();
    let tables: Vec<_> = page.lines().filter(|line| line.starts_with('|')).map(bars).collect();
    assert_eq!(tables, [14, 14, 14, 14, 13, 13, 13, 13]);

    let values = table::separated_heading() + &table::separated("data", &rows);
    let columns: Vec<_> = values.lines().map(|line| line.split('\t').count()).collect();
    assert_eq!(columns, [23, 23, 23]);
    assert!(table::line(&rows[0]).starts_with("a|b (clean): exit 4 (accepted), side 98.000 % WRONG"));
    assert!(table::line(&rows[1]).ends_with("skipped: no input"));
}

/// Writes like `zeroset`, or does not, by the case's name.
struct MadeUp;

impl Bench for MadeUp {
    fn reconstruct(&self, case: &Case, _: &Path, files: &Files, accept_doubt: bool) -> (Ending, Usage) {
        let usage = Usage { wall: if accept_doubt { 9.0 } else { 1.0 }, ..Usage::default() };
        let write = |report: &str| {
            fs::write(&files.result, "surface").expect("written");
            fs::write(&files.oriented, "points").expect("written");
            fs::write(&files.report, report).expect("written");
        };
        match case.name.as_str() {
            "refused" => {
                fs::write(&files.log, "points read\nerror: all points are one\n\n").expect("written");
                return (Ending::Exit(3), usage);
            }
            "slow" => return (Ending::TimedOut, usage),
            "doubt" if !accept_doubt => return (DOUBT, usage),
            "doubt" => write(r#"{"warnings": ["two sheets"]}"#),
            _ => write(r#"{"warnings": []}"#),
        }
        (Ending::Exit(0), usage)
    }

    fn measure(&self, case: &Case, truth: &Path, files: &Files) -> Measures {
        assert!(truth.is_file() && files.result.is_file() && files.oriented.is_file());
        row(case.clone(), 0, 0, 99.95, 0).measures
    }
}

#[test]
fn a_folder_of_cases() {
    let folder = TempDir::new().expect("folder");
    let work = TempDir::new().expect("folder");
    for name in ["doubt", "good", "large", "refused", "slow", "unknown"] {
        put(&folder, &format!("{name}/input.xyz"), if name == "large" { "0 0 0\n1 1 1\n" } else { "0 0 0\n" });
        if name != "unknown" {
            put(&folder, &format!("{name}/gt.ply"), "ply\n");
        }
    }
    put(&folder, "void/gt.ply", "ply\n");
    // What an earlier run left must not be taken for this one's.
    put(&work, "slow/mesh.ply", "old");
    for jobs in [1, 3] {
        let rows = all(&find(folder.path()).expect("folder read"), &MadeUp, work.path(), 1, jobs).expect("rows");
        let [doubt, good, large, refused, slow, unknown, void] = rows.as_slice() else { panic!("{} rows", rows.len()) };
        // The first run is the one that counts, but for the measures.
        assert_eq!((doubt.ending.clone(), doubt.accepted_doubt, doubt.usage.wall), (Some(DOUBT), true, 1.0));
        assert_eq!(
            (doubt.warnings.as_slice(), doubt.measures.side),
            (["two sheets".to_owned()].as_slice(), Some(99.95))
        );
        assert_eq!((Verdict::of(good), good.accepted_doubt), (Verdict::Right, false));
        assert_eq!(large.skipped.as_deref(), Some("more than 1 points"));
        assert_eq!(Verdict::of(refused), Verdict::Failed);
        assert_eq!(refused.notes, ["error: all points are one"]);
        assert_eq!((slow.ending.clone(), slow.measures.side), (Some(Ending::TimedOut), None));
        assert_eq!((unknown.ending.clone(), Verdict::of(unknown)), (Some(Ending::Exit(0)), Verdict::Unknown));
        assert_eq!(void.skipped.as_deref(), Some("no input"));
    }
}
