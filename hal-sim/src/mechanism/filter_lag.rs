//! A causal low-pass stands in the chain: what it delivers is late, its peaks are lower, and it rings.
//!
//! H = Π(−p_k)/Π(s − p_k) = Σ r_k/(s − p_k), of N poles. Butterworth: |H|² = 1/(1 + (f/f_c)^2N), p_k = ω_c·e^(iπ(2k + N + 1)/2N). Slow
//! signals are delayed by 1/(ω_c·sin(π/2N)): 4.2 ms for four poles at 100 Hz. Bessel, as amplifiers of load cells have it for pulses: H = θ_N(0)/θ_N(s·τ)
//! with the reverse Bessel polynomial θ_N = Σ (2N − k)!/((N − k)!·k!)·s^k/2^(N − k), τ such that f_c is where half of the power passes; the delay of
//! slow signals is τ, 3.4 ms for four poles at 100 Hz, and it does not swing. Each mode ẏ_k = p_k·y_k + r_k·F is solved exactly for a force that
//! runs straight between samples, so that uneven sampling does no harm.
//!
//! Source: S. Butterworth, Wireless Engineer 7 (1930) 536; W. E. Thomson, Proc. IEE 96 III (1949) 487; analogue filters of amplifiers and causal
//! forms of the verdict's filter; D. A. Winter, Biomechanics and Motor Control of Human Movement (2009), ch. 3: places that come from a video.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix};

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "filter-lag",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "|H(f)|² = 1/(1 + (f/f_c)^(2N)), or Bessel's, causal; delay of slow signals 1/(2π·f_c·sin(π/2N))",
    source: "Butterworth (1930), Thomson (1949); 30 to 1000 Hz, two or four poles; places from video are smoothed at 4 to 10 Hz (Winter 2009)",
    parameters: &[
        Parameter {
            name: "corner_Hz",
            unit: "Hz",
            meaning: "−3 dB frequency f_c",
            null: Some(f64::INFINITY),
            range: (1.0, 1e5),
            plausible: (4.0, 2000.0),
            typical: 150.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[8.0, 25.0, 60.0, 150.0, 400.0, 1000.0]),
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
        Parameter { name: "bessel", meaning: "0: Butterworth, 1: Bessel; others are rounded", ..Parameter::EITHER },
    ],
    signature: "the foot is round, the end of the pulse has a tail that may swing below zero; all is shifted, so the instant of contact hides most of it",
    confused_with: &["piezo-discharge", "hardening", "moving-piece-inertia"],
    separated_by: "the tail has the same shape and length after every impact; an impulse test of the chain",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let count = effect.form(1);
    let poles = if effect.form(2) == 0 { butterworth(count) } else { bessel(count) };
    assembly.chain.push(Box::new(LowPass::new(TAU * effect.value(0), &poles)));
}

/// The poles with a frequency of their own, for a corner at 1/s: one of each pair, and a real one last where their number is odd.
fn butterworth(count: u32) -> Vec<Complex<f64>> {
    let angle = |k: u32| PI * (2.0 * f64::from(k) + f64::from(count) + 1.0) / (2.0 * f64::from(count));
    (0..count.div_ceil(2)).map(|k| Complex::from_polar(1.0, angle(k))).collect()
}

/// The same: the roots of the reverse Bessel polynomial, over the angular frequency at which half of the power passes.
fn bessel(count: u32) -> Vec<Complex<f64>> {
    let count = count as usize;
    // θ_N/θ_N(0), from the constant up: each coefficient is the one before times 2(N − k)/((2N − k)·(k + 1)).
    let mut coefficients = vec![1.0; count + 1];
    for k in 0..count {
        coefficients[k + 1] = coefficients[k] * 2.0 * (count - k) as f64 / ((2 * count - k) * (k + 1)) as f64;
    }
    // The companion matrix' eigenvalues are the polynomial's roots.
    let companion = DMatrix::from_fn(count, count, |row, column| {
        let below = if row == column + 1 { 1.0 } else { 0.0 };
        if column + 1 == count { below - coefficients[row] / coefficients[count] } else { below }
    });
    let roots = companion.complex_eigenvalues();
    let passed = |radians: f64| {
        roots.iter().map(|root| (Complex::i() * radians / root - 1.0).norm_sqr().recip()).product::<f64>()
    };
    let (mut passes, mut stops) = (0.0, 2.0 * count as f64);
    for _ in 0..60 {
        let middle = 0.5 * (passes + stops);
        if passed(middle) > 0.5 { passes = middle } else { stops = middle }
    }
    let mut poles: Vec<Complex<f64>> = roots.iter().filter(|root| root.im > -1e-9).map(|root| root / passes).collect();
    poles.sort_by(|a, b| b.im.total_cmp(&a.im));
    poles
}

#[derive(Debug)]
struct LowPass {
    /// Pole and residue of each mode, 1/s, and how often it counts: twice for a pair, so that twice the real part is the sum of both.
    parts: Vec<(Complex<f64>, Complex<f64>, f64)>,
}

/// One pole, or one of a pair of which the other is its mirror image.
struct Mode {
    pole_per_s: Complex<f64>,
    residue_per_s: Complex<f64>,
    share: f64,
    value: Complex<f64>,
    /// What a step of the last length does: to the mode, and per force at its begin and at its end.
    step: [Complex<f64>; 3],
}

impl LowPass {
    /// With these poles for a corner at 1/s.
    fn new(radians_per_s: f64, poles: &[Complex<f64>]) -> Self {
        let is_pair = |pole: &Complex<f64>| pole.im > 1e-9;
        let all: Vec<Complex<f64>> =
            poles.iter().flat_map(|pole| [Some(*pole), is_pair(pole).then(|| pole.conj())]).flatten().collect();
        let part = |pole: &Complex<f64>| {
            let others = all.iter().filter(|other| *other != pole);
            // r = Π(−p_j)/Π(p − p_j), a factor at a time, so that nothing overflows.
            let residue = others.fold(-pole, |r, other| r * -other / (pole - other));
            (pole * radians_per_s, residue * radians_per_s, if is_pair(pole) { 2.0 } else { 1.0 })
        };
        Self { parts: poles.iter().map(part).collect() }
    }

    fn modes(&self) -> Vec<Mode> {
        let zero = Complex::new(0.0, 0.0);
        let mode = |&(pole_per_s, residue_per_s, share): &_| Mode {
            pole_per_s,
            residue_per_s,
            share,
            value: zero,
            step: [zero; 3],
        };
        self.parts.iter().map(mode).collect()
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
    /// −H'(0) of H = Σ r/(s − p), whose H(0) is one.
    fn delay_s(&self) -> f64 {
        self.parts.iter().map(|(pole, residue, share)| share * (residue / (pole * pole)).re).sum()
    }

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
                let stage = LowPass::new(TAU * 100.0, &butterworth(poles));
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
            let stage = LowPass::new(TAU * 50.0, &butterworth(poles));
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
        let stage = LowPass::new(400.0, &butterworth(2));
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

    #[test]
    fn slow_signals_are_as_late_as_the_equation_says() {
        for poles in [1, 2, 3, 4, 8] {
            let effect = Effect::new("filter-lag", &[("corner_Hz", 100.0), ("poles", f64::from(poles))]).unwrap();
            let expected = 1.0 / (TAU * 100.0 * (PI / f64::from(2 * poles)).sin());
            assert!((Assembly::delay_s(&effect) / expected - 1.0).abs() < 1e-9, "{poles} poles");
        }
        let others = ["filter-lag:corner_Hz=inf", "lost-samples", "clipping", "frame-compliance"];
        assert!(others.iter().all(|effect| Assembly::delay_s(&effect.parse().unwrap()) == 0.0));
    }

    /// For a corner at 1/s: delays and poles after A. I. Zverev, Handbook of Filter Synthesis (1967); half of the power passes at the corner.
    #[test]
    fn bessel_delays_a_ramp_without_swinging_beyond_a_step() {
        for (count, delay, pole) in [(2, 1.361_654, (-1.101_601, 0.636_010)), (4, 2.113_917_7, (-0.995_209, 1.257_106))]
        {
            let poles = bessel(count);
            assert!((poles[0] - Complex::new(pole.0, pole.1)).norm() < 1e-5, "{poles:?}");
            let stage = LowPass::new(TAU * 50.0, &poles);
            let times = grid(2_000, 1e-4);
            let mut ramp: Vec<f64> = times.iter().map(|t| 10.0 + 3.0 * t).collect();
            stage.apply(&times, &mut ramp);
            let delayed = 10.0 + 3.0 * (0.1999 - delay / (TAU * 50.0));
            assert!((stage.delay_s() - delay / (TAU * 50.0)).abs() < 1e-8, "{}", stage.delay_s());
            assert!((ramp[1_999] - delayed).abs() < 1e-6, "{count} poles: {}, {delayed}", ramp[1_999]);
            let mut step = vec![1.0; 2_000];
            step[0] = 0.0;
            stage.apply(&times, &mut step);
            let top = step.iter().copied().fold(0.0, f64::max);
            assert!(top < 1.01, "{top}");
            let mut sine: Vec<f64> = times.iter().map(|t| (TAU * 50.0 * t).sin()).collect();
            stage.apply(&times, &mut sine);
            let top = sine[1_000..].iter().copied().fold(0.0, f64::max);
            assert!((top - 0.5_f64.sqrt()).abs() < 1e-3, "{top}");
        }
        assert_eq!(bessel(3).len(), 2);
        assert!((bessel(1)[0] - Complex::new(-1.0, 0.0)).norm() < 1e-9);
    }
}
