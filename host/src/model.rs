//! A model: the rig as it is understood, with its mechanisms and their parameters. `simulate` runs it, diagnosis writes it,
//! a person can read and edit it.
//!
//! ```toml
//! format = "thud-model/1"
//! name = "chest rig, as diagnosed"
//!
//! [rig]                       # the same table as in a campaign
//! kind = "impact"
//! body_stiffness_N_per_m = { value = 25120.0, sd = 60.0 }
//!
//! [[mechanism]]
//! id = "guide-friction"
//! configuration = "2"         # optional: it acts in the recordings of this configuration only
//! [mechanism.parameters]      # low and high: 95 % interval; a parameter that was held has none
//! force_N = { value = 2.1, low = 1.9, high = 2.3 }
//! cell_share = { value = 0.0 }
//! ```
//!
//! Parameters that are not named have the mechanism's typical value. Unknown keys, ids and parameters, and values that are
//! physically impossible, are refused with line and column.

mod read;
mod write;

pub use read::read;

use thud_sim::mechanism::{Effect, MechanismError};

use crate::campaign::Rig;

/// What the `format` key says.
pub const FORMAT: &str = "thud-model/1";

/// A 95 % interval, both ends in the parameter's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A mechanism of the model: its values, and how well each is known.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMechanism {
    /// The mechanism with its values.
    pub effect: Effect,
    /// One for each of its parameters, in their order; `None` for one that was held.
    pub intervals: Vec<Option<Interval>>,
    /// The name of the only configuration that it acts in; `None`: in all.
    pub only_in: Option<String>,
}

impl ModelMechanism {
    /// A mechanism whose values are given, not estimated.
    #[must_use]
    pub fn held(effect: Effect) -> Self {
        let intervals = vec![None; effect.values().len()];
        Self { effect, intervals, only_in: None }
    }
}

/// The rig with its mechanisms.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// A name for people.
    pub name: String,
    /// The rig.
    pub rig: Rig,
    /// What it has beyond the ideal impact, in the order in which it was found.
    pub mechanisms: Vec<ModelMechanism>,
}

impl Model {
    /// The mechanisms that act in every configuration, as the simulation takes them.
    #[must_use]
    pub fn effects(&self) -> Vec<Effect> {
        let everywhere = self.mechanisms.iter().filter(|mechanism| mechanism.only_in.is_none());
        everywhere.map(|mechanism| mechanism.effect.clone()).collect()
    }

    /// The mechanisms that act in one configuration only, each with that one's name.
    #[must_use]
    pub fn limited(&self) -> Vec<(Effect, String)> {
        let pair = |mechanism: &ModelMechanism| Some((mechanism.effect.clone(), mechanism.only_in.clone()?));
        self.mechanisms.iter().filter_map(pair).collect()
    }
}

/// The rig as the simulation takes it, every value as believed.
#[must_use]
pub fn simulated(rig: &Rig) -> thud_sim::rig::Rig {
    thud_sim::rig::Rig {
        kind: rig.kind,
        // A fall meets no spring; the simulation asks for one all the same.
        body_stiffness_n_per_m: rig.body_stiffness_n_per_m.map_or(1.0, |stiffness| stiffness.value),
        pad_stiffness_n_per_m: rig.pad_stiffness_n_per_m.map(|stiffness| stiffness.value),
        gravity_m_per_s2: rig.gravity_along_impact_m_per_s2,
    }
}

/// A refusal of a mechanism, for the command line.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error("{0}")]
#[diagnostic(help(
    "write `--mechanism ID` or `--mechanism ID:parameter=value,parameter=value`, once for each mechanism"
))]
pub struct MechanismRefused(pub MechanismError);

#[cfg(test)]
mod tests;
