//! Out of time, out of disk, no permission, nobody listening, killed: the run says so, files that stood there stay, the next run works.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// A folder with points on a sphere by the golden angle.
fn folder(count: u32) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("points.xyz");
    let line = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (s, c) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        format!("{:.6} {:.6} {z:.6}\n", ring * c, ring * s)
    };
    fs::write(&path, (0..count).map(line).collect::<String>()).unwrap();
    (folder, path)
}

fn zeroset() -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
    command.stdin(Stdio::null());
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Every file of the folder, sorted.
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_run_that_is_out_of_time_says_so_and_writes_nothing() {
    let (folder, points) = folder(40_000);
    let out = folder.path().join("mesh.obj");
    fs::write(&out, "old").unwrap();
    let start = Instant::now();
    let output = zeroset().args(["reconstruct", "--time", "0.4"]).arg(&points).arg("-o").arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(6), "{}", said(&output));
    assert!(said(&output).ends_with(
        "error: not done within --time 0.4: allow more, ask for fewer cells with --resolution, or give fewer points\n"
    ));
    // Half a second's grace, and a busy machine.
    assert!(start.elapsed() < Duration::from_secs(6), "{:?}", start.elapsed());
    assert_eq!(fs::read_to_string(&out).unwrap(), "old");
    assert_eq!(files(folder.path()), ["mesh.obj", "points.xyz"]);
    for wrong in ["0", "-1", "nan", "soon"] {
        let output =
            zeroset().args(["reconstruct", "--time", wrong]).arg(&points).arg("-o").arg(&out).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{wrong}: {}", said(&output));
    }
    let enough = ["reconstruct", "--time", "600", "--resolution", "8", "--no-refine"];
    let output = zeroset().args(enough).arg(&points).arg("-o").arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn outputs_that_the_system_refuses_are_named() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, points) = folder(300);
    let quick = ["reconstruct", "--resolution", "8", "--no-refine"];
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::write(locked.join("mesh.obj"), "old").unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    // For the superuser no folder is locked.
    if fs::write(locked.join("try"), "").is_err() {
        let output = zeroset().args(quick).arg(&points).arg("-o").arg(locked.join("mesh.obj")).output().unwrap();
        assert_eq!(output.status.code(), Some(5), "{}", said(&output));
        assert!(said(&output).contains("mesh.obj") && said(&output).contains("denied"), "{}", said(&output));
    }
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(fs::read_to_string(locked.join("mesh.obj")).unwrap(), "old");

    // A disk without room: no file may grow beyond 8 blocks, and whoever tries is told so instead of killed.
    let out = folder.path().join("full.obj");
    fs::write(&out, "old").unwrap();
    let command = format!(
        "trap '' XFSZ; ulimit -f 8; exec '{}' {} '{}' -o '{}'",
        assert_cmd::cargo::cargo_bin!("zeroset").display(),
        quick.join(" "),
        points.display(),
        out.display()
    );
    let output = Command::new("sh").args(["-c", &command]).output().unwrap();
    assert_eq!(output.status.code(), Some(5), "{}", said(&output));
    assert!(said(&output).contains("cannot write") && said(&output).contains("full.obj"), "{}", said(&output));
    assert_eq!(fs::read_to_string(&out).unwrap(), "old");
    assert!(!files(folder.path()).iter().any(|name| name.ends_with(".part")));
}

#[test]
fn devices_and_pipes_are_not_replaced_by_files() {
    use std::os::unix::fs::FileTypeExt;
    let (folder, points) = folder(300);
    let quick = ["-q", "reconstruct", "--resolution", "8", "--no-refine"];
    let pipe = folder.path().join("pipe.obj");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = {
        let pipe = pipe.clone();
        std::thread::spawn(move || fs::read_to_string(pipe).unwrap())
    };
    let output = zeroset().args(quick).arg(&points).arg("-o").arg(&pipe).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let text = reader.join().unwrap();
    assert!(text.contains("\nf ") && text.ends_with('\n'), "the whole mesh");
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo(), "the pipe is still there");

    // A reader that goes away.
    let reader = {
        let pipe = pipe.clone();
        std::thread::spawn(move || drop(fs::File::open(pipe).unwrap()))
    };
    let output = zeroset().args(quick).arg(&points).arg("-o").arg(&pipe).output().unwrap();
    reader.join().unwrap();
    assert_eq!(output.status.code(), Some(5), "{}", said(&output));
    assert!(said(&output).contains("pipe.obj") && !said(&output).contains("panicked"), "{}", said(&output));

    if Path::new("/dev/full").exists() {
        let link = folder.path().join("full.obj");
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        let output = zeroset().args(quick).arg(&points).arg("-o").arg(&link).output().unwrap();
        assert_eq!(output.status.code(), Some(5), "{}", said(&output));
        assert!(said(&output).contains("No space left"), "{}", said(&output));
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}

#[test]
fn a_help_text_that_nobody_reads_to_its_end_is_no_error() {
    for arguments in [&["--help"][..], &["reconstruct", "--help"], &["--version"]] {
        let closed = std::io::pipe().unwrap().1;
        let output = zeroset().args(arguments).stdout(closed).stderr(Stdio::piped()).output().unwrap();
        assert!(!said(&output).contains("panicked"), "{}", said(&output));
    }
}

#[test]
fn a_killed_run_leaves_earlier_outputs_and_the_next_one_works() {
    let (folder, points) = folder(2000);
    let out = folder.path().join("mesh.obj");
    let run = || {
        let mut command = zeroset();
        command.args(["-q", "reconstruct", "--resolution", "16", "--no-refine"]).arg(&points).arg("-o").arg(&out);
        // Many files, so that many moments are such as one is being written.
        for n in 0..20 {
            command.arg("-o").arg(folder.path().join(format!("{n}.stl")));
        }
        command.stderr(Stdio::null());
        command
    };
    let start = Instant::now();
    assert!(run().status().unwrap().success());
    let whole = start.elapsed();
    let mesh = fs::read(&out).unwrap();
    let stl = fs::read(folder.path().join("0.stl")).unwrap();
    const TIMES: u32 = 25;
    for time in 0..TIMES {
        // Every moment of the run in turn, the later ones, when files are written, more closely.
        let share = 1.0 - (f64::from(time) / f64::from(TIMES)).powi(2);
        let mut child = run().spawn().unwrap();
        std::thread::sleep(whole.mul_f64(share));
        child.kill().unwrap();
        child.wait().unwrap();
        for name in files(folder.path()) {
            let content = fs::read(folder.path().join(&name)).unwrap();
            match name.rsplit('.').next().unwrap() {
                "obj" => assert_eq!(content, mesh, "{name} at {share}"),
                "stl" => assert_eq!(content, stl, "{name} at {share}"),
                // What was being written, under a name of its own.
                "part" => assert!(name.starts_with(".zeroset-"), "{name}"),
                _ => assert_eq!(name, "points.xyz"),
            }
        }
    }
    assert!(run().status().unwrap().success());
    assert_eq!(fs::read(&out).unwrap(), mesh, "the same bytes");
}
