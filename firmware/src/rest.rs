//! When a contact has ended: nothing is left of the force, or what is left stands still.
//!
//! ```text
//! F ▲    ╱‾╲              F within T/2 of a level F₀ for 0.1 s,   |F₀| ≤ min(10 N, half the peak)
//!   │   ╱   ╲
//!   │  ╱     ╲___________________________ F₀: the rest
//!   └─╱───────┴────────────────────▶ t
//!             the contact ends here       T: the onset threshold, six times the noise
//! ```
//!
//! A guide that rubs does not let the springs come back all the way: it holds the piece as soon as they push it less than its
//! sliding force, some newtons. Behind a piece that swings the rest can also pull. Such a rest is no contact: the impact is
//! over, and the next blow begins from there. What is above 10 N, or nearly as high as it ever was, is a body that is being
//! clamped, and a force that moves is something that touches or swings; neither is a rest.
//!
//! The detector decides by this when an impact is over, from the verdict filter's output ([`Touch`]); the evaluation decides
//! by the same [`Stillness`], from means of 2 ms, where one contact of an impact ends and from which level the next one rises.

use crate::filter::Causal;
use crate::units::{Newton, Second};

/// A force is still when it has stayed within some half of the threshold of a level for this long: five periods of 50 Hz, six of
/// 60 Hz, so that their remains average out.
pub const STILL: Second = Second(0.1);
/// How far from its level a still force may be, as a share of half the threshold: a little more than all of it, so that what rises
/// from zero is above half the threshold, and touches, before it is no longer still.
const BAND: f32 = 1.25;
/// Most that friction is believed to hold: a printed guide slides at 0.5 to 10 N. The lowest quasi-static limit of any
/// region is several times that.
pub const LARGEST_REST: Newton = Newton(10.0);
/// A rest is at most this share of the peak. What stays as high as it came was not left by a blow: a slow push, a drift.
const SHARE_OF_PEAK: f32 = 0.5;

/// The largest rest, N, that a blow of this peak may leave in either direction. What has rested there `before` it may do so again,
/// however weak the blow, and within `release`, half the threshold, nothing is there at all.
#[must_use]
pub fn largest(peak: f32, before: f32, release: f32) -> f32 {
    (SHARE_OF_PEAK * peak).min(LARGEST_REST.0).max(before.abs() + release)
}

/// Follows a force and notices when it stands still. Forces in N, instants in samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stillness {
    /// The force has been within the band around this since `since`.
    around: f32,
    since: u64,
    /// Sum of the distances from `around`, and their number, in the present span.
    sum: f32,
    count: u32,
    /// Mean force of the last whole span.
    mean: Option<f32>,
}

impl Stillness {
    /// Takes a force that stands for the time from `index` on; `release` is half the threshold, `span` how many forces in
    /// a row make it still.
    #[inline]
    pub fn take(&mut self, force: f32, index: u64, release: f32, span: u32) {
        let distance = force - self.around;
        if distance.abs() > BAND * release {
            *self = Self { around: force, since: index, ..Self::default() };
            return;
        }
        self.sum += distance;
        self.count += 1;
        if self.count == span {
            self.mean = Some(self.around + self.sum / span as f32);
            self.sum = 0.0;
            self.count = 0;
        }
    }

    /// The level at which the force stands still, if it does: its mean over the last whole span.
    #[must_use]
    pub fn level(&self) -> Option<f32> {
        self.mean
    }

    /// Since when the force has stood where it stands.
    #[must_use]
    pub fn since(&self) -> u64 {
        self.since
    }
}

/// How a contact ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// The force stands still at this level, N: the rest, or zero within half the threshold.
    Still(f32),
    /// The force has gone; something swings still.
    Gone,
}

/// Whether something still touches, judged by the force through the verdict filter.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    filter: Causal,
    /// The rest from which the force rose.
    before: f32,
    filtered: f32,
    highest: f32,
    last: u64,
    still: Stillness,
}

impl Touch {
    /// It touches since `index`; the force rose from the rest `before`, N.
    #[must_use]
    pub const fn new(filter: Causal, before: f32, index: u64) -> Self {
        let still = Stillness { around: 0.0, since: index, sum: 0.0, count: 0, mean: None };
        Self { filter, before, filtered: 0.0, highest: 0.0, last: index, still }
    }

    /// Takes a sample; `release` is half the threshold, `span` [`STILL`] in samples. Gives the filtered force.
    #[inline]
    pub fn take(&mut self, force: f32, index: u64, release: f32, span: u32) -> f32 {
        let filtered = self.filter.step(force);
        if filtered > release {
            self.last = index;
        }
        self.highest = self.highest.max(filtered);
        self.still.take(filtered, index, release, span);
        self.filtered = filtered;
        filtered
    }

    /// Whether the contact has ended. The force has gone when it has stayed below half the threshold for `gone_after` samples.
    #[must_use]
    pub fn end(&self, now: u64, release: f32, gone_after: u64) -> Option<End> {
        match self.still.level() {
            Some(level) if level.abs() <= largest(self.highest, self.before, release) => Some(End::Still(level)),
            _ if now - self.last > gone_after => Some(End::Gone),
            _ => None,
        }
    }

    /// The last sample at which something touched, with half the threshold and the level at which the force stands still now.
    #[must_use]
    pub fn last(&self, release: f32) -> u64 {
        match self.still.level() {
            Some(level) if level > release && level <= largest(self.highest, self.before, release) => {
                self.last.min(self.still.since())
            }
            _ => self.last,
        }
    }

    /// How long, in samples, the force has stood still, and around which level.
    #[must_use]
    pub fn standing(&self, now: u64) -> (u64, f32) {
        (now - self.still.since(), self.still.level().unwrap_or(self.filtered))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(forces: impl Iterator<Item = f32>) -> Stillness {
        let mut still = Stillness::default();
        for (index, force) in forces.enumerate() {
            still.take(force, index as u64, 0.9, 100);
        }
        still
    }

    #[test]
    fn what_stays_within_the_band_is_still_and_its_level_is_the_mean() {
        let found = still((0..500).map(|i| if i < 50 { 100.0 } else { 4.0 + 0.4 * (i as f32 * 0.628).sin() }));
        assert_eq!(found.since(), 50);
        assert!((found.level().unwrap() - 4.0).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn what_swings_or_grows_is_not() {
        assert_eq!(still((0..500).map(|i| 4.0 + 2.0 * (i as f32 * 0.1).sin())).level(), None);
        assert_eq!(still((0..500).map(|i| 0.02 * i as f32)).level(), None);
    }

    #[test]
    fn the_largest_rest_is_half_a_weak_blow_and_ten_newtons_of_a_strong_one() {
        let largest = |peak| largest(peak, 0.0, 0.9);
        assert_eq!((largest(8.0), largest(20.0), largest(500.0)), (4.0, 10.0, 10.0));
    }
}
