//! `thud diagnose`: where simulation and recordings differ, and what was left out.

use std::path::PathBuf;

use super::step::Steps;
use super::written::{Places, Results};
use crate::campaign;
use crate::diagnosis::{self, Note, Options, answer, found_model, shown};
use crate::json::JsonOption;

/// Say where simulation and recordings differ, what physics was left out, and how much better the model then fits
///
/// Everything that the campaign states is first re-tuned within its stated uncertainty; what is left is located, the
/// listed mechanisms are tried as its cause, and the result is shown on recordings that took no part.
///
/// Example: thud diagnose chest --report chest.html --model better.toml
#[derive(clap::Args, Debug)]
pub struct Diagnose {
    /// The campaign's folder
    campaign: PathBuf,
    #[command(flatten)]
    json: JsonOption,
    /// Write one HTML page with pictures, evidence and what to record next
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write the model that was found, for `thud simulate --model` and `thud evaluate`
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Do not try this mechanism (once for each)
    #[arg(long, value_name = "MECHANISM")]
    without: Vec<String>,
    /// Try only this mechanism (once for each)
    #[arg(long, value_name = "MECHANISM")]
    only: Vec<String>,
}

impl Diagnose {
    pub(super) fn run(self) -> miette::Result<()> {
        let loaded = campaign::load(&self.campaign)?;
        let options = Options { without: self.without, only: self.only };
        let steps = Steps::new()?;
        let found = diagnosis::diagnose(&loaded, &options, &mut |step| steps.next(step));
        steps.finish();
        let mut found = found?;
        let warnings: Vec<Note> =
            loaded.warnings.iter().map(|warning| Note { recording: None, sentence: warning.clone() }).collect();
        found.notes.splice(0..0, warnings);
        let answer = answer::answer(&found);
        let name = &loaded.campaign.name;
        let results = Results {
            answer: &answer.with_notes(&found.notes),
            page: || shown::page(&found, &answer, name),
            model: || found_model::to_toml(&found, name),
            screenful: || shown::screenful(&found, &answer, name),
        };
        results.give(&Places { json: &self.json, report: self.report.as_deref(), model: self.model.as_deref() })
    }
}
