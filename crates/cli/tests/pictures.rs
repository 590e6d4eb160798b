//! Pictures as a user asks for them.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

fn zeroset() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("zeroset"))
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/points").join(name)
}

/// Width and height of a PNG file, from its first chunk.
fn size(path: &Path) -> [u32; 2] {
    let bytes = fs::read(path).unwrap();
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

fn refused(command: &mut Command, code: i32, part: &str) {
    let run = command.assert().code(code);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains(part), "{text}");
}

#[test]
fn a_surface_is_drawn_from_three_sides_and_from_any() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let points = fixture("double_torus.ply");
    let mut command = zeroset();
    command.arg("reconstruct").arg(&points).args(["--resolution", "24", "--no-refine", "--up", "z"]);
    command.arg("-o").arg(path("preview.png")).arg("-o").arg(path("f.npz")).assert().success();
    assert_eq!(size(&path("preview.png")), [3 * 640, 640]);
    let render = |arguments: &[&str], output: &str| {
        let mut command = zeroset();
        command.arg("render").arg(path("f.npz")).arg("--points").arg(&points).args(arguments);
        command.arg("-o").arg(path(output));
        command
    };
    let view = ["--view", "-1,0.5,1", "--size", "120x80"];
    render(&[&view[..], &["--threads", "1"]].concat(), "one.png").assert().success();
    render(&[&view[..], &["--threads", "3"]].concat(), "three.png").assert().success();
    assert_eq!(size(&path("one.png")), [120, 80]);
    assert_eq!(fs::read(path("one.png")).unwrap(), fs::read(path("three.png")).unwrap());

    refused(&mut render(&["--size", "99999x10"], "no.png"), 2, "sides of 1 to 16384");
    refused(&mut render(&["--size", "800"], "no.png"), 2, "such as 800x600");
    refused(&mut render(&["--view", "0,0,0"], "no.png"), 2, "not all zero");
    refused(&mut render(&["--view", "1,2"], "no.png"), 2, "three numbers");
    refused(&mut render(&["--iso", "9"], "no.svg"), 2, "known: .png");
    refused(&mut render(&[], "no.pgn"), 2, "did you mean .png?");
    refused(&mut render(&["--iso", "-99"], "no.png"), 3, "f = -99");
    let mut command = zeroset();
    command.arg("render").arg(path("f.npz")).arg("--points").arg(fixture("star.xy")).arg("-o").arg(path("no.png"));
    refused(&mut command, 3, "another number of columns");
    assert!(!path("no.png").exists() && !path("no.svg").exists());
}

#[test]
fn a_function_of_two_variables_is_drawn_with_its_levels() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let points = fixture("star.xy");
    let mut command = zeroset();
    command.arg("reconstruct").arg(&points).arg("-o").arg(path("preview.png")).arg("-o").arg(path("curve.svg"));
    command.arg("-o").arg(path("star-preview.svg")).arg("-o").arg(path("f.npz")).assert().success();
    assert_eq!(size(&path("preview.png")).into_iter().max(), Some(640));
    let mut command = zeroset();
    command.arg("render").arg(path("f.npz")).arg("--points").arg(&points);
    command.arg("-o").arg(path("levels.svg")).arg("-o").arg(path("levels.png")).args(["--size", "400x100"]);
    command.assert().success();
    assert_eq!(size(&path("levels.png"))[1], 100, "as large as there is room");
    let count = |name: &str, part: &str| fs::read_to_string(path(name)).unwrap().matches(part).count();
    let rows = fs::read_to_string(&points).unwrap().lines().filter(|line| !line.starts_with('#')).count();
    for name in ["levels.svg", "star-preview.svg"] {
        assert_eq!(count(name, "<circle"), rows, "{name}");
        // About sixteen levels; the step is round, so half or twice as many.
        assert!((6..=34).contains(&count(name, "<path")), "{name}: {}", count(name, "<path"));
    }
    assert_eq!(count("curve.svg", "<path"), 1, "the curve alone");
    let mut command = zeroset();
    command.arg("render").arg(path("f.npz")).args(["--view", "1,0,0", "-o"]).arg(path("no.png"));
    refused(&mut command, 2, "has only one");
}
