//! When a force has begun: a limited mean of the last eight samples against a threshold.
//!
//! The threshold that a user sets is T = multiple · σ (six by default), or the configured minimum. The mean of
//! eight has less noise (σ₈, tracked as well: σ/√8 when the noise is white), so it can be compared with a level below T, at which a force of T is
//! certain to be noticed and noise is not:
//!
//! ```text
//! level = max(T − 5σ₈, 7σ₈), at most T       white noise, T = 6σ  ⇒  level = 4.2σ, which is 12 deviations of the mean
//! ```
//!
//! A force of T is missed by one mean with a probability of 3e-7 (five deviations). Noise alone passes seven
//! deviations with 1.3e-12 a sample, once in a thousand spells of ten hours at 20 kS/s; twelve, never.
//!
//! Before it enters the mean each sample is limited to three levels. One sample of whatever height thus adds
//! 3/8 of the level, two add 3/4; three in a row pass it. That is the confirmation: a spike never triggers, and a
//! hammer's blow of four samples does.
//!
//! Delay at the slowest slope that is asked for (500 N/s, σ = 0.3 N): the mean lags by 3.5 samples, which is
//! 0.09 N; the level lies 0.53 N below T. So the alarm comes 0.9 ms before the force passes T, give or take four of the
//! mean's deviations of 0.2 ms, plus at most a block (0.4 ms) and a CAN frame (0.15 ms).

/// Samples in the mean.
pub const WINDOW: usize = 8;

/// Samples are limited to this many levels.
const LIMIT: f32 = 3.0;

/// A sample limited to ±`limit`. By comparisons: `f32::clamp` also asks whether a limit is a number, four instructions each
/// time, and links the formatting of its panic.
#[inline]
#[must_use]
pub fn limited(sample: f32, limit: f32) -> f32 {
    if sample > limit {
        limit
    } else if sample < -limit {
        -limit
    } else {
        sample
    }
}

/// The limited mean.
#[derive(Clone, Debug)]
pub struct OnsetDetector {
    samples: [f32; WINDOW],
    next: usize,
    sum: f32,
    /// Sum of the samples since the window was last begun anew.
    fresh: f32,
    threshold: f32,
    sum_level: f32,
    limit: f32,
}

impl OnsetDetector {
    /// A detector that cannot trigger before a threshold is set.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            samples: [0.0; WINDOW],
            next: 0,
            sum: 0.0,
            fresh: 0.0,
            threshold: f32::INFINITY,
            sum_level: f32::INFINITY,
            limit: f32::INFINITY,
        }
    }

    /// Forgets the samples, keeps the threshold.
    pub fn clear(&mut self) {
        self.samples = [0.0; WINDOW];
        self.next = 0;
        self.sum = 0.0;
        self.fresh = 0.0;
    }

    /// Sets the threshold T from the noise of a sample and of the mean of eight (root mean square, N).
    pub fn set_noise(&mut self, noise: f32, of_mean: f32, multiple: f32, minimum: f32) {
        let threshold = noise * multiple;
        let level = (threshold - 5.0 * of_mean).max(7.0 * of_mean).min(threshold).max(minimum);
        self.threshold = threshold.max(minimum);
        self.sum_level = level * WINDOW as f32;
        self.limit = level * LIMIT;
    }

    /// The threshold T, N.
    #[must_use]
    pub const fn threshold(&self) -> f32 {
        self.threshold
    }

    /// Half of T, N: a force that has once been noticed is there until it falls below this.
    #[must_use]
    pub fn release_level(&self) -> f32 {
        0.5 * self.threshold
    }

    /// The most that one sample counts, N, in either direction.
    #[must_use]
    pub const fn limit(&self) -> f32 {
        self.limit
    }

    /// The same, or `other` where that is less.
    #[inline]
    #[must_use]
    pub fn limit_below(&self, other: f32) -> f32 {
        if self.limit < other { self.limit } else { other }
    }

    /// Mean of the last eight samples, limited, N.
    #[must_use]
    pub fn mean(&self) -> f32 {
        self.sum / WINDOW as f32
    }

    /// Takes a sample that is already limited to ±[`Self::limit`]; true when the mean is above the level.
    #[inline]
    pub fn push(&mut self, limited: f32) -> bool {
        let slot = &mut self.samples[self.next % WINDOW];
        self.sum += limited - *slot;
        self.fresh += limited;
        *slot = limited;
        self.next = (self.next + 1) % WINDOW;
        if self.next == 0 {
            // The running sum would gather rounding errors for ever.
            self.sum = self.fresh;
            self.fresh = 0.0;
        }
        self.sum > self.sum_level
    }
}

impl Default for OnsetDetector {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// σ of the mean over σ of a sample, 1/√8, for white noise.
    const MEAN_NOISE: f32 = 0.353_553_4;

    fn armed() -> OnsetDetector {
        let mut onset = OnsetDetector::new();
        onset.set_noise(0.3, 0.3 * MEAN_NOISE, 6.0, 0.5);
        onset
    }

    fn push(onset: &mut OnsetDetector, x: f32) -> bool {
        onset.push(x.clamp(-onset.limit(), onset.limit()))
    }

    #[test]
    fn one_sample_of_any_height_is_no_onset_and_three_are() {
        for height in [2.0, 50.0, 4000.0, f32::MAX] {
            let mut onset = armed();
            assert!(!(0..20).any(|i| push(&mut onset, if i == 9 { height } else { 0.3 })), "{height}");
            assert!(!(0..20).any(|i| push(&mut onset, if i == 9 || i == 12 { height } else { 0.0 })), "{height}");
        }
        let mut onset = armed();
        assert!((0..20).any(|i| push(&mut onset, if (9..12).contains(&i) { 50.0 } else { 0.0 })));
    }

    #[test]
    fn the_level_lies_between_noise_and_threshold() {
        for multiple in [3.0, 6.0, 50.0] {
            let mut onset = OnsetDetector::new();
            onset.set_noise(0.3, 0.3 * MEAN_NOISE, multiple, 0.5);
            let level = onset.limit() / LIMIT;
            assert!(level <= onset.threshold());
            assert!(level >= 7.0 * 0.3 * MEAN_NOISE - 1e-6);
        }
    }

    #[test]
    fn slow_noise_raises_the_level_and_the_minimum_holds() {
        let mut onset = armed();
        onset.set_noise(0.3, 0.3, 6.0, 0.5);
        assert_eq!(onset.limit() / LIMIT, onset.threshold());
        onset.set_noise(0.01, 0.004, 6.0, 0.5);
        assert_eq!((onset.limit() / LIMIT, onset.threshold()), (0.5, 0.5));
    }

    #[test]
    fn nothing_triggers_before_a_threshold_is_set() {
        let mut onset = OnsetDetector::new();
        assert!(!(0..100).any(|_| onset.push(1e30)));
    }
}
