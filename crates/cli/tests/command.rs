//! The command as a user meets it: outputs that other programs can read, and an answer to every bad input.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use ndarray::{Array2, ArrayD, IxDyn, OwnedRepr};
use ndarray_npy::NpzReader;
use serde_json::Value;
use tempfile::TempDir;
use zeroset_io::{SplineFile, SplineLevel};

fn zeroset() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("zeroset"))
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/points").join(name)
}

/// A folder for one test, with a circle of 60 points in it.
fn folder() -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let points = folder.path().join("circle.xy");
    let line = |i: i32| {
        let (s, c) = (f64::from(i) * std::f64::consts::TAU / 60.0).sin_cos();
        format!("{c} {s}\n")
    };
    fs::write(&points, (0..60).map(line).collect::<String>()).unwrap();
    (folder, points)
}

/// Runs `reconstruct` on a file that must be refused; returns what the user is told.
fn refused(points: &Path, output: &Path, code: i32) -> String {
    let run = zeroset().arg("reconstruct").arg(points).arg("-o").arg(output).assert().code(code);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.starts_with("error: ") || text.contains("\nerror: "), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    assert!(!output.exists(), "nothing half-written");
    text
}

#[test]
fn a_circle_in_every_format() {
    let (folder, points) = folder();
    let path = |name: &str| folder.path().join(name);
    let mut command = zeroset();
    command.arg("reconstruct").arg(&points);
    for name in [
        "circle.svg",
        "circle.json",
        "circle.csv",
        "circle.dxf",
        "circle.npz",
        "circle.npy",
        "circle.exr",
        "circle.vti",
    ] {
        command.arg("-o").arg(path(name));
    }
    command.arg("--oriented").arg(path("oriented.ply")).arg("--report").arg(path("report.json")).assert().success();

    let curves: Value = serde_json::from_slice(&fs::read(path("circle.json")).unwrap()).unwrap();
    let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(curves["curves"].clone()).unwrap();
    assert_eq!(loops.len(), 1);
    // Sixty points, a tenth apart: a thousandth of the radius is far above what the spline leaves.
    assert!(loops[0].iter().all(|p| (p[0].hypot(p[1]) - 1.0).abs() < 1e-3));
    assert!(fs::read_to_string(path("circle.svg")).unwrap().starts_with("<"));
    assert_eq!(fs::read_to_string(path("circle.csv")).unwrap().lines().count(), 1 + loops[0].len());
    assert_eq!(fs::read_to_string(path("circle.dxf")).unwrap().matches("\nVERTEX\n").count(), loops[0].len());
    assert!(fs::read(path("circle.vti")).unwrap().starts_with(b"<?xml"));

    let text = fs::read_to_string(path("report.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    // A reader keeps one of two entries of the same name.
    let again = serde_json::to_string_pretty(&report).unwrap();
    assert_eq!(again.lines().count(), text.lines().count(), "no entry is there twice");
    let stages: Vec<&str> = report["stages"].as_array().unwrap().iter().map(|s| s["stage"].as_str().unwrap()).collect();
    assert_eq!(stages, ["ladder", "distance", "sign", "initial-shape", "refinement", "redistancing", "extraction"]);
    assert_eq!(report["input"]["points"], 60);
    assert_eq!(report["stages"][6]["topology"]["loops"], 1);
    assert!(report["stages"].as_array().unwrap().iter().all(|s| s["seconds"].as_f64().unwrap() >= 0.0));
}

#[test]
fn a_saved_spline_is_evaluated_where_it_was_fitted() {
    let (folder, points) = folder();
    let (spline, table) = (folder.path().join("f.npz"), folder.path().join("values.csv"));
    zeroset().args(["-q", "reconstruct"]).arg(&points).arg("-o").arg(&spline).assert().success().stderr("");
    zeroset().args(["-q", "eval"]).arg(&spline).arg(&points).arg("-o").arg(&table).assert().success();
    let text = fs::read_to_string(&table).unwrap();
    assert_eq!(text.lines().next().unwrap(), "x,y,f,fx,fy,fxx,fxy,fyy", "point, value, gradient, Hessian");
    for line in text.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        // On the curve f vanishes up to the fit's residual, and the gradient points outward.
        assert!(row[2].abs() < 1e-3 && row[3] * row[0] + row[4] * row[1] > 0.9, "{line}");
    }
    // Distances are right far away, and outside the function's box too.
    let (far, distances) = (folder.path().join("far.xy"), folder.path().join("distances.csv"));
    fs::write(&far, "5 0\n0.5 0\n3 -4\n").unwrap();
    zeroset().args(["-q", "eval", "--distance"]).arg(&spline).arg(&far).arg("-o").arg(&distances).assert().success();
    let text = fs::read_to_string(&distances).unwrap();
    assert_eq!(text.lines().next().unwrap(), "x,y,f,fx,fy,fxx,fxy,fyy,distance");
    for (line, expected) in text.lines().skip(1).zip([4.0, -0.5, 4.0]) {
        let found: f64 = line.rsplit(',').next().unwrap().parse().unwrap();
        // As close as the curve is to the circle.
        assert!((found - expected).abs() < 1e-3, "{line}");
    }
    let mut archive = NpzReader::new(fs::File::open(&spline).unwrap()).unwrap();
    let coefficients: ArrayD<f64> = archive.by_name::<OwnedRepr<f64>, IxDyn>("coefficients").unwrap();
    let knots: ArrayD<f64> = archive.by_name::<OwnedRepr<f64>, IxDyn>("knots_x").unwrap();
    assert_eq!(knots.len(), coefficients.shape()[0] + 4, "cubic");
    zeroset().arg("info").arg(&spline).assert().success();
    zeroset().arg("info").arg(&points).assert().success();
}

/// Gradients against central differences of values, Hessians against those of gradients, at places in the middle of a function's box.
fn derivatives_agree<const D: usize>(points: &Path, middle: [f64; D], reach: [f64; D]) {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    zeroset().args(["-q", "reconstruct"]).arg(points).arg("-o").arg(path("f.npz")).assert().success();
    // Values have 16 digits: differences over h keep 9 of them.
    let h = 1e-7 * reach[0];
    let mut queries = Vec::new();
    for i in 0..200 {
        // Scattered evenly: irrational steps.
        let place: [f64; D] = std::array::from_fn(|axis| {
            middle[axis] + reach[axis] * (2.0 * (f64::from(i) * [0.8191, 0.6711, 0.5497][axis]).fract() - 1.0)
        });
        queries.push(place);
        for axis in 0..D {
            for step in [-h, h] {
                queries.push(std::array::from_fn(|k| place[k] + if k == axis { step } else { 0.0 }));
            }
        }
    }
    ndarray_npy::write_npy(path("queries.npy"), &ndarray::Array2::from(queries)).unwrap();
    zeroset()
        .args(["-q", "eval"])
        .arg(path("f.npz"))
        .arg(path("queries.npy"))
        .arg("-o")
        .arg(path("table.npy"))
        .assert()
        .success();
    let table: ndarray::Array2<f64> = ndarray_npy::read_npy(path("table.npy")).unwrap();
    // Coordinates, value, gradient, upper half of the Hessian by rows.
    let gradient = |row: usize, axis: usize| table[[row, D + 1 + axis]];
    let hessian = |row: usize, a: usize, b: usize| table[[row, 2 * D + 1 + a * D - a * (a + 1) / 2 + b]];
    let largest = |columns: std::ops::Range<usize>| {
        columns.flat_map(|c| table.column(c).to_vec()).fold(0.0, |m: f64, x| m.max(x.abs()))
    };
    // The second derivative is continuous, but has kinks where cells meet: over h it changes by less than this share.
    let [first, second] = [1e-6 * largest(D + 1..2 * D + 1), 1e-3 * largest(2 * D + 1..table.ncols())];
    for row in (0..table.nrows()).step_by(2 * D + 1) {
        for a in 0..D {
            let [below, above] = [row + 1 + 2 * a, row + 2 + 2 * a];
            let step = table[[above, a]] - table[[below, a]];
            let slope = (table[[above, D]] - table[[below, D]]) / step;
            assert!((slope - gradient(row, a)).abs() < first, "row {row}: {slope} for {}", gradient(row, a));
            for b in a..D {
                let bend = (gradient(above, b) - gradient(below, b)) / step;
                assert!((bend - hessian(row, a, b)).abs() < second, "row {row}: {bend} for {}", hessian(row, a, b));
            }
        }
    }
}

#[test]
fn gradients_and_hessians_agree_with_differences() {
    derivatives_agree(&fixture("star.xy"), [0.0; 2], [1.0; 2]);
    derivatives_agree(&fixture("double_torus.ply"), [0.0; 3], [0.9, 0.5, 0.2]);
}

#[test]
fn a_surface_becomes_a_mesh() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut command = zeroset();
    command.arg("reconstruct").arg(fixture("double_torus.ply")).args(["--resolution", "24", "--no-refine"]);
    command.arg("-o").arg(path("a.ply")).arg("-o").arg(path("a.obj")).arg("-o").arg(path("a.exr"));
    command.arg("-o").arg(path("a.stl")).arg("-o").arg(path("a.glb")).arg("-o").arg(path("a.npz")).assert().success();
    let mut again = zeroset();
    again.arg("mesh").arg(path("a.npz")).args(["--resolution", "41", "-o"]).arg(path("b.obj"));
    again.arg("-o").arg(path("b.stl")).assert().success();
    assert_eq!(euler_characteristic(&path("b.obj")), -2, "the same genus on another lattice");
    assert!(fs::read(path("a.ply")).unwrap().starts_with(b"ply\n"));
    let text = fs::read_to_string(path("a.obj")).unwrap();
    let faces = text.lines().filter(|l| l.starts_with("f ")).count();
    assert_eq!(fs::read(path("a.stl")).unwrap().len(), 84 + 50 * faces);
    assert!(fs::read(path("a.glb")).unwrap().starts_with(b"glTF"));
    assert_eq!(euler_characteristic(&path("a.obj")), -2, "genus 2");
}

/// V − E + T of a closed mesh, where 2 E = 3 T.
fn euler_characteristic(path: &Path) -> i64 {
    let text = fs::read_to_string(path).unwrap();
    let count = |start: &str| text.lines().filter(|line| line.starts_with(start)).count() as i64;
    count("v ") - count("f ") / 2
}

#[test]
fn a_saved_curve_is_extracted_and_sampled_again() {
    let (folder, points) = folder();
    let path = |name: &str| folder.path().join(name);
    zeroset().args(["-q", "reconstruct"]).arg(&points).arg("-o").arg(path("f.npz")).assert().success();
    let radii = |arguments: &[&str]| {
        let mut command = zeroset();
        command.args(["-q", "mesh"]).arg(path("f.npz")).args(arguments).arg("-o").arg(path("c.json"));
        command.assert().success().stderr("");
        let curves: Value = serde_json::from_slice(&fs::read(path("c.json")).unwrap()).unwrap();
        let loops: Vec<Vec<[f64; 2]>> = serde_json::from_value(curves["curves"].clone()).unwrap();
        assert_eq!(loops.len(), 1);
        loops[0].iter().map(|p| p[0].hypot(p[1])).collect::<Vec<_>>()
    };
    // As far as the spline of the reconstruction itself.
    let (coarse, fine) = (radii(&["--resolution", "20"]), radii(&["--resolution", "200"]));
    assert!(coarse.iter().chain(&fine).all(|r| (r - 1.0).abs() < 1e-3));
    // Cells are halved, from the spline's own on: there are never fewer than those.
    assert_eq!(coarse, radii(&["--resolution", "2"]));
    assert!(fine.len() > 3 * coarse.len());
    let mut command = zeroset();
    command.arg("mesh").arg(path("f.npz")).args(["--memory", "1M"]).arg("-o").arg(path("c.json"));
    let run = command.assert().code(2);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains("allow more with --memory"), "{text}");
    // Near the curve f is close to the distance: to a tenth of it.
    assert!(radii(&["--iso", "0.05"]).iter().all(|r| (r - 1.05).abs() < 5e-3));
    assert!(radii(&["--iso", "-0.05"]).iter().all(|r| (r - 0.95).abs() < 5e-3));

    let mut command = zeroset();
    command.arg("field").arg(path("f.npz")).args(["--spacing", "0.125"]);
    command.arg("-o").arg(path("v.npz")).arg("-o").arg(path("v.vti")).assert().success();
    let mut archive = NpzReader::new(fs::File::open(path("v.npz")).unwrap()).unwrap();
    let [values, origin, spacing] =
        ["values", "origin", "spacing"].map(|name| archive.by_name::<OwnedRepr<f64>, IxDyn>(name).unwrap());
    assert_eq!(spacing.as_slice(), Some(&[0.125; 2][..]));
    for (index, f) in values.indexed_iter() {
        let r = (0..2).map(|a| (origin[a] + index[a] as f64 * 0.125).powi(2)).sum::<f64>().sqrt();
        // Nodes this near to the curve may lie on either side of it.
        assert!((r - 1.0).abs() < 1e-3 || (*f < 0.0) == (r < 1.0), "{f} at {r}");
    }
    let mut command = zeroset();
    command.arg("field").arg(path("f.npz")).args(["--cells", "10", "-o"]).arg(path("v.npy")).assert().success();
    let coarse: ArrayD<f64> = ndarray_npy::read_npy(path("v.npy")).unwrap();
    assert_eq!(coarse.shape().iter().max(), Some(&11));
    assert!(coarse.iter().all(|f| f.is_finite()), "the nodes lie in the box");

    let refused = |code: i32, arguments: &[&str], output: &str, part: &str| {
        let run =
            zeroset().arg(arguments[0]).arg(path("f.npz")).args(&arguments[1..]).arg("-o").arg(path(output)).assert();
        let text = String::from_utf8(run.code(code).get_output().stderr.clone()).unwrap();
        assert!(text.contains(part), "{text}");
    };
    refused(3, &["mesh", "--iso", "-9"], "d.json", "f = -9: no sample");
    refused(2, &["mesh", "--iso", "nan"], "d.json", "a finite number");
    refused(2, &["mesh", "--resolution", "1"], "d.json", "between 2 and 4096");
    refused(2, &["mesh"], "d.ply", "known: .svg");
    refused(2, &["mesh"], "d.npy", "no mesh and no curve");
    refused(2, &["field"], "d.ply", "known: .npy");
    refused(2, &["field", "--cells", "0"], "d.npy", "at least one cell");
    refused(2, &["field", "--spacing", "0"], "d.npy", "a positive length");
    refused(2, &["field", "--spacing", "1e-300"], "d.npy", "too large");
    refused(2, &["field", "--spacing", "1", "--cells", "2"], "d.npy", "cannot be used with");
}

#[test]
fn files_that_cannot_be_read() {
    let (folder, _) = folder();
    let out = folder.path().join("out.json");
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    assert!(refused(&folder.path().join("missing.xy"), &out, 3).contains("missing.xy"));
    assert!(refused(folder.path(), &out, 3).contains("is a folder"));
    assert!(refused(&file("empty.xy", ""), &out, 3).contains("empty.xy"));
    assert!(refused(&file("nan.xy", "0 1\n1 nan\n1 1\n2 0\n"), &out, 3).contains("line 2"));
    assert!(refused(&file("columns.xy", "0 1\n1 2 3\n"), &out, 3).contains("line 2"));
    assert!(refused(&file("one.xyz", "0\n1\n"), &out, 3).contains("1 column"));
    assert!(refused(&file("points.docx", "0 1\n"), &out, 2).contains("docx"));
    assert!(refused(&file("points.xyy", "0 1\n"), &out, 2).contains("did you mean"));
    assert!(refused(&file("cut.ply", "ply\nformat ascii 1.0\nelement vertex 9\n"), &out, 3).contains("cut.ply"));
}

#[test]
fn points_come_from_standard_input_in_a_named_format() {
    let (_folder, points) = folder();
    let info =
        |arguments: &[&str]| zeroset().arg("info").args(arguments).write_stdin(fs::read(&points).unwrap()).assert();
    let stdout = |run: assert_cmd::assert::Assert| String::from_utf8(run.get_output().stdout.clone()).unwrap();
    assert!(stdout(info(&["-", "--format", "xy"]).success()).contains("60 points, 2 coordinates"));
    let stderr = |run: assert_cmd::assert::Assert| String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(stderr(info(&["-"]).code(2)).contains("--format xyz"));
    assert!(stderr(info(&["-", "--format", "ply"]).code(3)).contains("standard input: line 1: a PLY file begins"));
    assert!(stderr(info(&["-", "--format", "plyy"]).code(2)).contains("'ply'"), "the close match");
    let other = points.with_extension("dat");
    fs::copy(&points, &other).unwrap();
    zeroset().arg("info").arg(&other).args(["--format", "txt"]).assert().success();
}

#[test]
fn points_without_a_shape() {
    let (folder, _) = folder();
    let (curve, mesh) = (folder.path().join("out.json"), folder.path().join("out.ply"));
    let file = |name: &str, line: &dyn Fn(i32) -> String| {
        let path = folder.path().join(name);
        fs::write(&path, (0..30).map(line).collect::<String>()).unwrap();
        path
    };
    let one = folder.path().join("one.xy");
    fs::write(&one, "1 2\n").unwrap();
    assert!(refused(&one, &curve, 3).contains("1 points are too few"));
    assert!(refused(&file("equal.xy", &|_| "3 4\n".into()), &curve, 3).contains("equal"));
    assert!(refused(&file("line.xy", &|i| format!("{i} {}\n", 2 * i)), &curve, 3).contains("line"));
    assert!(refused(&file("line.xyz", &|i| format!("{i} {} 5\n", 2 * i)), &mesh, 3).contains("line or plane"));
    assert!(refused(&file("plane.xyz", &|i| format!("{i} {} {}\n", i * i, 3 * i - 2)), &mesh, 3).contains("plane"));
    assert!(refused(&file("pair.xy", &|i| format!("{} 0\n", i % 2)), &curve, 3).contains("2 of the points"));
}

#[test]
fn outputs_that_cannot_be_written() {
    let (folder, points) = folder();
    let text = refused(&points, &folder.path().join("no/such/folder/out.json"), 5);
    assert!(text.contains("does not exist"), "{text}");
    assert!(refused(&points, &folder.path().join("out.jsn"), 2).contains("did you mean .json?"));
    assert!(refused(&points, &folder.path().join("out.ply"), 2).contains("two columns"));
    fs::create_dir(folder.path().join("taken.json")).unwrap();
    zeroset().arg("reconstruct").arg(&points).arg("-o").arg(folder.path().join("taken.json")).assert().code(5);
}

#[test]
fn wrong_usage() {
    let (folder, points) = folder();
    let out = folder.path().join("out.json");
    let run = |arguments: &[&str]| {
        zeroset().arg("reconstruct").arg(&points).arg("-o").arg(&out).args(arguments).assert().code(2)
    };
    run(&["--resolution", "3"]);
    run(&["--degree", "9"]);
    run(&["--smooth", "-1"]);
    run(&["--robust", "0"]);
    run(&["--no-such-option"]);
    run(&["--threads", "0"]);
    run(&["--memory", "much"]);
    let run = run(&["--memory", "1M"]);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains("only 1 MiB may be used: allow more with --memory"), "{text}");
    assert!(!out.exists());
    zeroset().assert().code(2);
    zeroset().arg("reconstruct").arg(&points).assert().code(2);
    zeroset().arg("--help").assert().success();
}

#[test]
fn points_without_a_surface_end_in_doubt() {
    let (folder, _) = folder();
    let path = |name: &str| folder.path().join(name);
    // Points spread over a square (the golden ratio's sequence in the plane) lie on no curve.
    let spread = |i: i32| {
        let (x, y) = ((f64::from(i) * 0.754_877_666).fract(), (f64::from(i) * 0.569_840_296).fract());
        format!("{x} {y}\n")
    };
    fs::write(path("spread.xy"), (0..400).map(spread).collect::<String>()).unwrap();
    let mut command = zeroset();
    command.arg("reconstruct").arg(path("spread.xy")).arg("-o").arg(path("curve.json"));
    command.arg("--report").arg(path("report.json"));
    let run = command.assert().code(4);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains("no trustworthy closed") && text.contains("--accept-doubt"), "{text}");
    assert!(!path("curve.json").exists());
    let report: Value = serde_json::from_slice(&fs::read(path("report.json")).unwrap()).unwrap();
    assert!(report["doubt"].is_string() && report["trust"]["judgement"]["score"].as_f64().unwrap() > 0.4);

    command.arg("--accept-doubt").assert().success();
    assert!(path("curve.json").exists());
}

#[test]
fn a_reader_that_has_had_enough_is_no_error() {
    let (folder, points) = folder();
    let spline = folder.path().join("f.npz");
    // The reading end is closed before the program starts.
    let closed = || std::io::pipe().unwrap().1;
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
    command.arg("reconstruct").arg(&points).arg("-o").arg(&spline).stderr(closed());
    assert_eq!(command.status().unwrap().code(), Some(0));
    for file in [&points, &spline] {
        let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
        let run = command.arg("info").arg(file).stdout(closed()).stderr(std::process::Stdio::piped()).output().unwrap();
        assert_eq!((run.status.code(), String::from_utf8_lossy(&run.stderr).as_ref()), (Some(0), ""));
    }
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
    let missing = command.arg("info").arg(folder.path().join("none.xy")).stderr(closed()).status().unwrap();
    assert_eq!(missing.code(), Some(3), "the exit code still tells");
}

#[test]
fn functions_with_levels_are_described_and_evaluated() {
    let folder = TempDir::new().unwrap();
    let (spline, table, queries) =
        (folder.path().join("f.npz"), folder.path().join("values.csv"), folder.path().join("queries.xy"));
    // 1 on the whole, and 2 more where all functions of a level act: on the middle cells 4 to 6 of 0 to 9.
    let knots: Vec<f64> = (0..12).map(|k| f64::from(k) - 3.0).collect();
    let root = SplineFile::new(vec![10.0, 20.0], vec![knots.clone(), knots], 3, ArrayD::ones(vec![8, 8])).unwrap();
    let index = Array2::from_shape_fn((36, 2), |(n, axis)| 4 + [n / 6, n % 6][axis] as i32);
    let file = root.with_levels(vec![SplineLevel { index, coefficients: vec![2.0; 36] }]).unwrap();
    zeroset_io::write_spline(&spline, &file).unwrap();
    fs::write(&queries, "12.5 22.5\n10.1 20.1\n").unwrap();
    zeroset().args(["-q", "eval"]).arg(&spline).arg(&queries).arg("-o").arg(&table).assert().success();
    let text = fs::read_to_string(&table).unwrap();
    let values: Vec<f64> = text.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap()).collect();
    // Rounding of a sum of sixteen products.
    assert!((values[0] - 3.0).abs() < 1e-14 && (values[1] - 1.0).abs() < 1e-14, "{text}");
    let mut command = zeroset();
    command.arg("mesh").arg(&spline).args(["--iso", "2.5", "-o"]).arg(folder.path().join("hill.svg"));
    let run = command.assert().success();
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains("curve: 1 part and 1 hole") && text.contains("leaves the function's box"), "{text}");
    let run = zeroset().arg("info").arg(&spline).assert().success();
    let text = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    assert!(text.contains("x: 10 to 15\n") && text.contains("control coefficients: 8 × 8\n"), "{text}");
    assert!(text.contains("levels: 1 on top of the dense one, whose cells have sides 1 × 1\n"), "{text}");
    assert!(text.contains("level 1: 36 active functions, cells of sides 0.5 × 0.5\n"), "{text}");
    assert!(text.contains("coefficients of all levels: 100\n") && text.contains("0 may contain"), "{text}");
}

#[test]
fn colours_and_labels_of_the_points_reach_an_open_mesh() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    // The lower half of a sphere, red on one side and labelled on the other.
    let mut text = String::from("x,y,z,red,green,blue,label,heat\n");
    for i in 0..600 {
        let z = -(f64::from(i) + 0.5) / 600.0;
        let (s, c) = (f64::from(i) * 2.399_963).sin_cos();
        let (x, y) = ((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s);
        let red = if x > 0.0 { 255 } else { 0 };
        text += &format!("{x},{y},{z},{red},0,17,{},{}\n", i32::from(x > 0.0) * 40, 10.0 * x);
    }
    fs::write(path("bowl.csv"), text).unwrap();
    let mut command = zeroset();
    command.args(["reconstruct", "--open", "--resolution", "16"]).arg(path("bowl.csv"));
    for name in ["mesh.ply", "mesh.obj", "mesh.glb"] {
        command.arg("-o").arg(path(name));
    }
    let run = command.assert().success();
    let said = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(said.contains("open with 1 boundary loop") && !said.contains("warning"), "{said}");

    let Ok(zeroset_io::Points::Three(mesh)) = zeroset_io::read_points(path("mesh.ply")) else { panic!("a surface") };
    let names: Vec<&str> = mesh.attributes.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["support", "red", "green", "blue", "label", "heat"]);
    assert_eq!(mesh.normals.as_ref().map(Vec::len), Some(mesh.points.len()));
    for (i, x) in mesh.points.iter().map(|p| p[0]).enumerate() {
        let value = |column: usize| mesh.attributes[column].values[i];
        // The points are 0.1 apart.
        assert!((0.0..0.25).contains(&value(0)));
        assert_eq!((value(2), value(3)), (0.0, 17.0));
        assert!((value(5) - 10.0 * x).abs() < 1.5, "{} at {x}", value(5));
        if x.abs() > 0.3 {
            assert_eq!(value(1), if x > 0.0 { 255.0 } else { 0.0 });
        }
    }
    let obj = fs::read_to_string(path("mesh.obj")).unwrap();
    assert!(
        obj.lines().filter(|l| l.starts_with("v ")).all(|l| l.split_whitespace().count() == 7 && l.ends_with("0.067"))
    );
    let glb = fs::read(path("mesh.glb")).unwrap();
    assert!(glb.windows(7).any(|w| w == b"COLOR_0"));
}

#[test]
fn an_open_outline_is_a_path() {
    let folder = TempDir::new().unwrap();
    let points = folder.path().join("arc.xy");
    let line = |i: i32| {
        let (s, c) = (f64::from(i) * 0.05).sin_cos();
        format!("{c} {s}\n")
    };
    fs::write(&points, (0..60).map(line).collect::<String>()).unwrap();
    let output = folder.path().join("arc.json");
    let function = folder.path().join("arc.npz");
    let mut command = zeroset();
    command.args(["reconstruct", "--open"]).arg(&points).arg("-o").arg(&output).arg("-o").arg(&function);
    let run = command.assert().success();
    let said = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(said.contains("curve: 1 open path and 0 closed loops") && !said.contains("warning"), "{said}");
    let curves: Value = serde_json::from_slice(&fs::read(output).unwrap()).unwrap();
    let (loops, paths) = (curves["curves"].as_array().unwrap(), curves["paths"].as_array().unwrap());
    assert_eq!((loops.len(), paths.len()), (0, 1));
    // The function alone does not end where the points do.
    let whole = folder.path().join("whole.svg");
    for command in ["mesh", "render"] {
        let run = zeroset().arg(command).arg(&function).arg("-o").arg(&whole).assert().success();
        let said = String::from_utf8(run.get_output().stderr.clone()).unwrap();
        assert!(said.contains("arc.npz was made with --open") && said.contains("closed here"), "{said}");
    }
    let told = zeroset().arg("info").arg(&function).assert().success();
    assert!(String::from_utf8_lossy(&told.get_output().stdout).contains("arc.npz was made with --open"));
}

/// Four hundred points on an ellipse with half axes 3 and 2, some way off the origin, with inward normals.
fn ellipse() -> Vec<[f64; 4]> {
    (0..400)
        .map(|i| (f64::from(i) / 400.0 * std::f64::consts::TAU).sin_cos())
        .map(|(s, c)| [5.0 + 3.0 * c, 2.0 * s - 4.0, -2.0 * c, -3.0 * s])
        .collect()
}

/// Runs `reconstruct` in a folder; what it says, and the curve.
fn curve(folder: &Path, arguments: &str) -> (String, Vec<u8>) {
    let run =
        zeroset().current_dir(folder).arg("reconstruct").args(arguments.split(' ')).args(["-o", "out.csv"]).assert();
    let run = run.success();
    (String::from_utf8(run.get_output().stderr.clone()).unwrap(), fs::read(folder.join("out.csv")).unwrap())
}

#[test]
fn normals_of_the_points_are_a_hint_or_the_law() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, half: bool| {
        let turn = |i: usize| if half && i < 200 { -1.0 } else { 1.0 };
        let line = |(i, [x, y, nx, ny]): (usize, [f64; 4])| format!("{x},{y},{},{}\n", turn(i) * nx, turn(i) * ny);
        let lines: String = ellipse().into_iter().enumerate().map(line).collect();
        fs::write(folder.path().join(name), format!("x,y,nx,ny\n{lines}")).unwrap();
    };
    write("right.csv", false);
    write("half.csv", true);
    let (said, bare) = curve(folder.path(), "right.csv --normals ignore");
    assert!(said.contains("400 points, whose normals are ignored\n"), "{said}");
    let (said, hinted) = curve(folder.path(), "right.csv");
    assert!(said.contains("400 points, whose normals are a hint (--normals)\n"), "{said}");
    assert!(said.contains("1 part and 0 holes") && hinted.len().abs_diff(bare.len()) < bare.len() / 10, "{said}");
    // A hint that is half wrong is put right, and changes nothing but bits.
    assert!(curve(folder.path(), "half.csv").0.contains("1 part and 0 holes"));
    assert!(curve(folder.path(), "right.csv --normals trust").0.contains("1 part and 0 holes"));
    // As the law it is seen to contradict the sides.
    let law = ["reconstruct", "half.csv", "--normals", "trust", "-o", "out.svg"];
    zeroset().current_dir(folder.path()).args(law).assert().code(4);
}

#[test]
fn several_files_a_box_a_plane_and_a_margin() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, lines: String| fs::write(folder.path().join(name), lines).unwrap();
    let points = ellipse();
    let rows = |points: &[[f64; 4]]| points.iter().map(|[x, y, ..]| format!("{x} {y}\n")).collect::<String>();
    write("whole.xy", rows(&points));
    write("first.xy", rows(&points[..150]));
    write("rest.xy", rows(&points[150..]));
    let (_, whole) = curve(folder.path(), "whole.xy");
    let (said, parts) = curve(folder.path(), "first.xy rest.xy");
    assert!(said.contains("first.xy, rest.xy: 400 points\n"), "{said}");
    assert_eq!(parts, whole);
    // What lies outside the box is not there, and heights are of no matter in the plane.
    write(
        "more.xyz",
        points.iter().map(|[x, y, z, _]| format!("{x} {y} {z}\n")).collect::<String>() + "50 50 0\n60 60 0\n",
    );
    let (said, part) = curve(folder.path(), "more.xyz --plane xy --box -1,-9,9,9");
    assert!(said.contains("400 points\n"), "{said}");
    assert_eq!(part, whole);
    // With room around them the function reaches farther.
    let reach = |arguments: &[&str]| {
        let run = |arguments: &[&str]| zeroset().current_dir(folder.path()).args(arguments).assert().success();
        run(&[&["reconstruct", "whole.xy", "-o", "function.npz"], arguments].concat());
        let told = run(&["info", "function.npz"]);
        let text = String::from_utf8(told.get_output().stdout.clone()).unwrap();
        let x = text.lines().find(|line| line.starts_with("x: ")).unwrap().to_owned();
        x.split(' ').filter_map(|word| word.parse::<f64>().ok()).collect::<Vec<_>>()
    };
    let (near, far) = (reach(&[]), reach(&["--margin", "2.5"]));
    assert!(near[0] > 1.0 && near[1] < 9.0 && far[0] <= -0.5 && far[1] >= 10.5, "{near:?} {far:?}");
}
