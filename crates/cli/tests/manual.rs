//! Manual pages and completions: those of the repository are those of the program. (Without the features `las` and `e57` there are
//! fewer formats to complete.)

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
#![cfg(all(feature = "las", feature = "e57"))]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use tempfile::TempDir;

fn zeroset() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("zeroset"))
}

fn in_step(folder: &str, made: &[(String, Vec<u8>)]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
    let entries = fs::read_dir(&path).unwrap_or_else(|_| panic!("no {folder}: run cargo xtask manual"));
    let committed: BTreeMap<String, String> = entries
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read_to_string(entry.path()).unwrap()))
        .collect();
    let made: BTreeMap<String, String> =
        made.iter().map(|(name, text)| (name.clone(), String::from_utf8(text.clone()).unwrap())).collect();
    assert_eq!(
        committed.keys().collect::<Vec<_>>(),
        made.keys().collect::<Vec<_>>(),
        "{folder}: run cargo xtask manual"
    );
    for (name, text) in &made {
        // Repositories may be checked out with other line ends.
        assert!(committed[name].lines().eq(text.lines()), "{folder}/{name} is out of step: run cargo xtask manual");
    }
}

#[test]
fn manual_pages_are_in_step() {
    in_step("docs/man", &zeroset_cli::man_pages());
}

#[test]
fn completions_are_in_step() {
    in_step("docs/completions", &zeroset_cli::SHELLS.map(zeroset_cli::completions));
}

#[test]
fn they_are_printed_and_written() {
    let folder = TempDir::new().unwrap();
    let stdout = |arguments: &[&str]| {
        let run = zeroset().args(arguments).assert().success().stderr("");
        String::from_utf8(run.get_output().stdout.clone()).unwrap()
    };
    assert!(stdout(&["completions", "bash"]).contains("complete -F _zeroset"));
    assert!(stdout(&["man"]).contains(".TH ZEROSET 1"));
    assert!(zeroset_cli::man_pages().iter().all(|(_, page)| !String::from_utf8_lossy(page).contains("EXTRA")));
    let pages = folder.path().join("share/man1");
    zeroset().arg("man").arg(&pages).assert().success();
    assert!(fs::read_to_string(pages.join("zeroset-reconstruct.1")).unwrap().contains("\\-\\-report"));
    assert_eq!(fs::read_dir(&pages).unwrap().count(), zeroset_cli::man_pages().len());
    let run = zeroset().args(["completions", "bsh"]).assert().code(2);
    assert!(String::from_utf8(run.get_output().stderr.clone()).unwrap().contains("'bash'"), "the close match");
}
