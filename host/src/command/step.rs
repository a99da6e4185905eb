//! What a long command is doing, on standard error, and only on a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use miette::IntoDiagnostic as _;

/// How often the mark turns.
const TURN: Duration = Duration::from_millis(120);

/// A line that says what is being done.
pub(super) struct Steps(ProgressBar);

impl Steps {
    /// A line that is still empty.
    ///
    /// # Errors
    /// None that its fixed template could have.
    pub(super) fn new() -> miette::Result<Self> {
        let style = ProgressStyle::with_template("  {spinner} {msg}").into_diagnostic()?;
        let bar = ProgressBar::new_spinner().with_style(style);
        bar.enable_steady_tick(TURN);
        Ok(Self(bar))
    }

    /// Says what comes now.
    pub(super) fn next(&self, step: &str) {
        self.0.set_message(step.to_owned());
    }

    /// Takes the line away.
    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
