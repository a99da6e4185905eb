//! The report: one HTML page that needs nothing else, for someone who has never seen the tool.
//!
//! ```text
//! page ── head (what, when, verdict)
//!      ├─ impact ── figure (the blow, the whole curve, the first instants), legend
//!      │         ├─ what was sensed, beside what was true where that is known
//!      │         └─ flags in words
//!      └─ configuration with the provenance of its limits
//! ```
//!
//! Readable in black and white: lines differ in weight and dash, not in colour.

pub(crate) mod curve;
pub mod document;
mod figure;
pub(crate) mod page;
pub(crate) mod plot;
mod sheet;
pub mod words;

use thud_firmware::configuration::Configuration;
use thud_firmware::event::Event;
use thud_firmware::units::Hertz;

use crate::simulation::ContactTruth;

pub use curve::ForceCurve;
pub use page::page;

/// Everything that the page says.
#[derive(Clone, Debug)]
pub struct Report {
    /// Its title.
    pub title: String,
    /// What it shows and where that came from, one paragraph each.
    pub about: Vec<String>,
    /// Facts about the run (seed, device, file), name and value.
    pub facts: Vec<(String, String)>,
    /// The impacts.
    pub impacts: Vec<ImpactReport>,
    /// What they were judged by.
    pub configuration: Configuration,
    /// What comes after the impacts, ready made.
    pub closing: Option<maud::Markup>,
}

/// One impact: its curve, what was sensed, and what was true.
#[derive(Clone, Debug)]
pub struct ImpactReport {
    /// A heading.
    pub heading: String,
    /// The captured curve; `None` where it was not kept.
    pub curve: Option<ForceCurve>,
    /// The contacts, the blow first; not empty.
    pub events: Vec<Event>,
    /// Sample rate of the events' instants.
    pub sample_rate: Hertz,
    /// Instant of the blow's contact in the time that readers know, and what time that is: "s in the recording".
    pub clock: (f64, String),
    /// What the simulated rig truly did; `None` for a real recording.
    pub truth: Option<ImpactTruth>,
    /// What else is to be said, one sentence each.
    pub notes: Vec<String>,
}

/// What the simulated rig truly did, in seconds after the contact that the sensor found.
#[derive(Clone, Debug)]
pub struct ImpactTruth {
    /// Force at the cell, before the measuring chain: time and newton.
    pub curve: Vec<(f64, f64)>,
    /// Each touch, in the same time.
    pub contacts: Vec<ContactTruth>,
    /// Largest force through the verdict filter, N.
    pub filtered_peak_n: f64,
    /// S of the robot's true mass times that, N.
    pub scaled_n: f64,
}

#[cfg(test)]
mod tests;
