//! True values, drawn around what is believed.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use crate::campaign::Estimate;

/// A true value is at most this many standard deviations from the believed one: rarer ones (1 in 80) would make a
/// campaign that contradicts its own statement.
const MOST_DEVIATIONS: f64 = 2.5;

/// The source of all chance in one simulation.
pub(super) struct Chance(ChaCha8Rng);

impl Chance {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// A standard normal number within ±2.5.
    fn deviation(&mut self) -> f64 {
        loop {
            let normal: f64 = StandardNormal.sample(&mut self.0);
            if normal.abs() <= MOST_DEVIATIONS {
                return normal;
            }
        }
    }

    /// A true value for a believed one; positive where that is.
    pub(super) fn truth_of(&mut self, believed: Estimate) -> f64 {
        // Drawn even where it is not needed, so that what follows does not depend on it.
        let value = believed.value + believed.sd * self.deviation();
        // With a doubt above 40 % the value could change its sign; a tenth of it is as far off as is physical.
        if believed.value > 0.0 { value.max(0.1 * believed.value) } else { value }
    }

    /// 1 ± a relative standard deviation.
    pub(super) fn factor(&mut self, relative_sd: f64) -> f64 {
        self.truth_of(Estimate::new(1.0, relative_sd))
    }

    /// Uniform in [0, 1).
    pub(super) fn fraction(&mut self) -> f64 {
        self.0.random::<f64>()
    }

    /// A normal number with this standard deviation, without a limit.
    pub(super) fn noise(&mut self, sd: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.0);
        sd * normal
    }

    /// A seed for a generator of its own.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.random()
    }
}
