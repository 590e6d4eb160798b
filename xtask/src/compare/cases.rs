//! The cases of a folder: its index, and in each case's folder the input and the ground truth.

use std::collections::HashMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Longest file that can be a pointer to the ground truth, in bytes.
const LONGEST_POINTER: u64 = 4096;

/// One case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    pub name: String,
    pub group: String,
    pub dimension: Dimension,
    /// Number of points, if the index or the file's header tells.
    pub points: Option<usize>,
    /// Standard deviation of the noise relative to the diagonal; `None` where the index says that it is unknown.
    pub noise: Option<f64>,
    pub input: Option<PathBuf>,
    /// The ground truth itself, pointers followed.
    pub truth: Option<PathBuf>,
    /// The topology that the index states.
    pub expected: Option<Topology>,
    /// What was odd about the folder.
    pub remark: Option<String>,
}

/// Outlines in the plane or surfaces in space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    Plane,
    Space,
}

/// Components and their total genus; in the plane loops, and no genus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topology {
    pub components: u64,
    pub genus: Option<u64>,
}

impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.components)?;
        self.genus.map_or(Ok(()), |genus| write!(f, "/{genus}"))
    }
}

type Entry = HashMap<String, String>;

/// All cases of a folder: those of its index in their order, then folders that the index does not name.
pub fn find(folder: &Path) -> Result<Vec<Case>> {
    let index = folder.join("INDEX.tsv");
    let entries = if index.is_file() {
        parse_index(&fs::read_to_string(&index).with_context(|| format!("{} cannot be read", index.display()))?)
    } else {
        Vec::new()
    };
    let mut cases: Vec<_> = entries.iter().map(|(name, entry)| case(&folder.join(name), name, entry)).collect();
    for name in case_folders(folder)? {
        if cases.iter().all(|case| case.name != name) {
            cases.push(case(&folder.join(&name), &name, &Entry::new()));
        }
    }
    Ok(cases)
}

/// Name and columns of each row. Columns may be missing, and rows may be short; without a column `case` nothing is told.
fn parse_index(text: &str) -> Vec<(String, Entry)> {
    let mut lines = text.lines().map(|line| line.trim_end_matches('\r')).filter(|line| !line.trim().is_empty());
    let columns: Vec<_> =
        lines.next().unwrap_or("").trim_start_matches('\u{feff}').split('\t').map(str::trim).collect();
    lines
        .filter_map(|line| {
            let mut entry: Entry =
                columns.iter().zip(line.split('\t')).map(|(&c, field)| (c.into(), field.trim().into())).collect();
            entry.remove("case").filter(|name| !name.is_empty()).map(|name| (name, entry))
        })
        .collect()
}

/// Folders that can hold a case, by name; `_gt` and the like hold what cases share.
fn case_folders(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("{} cannot be listed", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() && !name.starts_with(['_', '.']) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn case(folder: &Path, name: &str, entry: &Entry) -> Case {
    let stated = |column: &str| entry.get(column).map(String::as_str).filter(|text| !matches!(*text, "" | "-" | "?"));
    let file = |name: &str| Some(folder.join(name)).filter(|path| path.is_file());
    let outline = file("input.xy");
    let plane = outline.is_some() || file("gt.npy").is_some();
    let dimension = if plane { Dimension::Plane } else { Dimension::Space };
    let input = outline.or_else(|| file("input.ply")).or_else(|| file("input.xyz"));
    let noise = match entry.get("noise") {
        Some(text) => text.parse().ok().filter(|noise: &f64| noise.is_finite()),
        None => Some(noise_of(name)),
    };
    let group = match (stated("group"), dimension) {
        (Some(group), _) => group.to_owned(),
        (None, Dimension::Plane) if noise == Some(0.0) => "2D clean".to_owned(),
        (None, Dimension::Plane) => "2D noise".to_owned(),
        (None, Dimension::Space) => "no group".to_owned(),
    };
    let expected = match dimension {
        Dimension::Plane => {
            stated("loops").and_then(|loops| loops.parse().ok()).map(|components| Topology { components, genus: None })
        }
        Dimension::Space => stated("gt_genus_or_components").and_then(parse_topology),
    };
    let (truth, remark) = match truth(&folder.join(if plane { "gt.npy" } else { "gt.ply" })) {
        Ok(truth) => (truth, None),
        Err(remark) => (None, Some(remark)),
    };
    let points = stated("n_points").and_then(|text| text.parse().ok()).or_else(|| count_points(input.as_deref()?));
    Case { name: name.to_owned(), group, dimension, points, noise, input, truth, expected, remark }
}

/// `components=1 genus=2`.
fn parse_topology(text: &str) -> Option<Topology> {
    let number = |key: &str| {
        let value = text.split([' ', ',', ';']).find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        value?.parse().ok()
    };
    Some(Topology { components: number("components")?, genus: Some(number("genus")?) })
}

/// Noise by the name where no index tells: `bunny_noise0.5` has 0.5 %, and a name without `noise` none.
fn noise_of(name: &str) -> f64 {
    let Some((_, rest)) = name.rsplit_once("noise") else { return 0.0 };
    let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
    rest[..digits].parse().map_or(0.0, |percent: f64| percent / 100.0)
}

/// Follows a ground truth that may be the file, a link to it, or a text with the relative path to it.
fn truth(path: &Path) -> Result<Option<PathBuf>, String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let Ok(length) = fs::metadata(path).map(|metadata| metadata.len()) else {
        // A link into nowhere is a mistake; no file at all is a case without ground truth.
        let dangling = fs::symlink_metadata(path).is_ok();
        return if dangling { Err(format!("{name} is a link to a file that is not there")) } else { Ok(None) };
    };
    let head = if length > LONGEST_POINTER { Vec::new() } else { fs::read(path).map_err(|error| error.to_string())? };
    if head.is_empty() || head.starts_with(b"ply") || head.starts_with(b"\x93NUMPY") {
        return Ok(Some(path.to_owned()));
    }
    let target = String::from_utf8(head).map_err(|_| format!("{name} is neither a mesh nor a path"))?;
    let resolved = path.parent().unwrap_or(Path::new(".")).join(target.trim());
    if resolved.is_file() { Ok(Some(resolved)) } else { Err(format!("{name} points to {}, not there", target.trim())) }
}

/// Points of a file as its header, or its lines, tell.
fn count_points(input: &Path) -> Option<usize> {
    let bytes = fs::read(input).ok()?;
    if input.extension().is_some_and(|extension| extension == "ply") {
        let mut header = bytes.split(|&byte| byte == b'\n').take_while(|line| !line.starts_with(b"end_header"));
        return header
            .find_map(|line| String::from_utf8_lossy(line).trim().strip_prefix("element vertex")?.trim().parse().ok());
    }
    let text = String::from_utf8_lossy(&bytes);
    Some(
        text.lines()
            .filter(|line| {
                line.trim_start().starts_with(['-', '+', '.', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9'])
            })
            .count(),
    )
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn put(folder: &TempDir, path: &str, text: &str) {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().expect("inside the folder")).expect("folder made");
        fs::write(path, text).expect("file written");
    }

    fn find_in(folder: &TempDir) -> Vec<Case> {
        find(folder.path()).expect("folder read")
    }

    #[test]
    fn index_decides_and_folders_fill_up() {
        let folder = TempDir::new().expect("folder");
        put(
            &folder,
            "INDEX.tsv",
            "case\tn_points\tgt_genus_or_components\tnoise\tgroup\n\
         b\t7\tcomponents=2 genus=3\t0.005\tnoise\n\
         gone\t2500000\tcomponents=1 genus=0\t0\tscale\n\
         short\t9\n",
        );
        put(&folder, "_gt/b.ply", "ply\n");
        put(&folder, "b/gt.ply", "../_gt/b.ply\n");
        put(&folder, "b/input.xyz", "0 0 0\n");
        put(&folder, "short/input.ply", "ply\nformat ascii 1.0\nelement vertex 12\nend_header\n");
        put(&folder, "short/gt.ply", "ply\n");
        put(&folder, "a_noise0.25/input.ply", "ply\nformat ascii 1.0\nelement vertex 12\nend_header\n");
        put(&folder, "a_noise0.25/gt.ply", "../_gt/none.ply");
        let cases = find_in(&folder);
        let names: Vec<_> = cases.iter().map(|case| case.name.as_str()).collect();
        assert_eq!(names, ["b", "gone", "short", "a_noise0.25"]);

        assert_eq!(cases[0].expected, Some(Topology { components: 2, genus: Some(3) }));
        assert_eq!((cases[0].points, cases[0].noise, cases[0].group.as_str()), (Some(7), Some(0.005), "noise"));
        assert!(cases[0].truth.as_ref().expect("pointer followed").ends_with("../_gt/b.ply"));
        assert_eq!(cases[1].input, None);
        assert_eq!((cases[2].points, cases[2].expected, cases[2].group.as_str()), (Some(9), None, "no group"));
        assert!(cases[2].truth.as_ref().expect("the file itself").ends_with("short/gt.ply"));
        // The folder alone: points by the header, noise by the name, and a pointer to nothing is no ground truth.
        assert_eq!((cases[3].points, cases[3].noise, cases[3].truth.as_ref()), (Some(12), Some(0.0025), None));
        assert!(cases[3].remark.as_ref().expect("a remark").contains("none.ply"));
    }

    #[test]
    fn outlines_and_columns_that_are_missing() {
        let folder = TempDir::new().expect("folder");
        put(&folder, "INDEX.tsv", "case\tloops\tnoise\nring\t2\t0.0\nring_noise1\t2\t0.01\n");
        for case in ["ring", "ring_noise1"] {
            put(&folder, &format!("{case}/input.xy"), "# x y\n0 1\n-1 0\n.5 2\n");
            put(&folder, &format!("{case}/gt.npy"), "\u{1}NUMPY");
        }
        fs::write(folder.path().join("ring/gt.npy"), b"\x93NUMPY").expect("file written");
        let cases = find_in(&folder);
        assert_eq!(cases[0].dimension, Dimension::Plane);
        assert_eq!(cases[0].expected, Some(Topology { components: 2, genus: None }));
        assert_eq!((cases[0].points, cases[0].group.as_str(), cases[0].truth.is_some()), (Some(3), "2D clean", true));
        assert_eq!(cases[1].group, "2D noise");

        // An index that does not name cases tells nothing.
        put(&folder, "INDEX.tsv", "loops\n2\n");
        let cases = find_in(&folder);
        assert_eq!(cases.len(), 2);
        assert_eq!((cases[1].expected, cases[1].noise), (None, Some(0.01)));
    }

    #[cfg(unix)]
    #[test]
    fn links_to_the_ground_truth() {
        let folder = TempDir::new().expect("folder");
        put(&folder, "_gt/a.ply", "ply\n");
        for (case, target) in [("good", "../_gt/a.ply"), ("dangling", "../_gt/b.ply")] {
            put(&folder, &format!("{case}/input.xyz"), "0 0 0\n");
            std::os::unix::fs::symlink(target, folder.path().join(case).join("gt.ply")).expect("link made");
        }
        let cases = find_in(&folder);
        assert!(cases[0].truth.is_none() && cases[0].remark.is_some());
        assert!(cases[1].truth.is_some() && cases[1].remark.is_none());
    }
}
