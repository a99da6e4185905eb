//! Results as JSON: `--json FILE`, with `-` for standard output.

use std::path::PathBuf;

use miette::{IntoDiagnostic as _, WrapErr as _};
use serde::Serialize;

use crate::standard_output;

/// The option that every command with results takes.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct JsonOption {
    /// Also write the results as JSON to FILE; `-` is standard output (and then nothing else is printed there)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl JsonOption {
    /// Whether standard output belongs to the JSON, so that the command prints its words elsewhere or not at all.
    #[must_use]
    pub fn owns_stdout(&self) -> bool {
        self.json.as_deref() == Some("-".as_ref())
    }

    /// Writes `results`, if the option was given.
    ///
    /// # Errors
    /// The file that could not be written, and why.
    pub fn write(&self, results: &impl Serialize) -> miette::Result<()> {
        let Some(path) = &self.json else { return Ok(()) };
        let mut text = serde_json::to_string_pretty(results).into_diagnostic()?;
        text.push('\n');
        if self.owns_stdout() {
            standard_output::write(text.as_bytes()).into_diagnostic()
        } else {
            std::fs::write(path, text)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot write the JSON results to {}", path.display()))
        }
    }
}
