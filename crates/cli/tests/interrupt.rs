//! Ctrl-C at any moment of a run: it ends soon, says so, and leaves no file behind.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]
#![cfg(unix)]

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A second is what a user waits; a busy machine may need more to get around to it.
const SOON: Duration = Duration::from_secs(5);

/// Points on a bumpy sphere, by the golden angle.
fn bumpy_sphere(path: &Path, count: u32) {
    let mut out = std::io::BufWriter::new(fs::File::create(path).unwrap());
    for i in 0..count {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let angle = f64::from(i) * 2.399_963_229_728_653;
        let r = 1.0 + 0.1 * (6.0 * z).sin() * (5.0 * angle).cos();
        let [x, y] = [angle.cos(), angle.sin()].map(|c| r * c * (1.0 - z * z).sqrt());
        writeln!(out, "{x:.6} {y:.6} {:.6}", r * z).unwrap();
    }
    out.flush().unwrap();
}

fn zeroset(arguments: &[&str], folder: &Path) -> Child {
    Command::new(assert_cmd::cargo::cargo_bin!("zeroset"))
        .arg("reconstruct")
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends Ctrl-C's signal, and expects the end of the run, and no files beside the points but those that were finished before it;
/// `said` is what it has said so far.
fn interrupt(child: &mut Child, times: usize, mut said: String, folder: &Path) {
    let start = Instant::now();
    for _ in 0..times {
        // The shell's own `kill`, which is everywhere.
        Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
    }
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    let (code, took) = (child.wait().unwrap().code(), start.elapsed());
    assert_eq!(code, Some(130), "{said}");
    assert!(said.ends_with("error: interrupted\n") && said.matches("error").count() == 1, "{said}");
    assert!(took < SOON, "{took:?}: {said}");
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.ends_with("points.xyz") {
            continue;
        }
        assert!(said.contains("  extraction ") && path.extension().is_some_and(|e| e == "obj"), "{path:?}: {said}");
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.ends_with('\n') && text.lines().last().unwrap().starts_with("f "), "{path:?} is cut off");
        fs::remove_file(path).unwrap();
    }
}

#[test]
fn ctrl_c_ends_every_stage_soon_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    bumpy_sphere(&folder.join("points.xyz"), 50_000);
    // So many that the last one is not reached while the signal is on its way.
    let meshes: Vec<String> = (0..60).map(|number| format!("-o{number}.obj")).collect();
    let meshes: Vec<&str> = meshes.iter().map(String::as_str).collect();
    // Waiting for points: no stage looks at its token there.
    let mut child = zeroset(&["-", "--format", "xyz", "-o", "a.obj"], folder);
    std::thread::sleep(Duration::from_secs(1));
    interrupt(&mut child, 1, String::new(), folder);
    for (line, refine, times) in [
        (": 50000 points", true, 1),
        ("  ladder ", true, 2),
        ("  distance ", true, 1),
        ("  sign ", true, 1),
        ("  initial-shape ", true, 1),
        ("  initial-shape ", false, 2),
        ("  extraction ", false, 1),
    ] {
        let arguments = [&["points.xyz"][..], &meshes, if refine { &[] } else { &["--no-refine"] }].concat();
        let mut child = zeroset(&arguments, folder);
        let said = until(child.stderr.as_mut().unwrap(), line);
        interrupt(&mut child, times, said, folder);
    }
    // The next run is none the worse for it.
    let child = zeroset(&["points.xyz", "--no-refine", "-o", "mesh.obj"], folder);
    assert!(child.wait_with_output().unwrap().status.success());
    assert!(folder.join("mesh.obj").is_file());
}

/// What a run says up to the first line with `part`. Read byte by byte: what comes after is for others to read.
fn until(stderr: &mut impl Read, part: &str) -> String {
    let mut said = Vec::new();
    let mut byte = [0];
    while stderr.read(&mut byte).unwrap() == 1 {
        said.push(byte[0]);
        if byte[0] == b'\n' && String::from_utf8_lossy(&said).contains(part) {
            return String::from_utf8(said).unwrap();
        }
    }
    panic!("the run ended without {part}: {}", String::from_utf8_lossy(&said));
}
