//! The charge amplifier drifts: a ramp that begins when it is reset, at the first sample.
//!
//! y = F + r·(t − t₀).
//!
//! Source: leakage current of a charge amplifier, 0.03 pC/s; 14 mN/s for a cell of the reference kind.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "charge-drift",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: false,
    exact: false,
    by_configuration: &[],
    by_recording: &["rate_N_per_s"],
    used_in: &[],
    sized: &[],
    equation: "y = F + r·(t − t_0), t_0 the first sample",
    source: "leakage of a charge amplifier, about 14 mN/s",
    parameters: &[Parameter {
        name: "rate_N_per_s",
        unit: "N/s",
        meaning: "slope",
        null: Some(0.0),
        range: (-100.0, 100.0),
        plausible: (-1.0, 1.0),
        typical: 0.014,
        scale: Scale::Linear,
        search: Search::Strength,
    }],
    signature: "a slow ramp before, during and after the impact alike",
    confused_with: &["piezo-discharge", "robot-push"],
    separated_by: "an unloaded log; a discharge depends on what was pressed, a drift does not",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Ramp { rate_n_per_s: effect.value(0) }));
}

#[derive(Debug)]
struct Ramp {
    rate_n_per_s: f64,
}

impl Stage for Ramp {
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let Some(&reset_s) = times_s.first() else { return };
        for (time_s, signal) in times_s.iter().zip(signal_n) {
            *signal += self.rate_n_per_s * (time_s - reset_s);
        }
    }
}
