//! Points from a file or from standard input.

use std::io::Read;
use std::path::Path;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use zeroset_io::{POINT_EXTENSIONS, PointFormat, Points, parse_points};

use crate::advice;
use crate::failure::Failure;

/// Reads `path`, or standard input where it is `-`.
pub fn read(path: &Path, format: Option<PointFormat>) -> Result<Points, Failure> {
    if path != Path::new("-") {
        if path.is_dir() {
            return Err(advice::folder(path));
        }
        return match format {
            Some(format) => zeroset_io::read_points_as(path, format),
            None => zeroset_io::read_points(path),
        }
        .map_err(|error| advice::no_points(path, error));
    }
    let format = format.ok_or_else(|| {
        Failure::usage("standard input has no extension: say what comes in with --format, such as --format xyz")
    })?;
    let mut bytes = Vec::new();
    let refuse = |problem: &dyn std::fmt::Display| Failure::input(format!("standard input: {problem}"));
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(|error| refuse(&error))?;
    parse_points(&bytes, format).map_err(|error| refuse(&error))
}

/// Formats by the extensions of their files.
pub fn format_parser() -> impl TypedValueParser<Value = PointFormat> {
    PossibleValuesParser::new(POINT_EXTENSIONS)
        .try_map(|name| PointFormat::named(&name).ok_or_else(|| format!("{name} is not a format")))
}
