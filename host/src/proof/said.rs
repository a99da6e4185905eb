//! What the tool said: `thud-diagnosis/1`, as far as judging needs it.

use serde::Deserialize;

/// A diagnosis. Numbers that are none (JSON's null) are absent.
#[derive(Clone, Debug, Deserialize)]
pub struct Said {
    /// `consistent`, `named`, `ambiguous`, `unexplained`.
    pub verdict: String,
    /// The re-tuned baseline.
    pub baseline: Baseline,
    /// Where it fails.
    #[serde(rename = "where")]
    pub places: Vec<Place>,
    /// What was named, the most important first.
    pub mechanisms: Vec<Named>,
    /// How the final model does.
    pub model: Model,
    /// What has no name.
    pub unexplained: Unexplained,
    /// What to record next, in sentences.
    #[serde(default)]
    pub advice: Vec<String>,
}

/// The re-tuned baseline.
#[derive(Clone, Debug, Deserialize)]
pub struct Baseline {
    /// On recordings that took no part.
    pub held_out_rmse: Option<f64>,
    /// Rms of the noise before contact.
    pub noise_rms: Option<f64>,
}

/// A place.
#[derive(Clone, Debug, Deserialize)]
pub struct Place {
    /// Phase.
    pub phase: String,
    /// Recordings.
    pub recordings: Vec<String>,
    /// Share of the excess.
    pub share: Option<f64>,
    /// Corrected for all places looked at.
    pub p_value: Option<f64>,
}

/// A mechanism that was named.
#[derive(Clone, Debug, Deserialize)]
pub struct Named {
    /// Id.
    pub id: String,
    /// Parameters with intervals.
    pub parameters: Vec<Parameter>,
    /// What it cannot be told from.
    pub indistinguishable_from: Vec<String>,
}

/// A parameter.
#[derive(Clone, Debug, Deserialize)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: Option<f64>,
    /// Lower end of the 95 % interval.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

/// The final model.
#[derive(Clone, Debug, Deserialize)]
pub struct Model {
    /// On recordings that took no part.
    pub held_out_rmse: Option<f64>,
}

/// What has no name.
#[derive(Clone, Debug, Deserialize)]
pub struct Unexplained {
    /// On recordings that took no part, with the map of what has no name.
    pub held_out_rmse: Option<f64>,
}

impl Said {
    /// Rmse of what the tool ends with, on recordings that took no part: with the map where something has no name.
    #[must_use]
    pub fn held_out_rmse(&self) -> Option<f64> {
        let mapped = self.unexplained.held_out_rmse.filter(|rmse| *rmse > 0.0 && self.verdict == "unexplained");
        mapped.or(self.model.held_out_rmse)
    }

    /// The place with the largest share.
    #[must_use]
    pub fn first_place(&self) -> Option<&Place> {
        self.places.iter().max_by(|a, b| a.share.unwrap_or(0.0).total_cmp(&b.share.unwrap_or(0.0)))
    }

    /// Names, the most important first.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        self.mechanisms.iter().map(|named| named.id.as_str()).collect()
    }
}

impl Named {
    /// Whether it, or one that it cannot be told from, is `id`.
    #[must_use]
    pub fn means(&self, id: &str) -> bool {
        self.id == id || self.indistinguishable_from.iter().any(|other| other == id)
    }
}
