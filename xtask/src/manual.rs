//! Manual pages and completions, from what the command line says of itself.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

pub fn run(root: &Path) -> Result<()> {
    let completions = zeroset_cli::SHELLS.map(zeroset_cli::completions).to_vec();
    for (folder, files) in [("docs/man", zeroset_cli::man_pages()), ("docs/completions", completions)] {
        let path = root.join(folder);
        // What is not written any more goes.
        if path.is_dir() {
            fs::remove_dir_all(&path).with_context(|| path.display().to_string())?;
        }
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        for (name, text) in &files {
            fs::write(path.join(name), text).with_context(|| path.join(name).display().to_string())?;
        }
        println!("wrote {} files to {folder}", files.len());
    }
    Ok(())
}
