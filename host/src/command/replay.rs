//! `thud replay`: what would the sensor have said to this recording?

use std::path::{Path, PathBuf};

use thud_firmware::configuration::Configuration;
use thud_firmware::event::Flags;
use thud_firmware::units::{Kilogram, NewtonPerMetre};

use super::written;
use crate::campaign;
use crate::json::JsonOption;
use crate::recording;
use crate::replay::{Outcome, Replayed, replay};
use crate::report::{self, words};
use crate::settings::{JudgeOptions, explain_invalid};
use crate::table::{Side, Table};

/// Push recordings through the sensor's firmware and show its events
///
/// A recording is a CSV with a header that names columns with units: `time_s`, `force_N`, others are ignored. It is
/// brought to the ADC's rate, made into counts by the reference chain, and pushed through the firmware's own logic.
/// Times are the recording's own.
///
/// A campaign's folder stands for all its recordings, each judged with the effective mass, the body stiffness and the
/// full scale that the campaign states for it, unless --mass, --stiffness or --full-scale is given.
#[derive(clap::Args, Debug)]
pub struct Replay {
    /// Recordings, or folders of campaigns
    #[arg(required = true, value_name = "FILE.csv")]
    files: Vec<PathBuf>,
    /// Samples per second of the replay [default: that of the recording, up to 250 000; 20 000 for one slower than 3 000]
    #[arg(long, value_name = "HZ")]
    sample_rate: Option<f64>,
    #[command(flatten)]
    judge: JudgeOptions,
    #[command(flatten)]
    json: JsonOption,
    /// Also write one self-contained HTML page to FILE
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
}

impl Replay {
    pub(super) fn run(self) -> miette::Result<()> {
        let configuration = self.judge.configuration()?;
        let mut all = Vec::with_capacity(self.files.len());
        for path in &self.files {
            if path.is_dir() {
                self.campaign(path, &configuration, &mut all)?;
            } else {
                let name = path.display().to_string();
                let recording = recording::read(path)?;
                let replayed = replay(&name, &recording, &configuration, self.sample_rate)?;
                all.push((name, replayed));
            }
        }
        let mut outcome = Outcome::default();
        for (name, replayed) in &all {
            outcome.add(replayed, (all.len() > 1).then_some(name));
        }
        self.json.write(&outcome)?;
        if !self.json.owns_stdout() {
            for (name, replayed) in &all {
                print_one(name, replayed);
            }
        }
        if let Some(path) = &self.report {
            let page = report::page(&crate::replay::report(&all, &configuration));
            written::write(path, &page)?;
            if !self.json.owns_stdout() {
                crate::say!("The page is in {}.", path.display());
            }
        }
        Ok(())
    }

    /// Replays all recordings of a campaign, each with what is believed of it.
    fn campaign(
        &self,
        folder: &Path,
        configuration: &Configuration,
        all: &mut Vec<(String, Replayed)>,
    ) -> miette::Result<()> {
        let loaded = campaign::load(folder)?;
        for warning in &loaded.warnings {
            eprintln!("warning: {warning}");
        }
        for (entry, recording) in loaded.campaign.recordings.iter().zip(&loaded.recordings) {
            let name = folder.join(&entry.file).display().to_string();
            let mut configuration = *configuration;
            if self.judge.mass.is_none() {
                configuration.effective_mass = Some(Kilogram(entry.effective_mass_kg.value as f32));
            }
            if let (None, Some(stiffness)) = (self.judge.stiffness, loaded.campaign.rig.body_stiffness_n_per_m) {
                configuration.body_stiffness = NewtonPerMetre(stiffness.value as f32);
            }
            if let Some(full_scale) = loaded.campaign.chain.full_scale.filter(|_| self.judge.full_scale.is_none()) {
                // What reached full scale was clipped, whatever the reference chain could have measured.
                let codes = configuration.chain.clip_high - configuration.chain.zero_code;
                configuration.chain.newton_per_code = (full_scale / f64::from(codes)) as f32;
                configuration.validate().map_err(|invalid| miette::miette!("{}", explain_invalid(invalid)))?;
            }
            let replayed = replay(&name, recording, &configuration, self.sample_rate)?;
            all.push((name, replayed));
        }
        Ok(())
    }
}

fn print_one(name: &str, replayed: &Replayed) {
    let mut outcome = Outcome::default();
    outcome.add(replayed, None);
    crate::say!("{name}");
    for note in &outcome.notes {
        crate::say!("  note: {note}");
    }
    if outcome.events.is_empty() {
        crate::say!("  No contact was found.\n");
        return;
    }
    let mut table = Table::new(&[
        ("impact", Side::Right),
        ("contact", Side::Left),
        ("at s", Side::Right),
        ("raw peak N", Side::Right),
        ("judged N", Side::Right),
        ("scaled N", Side::Right),
        ("limit N", Side::Right),
        ("impulse Ns", Side::Right),
        ("duration ms", Side::Right),
        ("verdict", Side::Left),
        ("flags", Side::Left),
    ]);
    for event in &outcome.events {
        table.row([
            event.impact.to_string(),
            if event.contact == 0 { "blow".to_owned() } else { format!("rebound {}", event.contact) },
            format!("{:.6}", event.contact_s),
            format!("{:.2}", event.raw_peak_N),
            format!("{:.2}", event.peak_N),
            format!("{:.2}", event.scaled_N),
            event.transient_limit_N.map_or_else(|| "-".to_owned(), |limit| format!("{limit:.0}")),
            format!("{:.4}", event.impulse_Ns),
            format!("{:.2}", event.duration_s * 1e3),
            event.verdict.to_owned(),
            event.flags.join(" "),
        ]);
    }
    crate::standard_output::say(format_args!("{table}"));
    if outcome.lost > 0 {
        crate::say!("  {} samples of the recording are missing.", outcome.lost);
    }
    let flags = replayed.events().fold(Flags::empty(), |all, event| all | event.flags);
    for (flag, meaning) in words::explain_flags(flags) {
        crate::say!("  {flag}: {meaning}");
    }
    crate::say!();
}
