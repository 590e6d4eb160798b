//! What a new user gets wrong, and every word of the answer: what was wrong, and what to do next. The answers are in `snapshots/`;
//! `INSTA_UPDATE=always cargo test -p zeroset-cli --test first_mistakes` writes them anew, to be read before they are committed.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use insta::assert_snapshot;
use tempfile::TempDir;

/// A folder as somebody might have it.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let file = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let line = |i: i32| {
        let (s, c) = (f64::from(i) * std::f64::consts::TAU / 60.0).sin_cos();
        format!("{c} {s}\n")
    };
    file("outline.xy", (0..60).map(line).collect::<String>().as_bytes());
    file("flat.xyz", (0..60).map(line).collect::<String>().as_bytes());
    file("photo.png", b"\x89PNG\r\n\x1a\n");
    file("photo.ply", b"\x89PNG\r\n\x1a\n");
    file("function.npz", b"");
    file("empty.xyz", b"");
    file("letter.txt", b"Dear all,\nthe scan is attached.\n");
    file("scan.xyz.gz", b"\x1f\x8b");
    let mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
                property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    file("mesh.ply", mesh.as_bytes());
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/points/double_torus.ply");
    fs::copy(scan, folder.path().join("scan.ply")).unwrap();
    fs::create_dir(folder.path().join("scans")).unwrap();
    folder
}

/// Runs a command that must fail and leave the folder's files as they were; its code, and what it says.
fn answer(folder: &Path, command: &str) -> (i32, String) {
    let files = || {
        let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    };
    let before = files();
    let mut run = Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
    let run = run.current_dir(folder).args(command.split(' ')).assert().failure();
    let output = run.get_output();
    assert_eq!(files(), before, "{command}");
    assert!(output.stdout.is_empty(), "{command}");
    (output.status.code().unwrap(), String::from_utf8(output.stderr.clone()).unwrap())
}

/// The commands with their answers, as on a terminal.
fn session(commands: &[&str]) -> String {
    let folder = folder();
    commands.iter().fold(String::new(), |session, command| {
        let (code, text) = answer(folder.path(), command);
        session + &format!("$ zeroset {command}\n{text}[exit code {code}]\n\n")
    })
}

#[test]
fn files_that_are_no_points() {
    assert_snapshot!(session(&[
        "reconstruct scna.ply -o out.ply",
        "reconstruct dragon.ply -o out.ply",
        "reconstruct data/scan.ply -o out.ply",
        "reconstruct . -o out.ply",
        "info scans",
        "reconstruct photo.png -o out.ply",
        "reconstruct photo.ply -o out.ply",
        "reconstruct scan.xyz.gz -o out.ply",
        "reconstruct function.npz -o out.ply",
        "reconstruct empty.xyz -o out.ply",
        "reconstruct letter.txt -o out.ply",
    ]));
}

#[test]
fn a_mesh_is_taken_for_its_corners() {
    assert_snapshot!(session(&["reconstruct mesh.ply -o out.ply",]));
}

#[test]
fn arguments_in_the_wrong_order() {
    assert_snapshot!(session(&[
        "eval outline.xy function.npz -o values.csv",
        "mesh scan.ply -o out.obj",
        "render outline.xy -o out.png",
        "reconstruct outline.xy out.svg",
        "reconstruct outline.xy out.svg -o function.npz",
        "eval function.npz outline.xy values.csv",
        "reconstruct out.svg -o outline.xy",
        "reconstruct scan.ply -o scan.ply",
    ]));
}

#[test]
fn names_that_are_nearly_right() {
    assert_snapshot!(session(&[
        "reconstruct scan.ply -o out.ply --resoluton 20",
        "reconstruct scan.ply -o out.plyy",
        "reconstruct scan.ply -o out",
        "reconstrcut scan.ply -o out.ply",
        "reconstruct scan.ply -o out.ply --normals trusted",
    ]));
}

#[test]
fn numbers_that_are_none() {
    assert_snapshot!(session(&[
        "reconstruct scan.ply -o out.ply --degree 9",
        "reconstruct scan.ply -o out.ply --resolution 4",
        "reconstruct scan.ply -o out.ply --smooth -1",
        "reconstruct scan.ply -o out.ply --threads 0",
        "reconstruct scan.ply -o out.ply --memory lots",
        "reconstruct outline.xy --margin 7 -o out.svg",
    ]));
}

#[test]
fn parts_that_are_none() {
    assert_snapshot!(session(&[
        "reconstruct scan.ply outline.xy -o out.ply",
        "reconstruct scan.ply --normals trust -o out.ply",
        "reconstruct - - --format xyz -o out.ply",
        "reconstruct scan.ply --box 0,0,1,1 -o out.ply",
        "reconstruct scan.ply --box 1,-1,-1,0,1,1 -o out.ply",
        "reconstruct outline.xy --box 2,2,3,3 -o out.svg",
        "reconstruct scan.ply --plane xy -o out.ply",
    ]));
}

#[test]
fn two_columns_where_three_were_meant() {
    assert_snapshot!(session(&[
        "reconstruct flat.xyz -o out.ply",
        "reconstruct scan.ply -o out.svg",
        "reconstruct scan.ply -o preview.svg",
    ]));
}

/// Before the work is done, not after it.
#[test]
fn places_that_cannot_be_written_to() {
    assert_snapshot!(session(&[
        "reconstruct scan.ply -o results/out.ply",
        "reconstruct scan.ply -o scans",
        "reconstruct scan.ply -o out.npz --report scans",
    ]));
    // A place where nobody may write, not even root.
    if cfg!(target_os = "linux") {
        let (code, text) = answer(folder().path(), "reconstruct scan.ply -o /proc/out.ply");
        assert_eq!(code, 5, "{text}");
        assert!(text.starts_with("error: cannot write /proc/out.ply: "), "{text}");
        assert!(
            text.ends_with("\n  tip: choose a folder that you may write to\n") && !text.contains("points\n"),
            "{text}"
        );
    }
}
