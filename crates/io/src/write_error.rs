//! What can go wrong when a file is written.

use std::io;
use std::path::PathBuf;

use crate::extension::UnknownExtension;

/// Why a file was not written. What stood at its path before still stands there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The extension names no format of the thing to be written.
    #[error(transparent)]
    UnknownExtension(#[from] UnknownExtension),
    /// The folder that the file should go to does not exist: create it.
    #[error("cannot write {}: there is no folder {}", path.display(), folder.display())]
    NoFolder {
        /// The path as given.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The path is a folder: name a file in it.
    #[error("cannot write {}: it is a folder", path.display())]
    Folder {
        /// The path as given.
        path: PathBuf,
    },
    /// The operating system refused: no permission, disk full, device error.
    #[error("cannot write {}: {source}", path.display())]
    Unwritable {
        /// The path as given.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// Writing was abandoned: see [`abandon_writes`](crate::abandon_writes).
    #[error("{} was not written: the run was interrupted", path.display())]
    Abandoned {
        /// The path as given.
        path: PathBuf,
    },
    /// The data do not fit together or not into the format: lengths that differ, an index out of range.
    #[error("cannot write {}: {problem}", path.display())]
    Invalid {
        /// The path as given.
        path: PathBuf,
        /// One sentence: what does not fit.
        problem: String,
    },
}
