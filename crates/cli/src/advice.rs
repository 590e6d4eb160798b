//! What to do next, for mistakes that are often made: a line behind the error.

use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue, ErrorKind as Usage};
use strsim::levenshtein as slips;
use zeroset_io::{POINT_EXTENSIONS, PointFormat, ReadError, extension_among};

use crate::failure::Failure;

/// So many names of files are offered.
const OFFERED: usize = 3;
/// So many bytes at a file's start tell what it is.
const HEAD: u64 = 1 << 16;

/// Points were asked for, and a folder was named.
pub fn folder(path: &Path) -> Failure {
    let found = points_files(path);
    let tip = match found.first() {
        Some(first) => {
            format!("name a points file in it, such as {}", path.join(first).display())
        }
        None => "name a points file; there is none in this folder".into(),
    };
    Failure::input(format_args!("{} is a folder, not a file", path.display())).with_tip(tip)
}

/// Points could not be read.
pub fn no_points(path: &Path, error: ReadError) -> Failure {
    let tip = match &error {
        ReadError::UnknownExtension(unknown) => other_kind(&unknown.extension),
        ReadError::Unreadable { source, .. } if source.kind() == ErrorKind::NotFound => Some(missing(path)),
        ReadError::Unreadable { source, .. } if source.kind() == ErrorKind::PermissionDenied => {
            Some("ask for the right to read it, or copy it to where you have it".into())
        }
        ReadError::Malformed { .. } => looks_like(path).or_else(|| without_rows(path)),
        _ => None,
    };
    match tip {
        Some(tip) => Failure::reading(error).with_tip(tip),
        None => Failure::reading(error),
    }
}

/// A second file of points could not be read: it may have been meant as an output.
pub fn another_input(path: &Path, failure: Failure) -> Failure {
    if !is_new_output(path) {
        return failure;
    }
    failure.with_tip(format_args!("if it is to be written, outputs stand behind -o: -o {}", path.display()))
}

/// What files hold that people try, by their extensions.
fn other_kind(extension: &str) -> Option<String> {
    let tip = match extension {
        "png" | "jpg" | "jpeg" | "gif" | "bmp" | "tif" | "tiff" | "webp" | "heic" | "svg" | "pdf" => {
            "a picture holds no points: export the points themselves, as .ply or .csv"
        }
        "gz" | "zip" | "7z" | "xz" | "zst" | "bz2" | "rar" => {
            "unpack it first, or pipe it: zcat scan.xyz.gz | zeroset reconstruct - --format xyz -o scan.ply"
        }
        "npz" => {
            "this is a function that reconstruct saved: zeroset mesh extracts its surface again, zeroset info describes it"
        }
        "glb" | "gltf" | "off" | "3mf" | "fbx" | "dae" | "pcd" | "vtk" | "vtp" | "ptx" | "step" | "stp" | "iges" => {
            "convert it to .ply first, in MeshLab or CloudCompare"
        }
        "" => "say what it holds with --format, such as --format xyz",
        _ => return None,
    };
    Some(tip.into())
}

/// What a file is whose bytes are not what its name says.
fn looks_like(path: &Path) -> Option<String> {
    let head = head(path)?;
    let kinds: [(&[u8], &str); 6] = [
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"%PDF", "a PDF document"),
        (b"PK\x03\x04", "a ZIP archive: unpack it first"),
        (b"\x1f\x8b", "a gzip archive: unpack it first"),
        (b"glTF", "a .glb mesh: convert it to .ply first"),
    ];
    let (_, kind) = kinds.into_iter().find(|(magic, _)| head.starts_with(magic))?;
    Some(format!("whatever its name says, this is {kind}"))
}

/// What a text file needs that holds nothing but words, or nothing.
fn without_rows(path: &Path) -> Option<String> {
    let has_digit = head(path)?.iter().any(u8::is_ascii_digit);
    (!has_digit).then(|| "each point is a row of its coordinates, such as 0.5 1.2 -3.4: export the points again".into())
}

fn head(path: &Path) -> Option<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path).ok()?.take(HEAD).read_to_end(&mut head).ok()?;
    Some(head)
}

/// Names that come near to that of a file which is not there.
fn missing(path: &Path) -> String {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let shown = |name: &str| parent.map_or(name.to_owned(), |parent| parent.join(name).display().to_string());
    if let Some(parent) = parent.filter(|parent| !parent.is_dir()) {
        return format!("there is no folder {} either: is the path right?", parent.display());
    }
    let files = points_files(parent.unwrap_or(Path::new(".")));
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let near = files.iter().map(|file| (slips(&name, &file.to_lowercase()), file)).min();
    match near {
        Some((slips, file)) if slips <= 2 => format!("did you mean {}?", shown(file)),
        Some(_) => {
            let some: Vec<String> = files.iter().take(OFFERED).map(|file| shown(file)).collect();
            let more = if files.len() > OFFERED { ", …" } else { "" };
            format!("is the path right? Points files there: {}{more}", some.join(", "))
        }
        None => "is the path right? There is no points file in that folder".into(),
    }
}

/// Names of the points files in a folder, sorted.
fn points_files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files =
        entries.filter(|entry| entry.path().is_file() && extension_among(&entry.path(), POINT_EXTENSIONS).is_ok());
    let mut names: Vec<String> = files.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

/// A saved function is needed; `right` is how the command is meant where what was taken for the function is in truth the points.
pub fn check_spline(path: &Path, right: Option<(&str, &Path)>) -> Result<(), Failure> {
    let Err(error) = extension_among(path, zeroset_io::SPLINE_EXTENSIONS) else { return Ok(()) };
    let failure = Failure::usage(error);
    if let Some((command, other)) = right
        && extension_among(other, zeroset_io::SPLINE_EXTENSIONS).is_ok()
    {
        let (spline, points) = (other.display(), path.display());
        return Err(failure.with_tip(format_args!("the function comes first: zeroset {command} {spline} {points}")));
    }
    if extension_among(path, POINT_EXTENSIONS).is_ok() {
        let tip =
            format!("a saved function is needed: zeroset reconstruct {} -o function.npz makes one", path.display());
        return Err(failure.with_tip(tip));
    }
    Err(failure)
}

/// A reconstruction cannot write to `output`, which may be what it should read.
pub fn no_output(points: &[PathBuf], output: &Path, error: zeroset_io::UnknownExtension) -> Failure {
    let failure = Failure::usage(error);
    let swapped = |points: &&PathBuf| {
        extension_among(output, POINT_EXTENSIONS).is_ok() && zeroset_io::OutputKind::of(points).is_ok()
    };
    let Some(points) = points.first().filter(swapped) else { return failure };
    let (points, output) = (points.display(), output.display());
    failure.with_tip(format_args!("points come first, and outputs behind -o: zeroset reconstruct {output} -o {points}"))
}

/// Whether both are there, and are one.
pub fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// What is said of a mesh that is given as points.
pub fn mesh_note(path: &Path, format: Option<PointFormat>) -> Option<String> {
    let extension = if format.is_some() { return None } else { extension_among(path, POINT_EXTENSIONS).ok()? };
    let is_mesh = match extension {
        "stl" => true,
        "ply" => {
            head(path)?.split(|byte| *byte == b'\n').take_while(|line| !line.starts_with(b"end_header")).any(|line| {
                let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).collect();
                words.starts_with(&[b"element", b"face"]) && words.get(2).is_some_and(|count| *count != b"0")
            })
        }
        _ => false,
    };
    is_mesh.then(|| {
        format!(
            "note: {} is a mesh: its corners are taken as points, its faces are passed over; of a coarse mesh sample more \
             points first",
            path.display()
        )
    })
}

/// An argument too many is mostly an output without its `-o`.
pub fn on_usage(mut error: clap::Error) -> clap::Error {
    let stray = match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (Usage::UnknownArgument, Some(ContextValue::String(stray))) if !stray.starts_with('-') => Some(stray.clone()),
        (Usage::MissingRequiredArgument, _) => last_argument().filter(|last| is_new_output(Path::new(last))),
        _ => None,
    };
    if let Some(stray) = stray {
        let tip = format!("outputs stand behind -o: -o {stray}");
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

/// What the command line ends with, if it is no option.
fn last_argument() -> Option<String> {
    std::env::args_os().next_back()?.into_string().ok().filter(|last| !last.starts_with('-'))
}

/// Whether it could be written, and is not there.
fn is_new_output(path: &Path) -> bool {
    !path.exists() && zeroset_io::OutputKind::of(path).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_counted() {
        let found = [("scan", "scan"), ("scna", "scan"), ("scan", "scans"), ("", "abc"), ("größe", "grosse")];
        assert_eq!(found.map(|(a, b)| slips(a, b)), [0, 2, 1, 3, 3]);
    }
}
