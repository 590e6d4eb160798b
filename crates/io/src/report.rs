//! Reports: `.json` and `.html`.

use std::io;
use std::path::Path;

use serde::Serialize;

use crate::extension::extension_among;
use crate::replace_file::replace_file;
use crate::write_error::WriteError;

/// Writes anything that serialises as indented JSON with a line end; NaN and infinity become `null`.
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_report(path: impl AsRef<Path>, report: &impl Serialize) -> Result<(), WriteError> {
    let path = path.as_ref();
    extension_among(path, &["json"])?;
    replace_file(path, |out| {
        serde_json::to_writer_pretty(&mut *out, report).map_err(io::Error::from)?;
        io::Write::write_all(out, b"\n")
    })
}

/// Writes a page as it is.
///
/// # Errors
/// [`WriteError`]; the file at `path` is replaced only when everything was written.
pub fn write_page(path: impl AsRef<Path>, html: &str) -> Result<(), WriteError> {
    let path = path.as_ref();
    extension_among(path, &["html"])?;
    replace_file(path, |out| io::Write::write_all(out, html.as_bytes()))
}
