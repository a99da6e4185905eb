//! `thud diagnose`: where simulation and recordings differ, and what was left out.

use std::path::PathBuf;

use crate::campaign;
use crate::diagnosis::{self, Options};
use crate::json::JsonOption;

/// Say where simulation and recordings differ, what physics was left out, and how much better the model then fits
#[derive(clap::Args, Debug)]
pub struct Diagnose {
    /// The campaign's folder
    campaign: PathBuf,
    #[command(flatten)]
    json: JsonOption,
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
        let found = diagnosis::diagnose(&loaded, &options, &mut |step| eprintln!("{step}"))?;
        self.json.write(&diagnosis::answer::answer(&found))?;
        Ok(())
    }
}
