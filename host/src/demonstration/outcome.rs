//! The demonstration's results: as JSON and as a table for the terminal.

use serde::Serialize;

use super::{Blow, Demonstrated, Riddle};
use crate::table::{Side, Table};

/// All of it as JSON.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct Outcome {
    /// `thud-demo/1`.
    pub format: &'static str,
    /// The seed; the same one gives the same results.
    pub seed: u64,
    /// Body region.
    pub region: &'static str,
    /// True effective mass of the robot, kg.
    pub true_mass_kg: f64,
    /// What the robot's controller said, kg.
    pub believed_mass_kg: f64,
    /// True stiffness of the body springs, N/m.
    pub body_stiffness_N_per_m: f64,
    /// True stiffness of the pad, N/m.
    pub pad_stiffness_N_per_m: Option<f64>,
    /// What the rig has beyond the ideal impact.
    pub mechanisms: Vec<String>,
    /// Configuration's revision and hash.
    pub configuration: (u32, String),
    /// The blows.
    pub blows: Vec<BlowOutcome>,
    /// Frames that the host received over the simulated bus.
    pub frames_received: u64,
    /// Frames that it lost.
    pub frames_lost: u64,
    /// Virtual time that passed, s.
    pub virtual_s: f64,
    /// What was hidden in another rig, and what the diagnosis said.
    pub riddle: Riddle,
}

/// One blow.
#[derive(Clone, Debug, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct BlowOutcome {
    /// Speed of the robot, m/s.
    pub impact_speed_m_per_s: f64,
    /// As the sensor says.
    pub sensed: Figures,
    /// As it was.
    #[serde(rename = "true")]
    pub truth: Figures,
    /// Sensed less true.
    pub error: Figures,
    /// The transient limit, N.
    pub limit_N: Option<f64>,
    /// The verdict.
    pub verdict: &'static str,
    /// Names of the flags.
    pub flags: Vec<&'static str>,
    /// Contacts that the sensor found, rebounds included.
    pub contacts: usize,
    /// From the true contact until the alarm frame was with the host, s.
    pub alarm_after_s: Option<f64>,
}

/// The figures that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct Figures {
    /// Instant of contact since power-up, s.
    pub contact_s: f64,
    /// Peak of the unfiltered force, N.
    pub raw_peak_N: f64,
    /// Peak of the judged force, N.
    pub peak_N: f64,
    /// Impulse of the blow, N·s.
    pub impulse_Ns: f64,
    /// S times the judged force, N.
    pub scaled_N: f64,
}

impl BlowOutcome {
    fn new(blow: &Blow, sample_rate: thud_firmware::units::Hertz) -> Self {
        let event = &blow.events[0];
        let sensed = Figures {
            contact_s: event.contact_instant.seconds(sample_rate),
            raw_peak_N: f64::from(event.raw_peak.0),
            peak_N: f64::from(event.severity.transient.0),
            impulse_Ns: f64::from(event.impulse.0),
            scaled_N: f64::from(event.severity.scaled.0),
        };
        let contact = &blow.truth.contacts[0];
        let truth = Figures {
            contact_s: contact.contact_s,
            raw_peak_N: contact.peak_N,
            peak_N: blow.truth.filtered_peak_n,
            impulse_Ns: contact.impulse_Ns,
            scaled_N: blow.truth.scaled_n(),
        };
        Self {
            impact_speed_m_per_s: blow.speed_m_per_s,
            sensed,
            truth,
            error: Figures {
                contact_s: sensed.contact_s - truth.contact_s,
                raw_peak_N: sensed.raw_peak_N - truth.raw_peak_N,
                peak_N: sensed.peak_N - truth.peak_N,
                impulse_Ns: sensed.impulse_Ns - truth.impulse_Ns,
                scaled_N: sensed.scaled_N - truth.scaled_N,
            },
            limit_N: event.severity.transient_limit.map(|limit| f64::from(limit.0)),
            verdict: event.severity.verdict.name(),
            flags: event.flags.names().collect(),
            contacts: blow.events.len(),
            alarm_after_s: blow.alarm_after_s,
        }
    }
}

impl Outcome {
    /// The results of a demonstration.
    #[must_use]
    pub fn new(demonstrated: &Demonstrated, riddle: &Riddle) -> Self {
        let scenario = &demonstrated.scenario;
        let rate = demonstrated.configuration.chain.sample_rate;
        Self {
            format: "thud-demo/1",
            seed: scenario.seed,
            region: scenario.region.name(),
            true_mass_kg: scenario.true_mass_kg,
            believed_mass_kg: scenario.believed_mass_kg,
            body_stiffness_N_per_m: scenario.rig.body_stiffness_n_per_m,
            pad_stiffness_N_per_m: scenario.rig.pad_stiffness_n_per_m,
            mechanisms: scenario.effects.iter().map(ToString::to_string).collect(),
            configuration: (demonstrated.stamp.0, format!("{:08x}", demonstrated.stamp.1)),
            blows: demonstrated.blows.iter().map(|blow| BlowOutcome::new(blow, rate)).collect(),
            frames_received: demonstrated.frames.0,
            frames_lost: demonstrated.frames.1,
            virtual_s: demonstrated.virtual_s,
            riddle: riddle.clone(),
        }
    }
}

/// Sensed beside true, for the terminal.
#[must_use]
pub fn table(outcome: &Outcome) -> Table {
    let mut table = Table::new(&[
        ("blow", Side::Left),
        ("quantity", Side::Left),
        ("sensed", Side::Right),
        ("true", Side::Right),
        ("error", Side::Right),
        ("limit", Side::Right),
        ("verdict", Side::Left),
    ]);
    for (index, blow) in outcome.blows.iter().enumerate() {
        let (sensed, truth, error) = (&blow.sensed, &blow.truth, &blow.error);
        let force = |name: &str, sensed: f64, truth: f64, error: f64| {
            let relative = 100.0 * error / truth;
            [
                String::new(),
                name.to_owned(),
                format!("{sensed:.2} N"),
                format!("{truth:.2} N"),
                format!("{error:+.2} N ({relative:+.2} %)"),
            ]
        };
        table.row([
            format!("{}: {:.3} m/s", index + 1, blow.impact_speed_m_per_s),
            "contact instant".to_owned(),
            format!("{:.6} s", sensed.contact_s),
            format!("{:.6} s", truth.contact_s),
            format!("{:+.1} µs", 1e6 * error.contact_s),
        ]);
        table.row(force("peak", sensed.raw_peak_N, truth.raw_peak_N, error.raw_peak_N));
        table.row(force("judged peak", sensed.peak_N, truth.peak_N, error.peak_N));
        table.row([
            String::new(),
            "impulse".to_owned(),
            format!("{:.4} N·s", sensed.impulse_Ns),
            format!("{:.4} N·s", truth.impulse_Ns),
            format!("{:+.4} N·s ({:+.2} %)", error.impulse_Ns, 100.0 * error.impulse_Ns / truth.impulse_Ns),
        ]);
        let mut scaled = force("scaled force", sensed.scaled_N, truth.scaled_N, error.scaled_N).to_vec();
        scaled.push(blow.limit_N.map_or_else(|| "none".to_owned(), |limit| format!("{limit:.0} N")));
        scaled.push(blow.verdict.to_uppercase());
        table.row(scaled);
    }
    table
}
