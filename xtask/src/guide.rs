//! The commands of the guide, run again: what it says that they print is what they print.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::target_with_program;

/// A command, and lines that are shown of what it prints.
#[derive(Debug, PartialEq)]
struct Shown<'a> {
    command: &'a str,
    lines: Vec<&'a str>,
}

/// Runs them in a folder with the fixtures, one after the other, for some read what others have written.
pub fn run(root: &Path) -> Result<()> {
    let root = root.canonicalize()?;
    let target = target_with_program(&root, &["--release"])?;
    // Below the workspace, where cargo knows its tasks.
    let folder = root.join("target/guide");
    let points = folder.join("fixtures/points");
    std::fs::create_dir_all(&points).with_context(|| points.display().to_string())?;
    for entry in std::fs::read_dir(root.join("fixtures/points"))? {
        let entry = entry?;
        std::fs::copy(entry.path(), points.join(entry.file_name()))?;
    }
    let others = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([target.join("release")].into_iter().chain(std::env::split_paths(&others)))?;

    let guide = std::fs::read_to_string(root.join("docs/guide.md"))?;
    let (mut status, mut failed) = (0, 0);
    for Shown { command, lines } in shown(&guide) {
        let mut shell = Command::new("sh");
        // The status of the command before it is what a user sees too.
        shell.arg("-c").arg(format!("(exit {status}); {command}")).current_dir(&folder).env("PATH", &path);
        let output = shell.output().context("sh could not be started")?;
        status = output.status.code().unwrap_or(1);
        let text = [output.stdout, output.stderr].map(|part| String::from_utf8_lossy(&part).into_owned()).join("\n");
        let printed = without_times(&text);
        let missing: Vec<&&str> = lines.iter().filter(|line| !printed.contains(&without_times(line))).collect();
        println!("{}  {command}", if missing.is_empty() { "ok     " } else { "DIFFERS" });
        missing.iter().for_each(|line| println!("         not printed: {line}"));
        failed += usize::from(!missing.is_empty());
    }
    if failed > 0 {
        bail!("{failed} commands of docs/guide.md print something else than it says");
    }
    Ok(())
}

/// The commands in the blocks of a text, each on a line that begins with `$`. A line of three dots stands for any others.
fn shown(text: &str) -> Vec<Shown<'_>> {
    let (mut found, mut in_block, mut begun): (Vec<Shown<'_>>, _, _) = (Vec::new(), false, false);
    for line in text.lines() {
        if line.starts_with("```") {
            (in_block, begun) = (!in_block, false);
        } else if let Some(command) = line.strip_prefix("$ ").filter(|_| in_block) {
            found.push(Shown { command, lines: Vec::new() });
            begun = true;
        } else if let Some(last) = found.last_mut().filter(|_| begun && !["", "…"].contains(&line.trim())) {
            last.lines.push(line);
        }
    }
    found
}

/// The words of a text, however it is broken into lines, without the seconds that something took.
fn without_times(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_time = |i: usize| words[i].parse::<f64>().is_ok() && words.get(i + 1) == Some(&"s");
    let plain: Vec<&str> = (0..words.len()).map(|i| if is_time(i) { "…" } else { words[i] }).collect();
    plain.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_and_what_is_shown_of_their_output_are_found() {
        let text = "Text.\n\n```\n$ one -o x\nfirst\n…\nlast\n$ two\n```\n\n$ no block\n\n```rust\nlet x = 1;\n```\n";
        let wanted =
            [Shown { command: "one -o x", lines: vec!["first", "last"] }, Shown { command: "two", lines: vec![] }];
        assert_eq!(shown(text), wanted);
    }

    #[test]
    fn times_and_line_breaks_make_no_difference() {
        assert_eq!(without_times("  ladder    0.21 s\ndone in\n1.2 s"), without_times("ladder 3.0 s done in 0.4 s"));
        assert_ne!(without_times("area 0.21"), without_times("area 0.22"));
    }
}
