//! The cell is not as sensitive as its certificate says.
//!
//! y = F·(1 + ε).
//!
//! Source: calibration and cross-sensitivity of a load cell, 1 to 5 %.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "gain-error",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: false,
    exact: true,
    by_configuration: &["relative"],
    by_recording: &["relative"],
    used_in: &[],
    sized: &[],
    equation: "y = F·(1 + ε)",
    source: "calibration, and cross-sensitivity to loads beside the axis; 1 to 5 %",
    parameters: &[Parameter {
        name: "relative",
        unit: "1",
        meaning: "error of the gain",
        null: Some(0.0),
        range: (-0.5, 0.5),
        plausible: (-0.05, 0.05),
        typical: 0.02,
        scale: Scale::Linear,
        search: Search::Strength,
    }],
    signature: "every force is off by the same ratio, times are right",
    confused_with: &["speed-error", "pose-dependent-mass"],
    separated_by: "a dead weight put on the cell",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Gain { factor: 1.0 + effect.value(0) }));
}

#[derive(Debug)]
struct Gain {
    factor: f64,
}

impl Stage for Gain {
    fn apply(&self, _times_s: &[f64], signal_n: &mut [f64]) {
        for signal in signal_n {
            *signal *= self.factor;
        }
    }
}
