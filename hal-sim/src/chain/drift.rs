//! The zero wanders: charge drift and warming.
//!
//! ```text
//! d(t) = rate·t + thermal·(1 − e^(−t/thermal_time))
//! ```

use thud_firmware::units::{Newton, Second};

/// Slow wandering of the zero since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drift {
    /// Charge drift, N/s; 0.014 is typical of a piezo amplifier.
    pub rate_newton_per_second: f32,
    /// Where warming leads in the end.
    pub thermal: Newton,
    /// Time constant of warming.
    pub thermal_time: Second,
}

impl Drift {
    pub(super) fn moves(&self) -> bool {
        self.rate_newton_per_second != 0.0 || self.thermal.0 != 0.0
    }
}

pub(super) struct Source {
    rate_per_sample: f64,
    thermal: f64,
    samples_per_thermal_time: f64,
    index: u64,
}

impl Source {
    pub(super) fn new(drift: Drift, period_s: f64) -> Self {
        Self {
            rate_per_sample: f64::from(drift.rate_newton_per_second) * period_s,
            thermal: f64::from(drift.thermal.0),
            samples_per_thermal_time: f64::from(drift.thermal_time.0).max(f64::MIN_POSITIVE) / period_s,
            index: 0,
        }
    }

    pub(super) fn add(&mut self, newtons: &mut [f64]) {
        // Within the few samples of a slice the exponential is its tangent.
        let begin = self.index as f64;
        let cold =
            if self.thermal == 0.0 { 0.0 } else { self.thermal * (-begin / self.samples_per_thermal_time).exp() };
        let slope = self.rate_per_sample + cold / self.samples_per_thermal_time;
        let mut drift = self.rate_per_sample * begin + self.thermal - cold;
        for sample in &mut *newtons {
            *sample += drift;
            drift += slope;
        }
        self.index += newtons.len() as u64;
    }
}
