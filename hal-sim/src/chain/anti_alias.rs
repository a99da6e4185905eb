//! The analogue filter before the ADC: a second-order Butterworth low-pass.
//!
//! ```text
//! ÿ + √2·ω·ẏ + ω²·y = ω²·x          delay of slow signals: √2/ω
//! ```
//!
//! Solved exactly for a force that is linear between samples: with the state s = (y, ẏ), ṡ = A·s + B·x, and
//! Φ = e^(AT),
//! `s' = Φ·s + A⁻¹(Φ − 1)B · x + A⁻²(Φ − 1 − AT)B/T · (x' − x)`.

use nalgebra::{Matrix2, Vector2};
use thud_firmware::units::{Hertz, Second};

/// A second-order Butterworth low-pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntiAlias {
    /// −3 dB frequency.
    pub corner: Hertz,
}

impl AntiAlias {
    /// 8 kHz: the 16-fold oversampling of the ADC guards beyond the 10 kHz of half the sample rate, and below 100 Hz the
    /// filter takes nothing: (100/8000)⁴/2 is 1.2·10⁻⁸.
    pub const REFERENCE: Self = Self { corner: Hertz(8_000.0) };

    /// By how much it delays signals far below its corner: √2/(2π·f_c), 28 µs at 8 kHz.
    #[must_use]
    pub fn delay(self) -> Second {
        Second(std::f32::consts::SQRT_2 / (std::f32::consts::TAU * self.corner.0))
    }
}

pub(super) struct Filter {
    transition: Matrix2<f64>,
    level: Vector2<f64>,
    ramp: Vector2<f64>,
    state: Vector2<f64>,
    last_input: f64,
}

impl Filter {
    pub(super) fn new(filter: AntiAlias, period_s: f64) -> Self {
        // In units of the period, so that both states are of the same size.
        let w = std::f64::consts::TAU * f64::from(filter.corner.0) * period_s;
        let a = Matrix2::new(0.0, 1.0, -w * w, -std::f64::consts::SQRT_2 * w);
        let b = Vector2::new(0.0, w * w);
        let inverse = a.try_inverse().expect("the determinant is ω², and a corner of 0 Hz is no filter");
        let transition = a.exp();
        let one = Matrix2::identity();
        Self {
            transition,
            level: inverse * (transition - one) * b,
            ramp: inverse * inverse * (transition - one - a) * b,
            state: Vector2::zeros(),
            last_input: 0.0,
        }
    }

    pub(super) fn apply(&mut self, newtons: &mut [f64]) {
        for sample in newtons {
            let rise = *sample - self.last_input;
            self.state = self.transition * self.state + self.level * self.last_input + self.ramp * rise;
            self.last_input = *sample;
            *sample = self.state.x;
        }
    }
}
