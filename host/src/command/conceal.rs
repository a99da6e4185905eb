//! `thud conceal`: a campaign with a hidden effect, for someone else to diagnose.

use std::path::PathBuf;

use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use thud_conceal::chosen::{self, WayWord};
use thud_conceal::files::{self, Answers};
use thud_conceal::{case, effect};

use crate::proof::seal;
use crate::say;
use crate::table::{Side, Table};

/// Hide an effect in a campaign, for someone else to diagnose
///
/// A simulator that shares no code with the diagnosis makes recordings of a rig with ordinary imperfections (coloured noise, hum,
/// drift, springs that repeat to a per mille, speeds and masses known only roughly) and hides what you choose among them. The
/// campaign goes to --out, what was hidden to --answer. Give away the one and keep the other.
///
/// The strength d is the norm of what the best re-tuned simulation leaves of the effect, in units of the noise: below 5 nobody can see
/// it, from 10 on it should be found, 60 is plain.
///
/// Example: thud conceal --effect guide-friction --strength 15 --out riddle --answer answer.json && thud diagnose riddle
#[derive(clap::Args, Debug)]
pub struct Conceal {
    /// What to hide; two or more separated by commas, each of the same strength
    #[arg(long, value_name = "ID", value_delimiter = ',', required_unless_present = "list")]
    effect: Vec<String>,
    /// Strength d of each effect
    #[arg(long, value_name = "D", default_value_t = 20.0)]
    strength: f64,
    /// How it is concealed
    #[arg(long, value_enum, default_value_t = WayWord::Unnamed)]
    way: WayWord,
    /// The same seed makes the same campaign [default: from the operating system's randomness]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Number of recordings
    #[arg(long, value_name = "N", default_value_t = 12)]
    recordings: usize,
    /// Folder for the campaign
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// File for what was hidden, outside that folder
    #[arg(long, value_name = "FILE.json", required_unless_present = "list")]
    answer: Option<PathBuf>,
    /// List what can be hidden, and stop
    #[arg(long)]
    list: bool,
}

impl Conceal {
    pub(super) fn run(self) -> miette::Result<()> {
        let (Some(out), Some(answer)) = (&self.out, &self.answer) else {
            list();
            return Ok(());
        };
        if self.list {
            list();
            return Ok(());
        }
        let seed = match self.seed {
            Some(seed) => seed,
            None => seal::seed()?,
        };
        let sentence = |sentence: String| miette!("{sentence}");
        let request =
            chosen::request(&self.effect, self.strength, self.way, seed, self.recordings).map_err(sentence)?;
        chosen::refuse_answer_inside(answer, out).map_err(sentence)?;
        if out.join("campaign.toml").exists() {
            return Err(miette!("{} holds a campaign already; choose another --out", out.display()));
        }
        let case = case::make(&request);
        let hidden = files::write(&case, out, "campaign")
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write the campaign to {}", out.display()))?;
        let d = hidden.d;
        let answers = Answers { format: files::FORMAT, mix: None, seed, cases: vec![hidden] };
        let text = serde_json::to_vec_pretty(&answers).into_diagnostic()?;
        std::fs::write(answer, &text)
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot write the answer to {}", answer.display()))?;
        say!("The campaign is in {}, the answer in {}.", out.display(), answer.display());
        say!("SHA-256 of the answer: {}", seal::sha256(&text));
        if !case.on_target {
            say!(
                "note: this effect cannot have d = {} in such a campaign; {d:.1} is the nearest. Another seed draws another rig.",
                self.strength
            );
        }
        say!("Whoever diagnoses: thud diagnose {} --report riddle.html", out.display());
        Ok(())
    }
}

fn list() {
    for (listed, heading) in [(true, "The tool knows of:"), (false, "The tool knows nothing of:")] {
        let mut table = Table::new(&[("effect", Side::Left), (heading, Side::Left)]);
        for effect in effect::ALL.iter().filter(|effect| effect.listed == listed) {
            table.row([effect.id.to_owned(), effect.about.to_owned()]);
        }
        crate::standard_output::say(format_args!("{table}\n"));
    }
}
