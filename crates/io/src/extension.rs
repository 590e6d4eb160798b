//! File name extensions: which format a path asks for.

use std::path::{Path, PathBuf};

/// Extensions of the files that [`crate::read_points`] reads; `.las`, `.laz` and `.e57` with the features `las` and `e57`.
pub const POINT_EXTENSIONS: &[&str] = &[
    "ply",
    "xyz",
    "xy",
    "txt",
    "csv",
    "asc",
    "pts",
    "obj",
    "stl",
    "npy",
    #[cfg(feature = "las")]
    "las",
    #[cfg(feature = "las")]
    "laz",
    #[cfg(feature = "e57")]
    "e57",
];
/// Extensions of the files that [`crate::write_mesh`] writes.
pub const MESH_EXTENSIONS: &[&str] = &["ply", "obj", "stl", "glb"];
/// Extensions of the files that [`crate::write_curves`] writes.
pub const CURVE_EXTENSIONS: &[&str] = &["svg", "json", "csv", "dxf"];
/// Extension of the files that [`crate::write_spline`] and [`crate::read_spline`] handle.
pub const SPLINE_EXTENSIONS: &[&str] = &["npz"];
/// Extensions of the files that [`crate::write_field`] writes. `reconstruct` reads `.npz` as a spline, see [`OutputKind`].
pub const FIELD_EXTENSIONS: &[&str] = &["npy", "npz", "exr", "vti"];
/// Extensions of the files that [`crate::write_picture`] writes. `reconstruct` reads most `.svg` as a curve, see [`OutputKind`].
pub const PICTURE_EXTENSIONS: &[&str] = &["png", "svg"];
/// Extensions of the files that [`crate::write_table`] writes.
pub const TABLE_EXTENSIONS: &[&str] = &["csv", "txt", "npy"];
/// Extension of the files that [`crate::write_oriented`] and [`crate::write_points`] write.
pub const ORIENTED_EXTENSIONS: &[&str] = &["ply"];
/// Extensions of the files that reports are written to: `.json` by [`crate::write_report`], `.html` by [`crate::write_page`].
pub const REPORT_EXTENSIONS: &[&str] = &["json", "html"];

/// What a reconstruction writes to a path, told by the extension, and of `.svg` by the rest of the name too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OutputKind {
    /// The zero set as a triangle mesh (3D): `.ply`, `.obj`, `.stl`, `.glb`.
    Mesh,
    /// The zero set as closed polylines (2D): `.svg`, `.json`, `.csv`, `.dxf`.
    Curve,
    /// The spline itself: `.npz`.
    Spline,
    /// The function's values on a lattice: `.npy`, `.exr`, `.vti`.
    Field,
    /// A picture: `.png`, and `.svg` where the name without it ends in `preview`, such as `preview.svg` and `star-preview.svg`.
    Picture,
}

impl OutputKind {
    /// Every extension that a reconstruction can write, in the order in which errors list them.
    pub const EXTENSIONS: &[&str] =
        &["ply", "obj", "stl", "glb", "svg", "json", "csv", "dxf", "npz", "npy", "exr", "vti", "png"];

    /// The kind that `path` asks for.
    ///
    /// # Errors
    /// [`UnknownExtension`] with the known ones and a close match.
    ///
    /// ```
    /// use zeroset_io::OutputKind;
    /// assert_eq!(OutputKind::of("bunny.PLY".as_ref())?, OutputKind::Mesh);
    /// let error = OutputKind::of("bunny.pyl".as_ref()).unwrap_err();
    /// assert_eq!(error.suggestion, Some("ply"));
    /// # Ok::<(), zeroset_io::UnknownExtension>(())
    /// ```
    pub fn of(path: &Path) -> Result<Self, UnknownExtension> {
        Ok(match extension_among(path, Self::EXTENSIONS)? {
            "ply" | "obj" | "stl" | "glb" => Self::Mesh,
            "svg" if is_preview(path) => Self::Picture,
            "svg" | "json" | "csv" | "dxf" => Self::Curve,
            "npz" => Self::Spline,
            "png" => Self::Picture,
            _ => Self::Field,
        })
    }
}

/// Whether the name says that a picture is meant, not lines for other programs to read.
fn is_preview(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem.to_string_lossy().to_ascii_lowercase().ends_with("preview"))
}

/// A path whose extension is none of the known ones.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}{}; known: {}", path.display(), describe(extension), suggest(*suggestion), list(known))]
pub struct UnknownExtension {
    /// The path as given.
    pub path: PathBuf,
    /// Its extension without the dot, in lower case; empty where there is none.
    pub extension: String,
    /// The extensions that would do, without the dot.
    pub known: &'static [&'static str],
    /// The known extension that was probably meant.
    pub suggestion: Option<&'static str>,
}

fn describe(extension: &str) -> String {
    if extension.is_empty() { "no file extension".into() } else { format!("unknown extension .{extension}") }
}

fn suggest(suggestion: Option<&str>) -> String {
    suggestion.map(|s| format!(" (did you mean .{s}?)")).unwrap_or_default()
}

fn list(known: &[&str]) -> String {
    known.iter().map(|k| format!(".{k}")).collect::<Vec<_>>().join(", ")
}

/// The entry of `known` that equals the extension of `path`, upper and lower case alike.
///
/// # Errors
/// [`UnknownExtension`] where there is none.
pub fn extension_among(path: &Path, known: &'static [&'static str]) -> Result<&'static str, UnknownExtension> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    known.iter().find(|k| **k == extension).copied().ok_or_else(|| UnknownExtension {
        path: path.to_owned(),
        suggestion: closest(&extension, known),
        extension,
        known,
    })
}

/// The known extension one slip away: a letter too many, too few, wrong, or two letters swapped.
fn closest(extension: &str, known: &[&'static str]) -> Option<&'static str> {
    known.iter().find(|k| is_one_slip(extension.as_bytes(), k.as_bytes())).copied()
}

fn is_one_slip(mut a: &[u8], mut b: &[u8]) -> bool {
    // What both begin and end with.
    while let ([x, a_rest @ ..], [y, b_rest @ ..]) = (a, b)
        && x == y
    {
        (a, b) = (a_rest, b_rest);
    }
    while let ([a_rest @ .., x], [b_rest @ .., y]) = (a, b)
        && x == y
    {
        (a, b) = (a_rest, b_rest);
    }
    match (a, b) {
        ([_], []) | ([], [_]) | ([_], [_]) => true,
        ([a0, a1], [b0, b1]) => a0 == b1 && a1 == b0,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_follow_the_extension_in_either_case() {
        for (path, kind) in [
            ("a.ply", OutputKind::Mesh),
            ("a.OBJ", OutputKind::Mesh),
            ("a.b.svg", OutputKind::Curve),
            ("a.json", OutputKind::Curve),
            ("a.stl", OutputKind::Mesh),
            ("a.glb", OutputKind::Mesh),
            ("a.csv", OutputKind::Curve),
            ("a.dxf", OutputKind::Curve),
            ("a.npz", OutputKind::Spline),
            ("a.npy", OutputKind::Field),
            ("a.exr", OutputKind::Field),
            ("a.vti", OutputKind::Field),
            ("a.png", OutputKind::Picture),
            ("out/Preview.SVG", OutputKind::Picture),
            ("star-preview.svg", OutputKind::Picture),
            ("preview/star.svg", OutputKind::Curve),
            ("preview.json", OutputKind::Curve),
        ] {
            assert_eq!(OutputKind::of(Path::new(path)).unwrap(), kind, "{path}");
        }
    }

    #[test]
    fn slips_get_a_suggestion_and_strangers_do_not() {
        for (path, suggestion) in
            [("a.plyy", Some("ply")), ("a.pl", Some("ply")), ("a.lpy", Some("ply")), ("a.docx", None), ("a", None)]
        {
            let error = OutputKind::of(Path::new(path)).unwrap_err();
            assert_eq!(error.suggestion, suggestion, "{path}");
        }
        let sentence = OutputKind::of(Path::new("out/a.objj")).unwrap_err().to_string();
        assert_eq!(
            sentence,
            "out/a.objj: unknown extension .objj (did you mean .obj?); known: .ply, .obj, .stl, .glb, .svg, .json, .csv, .dxf, .npz, .npy, .exr, \
             .vti, .png"
        );
    }

    #[test]
    fn a_path_without_extension_is_named() {
        let sentence = extension_among(Path::new("points"), POINT_EXTENSIONS).unwrap_err().to_string();
        assert!(sentence.starts_with("points: no file extension; known: .ply"), "{sentence}");
    }
}
