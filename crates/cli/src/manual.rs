//! `zeroset completions` and `zeroset man`: what the command line says of itself, for shells and for `man`.

use std::io::{self, Write};

use clap_complete::{Generator, Shell};

use crate::arguments::{Completions, Man};
use crate::failure::Failure;
use crate::progress::Say;

/// Shells whose completions are known.
pub const SHELLS: [Shell; 5] = [Shell::Bash, Shell::Elvish, Shell::Fish, Shell::PowerShell, Shell::Zsh];

/// The completions for a shell: the name that their file has by custom, and its text.
pub fn completions(shell: Shell) -> (String, Vec<u8>) {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut crate::command(), "zeroset", &mut text);
    (shell.file_name("zeroset"), text)
}

/// A page for the program, then one for each command: names of files, and their text in roff.
pub fn man_pages() -> Vec<(String, Vec<u8>)> {
    let mut program = crate::command().disable_help_subcommand(true);
    // Names of commands are made when it is built: zeroset-reconstruct.
    program.build();
    let commands: Vec<clap::Command> =
        std::iter::once(&program).chain(program.get_subcommands()).map(clap::Command::clone).collect();
    let page = |command: clap::Command| {
        let name = command.get_display_name().unwrap_or("zeroset").to_owned();
        let mut text = Vec::new();
        let page = clap_mangen::Man::new(command).title(name.to_uppercase()).manual("zeroset");
        // A vector takes everything.
        let _ = page.source(concat!("zeroset ", env!("CARGO_PKG_VERSION"))).render(&mut text);
        // Of what stands behind the options, commands have examples, and the program its exit codes.
        let text = String::from_utf8_lossy(&text)
            .replace(".SH EXTRA\nExamples:\n", ".SH EXAMPLES\n")
            .replace(".SH EXTRA\nExample:\n", ".SH EXAMPLES\n")
            .replace(".SH EXTRA\nExit codes: ", ".SH \"EXIT STATUS\"\n");
        (format!("{name}.1"), text.into_bytes())
    };
    commands.into_iter().map(page).collect()
}

pub fn run_completions(arguments: &Completions) -> Result<(), Failure> {
    print(&completions(arguments.shell).1)
}

pub fn run_man(arguments: &Man, say: &Say) -> Result<(), Failure> {
    let pages = man_pages();
    let Some(folder) = &arguments.folder else {
        return pages.first().map_or(Ok(()), |(_, text)| print(text));
    };
    let refused = |error: io::Error| Failure::output(format!("{}: {error}", folder.display()));
    std::fs::create_dir_all(folder).map_err(refused)?;
    for (name, text) in &pages {
        std::fs::write(folder.join(name), text).map_err(refused)?;
    }
    say.line(format_args!("wrote {} pages to {}: read them with man -l FILE", pages.len(), folder.display()));
    Ok(())
}

/// To standard output; whoever reads may have read enough.
fn print(text: &[u8]) -> Result<(), Failure> {
    let out = &mut io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        printed => printed.map_err(|error| Failure::output(format!("standard output: {error}"))),
    }
}
