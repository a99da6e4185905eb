//! The signal's way from the cell to the converter: discharge, low-pass, anti-alias filter, at the integrator's own rate.

use std::f64::consts::TAU;

use crate::world::Chain;

/// A second-order low-pass from its analogue form by the bilinear rule.
#[derive(Debug, Clone, Copy)]
struct LowPass {
    b: [f64; 3],
    a: [f64; 2],
    s: [f64; 2],
}

impl LowPass {
    fn new(natural_hz: f64, quality: f64, step_s: f64) -> Self {
        // Prewarped, so that a corner near half the rate stays where it is meant.
        let w = (TAU * natural_hz * step_s / 2.0).tan();
        let norm = 1.0 / (1.0 + w / quality + w * w);
        let gain = w * w * norm;
        Self {
            b: [gain, 2.0 * gain, gain],
            a: [2.0 * (w * w - 1.0) * norm, (1.0 - w / quality + w * w) * norm],
            s: [0.0; 2],
        }
    }

    fn push(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.s[0];
        self.s[0] = self.b[1] * x - self.a[0] * y + self.s[1];
        self.s[1] = self.b[2] * x - self.a[1] * y;
        y
    }
}

/// Poles of the fourth-order Bessel filter of unit delay: (real, imaginary) of each pair, and its −3 dB frequency.
const BESSEL_4: [(f64, f64); 2] = [(-2.896_210_6, 0.867_234_1), (-2.103_789_4, 2.657_418_0)];
const BESSEL_4_CORNER: f64 = 2.113_917_7;

/// Delay of the anti-alias filter, s.
#[must_use]
pub fn anti_alias_delay_s(corner_hz: f64) -> f64 {
    BESSEL_4_CORNER / (TAU * corner_hz)
}

/// The stages with memory.
#[derive(Debug, Clone)]
pub struct Readout {
    anti_alias: [LowPass; 2],
    lag: Option<LowPass>,
    discharge: Option<(f64, f64, f64)>,
}

impl Readout {
    /// The stages of `chain`, run every `step_s`.
    #[must_use]
    pub fn new(chain: &Chain, step_s: f64) -> Self {
        let section = |(re, im): (f64, f64)| {
            let radius = f64::hypot(re, im);
            LowPass::new(chain.anti_alias_hz * radius / BESSEL_4_CORNER, radius / (-2.0 * re), step_s)
        };
        Self {
            anti_alias: BESSEL_4.map(section),
            lag: chain.lag_hz.map(|hz| LowPass::new(hz, std::f64::consts::FRAC_1_SQRT_2, step_s)),
            // A charge that leaks: y' = x' − y/τ, exactly for a step's straight piece.
            discharge: chain.discharge_s.map(|tau| ((-step_s / tau).exp(), 0.0, 0.0)),
        }
    }

    /// One step.
    pub fn push(&mut self, newton: f64) -> f64 {
        let mut y = newton;
        if let Some((keep, last, charge)) = &mut self.discharge {
            *charge = *charge * *keep + (y - *last) * 0.5 * (1.0 + *keep);
            *last = y;
            y = *charge;
        }
        if let Some(lag) = &mut self.lag {
            y = lag.push(y);
        }
        let [first, second] = &mut self.anti_alias;
        second.push(first.push(y))
    }
}
