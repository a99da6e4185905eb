//! Campaigns from the simulated rig: what is believed is written down, what is true stays apart.
//!
//! ```text
//! plan (believed: speeds, masses, springs, each with sd) ─┬───────────────────────────────▶ campaign.toml
//!                                                         └▶ draw ─▶ rig ─N─▶ chain ─codes─▶ recordings/001.csv …
//!                                                          (true)                         ╰▶ truth, if asked for
//! ```
//!
//! Every random number comes from one generator that the seed starts, drawn in the order of the recordings: the same
//! plan and seed give the same bytes.

mod draw;
mod strike;
mod truth;

pub use strike::{SimulationError, simulate};
pub use truth::{CampaignTruth, ContactTruth, FORMAT as TRUTH_FORMAT, RecordingTruth, Truth};

use thud_sim::mechanism::Effect;

use crate::campaign::{Campaign, Rig};
use crate::recording::Recording;

/// Values of recordings are written to this resolution, N: a seven-hundredth of the reference chain's code.
const WRITTEN_RESOLUTION_N: f64 = 1e-4;

/// What noise and wandering the measuring chain adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imperfection {
    /// White noise, N rms.
    pub noise_n: f64,
    /// Amplitude of 50 Hz hum, N; with harmonics in it.
    pub hum_n: f64,
    /// Drift of the zero, N/s.
    pub drift_n_per_s: f64,
}

/// Relative standard deviations of what the experimenter believes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubt {
    /// Of the speed of each recording.
    pub speed: f64,
    /// Of the robot's mass, common to the recordings of one configuration.
    pub mass: f64,
}

/// What is to be simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The campaign's name.
    pub name: String,
    /// The rig as it is believed to be; its own `sd`s say how far the true one may be off.
    pub rig: Rig,
    /// What it has beyond the ideal impact.
    pub effects: Vec<Effect>,
    /// What it has in one configuration only: with that one's name, which is its number from 1.
    pub limited: Vec<(Effect, String)>,
    /// Speeds at contact, m/s.
    pub speeds_m_per_s: Vec<f64>,
    /// Effective masses, kg; each is a configuration of its own.
    pub masses_kg: Vec<f64>,
    /// How often each pair of speed and mass is repeated.
    pub repeats: usize,
    /// How sure the experimenter is.
    pub doubt: Doubt,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Full scale of the chain, N.
    pub full_scale_n: f64,
    /// What the chain adds.
    pub imperfection: Imperfection,
    /// Quiet before the contact, s; up to a tenth of it more, by chance.
    pub before_s: f64,
    /// Duration after the contact, s.
    pub after_s: f64,
    /// Also write the stroke of the body springs, with this noise, m rms.
    pub displacement_noise_m: Option<f64>,
    /// Noise of the height that is recorded of a fall, m rms.
    pub height_noise_m: f64,
    /// Starts the random numbers.
    pub seed: u64,
}

/// A campaign with its recordings, and what was true.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// What is believed.
    pub campaign: Campaign,
    /// The recordings, in its order.
    pub recordings: Vec<Recording>,
    /// What was true; never part of the campaign.
    pub truth: CampaignTruth,
}

#[cfg(test)]
mod tests;
