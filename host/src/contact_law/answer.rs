//! The answer as JSON: `thud-identification/1`.

use serde::Serialize;

use super::depth::Source;
use super::found_model::{NearestModel, nearest_model};
use super::identification::{Identification, Identified, Parameter};
use crate::campaign::Loaded;
use crate::decimal::significant;

/// What was identified, as files have it.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct Answer {
    /// `thud-identification/1`.
    pub format: &'static str,
    /// `identified`, or `ambiguous` where another force fits as well.
    pub verdict: &'static str,
    /// The law that is named.
    pub law: &'static str,
    /// Laws that these recordings cannot tell from it.
    pub indistinguishable_from: Vec<&'static str>,
    /// `measured` or `reconstructed`.
    pub depth: &'static str,
    /// Noise before contact, rms.
    pub noise_rms_N: f64,
    /// Depth in the middle of the recordings, that `force_at_middle_depth` belongs to.
    pub middle_depth_m: f64,
    /// Every law that was fitted, best on recordings left out first.
    pub laws: Vec<LawAnswer>,
    /// Laws that were not fitted.
    pub not_fitted: Vec<Because>,
    /// What cannot be identified.
    pub cannot_be_identified: Vec<String>,
    /// Recordings that were used.
    pub recordings: Vec<RecordingAnswer>,
    /// Recordings that were not.
    pub left_out: Vec<Because>,
    /// What is to be noted.
    pub notes: Vec<String>,
    /// What a model file can carry of the law that is named.
    pub model: ModelAnswer,
}

/// One law.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct LawAnswer {
    /// Its id.
    pub id: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// Its source.
    pub source: &'static str,
    /// Its parameters with 95 % intervals.
    pub parameters: Vec<ParameterAnswer>,
    /// What is left of the recordings that it was fitted to, rms.
    pub rmse_N: f64,
    /// What is left of recordings that took no part, rms.
    pub held_out_rmse_N: f64,
    /// That over the noise before contact.
    pub noise_ratio: f64,
    /// The restitution that the law really gives.
    pub restitution: Vec<RestitutionAnswer>,
    /// What it claims at the middle speed; `null`: it claims none.
    pub claimed_restitution: Option<f64>,
    /// What it gives there.
    pub true_restitution: f64,
}

/// A parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterAnswer {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A point of the restitution.
#[derive(Clone, Debug, Serialize)]
pub struct RestitutionAnswer {
    /// Speed of approach.
    pub speed_m_per_s: f64,
    /// Speed of the rebound over it.
    pub restitution: f64,
}

/// Something that was not done, and why.
#[derive(Clone, Debug, Serialize)]
pub struct Because {
    /// A law or a recording.
    pub id: String,
    /// Why.
    pub because: String,
}

/// One recording.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct RecordingAnswer {
    /// Its file.
    pub file: String,
    /// As stated.
    pub speed_m_per_s: f64,
    /// As stated.
    pub mass_kg: f64,
    /// Highest force.
    pub peak_N: f64,
    /// By its momentum, mass and speed as stated.
    pub restitution: f64,
    /// One standard deviation of it.
    pub restitution_sd: f64,
    /// What the law that is named leaves of it when it took no part, rms.
    pub held_out_rmse_N: f64,
}

/// What a model file carries.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys of the file carry their units")]
pub struct ModelAnswer {
    /// Whether it is the law itself.
    pub exact: bool,
    /// What it cannot carry, and what stands for it.
    pub because: String,
    /// Root mean square of its force less the law's, over all recordings' contacts.
    pub error_rms_N: f64,
    /// Its largest deviation in a peak, relative.
    pub worst_peak_error: f64,
}

/// The answer of an identification.
#[must_use]
pub fn answer(found: &Identification, loaded: &Loaded) -> Answer {
    let named = found.law();
    Answer {
        format: "thud-identification/1",
        verdict: if found.is_ambiguous() { "ambiguous" } else { "identified" },
        law: named.law.id,
        indistinguishable_from: found.alike.iter().map(|&place| found.laws[place].law.id).collect(),
        depth: match found.source {
            Source::Measured => "measured",
            Source::Reconstructed => "reconstructed",
        },
        noise_rms_N: round(found.noise_n),
        middle_depth_m: found.middle.0,
        laws: found.laws.iter().map(|law| law_answer(law, found.noise_n)).collect(),
        not_fitted: found
            .unfitted
            .iter()
            .map(|(law, because)| Because { id: law.id.to_owned(), because: because.clone() })
            .collect(),
        cannot_be_identified: found.cannot.clone(),
        recordings: found
            .recordings
            .iter()
            .zip(&named.held_out_n)
            .map(|(recording, held_out)| RecordingAnswer {
                file: recording.file.clone(),
                speed_m_per_s: recording.speed_m_per_s,
                mass_kg: recording.mass_kg,
                peak_N: round(recording.peak_n),
                restitution: round(recording.restitution.0),
                restitution_sd: round(recording.restitution.1),
                held_out_rmse_N: round(*held_out),
            })
            .collect(),
        left_out: found
            .left_out
            .iter()
            .map(|(file, because)| Because { id: file.clone(), because: because.clone() })
            .collect(),
        notes: found.notes.clone(),
        model: model_answer(&nearest_model(found, loaded)),
    }
}

fn law_answer(law: &Identified, noise_n: f64) -> LawAnswer {
    LawAnswer {
        id: law.law.id,
        equation: law.law.equation,
        source: law.law.source,
        parameters: law.parameters.iter().map(parameter).collect(),
        rmse_N: round(law.rmse_n),
        held_out_rmse_N: round(law.held_out_rmse_n()),
        noise_ratio: round(law.held_out_rmse_n() / noise_n),
        restitution: law
            .restitution
            .iter()
            .map(|(speed, restitution)| RestitutionAnswer {
                speed_m_per_s: round(*speed),
                restitution: round(*restitution),
            })
            .collect(),
        claimed_restitution: law.claimed_restitution.map(round),
        true_restitution: round(law.true_restitution),
    }
}

fn parameter(parameter: &Parameter) -> ParameterAnswer {
    ParameterAnswer {
        name: parameter.name,
        unit: parameter.unit,
        value: round(parameter.value),
        low: round(parameter.low),
        high: round(parameter.high),
    }
}

fn model_answer(model: &NearestModel) -> ModelAnswer {
    ModelAnswer {
        exact: model.exact,
        because: model.because.clone(),
        error_rms_N: round(model.error_rms_n),
        worst_peak_error: round(model.worst_peak_error),
    }
}

/// More digits would say nothing.
fn round(value: f64) -> f64 {
    significant(value, 6)
}
