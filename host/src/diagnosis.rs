//! Where simulation and recordings differ, what was left out, modelled, and shown.
//!
//! ```text
//! campaign ─▶ problem ─▶ baseline, re-tuned ─▶ where ─▶ which mechanism ─▶ model ─▶ shown on recordings left out
//!             noise,     fit                   locate    screen, select    answer    held_out
//!             samples                                    omnibus: is there a rest?   rest: modelled without a name
//! ```
//!
//! [`diagnose`] goes the whole way; [`Diagnosis`] is what it found. The contract of files, JSON and verdicts is
//! `docs/diagnosis.md`. The physics is that of `thud_sim::mechanism`, one file each; nothing here knows a mechanism's equation.

pub mod advice;
pub mod answer;
pub mod candidate;
pub mod coincidence;
mod conditions;
mod convention;
pub mod evaluation;
pub mod evidence;
pub mod fit;
pub mod found_model;
pub mod held_out;
pub mod instants;
pub mod layout;
pub mod locate;
pub mod noise;
pub mod omnibus;
pub mod predict;
pub mod problem;
pub mod refit;
mod repeats;
mod rest;
pub mod retuned;
pub mod sampling;
pub mod screen;
pub mod select;
mod series;
pub mod shown;
pub mod spectrum;
pub mod strangers;
pub mod subset;
pub mod unfold;
pub mod verdict;
pub mod words;
pub mod work;

use thud_sim::mechanism::{LIST, Mechanism, MechanismError};

use crate::campaign::{Campaign, Loaded, RigKind};
use fit::{Effort, Fit};
use held_out::HeldOut;
use layout::Layout;
use problem::Problem;
use select::{Selection, select};

/// Why a campaign cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum DiagnosisError {
    /// No recording shows anything.
    #[error("no recording of the campaign rises above its noise")]
    #[diagnostic(help("record impacts: the observed channel has to leave its rest by more than five times its noise"))]
    Nothing,
    /// Too few samples in every recording.
    #[error("the longest recording has {most} samples that can be used")]
    #[diagnostic(help("20 samples at least; a recording begins 50 ms before contact and ends after the separation"))]
    TooFewSamples {
        /// The most that a recording has.
        most: usize,
    },
    /// The simulation fails at what the campaign states.
    #[error("the rig that the campaign states cannot be simulated: {0}")]
    #[diagnostic(help("look at [rig] and at the speeds and masses in campaign.toml"))]
    Impossible(String),
    /// A model of another experiment.
    #[error("the model is of kind \"{model}\", the campaign of kind \"{campaign}\"")]
    #[diagnostic(help("evaluate a model on recordings of the same kind of experiment"))]
    OtherKind {
        /// The model's kind.
        model: &'static str,
        /// The campaign's kind.
        campaign: &'static str,
    },
    /// A mechanism that does not exist.
    #[error("{0}")]
    #[diagnostic(help("`thud mechanisms` lists them with their equations"))]
    Mechanism(MechanismError),
}

/// Something that was odd but could be worked with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The recording; none: the campaign.
    pub recording: Option<String>,
    /// What, with the remedy.
    pub sentence: String,
}

impl Note {
    fn about(recording: &str, sentence: &str) -> Self {
        Self { recording: Some(recording.to_owned()), sentence: sentence.to_owned() }
    }

    fn general(sentence: &str) -> Self {
        Self { recording: None, sentence: sentence.to_owned() }
    }
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.recording {
            Some(recording) => write!(f, "{recording}: {}", self.sentence),
            None => f.write_str(&self.sentence),
        }
    }
}

/// What may be tried.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Mechanisms that are not tried.
    pub without: Vec<String>,
    /// The only ones that are tried; none: all.
    pub only: Vec<String>,
}

impl Options {
    /// The mechanisms that may be tried for a campaign's kind of rig and what was observed.
    ///
    /// # Errors
    /// An id that does not exist.
    pub fn mechanisms(&self, campaign: &Campaign) -> Result<Vec<&'static Mechanism>, DiagnosisError> {
        for id in self.without.iter().chain(&self.only) {
            Mechanism::find(id).map_err(DiagnosisError::Mechanism)?;
        }
        let kind = campaign.rig.kind;
        let wanted = |mechanism: &&'static Mechanism| {
            let id = mechanism.id;
            let listed = self.only.is_empty() || self.only.iter().any(|only| only == id);
            let is_shown = !campaign.is_of_places() || mechanism.is_seen_in_place();
            listed && !self.without.iter().any(|without| without == id) && mechanism.concerns(kind) && is_shown
        };
        Ok(LIST.iter().copied().filter(wanted).collect())
    }
}

/// What was found.
#[derive(Debug)]
pub struct Diagnosis {
    /// The mechanisms that were tried.
    pub tried: Vec<&'static Mechanism>,
    /// What was fitted.
    pub problem: Problem,
    /// The baseline exactly as stated: only contact instants and offsets are fitted.
    pub nominal: Fit,
    /// The re-tuned baseline with its offsets as the quiet before contact shows them: what is located.
    pub located: Fit,
    /// Baseline, chosen model and its rivals.
    pub selection: Selection,
    /// The baseline on recordings left out.
    pub baseline_held_out: HeldOut,
    /// The chosen model on recordings left out.
    pub held_out: HeldOut,
    /// What no mechanism explains, as a map.
    pub map: Option<rest::Map>,
    /// What was odd.
    pub notes: Vec<Note>,
}

/// Diagnoses a campaign. `progress` hears what is being done.
///
/// # Errors
/// A campaign that cannot be used, with the remedy.
pub fn diagnose(
    loaded: &Loaded,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Diagnosis, DiagnosisError> {
    let mechanisms = options.mechanisms(&loaded.campaign)?;
    let mut notes = Vec::new();
    let problem = Problem::new(loaded, &mut notes)?;
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    progress("baseline");
    let impossible = || DiagnosisError::Impossible("its motion cannot be followed".to_owned());
    let layout = Layout::new(&problem, Vec::new());
    let start = layout.start(&problem);
    let nominal = Fit::run(&problem, layout.clone(), start, &all, Effort::NOMINAL).ok_or_else(impossible)?;
    let baseline = Fit::run(&problem, layout, nominal.point.clone(), &all, Effort::FULL).ok_or_else(impossible)?;
    let selection = select(&problem, baseline, &mechanisms, progress).ok_or_else(impossible)?;
    let baseline = &selection.baseline;
    let seen = Layout { offsets_as_seen: true, ..baseline.layout.clone() };
    let located =
        Fit::run(&problem, seen, baseline.point.clone(), &all, Effort::AGAIN).unwrap_or_else(|| baseline.clone());
    notes.extend(retuned::delays(&problem, &selection));
    notes.extend(problem.work.cut_short().map(|sentence| Note::general(&sentence)));
    let map =
        verdict::remains(&selection).then(|| rest::map(&problem, &selection.best.fit, &selection.tangent)).flatten();
    progress("recordings left out");
    let baseline_held_out = held_out::held_out(&problem, baseline, baseline);
    let held_out = if selection.best.fit.layout.entrants.is_empty() {
        baseline_held_out.clone()
    } else {
        held_out::held_out(&problem, baseline, &selection.best.fit)
    };
    Ok(Diagnosis { tried: mechanisms, problem, nominal, located, selection, baseline_held_out, held_out, map, notes })
}
