//! What a command leaves behind: files that it was asked for, and words on the screen that say where they are.

use std::path::Path;

use miette::{IntoDiagnostic as _, WrapErr as _};
use serde::Serialize;

use crate::json::JsonOption;

/// Writes a file.
///
/// # Errors
/// The file that could not be written, and why.
pub(super) fn write(path: &Path, text: &str) -> miette::Result<()> {
    std::fs::write(path, text).into_diagnostic().wrap_err_with(|| format!("cannot write {}", path.display()))
}

/// Where the results of a command that explains a campaign go, as its options say.
pub(super) struct Places<'a> {
    pub(super) json: &'a JsonOption,
    pub(super) report: Option<&'a Path>,
    pub(super) model: Option<&'a Path>,
}

/// These results; a page and a model are made only where they are wanted.
pub(super) struct Results<A, P, M, S> {
    pub(super) answer: A,
    pub(super) page: P,
    pub(super) model: M,
    pub(super) screenful: S,
}

impl<A: Serialize, P: FnOnce() -> String, M: FnOnce() -> String, S: FnOnce() -> String> Results<A, P, M, S> {
    /// Writes model, page and JSON, and says the rest where standard output is free for it.
    ///
    /// # Errors
    /// The file that could not be written, and why.
    pub(super) fn give(self, places: &Places<'_>) -> miette::Result<()> {
        if let Some(path) = places.model {
            write(path, &(self.model)())?;
        }
        if let Some(path) = places.report {
            write(path, &(self.page)())?;
        }
        places.json.write(&self.answer)?;
        if !places.json.owns_stdout() {
            crate::standard_output::say(format_args!("{}", (self.screenful)()));
            if let Some(path) = places.report {
                crate::say!("The page is in {}.", path.display());
            }
            if let Some(path) = places.model {
                crate::say!("The model is in {}.", path.display());
            }
        }
        Ok(())
    }
}
