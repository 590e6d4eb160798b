//! What the user is told while a run goes on: lines, and on a terminal a bar.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use zeroset::{CancelToken, Progress, Watch};

use crate::failure::Failure;

/// Lines for the user on standard error, unless the run is quiet; on a terminal with a bar below them while stages run.
#[derive(Clone)]
pub struct Say {
    quiet: bool,
    bar: Option<ProgressBar>,
    cancel: CancelToken,
}

impl Say {
    /// A bar is shown where standard error is a terminal.
    pub fn new(quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let bar = shown.then(|| {
            let style = ProgressStyle::with_template("{spinner} {msg:<14} [{bar:24}] {pos}/{len} {elapsed}");
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> ");
            // Nothing is drawn before the first stage.
            let bar = ProgressBar::with_draw_target(Some(0), indicatif::ProgressDrawTarget::hidden());
            bar.with_style(style)
        });
        Self { quiet, bar, cancel: CancelToken::new() }
    }

    /// Cancelled by Ctrl-C.
    pub fn cancel(&self) -> &CancelToken {
        &self.cancel
    }

    /// A line, unless the run is quiet.
    pub fn line(&self, text: impl Display) {
        if !self.quiet {
            self.above_the_bar(text);
        }
    }

    /// A line that is said in quiet runs too; the bar goes.
    pub fn error(&self, text: impl Display) {
        self.end();
        tell(format_args!("error: {text}"));
    }

    /// Shows the bar from now on, for a run of so many stages.
    pub fn begin(&self, stages: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(stages);
            bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
            bar.enable_steady_tick(Duration::from_millis(100));
        }
    }

    /// Takes the bar away.
    pub fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Runs a stage of the program's own, of which only a bar tells.
    ///
    /// # Errors
    /// Those of the work, or that it was interrupted.
    pub fn stage<T>(&self, name: &'static str, work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        let told = |progress| self.bar.iter().for_each(|_| self.progress(progress));
        self.watched_by(&told, |watch| watch.stage(name, work).map_err(Failure::internal)?)
    }

    /// Has `work` tell its progress here, and end where the user wishes it.
    pub fn watched<T>(&self, work: impl FnOnce(&Watch) -> T) -> T {
        self.watched_by(&|progress| self.progress(progress), work)
    }

    fn watched_by<T>(&self, told: &dyn Fn(Progress), work: impl FnOnce(&Watch) -> T) -> T {
        work(&Watch { cancel: self.cancel.clone(), progress: Some(told) })
    }

    fn progress(&self, progress: Progress) {
        match (progress, &self.bar) {
            (Progress::Started { stage }, Some(bar)) => bar.set_message(stage),
            (Progress::Finished { stage, seconds }, bar) => {
                bar.iter().for_each(|bar| bar.inc(1));
                self.line(format_args!("  {stage:<14} {seconds:.2} s"));
            }
            _ => {}
        }
    }

    fn above_the_bar(&self, text: impl Display) {
        match &self.bar {
            Some(bar) => bar.suspend(|| tell(text)),
            None => tell(text),
        }
    }
}

/// A line on standard error; nothing where that is closed.
fn tell(text: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}
