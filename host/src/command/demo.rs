//! `thud demo`: the first thing that a newcomer runs.

use std::path::PathBuf;

use indicatif::ProgressBar;
use miette::{IntoDiagnostic as _, WrapErr as _};

use super::written;
use crate::demonstration::{Outcome, RECORDINGS, Scenario, demonstrate, report, riddle, table};
use crate::json::JsonOption;
use crate::report::{page, words};

/// A robot hits the simulated rig; see what the sensor makes of it
///
/// A robot runs into a rig three times, each time faster. The sensor's own firmware runs on a simulated board, senses the
/// blows through a simulated measuring chain, and reports them over a simulated CAN bus. What was sensed stands beside
/// what the rig truly did. One HTML page shows the force curves.
///
/// Then something is hidden in another simulated rig, an effect that the seed chooses, and the diagnosis, which gets the
/// recordings only, says what it is.
#[derive(clap::Args, Debug)]
pub struct Demo {
    /// Starts the random numbers: region, robot, speeds, noise; the same seed gives the same results
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write the HTML page to FILE [default: out/demo.html]
    #[arg(long, value_name = "FILE.html", conflicts_with = "out")]
    report: Option<PathBuf>,
    /// Write page and JSON into DIR, as demo.html and demo.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
}

impl Demo {
    pub(super) fn run(self) -> miette::Result<()> {
        let quiet = self.json.owns_stdout();
        let page_path = match (&self.out, &self.report) {
            (Some(folder), _) => folder.join("demo.html"),
            (None, Some(path)) => path.clone(),
            (None, None) => PathBuf::from("out/demo.html"),
        };
        if let Some(folder) = page_path.parent() {
            std::fs::create_dir_all(folder)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let scenario = Scenario::from_seed(self.seed).into_diagnostic()?;
        if !quiet {
            crate::say!(
                "A simulated robot of {:.2} kg runs into a rig for the {} ({:.0} N/mm), three times.\n",
                scenario.true_mass_kg,
                words::region_name(scenario.region),
                scenario.rig.body_stiffness_n_per_m / 1e3,
            );
        }
        let spinner = ProgressBar::new_spinner();
        spinner.enable_steady_tick(std::time::Duration::from_millis(100));
        let demonstrated = demonstrate(scenario, |step| spinner.set_message(step.to_owned()))?;
        let stem = page_path.file_stem().map_or_else(|| "demo".into(), |stem| stem.to_string_lossy().into_owned());
        let (diagnosis_name, campaign_name) = (format!("{stem}-diagnosis.html"), format!("{stem}-campaign"));
        let campaign_path = page_path.with_file_name(&campaign_name);
        let riddle = riddle(self.seed, &campaign_path, &mut |step| spinner.set_message(step.to_owned()))?;
        spinner.finish_and_clear();

        let outcome = Outcome::new(&demonstrated, &riddle);
        written::write(&page_path, &page(&report(&demonstrated, &riddle, &diagnosis_name)))?;
        written::write(&page_path.with_file_name(&diagnosis_name), &riddle.page)?;
        if let Some(folder) = &self.out {
            JsonOption { json: Some(folder.join("demo.json")) }.write(&outcome)?;
        }
        self.json.write(&outcome)?;
        if !quiet {
            crate::say!("{}", table(&outcome));
            for (index, blow) in demonstrated.blows.iter().enumerate() {
                crate::say!("  Blow {}: {}", index + 1, words::explain_verdict(&blow.events[0]));
            }
            crate::say!(
                "\n  {} frames came over the simulated CAN bus, {} were lost; {:.1} s of virtual time.",
                outcome.frames_received,
                outcome.frames_lost,
                outcome.virtual_s
            );
            crate::say!(
                "\n  Another rig was hit {} times, with something hidden in it; the diagnosis got the recordings only:",
                RECORDINGS
            );
            crate::say!("  {} {}", riddle.verdict, riddle.gain);
            crate::say!("  {}", riddle.resolved());
            crate::say!("  Try it yourself: thud diagnose {}", campaign_path.display());
            crate::say!(
                "\n  The page with the force curves and the diagnosis is {}; open it in a browser.",
                page_path.display()
            );
        }
        Ok(())
    }
}
