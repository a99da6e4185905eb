//! From counts to newtons, and what is wrong with the counts.
//!
//! ```text
//! force = newton_per_code · (code − zero_code)
//! ```
//!
//! Three things are watched that no later stage could tell from a force: codes at the ends of the range
//! (clipping), a bias voltage outside the IEPE cell's range (cable broken or shorted), and sample numbers that
//! do not follow one another (lost samples).

use crate::board::AdcCode;
use crate::configuration::Chain;
use crate::units::{Second, Volt};

/// A fault is cleared only after the chain has been healthy for this long, so that a loose contact is one
/// fault and not a hundred: a tenth of a second, the block over which idle tracking starts again.
pub const HEALTHY: Second = Second(0.1);

/// Counts to newtons for one chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    newton_per_code: f32,
    /// The code at no force; a whole number.
    zero: f32,
    /// The first code that does not clip, and how many do not.
    first_inside: AdcCode,
    inside: AdcCode,
}

impl Calibration {
    /// The calibration of a chain.
    #[must_use]
    pub const fn new(chain: &Chain) -> Self {
        Self {
            newton_per_code: chain.newton_per_code,
            zero: chain.zero_code as f32,
            first_inside: chain.clip_low.wrapping_add(1),
            inside: chain.clip_high.saturating_sub(chain.clip_low).saturating_sub(1),
        }
    }

    /// The force of a code, N, before zero and hum are removed.
    ///
    /// Exact up to one rounding of `f32`: the difference of two codes is an integer below 2¹⁷.
    #[inline]
    #[must_use]
    pub fn force(&self, code: AdcCode) -> f32 {
        (f32::from(code) - self.zero) * self.newton_per_code
    }

    /// Whether a code is at the end of the range, where the true force may be anything beyond.
    #[inline]
    #[must_use]
    pub const fn clipped(&self, code: AdcCode) -> bool {
        code.wrapping_sub(self.first_inside) >= self.inside
    }

    /// Root mean square of the quantiser's own error, N: a uniform distribution one code wide.
    #[must_use]
    pub fn quantisation_noise(&self) -> f32 {
        const ONE_OVER_SQRT_12: f32 = 0.288_675_13;
        self.newton_per_code * ONE_OVER_SQRT_12
    }
}

/// A condition that lasts: raised at once or after a time, cleared after [`HEALTHY`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lasting {
    raised: bool,
    contrary: u32,
}

/// How a lasting condition changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It is true from now on.
    Raised,
    /// It is over.
    Cleared,
}

impl Lasting {
    /// Not raised.
    #[must_use]
    pub const fn new() -> Self {
        Self { raised: false, contrary: 0 }
    }

    /// Whether it is raised.
    #[must_use]
    pub const fn raised(&self) -> bool {
        self.raised
    }

    /// `samples` more samples said `bad`. Raised after `raise_after` bad samples in a row, cleared after
    /// `clear_after` good ones.
    pub fn observe(&mut self, bad: bool, samples: u32, raise_after: u32, clear_after: u32) -> Option<Change> {
        if bad == self.raised {
            self.contrary = 0;
            return None;
        }
        self.contrary = self.contrary.saturating_add(samples);
        if self.contrary < if bad { raise_after } else { clear_after } {
            return None;
        }
        self.raised = bad;
        self.contrary = 0;
        Some(if bad { Change::Raised } else { Change::Cleared })
    }
}

impl Default for Lasting {
    fn default() -> Self {
        Self::new()
    }
}

/// Whether a bias voltage is that of a healthy cell. Not a number is not healthy.
#[must_use]
pub fn bias_healthy(bias: Volt, chain: &Chain) -> bool {
    bias >= chain.bias_low && bias <= chain.bias_high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_a_force() {
        let calibration = Calibration::new(&Chain::REFERENCE);
        assert_eq!(calibration.force(32_768), 0.0);
        let full_scale = calibration.force(65_535);
        assert!((full_scale - 2293.5).abs() < 1.0, "{full_scale} N");
        assert!((calibration.force(0) + full_scale + Chain::REFERENCE.newton_per_code).abs() < 0.01);
    }

    #[test]
    fn both_ends_clip() {
        let calibration = Calibration::new(&Chain::REFERENCE);
        for code in [0, 16, u16::MAX - 16, u16::MAX] {
            assert!(calibration.clipped(code), "{code}");
        }
        for code in [17, 32_768, u16::MAX - 17] {
            assert!(!calibration.clipped(code), "{code}");
        }
    }

    #[test]
    fn a_loose_contact_is_one_fault() {
        let mut fault = Lasting::new();
        assert_eq!(fault.observe(true, 8, 1, 100), Some(Change::Raised));
        for _ in 0..50 {
            assert_eq!(fault.observe(false, 8, 1, 100), None);
            assert_eq!(fault.observe(true, 8, 1, 100), None);
        }
        let cleared = (0..13).filter_map(|_| fault.observe(false, 8, 1, 100)).collect::<std::vec::Vec<_>>();
        assert_eq!(cleared, [Change::Cleared]);
    }

    #[test]
    fn a_bias_that_is_not_a_number_is_not_healthy() {
        assert!(bias_healthy(Volt(10.0), &Chain::REFERENCE));
        for bias in [0.0, 24.0, f32::NAN] {
            assert!(!bias_healthy(Volt(bias), &Chain::REFERENCE));
        }
    }
}
