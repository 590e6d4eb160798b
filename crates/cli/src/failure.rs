//! How the program ends.

use std::fmt;
use std::process::ExitCode;

/// A failed run: its exit code and the sentence for the user.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
    message: String,
    tip: Option<String>,
}

/// What failed; the numbers are the exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Internal = 1,
    Usage = 2,
    Input = 3,
    Doubt = 4,
    Output = 5,
}

impl Failure {
    /// A fault of the program.
    pub fn internal(error: impl fmt::Display) -> Self {
        Self { kind: Kind::Internal, message: error.to_string(), tip: None }
    }

    /// The command was given wrongly.
    pub fn usage(error: impl fmt::Display) -> Self {
        Self { kind: Kind::Usage, message: error.to_string(), tip: None }
    }

    /// The input was refused.
    pub fn input(error: impl fmt::Display) -> Self {
        Self { kind: Kind::Input, message: error.to_string(), tip: None }
    }

    /// There is a result, but not one to rely on.
    pub fn doubt(error: impl fmt::Display) -> Self {
        Self { kind: Kind::Doubt, message: error.to_string(), tip: None }
    }

    /// An output could not be written.
    pub fn output(error: impl fmt::Display) -> Self {
        Self { kind: Kind::Output, message: error.to_string(), tip: None }
    }

    /// A file could not be read.
    pub fn reading(error: zeroset_io::ReadError) -> Self {
        match error {
            zeroset_io::ReadError::UnknownExtension(_) => Self::usage(error),
            error => Self::input(error),
        }
    }

    /// A file could not be written.
    pub fn writing(error: zeroset_io::WriteError) -> Self {
        match error {
            zeroset_io::WriteError::UnknownExtension(_) => Self::usage(error),
            error => Self::output(error),
        }
    }

    /// The same, and what to do next in place of any other advice.
    pub fn with_tip(self, tip: impl fmt::Display) -> Self {
        Self { tip: Some(tip.to_string()), ..self }
    }

    /// The process' exit code.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.kind as u8)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        self.tip.iter().try_for_each(|tip| write!(f, "\n  tip: {tip}"))
    }
}
