//! What a replay gives as JSON: events in the recording's own time.

use serde::Serialize;
use thud_firmware::event::Event;
use thud_firmware::units::SampleInstant;

use super::{Prepared, Replayed};

/// One event. The keys up to `flags` are a contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct EventRecord {
    /// Instant of contact, s.
    pub contact_s: f64,
    /// Instant of the raw peak, s.
    pub peak_s: f64,
    /// Peak of the judged (filtered) force, N.
    pub peak_N: f64,
    /// Peak of the unfiltered force, N.
    pub raw_peak_N: f64,
    /// Integral of the force over the contact, N·s.
    pub impulse_Ns: f64,
    /// From contact to separation, s.
    pub duration_s: f64,
    /// S times the transient force, N: what is compared with the limit.
    pub scaled_N: f64,
    /// `pass`, `inconclusive`, `fail` or `none`.
    pub verdict: &'static str,
    /// Names of its flags.
    pub flags: Vec<&'static str>,
    /// The impact that the contact belongs to, counted from 1 within the recording.
    pub impact: u32,
    /// 0 for the blow, n for its n-th rebound.
    pub contact: u8,
    /// Scaling factor S.
    pub scaling: f64,
    /// Largest force after the transient window, N.
    pub quasi_static_N: Option<f64>,
    /// Transient limit, N.
    pub transient_limit_N: Option<f64>,
    /// Quasi-static limit, N.
    pub quasi_static_limit_N: Option<f64>,
    /// Expanded uncertainty (k = 2) of the judged force, N.
    pub expanded_uncertainty_N: f64,
    /// Noise before the contact, N rms.
    pub noise_rms_N: f64,
    /// The recording, where several are replayed at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

/// All events of one or more recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Outcome {
    /// Events in the order of recordings and time.
    pub events: Vec<EventRecord>,
    /// Samples that are missing in the recordings.
    pub lost: u64,
    /// What was done to the recordings before the firmware saw them.
    pub notes: Vec<String>,
}

impl Outcome {
    /// Adds the events of a recording; `file` is kept with each of them if it is given.
    pub fn add(&mut self, replayed: &Replayed, file: Option<&str>) {
        let records = replayed.events().map(|event| EventRecord::new(event, &replayed.prepared, file));
        self.events.extend(records);
        self.lost += replayed.prepared.lost;
        self.notes.extend(replayed.prepared.notes.iter().map(|note| match file {
            Some(file) => format!("{file}: {note}"),
            None => note.clone(),
        }));
    }
}

impl EventRecord {
    fn new(event: &Event, prepared: &Prepared, file: Option<&str>) -> Self {
        let instant =
            |instant: SampleInstant| rounded(prepared.time_s(instant.index as f64 + f64::from(instant.fraction)), 1e-9);
        let newton = |force: thud_firmware::units::Newton| rounded(f64::from(force.0), 1e-4);
        let severity = &event.severity;
        Self {
            contact_s: instant(event.contact_instant),
            peak_s: instant(event.peak_instant),
            peak_N: newton(event.peak),
            raw_peak_N: newton(event.raw_peak),
            impulse_Ns: rounded(f64::from(event.impulse.0), 1e-7),
            duration_s: rounded(f64::from(event.duration.0), 1e-7),
            scaled_N: newton(severity.scaled),
            verdict: severity.verdict.name(),
            flags: event.flags.names().collect(),
            impact: event.impact,
            contact: event.contact,
            scaling: rounded(f64::from(severity.scaling), 1e-7),
            quasi_static_N: severity.quasi_static.map(newton),
            transient_limit_N: severity.transient_limit.map(newton),
            quasi_static_limit_N: severity.quasi_static_limit.map(newton),
            expanded_uncertainty_N: newton(severity.expanded_uncertainty),
            noise_rms_N: newton(event.noise),
            file: file.map(str::to_owned),
        }
    }
}

/// The number at a resolution finer than it is known, so that single precision does not show as digits.
fn rounded(value: f64, resolution: f64) -> f64 {
    // Dividing by the inverse gives the nearest double to the decimal; multiplying by the resolution does not.
    let inverse = (1.0 / resolution).round();
    (value * inverse).round() / inverse
}
