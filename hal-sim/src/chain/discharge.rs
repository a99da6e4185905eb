//! The charge of a piezo cell leaks away: a first-order high-pass.
//!
//! ```text
//! ẏ = ẋ − y/τ
//! ```
//!
//! Solved exactly for a force that is linear between samples: over a period T with a = e^(−T/τ),
//! `y' = a·y + (1 − a)·τ/T · (x' − x)`.

use thud_firmware::units::Second;

pub(super) struct Discharge {
    decay: f64,
    step_gain: f64,
    last_input: f64,
    output: f64,
}

impl Discharge {
    pub(super) fn new(time_constant: Second, period_s: f64) -> Self {
        let ratio = period_s / f64::from(time_constant.0);
        Self { decay: (-ratio).exp(), step_gain: -(-ratio).exp_m1() / ratio, last_input: 0.0, output: 0.0 }
    }

    pub(super) fn apply(&mut self, newtons: &mut [f64]) {
        for sample in newtons {
            self.output = self.decay * self.output + self.step_gain * (*sample - self.last_input);
            self.last_input = *sample;
            *sample = self.output;
        }
    }
}
