//! The mains couples into the cable: a line at 50 or 60 Hz.
//!
//! y = F + A·sin(2πf·t + φ₀ + 2.4·n). The mains does not wait for the impact: the n-th of a campaign comes at another
//! phase, here a golden angle further, which spreads few or many impacts evenly. Rectifiers and transformers draw their current near the crests, which
//! adds odd harmonics to it, of which the third is the strongest; its phase is locked to the line's.
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
    used_in: &[("third_sine", "distorted", &[1.0]), ("third_cosine", "distorted", &[1.0])],
    sized: &[],
    equation: "y = F + A·(sin ϑ + p·sin 3ϑ + q·cos 3ϑ), ϑ = 2πf·t + φ_0 + 2.4·n, n the number of the impact",
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
        Parameter { name: "third_sine", meaning: "part p of the third harmonic, in phase with the line", ..THIRD },
        Parameter { name: "third_cosine", meaning: "part q of it, a quarter of its period ahead", ..THIRD },
        Parameter {
            name: "distorted",
            meaning: "0: a pure line, 1: with its third harmonic; others are rounded",
            search: Search::LaterForm(&[1.0]),
            ..Parameter::EITHER
        },
    ],
    signature: "a line in the spectrum before, during and after the impact alike, at another phase each time",
    confused_with: &["moving-piece-inertia", "frame-compliance"],
    separated_by: "it is there before contact; it moves with the mains, not with masses",
    enter,
};

/// Part of the third harmonic; its name and meaning are to be set.
const THIRD: Parameter = Parameter {
    name: "",
    unit: "1",
    meaning: "",
    null: None,
    range: (-1.0, 1.0),
    plausible: (-0.4, 0.4),
    typical: 0.05,
    scale: Scale::Linear,
    search: Search::Typical,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Line {
        amplitude_n: effect.value(0),
        radians_per_s: TAU * effect.value(1),
        phase_rad: effect.value(2) + GOLDEN_ANGLE_RAD * f64::from(assembly.approach.order),
        third: if effect.form(5) == 1 { [effect.value(3), effect.value(4)] } else { [0.0; 2] },
    }));
}

/// π·(3 − √5).
const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;

#[derive(Debug)]
struct Line {
    amplitude_n: f64,
    radians_per_s: f64,
    phase_rad: f64,
    /// Sine and cosine of the third harmonic.
    third: [f64; 2],
}

impl Stage for Line {
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        for (time_s, signal) in times_s.iter().zip(signal_n) {
            let angle = self.radians_per_s * time_s + self.phase_rad;
            let [sine, cosine] = self.third;
            let third =
                if self.third == [0.0; 2] { 0.0 } else { sine * (3.0 * angle).sin() + cosine * (3.0 * angle).cos() };
            *signal += self.amplitude_n * (angle.sin() + third);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// Before contact there is nothing else.
    #[test]
    fn the_third_harmonic_is_locked_to_the_line() {
        let hum = "mains-hum:amplitude_N=2,frequency_Hz=50,phase_rad=0.4,third_sine=0.2,third_cosine=-0.1,distorted=1";
        let times_s: Vec<f64> = (0..200).map(|sample| -0.05 + 2e-4 * f64::from(sample)).collect();
        let measured = strike(Rig::impact(40e3), 0.3, 6.0, &[hum]).measured_n(&times_s);
        for (time_s, measured) in times_s.iter().zip(measured) {
            let angle = 100.0 * std::f64::consts::PI * time_s + 0.4;
            let expected = angle.sin() + 0.2 * (3.0 * angle).sin() - 0.1 * (3.0 * angle).cos();
            near("hum", measured, 2.0 * expected, 1e-9);
        }
    }
}
