//! The idle signal as an impact takes it along, to be removed from the captured curve.

use super::TONES;
use crate::trigonometry::sin_cos;

/// The idle signal as known at one instant, to be removed from samples around it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Baseline {
    /// Sample to which the values refer.
    pub origin: u64,
    /// Zero at the origin, N.
    pub zero: f32,
    /// Drift of the zero, N per sample.
    pub slope: f32,
    /// Mains tones.
    pub tones: [BaselineTone; TONES],
}

/// A mains tone: `in_phase·cos(ω·n) + quadrature·sin(ω·n)`, n samples after the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BaselineTone {
    /// Amplitude of the cosine, N.
    pub in_phase: f32,
    /// Amplitude of the sine, N.
    pub quadrature: f32,
    /// ω, radians per sample.
    pub radians_per_sample: f32,
}

impl Baseline {
    /// The idle signal `n` samples after the origin, N.
    #[must_use]
    pub fn at(&self, n: f32) -> f32 {
        let tones: f32 = self.tones.iter().map(|tone| tone.at(n)).sum();
        self.zero + self.slope * n + tones
    }
}

impl BaselineTone {
    fn at(&self, n: f32) -> f32 {
        if self.in_phase == 0.0 && self.quadrature == 0.0 {
            return 0.0;
        }
        let phase = self.radians_per_sample * n;
        let (sine, cosine) = sin_cos(phase);
        self.in_phase * cosine + self.quadrature * sine
    }
}
