//! Noise: white, and coloured by a first-order low-pass (an Ornstein–Uhlenbeck process).
//!
//! ```text
//! n' = a·n + √(1 − a²)·σ·ξ,   a = e^(−2πf_c·T),  ξ ~ N(0, 1)
//! ```
//!
//! which has the standard deviation σ at every instant and a flat spectrum up to f_c.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use thud_firmware::units::{Hertz, Newton};

/// Noise of the idle signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// White up to half the sample rate, root mean square.
    pub white: Newton,
    /// Noise with more power below a corner.
    pub coloured: Option<ColouredNoise>,
}

/// Noise with more power below a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColouredNoise {
    /// Root mean square.
    pub rms: Newton,
    /// Corner above which it falls with 6 dB per octave.
    pub corner: Hertz,
}

pub(super) struct Source {
    white: f64,
    coloured: Option<Coloured>,
    random: ChaCha8Rng,
}

struct Coloured {
    decay: f64,
    kick: f64,
    level: f64,
}

impl Source {
    pub(super) fn new(noise: &Noise, period_s: f64, seed: &mut ChaCha8Rng) -> Self {
        let mut random = ChaCha8Rng::from_rng(seed);
        let coloured = noise.coloured.map(|coloured| {
            let decay = (-std::f64::consts::TAU * f64::from(coloured.corner.0) * period_s).exp();
            let rms = f64::from(coloured.rms.0);
            let start: f64 = StandardNormal.sample(&mut random);
            Coloured { decay, kick: rms * (1.0 - decay * decay).sqrt(), level: rms * start }
        });
        Self { white: f64::from(noise.white.0), coloured, random }
    }

    pub(super) fn add(&mut self, newtons: &mut [f64]) {
        if self.white != 0.0 {
            for sample in &mut *newtons {
                let normal: f64 = StandardNormal.sample(&mut self.random);
                *sample += self.white * normal;
            }
        }
        if let Some(coloured) = &mut self.coloured {
            for sample in newtons {
                *sample += coloured.level;
                let normal: f64 = StandardNormal.sample(&mut self.random);
                coloured.level = coloured.decay * coloured.level + coloured.kick * normal;
            }
        }
    }
}
