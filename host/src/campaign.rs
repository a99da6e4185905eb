//! A campaign: recordings together with what the experimenter believes about them.
//!
//! A folder with `campaign.toml` and one CSV for each recording. What is believed carries its own uncertainty: `sd`, one
//! standard deviation. The true values are not in it; nor is the instant of contact, which is estimated.
//!
//! ```text
//! chest/
//!   campaign.toml       format = "thud-campaign/1"; [rig], [chain], and a [[recording]] for each file
//!   recordings/001.csv  time_s,force_N
//! ```
//!
//! [`Campaign::parse`] reads the TOML alone, [`load`] the folder with its recordings. Both refuse unknown keys, values
//! that cannot be, contradictions and files that are missing, with file, line and column.

mod folder;
mod read;
mod write;

pub use folder::{FILE_NAME, Loaded, load};
pub(crate) use read::{RigCheck, RigTable};
pub(crate) use write::{number_toml, push_rig, string_toml};

/// What happens in the campaign's recordings.
pub use thud_sim::rig::Kind as RigKind;

use crate::recording;

#[cfg(test)]
mod tests;

/// What the `format` key says.
pub const FORMAT: &str = "thud-campaign/1";

/// Relative repeatability of the springs where the campaign does not state it.
pub const SPRING_REPEATABILITY: f64 = 0.002;

/// A value with the experimenter's own uncertainty, both in the unit of the key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// What is believed.
    pub value: f64,
    /// One standard deviation of it.
    pub sd: f64,
}

impl Estimate {
    /// A value with one standard deviation.
    #[must_use]
    pub const fn new(value: f64, sd: f64) -> Self {
        Self { value, sd }
    }
}

/// What was hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// What happens.
    pub kind: RigKind,
    /// Stiffness of the body spring, N/m. Always there, except in a fall.
    pub body_stiffness_n_per_m: Option<Estimate>,
    /// Stiffness of the pad in series with it, N/m.
    pub pad_stiffness_n_per_m: Option<Estimate>,
    /// The impact piece, whose inertia the baseline ignores, kg.
    pub moving_mass_kg: Option<Estimate>,
    /// Gravity along the impact, m/s²; positive into the rig.
    pub gravity_along_impact_m_per_s2: f64,
    /// How far the springs differ from one recording to the next, relative standard deviation.
    pub spring_repeatability: f64,
}

/// Which channel was observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Observed {
    /// Force on the cell.
    Force,
    /// Stroke of the body spring.
    Displacement,
    /// Height of a falling body.
    Height,
    /// Acceleration of the moving body.
    Acceleration,
}

impl Observed {
    /// All channels that can be observed.
    pub const ALL: [Self; 4] = [Self::Force, Self::Displacement, Self::Height, Self::Acceleration];

    /// Name of its column, with the unit.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::Force => recording::FORCE,
            Self::Displacement => "displacement_m",
            Self::Height => "height_m",
            Self::Acceleration => "acceleration_m_per_s2",
        }
    }
}

/// How it was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Samples per second, nominal.
    pub sample_rate_hz: f64,
    /// Noise of the observed channel, root mean square, in its own unit.
    pub noise_rms: f64,
    /// Full scale of the observed channel, in its own unit, where it has one that is known: a height off a video has none.
    pub full_scale: Option<f64>,
    /// The observed channel.
    pub observed: Observed,
}

/// One recording with what is believed about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Path of the CSV, relative to the campaign's folder, with `/`.
    pub file: String,
    /// Speed at contact, m/s.
    pub impact_speed_m_per_s: Estimate,
    /// Effective mass of the robot or mass of the falling body, kg.
    pub effective_mass_kg: Estimate,
    /// Recordings of one configuration share the robot's mass error.
    pub configuration: Option<String>,
}

/// What is believed about all recordings of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Campaign {
    /// A name for people.
    pub name: String,
    /// What was hit.
    pub rig: Rig,
    /// How it was measured.
    pub chain: Chain,
    /// The recordings, in the order in which they were made.
    pub recordings: Vec<Entry>,
}

impl Campaign {
    /// Whether what was observed are places of what falls, as a video gives them.
    #[must_use]
    pub fn is_of_places(&self) -> bool {
        self.rig.kind == RigKind::Fall && self.chain.observed != Observed::Acceleration
    }
}
