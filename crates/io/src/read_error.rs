//! What can be wrong with a file that is read.

use std::fmt;
use std::io;
use std::path::PathBuf;

use crate::extension::UnknownExtension;

/// Why a file was not read. Every variant names the file; [`Malformed`] names the place in it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The extension names no format that can be read here: rename the file, or convert it.
    #[error(transparent)]
    UnknownExtension(#[from] UnknownExtension),
    /// The path is a folder: name a file in it.
    #[error("{} is a folder, not a file", path.display())]
    Folder {
        /// The path as given.
        path: PathBuf,
    },
    /// The operating system did not hand over the bytes: missing file, no permission, device error.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The path as given.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The bytes are there, but they are not what the format asks for, or hold values that are refused.
    #[error("{}: {malformed}", path.display())]
    Malformed {
        /// The path as given.
        path: PathBuf,
        /// What is wrong, and where.
        malformed: Malformed,
    },
}

/// What is wrong inside a file, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Malformed {
    /// Where in the file.
    pub place: Place,
    /// One sentence: what is wrong and, where it helps, what to do.
    pub problem: String,
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
    /// A point, counted from 0 as in the arrays of the result.
    Point(usize),
}

impl Malformed {
    pub(crate) fn file(problem: impl Into<String>) -> Self {
        Self { place: Place::File, problem: problem.into() }
    }

    /// Where bytes that should be there could not be read: the file became shorter meanwhile, or worse.
    pub(crate) fn unread(error: io::Error) -> Self {
        Self::file(format!("the file cannot be read on: {error}"))
    }

    pub(crate) fn line(line: usize, problem: impl Into<String>) -> Self {
        Self { place: Place::Line(line), problem: problem.into() }
    }

    pub(crate) fn point(index: usize, problem: impl Into<String>) -> Self {
        Self { place: Place::Point(index), problem: problem.into() }
    }
}

impl fmt::Display for Malformed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::File => f.write_str(&self.problem),
            Place::Line(line) => write!(f, "line {line}: {}", self.problem),
            Place::Byte(byte) => write!(f, "byte {byte}: {}", self.problem),
            Place::Point(index) => write!(f, "point {index} (counted from 0): {}", self.problem),
        }
    }
}

impl std::error::Error for Malformed {}

/// A piece of the file for an error message: short, quoted, and with control characters escaped.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    if text.chars().count() <= LONGEST {
        format!("{text:?}")
    } else {
        let head: String = text.chars().take(LONGEST).collect();
        format!("{head:?}…")
    }
}
