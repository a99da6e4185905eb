//! Replay: a recording through the very logic that runs in the sensor.
//!
//! ```text
//! recording ─▶ resample ─▶ quiet before and after ─N─▶ chain ─codes─▶ firmware ─▶ events, in the recording's own time
//!  (force_N)    PCHIP       (its own idle samples)     quantise,       Sensor
//!               to the                                 saturate
//!               ADC's rate
//! ```
//!
//! Nothing is measured here: contact instants, peaks and verdicts are the firmware's own.

mod feed;
mod outcome;
pub mod padding;
mod prepare;
pub mod resample;
mod shown;

pub use feed::{Replayed, Sensed, replay};
pub use outcome::{EventRecord, Outcome};
pub use prepare::{LAST_RATE_HZ, OWN_RATE_FROM_HZ, Prepared, REFERENCE_RATE_HZ, prepare};
pub use shown::report;

/// Why a recording cannot be replayed.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum ReplayError {
    /// There is no force.
    #[error("{file}: there is no column `force_N`; it has {has}")]
    #[diagnostic(help("the sensor senses force: replay a recording with a column `force_N`, or name it so"))]
    NoForce {
        /// The file.
        file: String,
        /// Its columns.
        has: String,
    },
    /// No quiet stretch to learn zero and noise from.
    #[error("{file}: there are {samples} samples, too few to learn zero and noise from")]
    #[diagnostic(help("at least eight samples are needed, the first of them before the contact"))]
    NotIdle {
        /// The file.
        file: String,
        /// How many samples there are.
        samples: usize,
    },
    /// It would not end.
    #[error("{file}: {duration_s} s at {rate_hz} samples a second are {samples:e} samples")]
    #[diagnostic(help("check the unit of the time column, or choose a lower `--sample-rate`"))]
    TooLong {
        /// The file.
        file: String,
        /// Its duration.
        duration_s: f64,
        /// The rate.
        rate_hz: f64,
        /// How many samples that makes.
        samples: f64,
    },
    /// The configuration is not possible.
    #[error("{0}")]
    #[diagnostic(help("`thud replay --help` lists the options"))]
    Configuration(String),
}
