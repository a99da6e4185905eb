//! The mains couples into the cable: a line at 50 or 60 Hz.
//!
//! y = F + A·sin(2πf·t + φ₀ + 2.4·n). The mains does not wait for the impact: the n-th of a campaign comes at another
//! phase, here a golden angle further, which spreads few or many impacts evenly.
//!
//! Source: ground loops; the sensor is specified for 0.5 N.

use std::f64::consts::TAU;

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "mains-hum",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: false,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "y = F + A·sin(2πf·t + φ_0 + 2.4·n), n the number of the impact",
    source: "ground loops and stray fields; 50 or 60 Hz ± 0.2 Hz",
    parameters: &[
        Parameter {
            name: "amplitude_N",
            unit: "N",
            meaning: "amplitude (peak)",
            null: Some(0.0),
            range: (0.0, 100.0),
            plausible: (0.05, 5.0),
            typical: 0.5,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "frequency_Hz",
            unit: "Hz",
            meaning: "frequency",
            null: None,
            range: (10.0, 1000.0),
            plausible: (49.8, 60.2),
            typical: 50.0,
            scale: Scale::Linear,
            search: Search::OneOf(&[50.0, 60.0]),
        },
        Parameter { name: "phase_rad", meaning: "phase at the contact of the first impact", ..Parameter::ANGLE },
    ],
    signature: "a line in the spectrum before, during and after the impact alike, at another phase each time",
    confused_with: &["moving-piece-inertia", "frame-compliance"],
    separated_by: "it is there before contact; it moves with the mains, not with masses",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Line {
        amplitude_n: effect.value(0),
        radians_per_s: TAU * effect.value(1),
        phase_rad: effect.value(2) + GOLDEN_ANGLE_RAD * f64::from(assembly.approach.order),
    }));
}

/// π·(3 − √5).
const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;

#[derive(Debug)]
struct Line {
    amplitude_n: f64,
    radians_per_s: f64,
    phase_rad: f64,
}

impl Stage for Line {
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        for (time_s, signal) in times_s.iter().zip(signal_n) {
            *signal += self.amplitude_n * (self.radians_per_s * time_s + self.phase_rad).sin();
        }
    }
}
