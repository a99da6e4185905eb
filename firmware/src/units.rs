//! Physical quantities as types: a unit is in the type's name, never in a comment.
//!
//! They wrap `f32`, the precision of the target's floating-point unit. Arithmetic beyond scaling and
//! comparison is done on `.0`, in expressions short enough to check by eye.

use serde::{Deserialize, Serialize};

macro_rules! quantity {
    ($(#[$doc:meta] $name:ident, $symbol:literal;)+) => {$(
        #[$doc]
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        pub struct $name(pub f32);

        impl $name {
            /// Nothing of it.
            pub const ZERO: Self = Self(0.0);

            /// The larger of the two.
            #[must_use]
            pub fn max(self, other: Self) -> Self {
                if other.0 > self.0 { other } else { self }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    )+};
}

quantity! {
    /// Force.
    Newton, "N";
    /// Impulse.
    NewtonSecond, "N·s";
    /// Stiffness. Tables in the standards print N/mm; this is a thousandth of it.
    NewtonPerMetre, "N/m";
    /// Mass.
    Kilogram, "kg";
    /// Length, stroke.
    Metre, "m";
    /// Energy.
    Joule, "J";
    /// Duration.
    Second, "s";
    /// Frequency, sample rate.
    Hertz, "Hz";
    /// Voltage.
    Volt, "V";
}

/// An instant on the sensor's own time axis: whole samples since power-up and a fraction of one.
///
/// Samples, not wall time, because the ADC's trigger is the only clock that the force curve knows; a `u64`
/// lasts 29 million years at 20 kS/s, so it never wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SampleInstant {
    /// Whole samples since power-up.
    pub index: u64,
    /// Fraction of a sample after `index`, in [0, 1).
    pub fraction: f32,
}

impl SampleInstant {
    /// `offset` samples after the sample `origin`; the offset may be negative or fractional.
    ///
    /// Instants before power-up are clipped to it.
    #[must_use]
    pub fn from_offset(origin: u64, offset: f32) -> Self {
        let whole = libm::floorf(offset);
        let fraction = offset - whole;
        let index = origin.checked_add_signed(whole as i64);
        match index {
            Some(index) => Self { index, fraction },
            None => Self::default(),
        }
    }

    /// Seconds since power-up at the given sample rate.
    #[must_use]
    pub fn seconds(self, sample_rate: Hertz) -> f64 {
        (self.index as f64 + f64::from(self.fraction)) / f64::from(sample_rate.0)
    }

    /// Seconds from `earlier` to `self`.
    #[must_use]
    pub fn since(self, earlier: Self, sample_rate: Hertz) -> Second {
        let whole = self.index.wrapping_sub(earlier.index) as i64 as f32;
        Second((whole + (self.fraction - earlier.fraction)) / sample_rate.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_keeps_its_fraction_late_in_life() {
        let late = SampleInstant::from_offset(20_000 * 3600 * 24 * 365, -0.25);
        assert_eq!(late.index, 20_000 * 3600 * 24 * 365 - 1);
        assert_eq!(late.fraction, 0.75);
    }

    #[test]
    fn before_power_up_is_power_up() {
        assert_eq!(SampleInstant::from_offset(3, -7.5), SampleInstant::default());
    }
}
