//! `thud identify`: the contact law of a campaign.

use std::path::PathBuf;

use clap::ValueEnum;

use super::step::Steps;
use super::written::{Places, Results};
use crate::campaign;
use crate::contact_law::{Options, Source, answer, identify, nearest_model, shown, to_toml};
use crate::json::JsonOption;

/// Say which contact law holds: linear, Hertz, Hunt–Crossley and others, with intervals for every parameter
///
/// Every law is fitted to all recordings together and judged on recordings that took no part. The depth is the column
/// `displacement_m` where there is one, else the force integrated twice with the stated mass and speed. What the recordings
/// cannot tell is said, not fitted.
///
/// Example: thud identify chest --report law.html --model law.toml
#[derive(clap::Args, Debug)]
pub struct Identify {
    /// The campaign's folder
    campaign: PathBuf,
    #[command(flatten)]
    json: JsonOption,
    /// Write one HTML page with loops of force over depth, what each law leaves, and restitution against speed
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write the law, or what comes nearest to it, as a model for `thud simulate --model` and `thud evaluate`
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Where the depth comes from [default: measured where it was measured]
    #[arg(long, value_enum, value_name = "SOURCE")]
    depth: Option<DepthOption>,
    /// Hold the exponent, where it is known
    #[arg(long, value_name = "N")]
    exponent: Option<f64>,
    /// Fit only this law (once for each)
    #[arg(long = "law", value_name = "LAW")]
    laws: Vec<String>,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum DepthOption {
    /// The column `displacement_m`
    Measured,
    /// Force, mass and speed, integrated twice
    Reconstructed,
}

impl Identify {
    pub(super) fn run(self) -> miette::Result<()> {
        let options = Options {
            laws: self.laws,
            depth: self.depth.map(|depth| match depth {
                DepthOption::Measured => Source::Measured,
                DepthOption::Reconstructed => Source::Reconstructed,
            }),
            exponent: self.exponent,
        };
        let loaded = campaign::load(&self.campaign)?;
        let steps = Steps::new()?;
        let found = identify(&loaded, &options, &mut |step| steps.next(step));
        steps.finish();
        let found = found?;
        let answer = answer(&found, &loaded);
        let nearest = nearest_model(&found, &loaded);
        let name = &loaded.campaign.name;
        let results = Results {
            answer: &answer,
            page: || shown::page(&found, &answer, &nearest, name),
            model: || to_toml(&nearest, &found),
            screenful: || shown::screenful(&found, &nearest, name),
        };
        results.give(&Places { json: &self.json, report: self.report.as_deref(), model: self.model.as_deref() })
    }
}
