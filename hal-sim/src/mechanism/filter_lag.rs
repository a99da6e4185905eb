//! A causal low-pass stands in the chain: what it delivers is late, its peaks are lower, and it rings.
//!
//! Butterworth of N poles, |H|² = 1/(1 + (f/f_c)^2N), p_k = ω_c·e^(iπ(2k + N + 1)/2N), H = Σ r_k/(s − p_k). Slow signals
//! are delayed by 1/(ω_c·sin(π/2N)): 4.2 ms for four poles at 100 Hz. Each mode ẏ_k = p_k·y_k + r_k·F is solved exactly
//! for a force that runs straight between samples, so that uneven sampling does no harm.
//!
//! Source: S. Butterworth, Wireless Engineer 7 (1930) 536; analogue filters of amplifiers and causal forms of the
//! verdict's filter.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "filter-lag",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: true,
    by_configuration: &[],
    by_recording: &[],
    equation: "|H(f)|² = 1/(1 + (f/f_c)^(2N)), causal; delay of slow signals 1/(2π·f_c·sin(π/2N))",
    source: "Butterworth (1930); 30 to 1000 Hz, two or four poles",
    parameters: &[
        Parameter {
            name: "corner_Hz",
            unit: "Hz",
            meaning: "−3 dB frequency f_c",
            null: Some(f64::INFINITY),
            range: (1.0, 1e5),
            plausible: (20.0, 2000.0),
            typical: 150.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[60.0, 150.0, 400.0, 1000.0]),
        },
        Parameter {
            name: "poles",
            unit: "1",
            meaning: "number N of poles; a whole number, others are rounded",
            null: None,
            range: (1.0, 8.0),
            plausible: (1.0, 4.0),
            typical: 2.0,
            scale: Scale::Linear,
            search: Search::Form(&[1.0, 2.0, 4.0]),
        },
    ],
    signature: "the foot is round, the end of the pulse has a tail that may swing below zero; all is shifted, so the instant of contact hides most of it",
    confused_with: &["piezo-discharge", "hardening", "moving-piece-inertia"],
    separated_by: "the tail has the same shape and length after every impact; an impulse test of the chain",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let poles = effect.value(1).round() as u32;
    assembly.chain.push(Box::new(LowPass { radians_per_s: TAU * effect.value(0), poles }));
}

#[derive(Debug)]
struct LowPass {
    radians_per_s: f64,
    poles: u32,
}

/// One pole, or one of a pair of which the other is its mirror image.
struct Mode {
    pole_per_s: Complex<f64>,
    residue_per_s: Complex<f64>,
    /// 2 for a pair, so that twice the real part is the sum of both.
    share: f64,
    value: Complex<f64>,
    /// What a step of the last length does: to the mode, and per force at its begin and at its end.
    step: [Complex<f64>; 3],
}

impl LowPass {
    fn modes(&self) -> Vec<Mode> {
        let count = f64::from(self.poles);
        let pole =
            |k: u32| Complex::from_polar(self.radians_per_s, PI * (2.0 * f64::from(k) + count + 1.0) / (2.0 * count));
        (0..self.poles.div_ceil(2))
            .map(|k| {
                let others = (0..self.poles).filter(|other| *other != k).map(|other| pole(k) - pole(other));
                let zero = Complex::new(0.0, 0.0);
                Mode {
                    pole_per_s: pole(k),
                    // H(s) = ω_c^N/Π(s − p_k); a factor at a time, so that nothing overflows.
                    residue_per_s: others
                        .fold(Complex::new(self.radians_per_s, 0.0), |r, other| r * self.radians_per_s / other),
                    share: if 2 * k + 1 == self.poles { 1.0 } else { 2.0 },
                    value: zero,
                    step: [zero; 3],
                }
            })
            .collect()
    }
}

impl Mode {
    /// ẏ = p·y + r·F over a step in which F runs straight: with w = p·T,
    /// y' = e^w·y + r·T·((φ₁ − φ₂)·F + φ₂·F'), φ₁ = (e^w − 1)/w, φ₂ = (φ₁ − 1)/w.
    fn prepare(&mut self, duration_s: f64) {
        let w = self.pole_per_s * duration_s;
        let grown = w.exp();
        // Below, the differences lose more digits than the series leaves out.
        let (first, second) = if w.norm() < 1e-2 {
            let second = 0.5 + w * (1.0 / 6.0 + w * (1.0 / 24.0 + w * (1.0 / 120.0 + w / 720.0)));
            (w * second + 1.0, second)
        } else {
            let first = (grown - 1.0) / w;
            (first, (first - 1.0) / w)
        };
        let gain = self.residue_per_s * duration_s;
        self.step = [grown, gain * (first - second), gain * second];
    }
}

impl Stage for LowPass {
    /// Before the first sample the force is taken to have been what it is there.
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let Some(mut force_before) = signal_n.first().copied() else { return };
        let mut modes = self.modes();
        for mode in &mut modes {
            mode.value = -mode.residue_per_s / mode.pole_per_s * force_before;
        }
        let mut prepared_s = f64::NAN;
        for (interval, signal) in times_s.windows(2).zip(&mut signal_n[1..]) {
            let duration_s = interval[1] - interval[0];
            // Times of an even grid differ by rounding alone.
            let other = (duration_s - prepared_s).abs() <= 1e-9 * duration_s;
            if !other {
                prepared_s = duration_s;
                modes.iter_mut().for_each(|mode| mode.prepare(duration_s));
            }
            let force = *signal;
            *signal = 0.0;
            for mode in &mut modes {
                let [grown, at_begin, at_end] = mode.step;
                mode.value = grown * mode.value + at_begin * force_before + at_end * force;
                *signal += mode.share * mode.value.re;
            }
            force_before = force;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(count: u32, step_s: f64) -> Vec<f64> {
        (0..count).map(|index| f64::from(index) * step_s).collect()
    }

    /// 1/√(1 + (f/f_c)^2N) for a sine, once it is steady; one for what does not change.
    #[test]
    fn a_sine_comes_out_with_the_gain_of_butterworth() {
        for poles in 1..=8 {
            for frequency in [20.0, 100.0, 250.0] {
                let stage = LowPass { radians_per_s: TAU * 100.0, poles };
                let times = grid(60_000, 1e-5);
                let mut signal: Vec<f64> = times.iter().map(|t| (TAU * frequency * t).sin()).collect();
                stage.apply(&times, &mut signal);
                let top = signal[40_000..].iter().copied().fold(0.0, f64::max);
                let expected = 1.0 / (1.0 + (frequency / 100.0_f64).powi(2 * poles as i32)).sqrt();
                assert!((top - expected).abs() < 1e-4, "{poles} poles, {frequency} Hz: {top}, {expected}");
            }
        }
    }

    /// A ramp is delayed by Σ −1/p = 1/(ω_c·sin(π/2N)), and a level is kept from the first sample on.
    #[test]
    fn a_ramp_is_late_by_the_known_delay_and_a_level_passes() {
        for poles in 1..=6 {
            let stage = LowPass { radians_per_s: TAU * 50.0, poles };
            let times = grid(2_000, 1e-3);
            let mut ramp: Vec<f64> = times.iter().map(|t| 10.0 + 3.0 * t).collect();
            stage.apply(&times, &mut ramp);
            let delay = 1.0 / (TAU * 50.0 * (PI / 2.0 / f64::from(poles)).sin());
            assert!((ramp[1_999] - (10.0 + 3.0 * (1.999 - delay))).abs() < 1e-9, "{poles} poles");
            let mut level = [7.0; 50];
            stage.apply(&times[..50], &mut level);
            assert!(level.iter().all(|value| (value - 7.0).abs() < 1e-9));
        }
    }

    /// The step response of two poles, 1 − e^(−σt)·(cos σt + sin σt), σ = ω_c/√2, on an uneven grid.
    #[test]
    fn a_step_comes_out_as_in_the_book_whatever_the_sampling() {
        let stage = LowPass { radians_per_s: 400.0, poles: 2 };
        let mut times = vec![-1e-9, 0.0];
        times.extend((1..200).map(|index: i32| 1e-4 * f64::from(index) + 3e-5 * f64::from(index % 3)));
        let mut signal = vec![1.0; times.len()];
        signal[0] = 0.0;
        stage.apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            let turn = 400.0 / 2.0_f64.sqrt() * time.max(0.0);
            let expected = 1.0 - (-turn).exp() * (turn.cos() + turn.sin());
            assert!((value - expected).abs() < 1e-6, "{time} s: {value}, {expected}");
        }
    }
}
