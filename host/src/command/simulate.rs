//! `thud simulate`: campaigns from the simulated rig.

use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use indicatif::{ProgressBar, ProgressStyle};
use miette::{IntoDiagnostic as _, WrapErr as _, miette};
use serde::Serialize;
use thud_firmware::limits::Region;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{pad_of, spring_set_of};

use crate::campaign::{self, Estimate, Rig, RigKind, SPRING_REPEATABILITY};
use crate::json::JsonOption;
use crate::model::{self, MechanismRefused};
use crate::settings::one_of;
use crate::simulation::{CampaignTruth, Doubt, Imperfection, Plan, TRUTH_FORMAT, Truth, simulate};

/// Make campaigns of simulated recordings
///
/// Every speed is combined with every mass, each pair `--repeats` times. What the campaign states is what an
/// experimenter would believe; the true values lie around it within the stated errors. The same options and seed give the
/// same bytes.
///
/// Example: thud simulate --region chest --speeds 0.1,0.2,0.3 --masses 4,6.1 --mechanism guide-friction:force_N=3 --out chest
#[derive(clap::Args, Debug)]
pub struct Simulate {
    /// Folder for the campaign; with several regions one folder for each in it
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Speeds at contact, m/s
    #[arg(long, value_name = "M/S", value_delimiter = ',', default_value = "0.1,0.2,0.3")]
    speeds: Vec<f64>,
    /// Effective masses of the robot, kg; each is a configuration of its own
    #[arg(long, value_name = "KG", value_delimiter = ',', default_value = "4,8")]
    masses: Vec<f64>,
    /// How often each pair of speed and mass is repeated
    #[arg(long, value_name = "N", default_value_t = 2)]
    repeats: usize,
    /// Starts the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Replace a campaign that is already in the folder
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    rig: RigOptions,
    #[command(flatten)]
    chain: ChainOptions,
    /// Write what was true (contact instants, peaks, values) to FILE, which is not part of the campaign
    #[arg(long, value_name = "FILE.json")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "The rig")]
struct RigOptions {
    /// Body regions whose springs the rig has, separated by commas: a campaign for each [default: chest]
    #[arg(
        long = "regions",
        visible_alias = "region",
        value_name = "REGION",
        value_delimiter = ',',
        conflicts_with_all = ["body_stiffness", "model"],
        value_parser = one_of(&Region::ALL, Region::name),
    )]
    regions: Vec<Region>,
    /// Stiffness of the body springs instead of a region's
    #[arg(long, value_name = "N/M", conflicts_with = "model")]
    body_stiffness: Option<f64>,
    /// Pad in series: `none`, `region` (the region's own), or its stiffness in N/m
    #[arg(long, value_name = "PAD", default_value = "none", conflicts_with = "model")]
    pad: PadChoice,
    /// A robot runs into the rig (impact), a mass falls on it (drop), or something falls freely (fall): its height is
    /// recorded, `--speeds` are those at release, 0 from rest
    #[arg(long, default_value = "impact", conflicts_with = "model", value_parser = one_of(&RigKind::ALL, RigKind::name))]
    kind: RigKind,
    /// A mechanism that the rig has beyond the ideal impact: `ID` or `ID:parameter=value,…`; repeatable
    #[arg(long = "mechanism", value_name = "MECHANISM")]
    mechanisms: Vec<String>,
    /// Run a model file: its rig and mechanisms
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "The measurement")]
struct ChainOptions {
    /// Noise of the force, N rms
    #[arg(long, value_name = "NEWTON", default_value_t = 0.3)]
    noise: f64,
    /// Amplitude of 50 Hz hum, N
    #[arg(long, value_name = "NEWTON", default_value_t = 0.0)]
    hum: f64,
    /// Drift of the zero, N/s
    #[arg(long, value_name = "N/S", default_value_t = 0.0, allow_negative_numbers = true)]
    drift: f64,
    /// Samples per second
    #[arg(long, value_name = "HZ", default_value_t = 20_000.0)]
    sample_rate: f64,
    /// Full scale of the chain, N
    #[arg(long, value_name = "NEWTON", default_value_t = 2_224.0)]
    full_scale: f64,
    /// Quiet before the contact, s
    #[arg(long, value_name = "SECOND", default_value_t = 0.15)]
    before: f64,
    /// Duration after the contact, s
    #[arg(long, value_name = "SECOND", default_value_t = 0.35)]
    after: f64,
    /// Relative standard deviation of the stated speeds
    #[arg(long, value_name = "RATIO", default_value_t = 0.01)]
    speed_error: f64,
    /// Relative standard deviation of the stated masses
    #[arg(long, value_name = "RATIO", default_value_t = 0.03)]
    mass_error: f64,
    /// Relative standard deviation of the stated stiffness of the body springs
    #[arg(long, value_name = "RATIO", default_value_t = 0.05)]
    stiffness_error: f64,
    /// Relative standard deviation of the stated stiffness of the pad
    #[arg(long, value_name = "RATIO", default_value_t = 0.25)]
    pad_error: f64,
    /// Relative standard deviation of the springs from one recording to the next
    #[arg(long, value_name = "RATIO", default_value_t = SPRING_REPEATABILITY)]
    spring_repeatability: f64,
    /// Noise of the height of a fall, m rms
    #[arg(long, value_name = "METRE", default_value_t = 0.001)]
    height_noise: f64,
    /// Also record the stroke of the springs, with this noise, m rms
    #[arg(long, value_name = "METRE")]
    displacement: Option<f64>,
}

/// Relative standard deviation of the stated mass of the impact piece: kitchen scales, and what of the springs moves along.
const PIECE_ERROR: f64 = 0.08;

#[derive(Clone, Copy, Debug, PartialEq)]
enum PadChoice {
    None,
    Region,
    Stiffness(f64),
}

impl std::str::FromStr for PadChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "none" => Ok(Self::None),
            "region" => Ok(Self::Region),
            number => match number.parse::<f64>() {
                Ok(stiffness) if stiffness.is_finite() && stiffness > 0.0 => Ok(Self::Stiffness(stiffness)),
                _ => Err("write `none`, `region`, or a stiffness in N/m above 0".to_owned()),
            },
        }
    }
}

/// What `--json` gives.
#[derive(Serialize)]
struct Written {
    seed: u64,
    campaigns: Vec<WrittenCampaign>,
}

#[derive(Serialize)]
struct WrittenCampaign {
    folder: String,
    name: String,
    recordings: usize,
}

impl Simulate {
    pub(super) fn run(self) -> miette::Result<()> {
        let plans = self.plans()?;
        let many = plans.len() > 1;
        let folders: Vec<PathBuf> =
            plans.iter().map(|plan| if many { self.out.join(&plan.name) } else { self.out.clone() }).collect();
        for folder in &folders {
            let present = folder.join(campaign::FILE_NAME);
            if present.exists() && !self.replace {
                return Err(miette!(
                    help = "choose another folder, or say `--replace`",
                    "there is already a campaign: {}",
                    present.display()
                ));
            }
        }
        let recordings: usize =
            plans.iter().map(|plan| plan.speeds_m_per_s.len() * plan.masses_kg.len() * plan.repeats).sum();
        // Drawn on standard error, and only on a terminal.
        let bar = ProgressBar::new(recordings as u64)
            .with_style(ProgressStyle::with_template("  simulating {bar:32} {pos}/{len}").into_diagnostic()?);
        let mut written = Written { seed: self.seed, campaigns: Vec::new() };
        let mut truths: Vec<CampaignTruth> = Vec::new();
        for (plan, folder) in plans.iter().zip(&folders) {
            let simulated = simulate(plan, || bar.inc(1))?;
            simulated
                .campaign
                .write(folder, &simulated.recordings)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot write the campaign to {}", folder.display()))?;
            written.campaigns.push(WrittenCampaign {
                folder: folder.display().to_string(),
                name: plan.name.clone(),
                recordings: simulated.recordings.len(),
            });
            truths.push(simulated.truth);
        }
        bar.finish_and_clear();
        if let Some(path) = &self.truth {
            write_truth(path, &Truth { format: TRUTH_FORMAT, seed: self.seed, campaigns: truths })?;
        }
        self.json.write(&written)?;
        if !self.json.owns_stdout() {
            for campaign in &written.campaigns {
                crate::say!("{}: {} recordings of {}", campaign.folder, campaign.recordings, campaign.name);
            }
        }
        Ok(())
    }

    fn plans(&self) -> miette::Result<Vec<Plan>> {
        let named: Result<Vec<Effect>, _> =
            self.rig.mechanisms.iter().map(|text| Effect::from_str(text).map_err(MechanismRefused)).collect();
        let mut effects = named?;
        let mut limited = Vec::new();
        let rigs: Vec<(String, Rig)> = if let Some(path) = &self.rig.model {
            let model = model::read(path)?;
            effects.splice(0..0, model.effects());
            limited = model.limited();
            for (effect, name) in &limited {
                if (1..=self.masses.len()).all(|number| number.to_string() != *name) {
                    eprintln!(
                        "warning: `{}` acts in configuration {name} only; the {} masses here are the configurations 1 to {}, so it never does",
                        effect.mechanism().id,
                        self.masses.len(),
                        self.masses.len()
                    );
                }
            }
            vec![(model.name, model.rig)]
        } else if let Some(stiffness) = self.rig.body_stiffness {
            vec![(format!("{stiffness} N/m"), self.rig_of(stiffness, None, &effects)?)]
        } else if self.rig.kind == RigKind::Fall {
            vec![(RigKind::Fall.name().to_owned(), self.rig_of(0.0, None, &effects)?)]
        } else {
            let regions = if self.rig.regions.is_empty() { vec![Region::Chest] } else { self.rig.regions.clone() };
            regions
                .into_iter()
                .map(|region| {
                    let stiffness = spring_set_of(region).stiffness_n_per_m();
                    Ok((region.name().to_owned(), self.rig_of(stiffness, Some(region), &effects)?))
                })
                .collect::<miette::Result<_>>()?
        };
        for (index, effect) in effects.iter().enumerate() {
            let id = effect.mechanism().id;
            if effects[..index].iter().any(|other| other.mechanism().id == id) {
                return Err(miette!(
                    help = "name each once, with all its parameters",
                    "the mechanism `{id}` is there twice"
                ));
            }
        }
        Ok(rigs
            .into_iter()
            .enumerate()
            .map(|(index, (name, rig))| Plan {
                name,
                rig,
                effects: effects.clone(),
                limited: limited.clone(),
                speeds_m_per_s: self.speeds.clone(),
                masses_kg: self.masses.clone(),
                repeats: self.repeats,
                doubt: Doubt { speed: self.chain.speed_error, mass: self.chain.mass_error },
                sample_rate_hz: self.chain.sample_rate,
                full_scale_n: self.chain.full_scale,
                imperfection: Imperfection {
                    noise_n: self.chain.noise,
                    hum_n: self.chain.hum,
                    drift_n_per_s: self.chain.drift,
                },
                before_s: self.chain.before,
                after_s: self.chain.after,
                displacement_noise_m: self.chain.displacement,
                height_noise_m: self.chain.height_noise,
                // Campaigns of one run are independent of each other.
                seed: self.seed.wrapping_add((index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
            })
            .collect())
    }

    /// The impact piece was weighed: where its inertia is simulated, its mass is stated.
    fn moving_mass(&self, effects: &[Effect]) -> miette::Result<Option<Estimate>> {
        let Some(piece) = effects.iter().find(|effect| effect.mechanism().id == "moving-piece-inertia") else {
            return Ok(None);
        };
        let mass = piece.get("mass_kg").map_err(MechanismRefused)?;
        Ok((mass > 0.0).then(|| Estimate::new(mass, PIECE_ERROR * mass)))
    }

    fn rig_of(&self, stiffness: f64, region: Option<Region>, effects: &[Effect]) -> miette::Result<Rig> {
        if self.rig.kind == RigKind::Fall {
            return Ok(Rig {
                kind: RigKind::Fall,
                body_stiffness_n_per_m: None,
                pad_stiffness_n_per_m: None,
                moving_mass_kg: None,
                gravity_along_impact_m_per_s2: RigKind::Fall.default_gravity_m_per_s2(),
                spring_repeatability: self.chain.spring_repeatability,
            });
        }
        let pad = match (self.rig.pad, region) {
            (PadChoice::None, _) => None,
            (PadChoice::Region, Some(region)) => Some(pad_of(region).typical_stiffness_n_per_m()),
            (PadChoice::Region, None) => {
                return Err(miette!(
                    help = "name a region, or give the pad's stiffness in N/m",
                    "`--pad region` needs a region"
                ));
            }
            (PadChoice::Stiffness(stiffness), _) => Some(stiffness),
        };
        Ok(Rig {
            kind: self.rig.kind,
            body_stiffness_n_per_m: Some(Estimate::new(stiffness, self.chain.stiffness_error * stiffness)),
            pad_stiffness_n_per_m: pad.map(|pad| Estimate::new(pad.round(), (self.chain.pad_error * pad).round())),
            moving_mass_kg: self.moving_mass(effects)?,
            gravity_along_impact_m_per_s2: self.rig.kind.default_gravity_m_per_s2(),
            spring_repeatability: self.chain.spring_repeatability,
        })
    }
}

fn write_truth(path: &Path, truth: &Truth) -> miette::Result<()> {
    let mut text = serde_json::to_string_pretty(truth).into_diagnostic()?;
    text.push('\n');
    std::fs::write(path, text)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot write the truth to {}", path.display()))
}
