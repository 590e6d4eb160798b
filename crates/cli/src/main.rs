//! The `zeroset` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    zeroset_cli::main()
}
