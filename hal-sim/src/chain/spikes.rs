//! Single samples that are far off: a spark nearby, a bit that flips.
//!
//! They come at random instants (a Poisson process), one sample each, of either sign.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Exp1};
use thud_firmware::units::{Hertz, Newton};

/// Single samples that are far off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spikes {
    /// How many a second, on average.
    pub rate: Hertz,
    /// The largest; each is between half of it and all of it.
    pub height: Newton,
}

pub(super) struct Source {
    height: f64,
    mean_gap: f64,
    /// Samples before the next one.
    gap: u64,
    random: ChaCha8Rng,
}

impl Source {
    pub(super) fn new(spikes: Spikes, period_s: f64, seed: &mut ChaCha8Rng) -> Self {
        let mut source = Self {
            height: f64::from(spikes.height.0),
            mean_gap: 1.0 / (f64::from(spikes.rate.0) * period_s),
            gap: 0,
            random: ChaCha8Rng::from_rng(seed),
        };
        source.gap = source.next_gap();
        source
    }

    fn next_gap(&mut self) -> u64 {
        let gap: f64 = Exp1.sample(&mut self.random);
        (gap * self.mean_gap) as u64
    }

    pub(super) fn add(&mut self, newtons: &mut [f64]) {
        let mut rest = newtons;
        while self.gap < rest.len() as u64 {
            let (before, after) = rest.split_at_mut(self.gap as usize);
            let _ = before;
            let height = self.height * self.random.random_range(0.5..=1.0);
            after[0] += if self.random.random_bool(0.5) { height } else { -height };
            rest = &mut after[1..];
            self.gap = self.next_gap();
        }
        self.gap -= rest.len() as u64;
    }
}
