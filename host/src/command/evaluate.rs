//! `thud evaluate`: does a model still hold?

use std::path::PathBuf;

use super::step::Steps;
use crate::campaign;
use crate::diagnosis::evaluation::{Evaluation, evaluate};
use crate::diagnosis::words::short;
use crate::json::JsonOption;
use crate::model;
use crate::table::{Side, Table};

/// Say whether a model still holds on recordings that it has never seen
///
/// The model is frozen. Of each recording its instant of contact, its zero, and its speed, mass and springs within their
/// stated uncertainty are estimated; what is then left is compared with the noise before contact.
///
/// Example: thud evaluate better.toml next-week
#[derive(clap::Args, Debug)]
pub struct Evaluate {
    /// The model, as `thud diagnose --model` writes it
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// The campaign's folder
    campaign: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

impl Evaluate {
    pub(super) fn run(self) -> miette::Result<()> {
        let model = model::read(&self.model)?;
        let loaded = campaign::load(&self.campaign)?;
        let steps = Steps::new()?;
        steps.next("recordings against the model");
        let found = evaluate(&model, &loaded);
        steps.finish();
        let mut found = found?;
        found.notes.splice(0..0, loaded.warnings.iter().cloned());
        self.json.write(&found)?;
        if !self.json.owns_stdout() {
            print(&model.name, &found);
        }
        Ok(())
    }
}

/// Columns of a terminal that everyone has.
const COLUMNS: usize = 100;

fn print(name: &str, found: &Evaluation) {
    crate::say!("{}", textwrap::fill(&format!("{name}: {}", found.because), COLUMNS));
    let mut table = Table::new(&[
        ("recording", Side::Left),
        ("rmse", Side::Right),
        ("over the noise", Side::Right),
        ("contact s", Side::Right),
        ("speed m/s", Side::Right),
        ("mass kg", Side::Right),
    ]);
    for recording in &found.recordings {
        table.row([
            recording.file.clone(),
            short(recording.rmse),
            format!("{:.2}", recording.noise_ratio),
            format!("{:.6}", recording.contact_s),
            format!("{:.4}", recording.impact_speed_m_per_s),
            format!("{:.3}", recording.effective_mass_kg),
        ]);
    }
    table.row(["all".to_owned(), short(found.rmse), format!("{:.2}", found.noise_ratio)]);
    crate::standard_output::say(format_args!("{table}"));
    for note in &found.notes {
        crate::say!("note: {note}");
    }
}
