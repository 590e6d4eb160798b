//! `--report`: pages and `.json`, in one run, for good results and doubtful ones.

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

#[test]
fn a_surface_is_reported_as_a_page_and_as_data() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut command = zeroset();
    command.arg("reconstruct").arg(fixture("double_torus.ply")).args([
        "--resolution",
        "24",
        "--no-refine",
        "--up",
        "z",
    ]);
    command.arg("--report").arg(path("a.json")).arg("--report").arg(path("a.html")).assert().success();
    let report: serde_json::Value = serde_json::from_slice(&fs::read(path("a.json")).unwrap()).unwrap();
    let extraction = report["stages"].as_array().unwrap().last().unwrap();
    let html = fs::read_to_string(path("a.html")).unwrap();
    assert!(html.contains("A closed surface: 1 component of genus 2"));
    assert!(html.contains(&format!("data-triangles=\"{}\"", extraction["triangles"])));
    assert!(html.contains("data-up=\"0e0 0e0 1e0\""));
    assert_eq!(html.matches("src=\"data:image/png;base64,iVBORw0KGgo").count(), 3, "three views");
    assert!(html.contains("<code>--resolution</code></th><td>24 cells</td><td>you</td>"));
    assert!(html.contains("<code>--degree</code></th><td>3</td><td>default</td>"));
}

#[test]
fn a_doubtful_result_is_reported_with_its_pictures() {
    let folder = TempDir::new().unwrap();
    // A name that would be markup.
    let points = folder.path().join("spread <b>&amp;.xy");
    let spread = |i: i32| {
        let (x, y) = ((f64::from(i) * 0.754_877_666).fract(), (f64::from(i) * 0.569_840_296).fract());
        format!("{x} {y}\n")
    };
    fs::write(&points, (0..400).map(spread).collect::<String>()).unwrap();
    let page = folder.path().join("report.html");
    zeroset().arg("reconstruct").arg(&points).arg("--report").arg(&page).assert().code(4);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("Not to be trusted") && html.contains("<h2>Doubt</h2><p>No trustworthy closed"));
    assert!(html.contains("<h1>spread &lt;b&gt;&amp;amp;.xy</h1>") && !html.contains("<b>"));
    assert!(html.contains("class=\"drawing\"") && !html.contains("xmlns"));
    // 400 points and some bands of levels.
    assert!(html.len() < 2_000_000, "{}", html.len());
}

#[test]
fn other_kinds_of_pages_are_refused_before_the_work() {
    let folder = TempDir::new().unwrap();
    let page = folder.path().join("report.htm");
    let run = zeroset().arg("reconstruct").arg(fixture("star.xy")).arg("--report").arg(&page).assert().code(2);
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert!(text.contains("did you mean .html?") && !page.exists(), "{text}");
}
