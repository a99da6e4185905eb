//! The charge of a piezoelectric cell leaks away: the chain is a high-pass.
//!
//! ẏ = Ḟ − y/τ. A held force decays as e^(−t/τ); after a pulse of impulse J the signal is −J/τ. In a chain of
//! several high-passes the shortest time constant wins, τ = (Σ 1/τᵢ)⁻¹.
//!
//! Source: first-order high-pass of cell and readout; PCB 208C03: 2000 s and more, a readout's AC
//! coupling 1.6 s and less.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "piezo-discharge",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "dy/dt = dF/dt − y/τ",
    source: "first-order high-pass of cell and readout; τ from 0.1 s (a wrong coupling) to 2000 s (a good cell)",
    parameters: &[Parameter {
        name: "time_constant_s",
        unit: "s",
        meaning: "time in which a held force decays to 37 %",
        null: Some(f64::INFINITY),
        range: (0.01, 1e5),
        plausible: (0.1, 2000.0),
        typical: 2.0,
        scale: Scale::Logarithmic,
        search: Search::Strength,
    }],
    signature: "after release the signal is below zero by impulse over τ and creeps back; a held force decays to nothing",
    confused_with: &["pad-relaxation", "charge-drift", "adhesion", "guide-friction"],
    separated_by: "a held contact: discharge goes to zero, relaxation to a plateau; a dead weight put on the cell",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Discharge { time_constant_s: effect.value(0) }));
}

/// Intervals that differ by less than this part are one: instants of some seconds, in double precision, are this exact over a
/// sample of microseconds.
const ROUNDING: f64 = 1e-9;

#[derive(Debug)]
struct Discharge {
    time_constant_s: f64,
}

impl Stage for Discharge {
    /// Exact for a force that runs straight between samples: its steady rate r gives y → r·τ.
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let Some(mut force_before) = signal_n.first().copied() else { return };
        let mut output = force_before;
        let (mut last_s, mut lost) = (0.0_f64, 0.0);
        for (interval, signal) in times_s.windows(2).zip(&mut signal_n[1..]) {
            let duration = interval[1] - interval[0];
            // Even sampling is even but for rounding.
            if (duration - last_s).abs() > ROUNDING * last_s {
                (last_s, lost) = (duration, -(-duration / self.time_constant_s).exp_m1());
            }
            let rate = (*signal - force_before) / duration;
            force_before = *signal;
            output += lost * (rate * self.time_constant_s - output);
            *signal = output;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_force_decays_exponentially_whatever_the_sampling() {
        let stage = Discharge { time_constant_s: 0.5 };
        let times = [0.0, 0.001, 0.2, 0.25, 1.0];
        let mut signal = [100.0; 5];
        stage.apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            assert!((value - 100.0 * (-time / 0.5_f64).exp()).abs() < 1e-9, "{time} s: {value}");
        }
    }

    #[test]
    fn a_pulse_leaves_its_impulse_over_the_time_constant() {
        let stage = Discharge { time_constant_s: 2.0 };
        let times: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-4).collect();
        let mut signal: Vec<f64> = times
            .iter()
            .map(|t| if *t < 0.05 { 200.0 * (std::f64::consts::PI * t / 0.05).sin() } else { 0.0 })
            .collect();
        let impulse = 200.0 * 0.05 * 2.0 / std::f64::consts::PI;
        stage.apply(&times, &mut signal);
        // y(T) = −(1/τ)·∫F·e^(−(T−t)/τ)dt, with the pulse's middle 75 ms before the end
        let expected = -impulse / 2.0 * (-0.075_f64 / 2.0).exp();
        assert!((signal[1000] / expected - 1.0).abs() < 1e-4, "{} {expected}", signal[1000]);
    }
}
