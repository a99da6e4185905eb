//! What the simulated rig truly did, in the sensor's own time.

use thud_firmware::configuration::Configuration;
use thud_firmware::detector::TRANSIENT_WINDOW;
use thud_sim::rig::Impact;

use super::Scenario;
use crate::report::ForceCurve;
use crate::simulation::ContactTruth;

/// The true force is shown from here, s before the contact.
const BEFORE_S: f64 = 0.1;

/// Truth of one blow. Time is the sensor's own, seconds since power-up.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Each touch of robot and rig.
    pub contacts: Vec<ContactTruth>,
    /// Largest force in the transient window after an ideal verdict filter, N.
    pub filtered_peak_n: f64,
    /// Scaling factor S of the robot's true mass.
    pub scaling: f64,
    /// Force at the cell, before the measuring chain: time and newton.
    pub curve: Vec<(f64, f64)>,
}

impl Truth {
    /// The truth of an impact that begins at `begins_s`.
    #[must_use]
    pub(super) fn new(impact: &Impact, begins_s: f64, scenario: &Scenario, configuration: &Configuration) -> Self {
        let rate = f64::from(configuration.chain.sample_rate.0);
        let end_s = impact.end_s();
        let times_s: Vec<f64> =
            (0..((BEFORE_S + end_s) * rate) as usize).map(|index| index as f64 / rate - BEFORE_S).collect();
        let force_n: Vec<f64> = times_s.iter().map(|time| impact.force_n(*time)).collect();
        let raw = force_n.iter().map(|force| *force as f32).collect();
        let filtered = ForceCurve::new(0, &configuration.chain, raw, configuration.filter).judged;
        let window = 0.0..=f64::from(TRANSIENT_WINDOW.0);
        let filtered_peak_n = times_s
            .iter()
            .zip(filtered)
            .filter(|(time, _)| window.contains(*time))
            .map(|(_, force)| f64::from(force))
            .fold(0.0, f64::max);
        let body_kg = f64::from(scenario.region.body().effective_mass.0);
        Self {
            contacts: impact.truth().contacts.iter().map(|contact| ContactTruth::new(contact, begins_s)).collect(),
            filtered_peak_n,
            scaling: (body_kg / (body_kg + scenario.true_mass_kg)).sqrt(),
            curve: times_s.iter().map(|time| begins_s + time).zip(force_n).collect(),
        }
    }

    /// S times the largest force, N.
    #[must_use]
    pub fn scaled_n(&self) -> f64 {
        self.scaling * self.filtered_peak_n
    }
}
