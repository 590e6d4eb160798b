//! What a new user gets wrong, and every word of the answer: what was wrong, and what to do next.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
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
    file("scan.xyz.gz", b"\x1f\x8b");
    let mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
                property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
    file("mesh.ply", mesh.as_bytes());
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/points/double_torus.ply");
    fs::copy(scan, folder.path().join("scan.ply")).unwrap();
    fs::create_dir(folder.path().join("scans")).unwrap();
    folder
}

/// Runs a command that must fail; what it says, with the folder's files as they were.
fn said(folder: &Path, command: &str, code: i32) -> String {
    let files = || {
        let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    };
    let before = files();
    let mut run = Command::new(assert_cmd::cargo::cargo_bin!("zeroset"));
    let run = run.current_dir(folder).args(command.split(' ')).assert();
    let text = String::from_utf8(run.get_output().stderr.clone()).unwrap();
    assert_eq!(run.get_output().status.code(), Some(code), "{command}: {text}");
    assert_eq!(files(), before, "{command}");
    text
}

const KNOWN: &str = ".ply, .xyz, .xy, .txt, .csv, .asc, .pts, .obj, .stl, .npy, .las, .laz, .e57";

#[test]
fn files_that_are_no_points() {
    let folder = folder();
    for (command, code, expected) in [
        (
            "reconstruct scna.ply -o out.ply",
            3,
            "error: cannot read scna.ply: No such file or directory (os error 2)\n  tip: did you mean scan.ply?\n",
        ),
        (
            "reconstruct dragon.ply -o out.ply",
            3,
            "error: cannot read dragon.ply: No such file or directory (os error 2)\n  tip: is the path right? Points files there: \
             flat.xyz, mesh.ply, outline.xy, …\n",
        ),
        (
            "reconstruct data/scan.ply -o out.ply",
            3,
            "error: cannot read data/scan.ply: No such file or directory (os error 2)\n  tip: there is no folder data either: is \
             the path right?\n",
        ),
        (
            "reconstruct . -o out.ply",
            3,
            "error: . is a folder, not a file\n  tip: name a points file in it, such as ./flat.xyz\n",
        ),
        (
            "info scans",
            3,
            "error: scans is a folder, not a file\n  tip: name a points file; there is none in this folder\n",
        ),
        (
            "reconstruct photo.png -o out.ply",
            2,
            "error: photo.png: unknown extension .png; known: KNOWN\n  tip: a picture holds no points: export the points \
             themselves, as .ply or .csv\n",
        ),
        (
            "reconstruct photo.ply -o out.ply",
            3,
            "error: photo.ply: line 1: a PLY file begins with the line \"ply\"; this one does not\n  tip: whatever its name says, \
             this is a PNG picture\n",
        ),
        (
            "reconstruct scan.xyz.gz -o out.ply",
            2,
            "error: scan.xyz.gz: unknown extension .gz; known: KNOWN\n  tip: unpack it first, or pipe it: zcat scan.xyz.gz | zeroset \
             reconstruct - --format xyz -o scan.ply\n",
        ),
        (
            "reconstruct function.npz -o out.ply",
            2,
            "error: function.npz: unknown extension .npz (did you mean .npy?); known: KNOWN\n  tip: this is a function that \
             reconstruct saved: zeroset mesh extracts its surface again, zeroset info describes it\n",
        ),
    ] {
        assert_eq!(said(folder.path(), command, code), expected.replace("KNOWN", KNOWN), "{command}");
    }
}

#[test]
fn a_mesh_is_taken_for_its_corners() {
    let folder = folder();
    let text = said(folder.path(), "reconstruct mesh.ply -o out.ply", 3);
    assert!(
        text.starts_with(
            "mesh.ply: 4 points\nnote: mesh.ply is a mesh: its corners are taken as points, its faces are passed over; of a coarse \
             mesh sample more points first\n"
        ),
        "{text}"
    );
    assert!(!said(folder.path(), "reconstruct scan.ply -o out.ply --degree 9", 2).contains("mesh"));
}

#[test]
fn arguments_in_the_wrong_order() {
    let folder = folder();
    for (command, code, expected) in [
        (
            "eval outline.xy function.npz -o values.csv",
            2,
            "error: outline.xy: unknown extension .xy; known: .npz\n  tip: the function comes first: zeroset eval function.npz \
             outline.xy\n",
        ),
        (
            "mesh scan.ply -o out.obj",
            2,
            "error: scan.ply: unknown extension .ply; known: .npz\n  tip: a saved function is needed: zeroset reconstruct scan.ply \
             -o function.npz makes one\n",
        ),
        (
            "render outline.xy -o out.png",
            2,
            "error: outline.xy: unknown extension .xy; known: .npz\n  tip: a saved function is needed: zeroset reconstruct \
             outline.xy -o function.npz makes one\n",
        ),
        (
            "reconstruct outline.xy out.svg",
            2,
            "error: the following required arguments were not provided:\n  --output <FILE>\n\n  tip: outputs stand behind -o: -o \
             out.svg\n\nUsage: zeroset reconstruct --output <FILE> <POINTS>...\n\nFor more information, try '--help'.\n",
        ),
        (
            "reconstruct outline.xy out.svg -o function.npz",
            2,
            "error: out.svg: unknown extension .svg; known: KNOWN\n  tip: if it is to be written, outputs stand behind -o: -o out.svg\n",
        ),
        (
            "eval function.npz outline.xy values.csv",
            2,
            "error: unexpected argument 'values.csv' found\n\n  tip: outputs stand behind -o: -o values.csv\n\nUsage: zeroset eval [OPTIONS] --output <FILE> <SPLINE> <POINTS>\n\nFor more information, try '--help'.\n",
        ),
        (
            "reconstruct out.svg -o outline.xy",
            2,
            "error: outline.xy: unknown extension .xy; known: .ply, .obj, .stl, .glb, .svg, .json, .csv, .dxf, .npz, .npy, .exr, .vti, \
             .png\n  tip: points come first, and outputs behind -o: zeroset reconstruct outline.xy -o out.svg\n",
        ),
        (
            "reconstruct scan.ply -o scan.ply",
            2,
            "error: scan.ply would be written over the points themselves\n  tip: give the output another name\n",
        ),
        (
            "reconstruct scan.ply -o out.ply --resoluton 20",
            2,
            "error: unexpected argument '--resoluton' found\n\n  tip: a similar argument exists: '--resolution'\n\nUsage: zeroset \
             reconstruct --output <FILE> --resolution <CELLS> <POINTS>...\n\nFor more information, try '--help'.\n",
        ),
    ] {
        assert_eq!(said(folder.path(), command, code), expected.replace("KNOWN", KNOWN), "{command}");
    }
}

#[test]
fn parts_that_are_none() {
    let folder = folder();
    for (command, code, expected) in [
        (
            "reconstruct scan.ply outline.xy -o out.ply",
            3,
            "error: scan.ply and outline.xy cannot be one cloud: one has two columns, the other three\n  tip: reconstruct them one by one, or give all the same number of coordinates\n",
        ),
        (
            "reconstruct scan.ply --normals trust -o out.ply",
            2,
            "error: --normals trust: the points of scan.ply have no normals\n  tip: leave the option out: zeroset finds the sides \
             itself\n",
        ),
        ("reconstruct - - --format xyz -o out.ply", 2, "error: standard input can be read once only: give - once\n"),
        (
            "reconstruct scan.ply --box 0,0,1,1 -o out.ply",
            2,
            "error: --box has 4 numbers: points with 3 coordinates need 6, X0,Y0,Z0,X1,Y1,Z1\n",
        ),
        (
            "reconstruct scan.ply --box 1,-1,-1,0,1,1 -o out.ply",
            2,
            "error: --box is empty: it goes from x = 1 to 0\n  tip: first the corner with the smaller coordinates, then the other\n",
        ),
        (
            "reconstruct outline.xy --box 2,2,3,3 -o out.svg",
            3,
            "error: outline.xy: no point lies in --box\n  tip: the points reach over -1 to 1, -1 to 1\n",
        ),
        (
            "reconstruct outline.xy --margin 7 -o out.svg",
            2,
            "outline.xy: 60 points\nerror: a margin of 7 is not possible: the longest side of the points is 2, and half of it is the most\n",
        ),
        (
            "reconstruct scan.ply --plane xy -o out.ply",
            2,
            "error: out.ply would be a mesh, but the points have two columns\n  tip: for a curve write .svg, .json, .csv or .dxf; for a surface every row needs x, y and z\n",
        ),
    ] {
        assert_eq!(said(folder.path(), command, code), expected, "{command}");
    }
}

#[test]
fn two_columns_where_three_were_meant() {
    let folder = folder();
    assert_eq!(
        said(folder.path(), "reconstruct flat.xyz -o out.ply", 2),
        "error: out.ply would be a mesh, but the points have two columns\n  tip: for a curve write .svg, .json, .csv or .dxf; for a \
         surface every row needs x, y and z\n"
    );
    assert_eq!(
        said(folder.path(), "reconstruct scan.ply -o out.svg", 2),
        "error: out.svg would be a curve, but the points have three columns\n  tip: for a surface write .ply, .obj, .stl or .glb; \
         for a curve take two of the columns, as with --plane xy\n"
    );
}

/// Before the work is done, not after it.
#[test]
fn places_that_cannot_be_written_to() {
    let folder = folder();
    assert_eq!(
        said(folder.path(), "reconstruct scan.ply -o results/out.ply", 5),
        "error: results/out.ply: the folder results does not exist: make it first\n"
    );
    assert_eq!(
        said(folder.path(), "reconstruct scan.ply -o out.npz --report scans", 2),
        "error: scans: no file extension; known: .json, .html\n"
    );
    // A place where nobody may write, not even root.
    if cfg!(target_os = "linux") {
        let text = said(folder.path(), "reconstruct scan.ply -o /proc/out.ply", 5);
        assert!(text.starts_with("error: cannot write /proc/out.ply: "), "{text}");
        assert!(
            text.ends_with("\n  tip: choose a folder that you may write to\n") && !text.contains("points\n"),
            "{text}"
        );
    }
}
