//! Writing beside, then renaming: a run that breaks, or is killed, leaves the old file as it was.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::write_error::WriteError;

/// The temporary files that are being written; nothing once writing was abandoned.
static WRITING: Mutex<Option<Vec<PathBuf>>> = Mutex::new(Some(Vec::new()));

fn writing() -> MutexGuard<'static, Option<Vec<PathBuf>>> {
    // A list of paths has no state between two others.
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary file of every write that is going on in this process, and has these and all later ones fail with
/// [`WriteError::Abandoned`]: for a program that was interrupted and is about to end. Files that stand at their paths stay.
pub fn abandon_writes() {
    for temporary in writing().take().into_iter().flatten() {
        // There is nobody to tell, and nothing else to try.
        let _ = std::fs::remove_file(temporary);
    }
}

/// Whether a file may be made in the folder of `path`, before much work is done for it: makes an empty one and removes it.
///
/// # Errors
/// [`WriteError`], as writing would give it.
pub fn check_writable(path: impl AsRef<Path>) -> Result<(), WriteError> {
    let path = path.as_ref();
    let folder = folder_of(path)?;
    if is_special(path) {
        return Ok(());
    }
    temporary_in(folder).map(drop).map_err(|source| WriteError::Unwritable { path: path.to_owned(), source })
}

/// Whether something other than a file is there already: a pipe or a device.
fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|data| !data.is_file())
}

/// The folder that a file goes to.
fn folder_of(path: &Path) -> Result<&Path, WriteError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return Err(WriteError::NoFolder { path: path.to_owned(), folder: folder.to_owned() });
    }
    if path.is_dir() {
        return Err(WriteError::Folder { path: path.to_owned() });
    }
    Ok(folder)
}

fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".zeroset-").suffix(".part");
    // Temporary files are private by default; the result should be as readable as any other new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Has `write` fill a temporary file in the folder of `path`, then renames it to `path`.
///
/// When anything fails, the temporary file is removed and `path` is untouched; a process that is killed leaves it, as
/// `.zeroset-….part`. Pipes and devices, which no file should take the place of, are written to as they are.
pub(crate) fn replace_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), WriteError> {
    let folder = folder_of(path)?;
    let unwritable = |source| WriteError::Unwritable { path: path.to_owned(), source };

    if is_special(path) {
        return File::options().write(true).open(path).and_then(|mut file| fill(&mut file, write)).map_err(unwritable);
    }
    let abandoned = || WriteError::Abandoned { path: path.to_owned() };
    // Made and listed at one stroke, and so renamed: whoever abandons the writes misses none.
    let mut temporary = match &mut *writing() {
        Some(list) => {
            let temporary = temporary_in(folder).map_err(unwritable)?;
            list.push(temporary.path().to_owned());
            temporary
        }
        None => return Err(abandoned()),
    };
    let written = fill(temporary.as_file_mut(), write);
    let mut list = writing();
    let list = list.as_mut().ok_or_else(abandoned)?;
    list.retain(|listed| listed != temporary.path());
    written.map_err(unwritable)?;
    temporary.persist(path).map(drop).map_err(|error| unwritable(error.error))
}

fn fill(file: &mut File, write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    write(&mut out).and_then(|()| out.flush())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_run_leaves_the_old_file_and_no_rubbish() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        std::fs::write(&path, "old").unwrap();
        let result = replace_file(&path, |out| {
            out.write_all(&[0; 100_000])?;
            Err(io::Error::other("the disk is full"))
        });
        assert!(matches!(result, Err(WriteError::Unwritable { .. })));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        replace_file(&path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
    }

    #[test]
    fn a_missing_folder_and_a_folder_in_place_of_the_file_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = replace_file(&folder.path().join("no/mesh.ply"), |_| Ok(())).unwrap_err();
        assert!(matches!(error, WriteError::NoFolder { ref folder, .. } if folder.ends_with("no")));
        let error = replace_file(folder.path(), |_| Ok(())).unwrap_err();
        assert!(matches!(error, WriteError::Folder { .. }));
    }

    #[cfg(unix)]
    #[test]
    fn results_are_not_private() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        replace_file(&ours, |_| Ok(())).unwrap();
        std::fs::write(&plain, "").unwrap();
        let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(ours), mode(plain));
    }
}
