//! Gain, zero, rails and 16 bits.
//!
//! ```text
//! code = zero + F · sensitivity · gain / (reference / 2¹⁶), rounded, within the amplifier's rails
//! ```

use thud_firmware::board::AdcCode;
use thud_firmware::configuration::Chain;
use thud_firmware::units::Volt;

/// Cell, amplifier and converter.
///
/// The sensor is told what a code means by its own configuration; where that differs from this, it is calibrated wrongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    /// Sensitivity of the cell, V/N.
    pub volt_per_newton: f64,
    /// Bias voltage of the cell, as it should be.
    pub bias: Volt,
    /// Gain from the cell to the converter.
    pub gain: f64,
    /// Full scale of the converter.
    pub reference: Volt,
    /// Code at no force.
    pub zero_code: AdcCode,
    /// Code at the amplifier's lower rail.
    pub lower_rail: AdcCode,
    /// Code at the amplifier's upper rail.
    pub upper_rail: AdcCode,
}

impl FrontEnd {
    /// PCB 208C03 on the reference front end; [`Chain::REFERENCE`] says how the figures hang together. The bias is the
    /// middle of the cell's 8 to 14 V.
    pub const REFERENCE: Self = Self {
        volt_per_newton: 2.248e-3,
        bias: Volt(11.0),
        gain: 0.32,
        reference: Volt(3.3),
        zero_code: Chain::REFERENCE.zero_code,
        lower_rail: Chain::REFERENCE.clip_low,
        upper_rail: Chain::REFERENCE.clip_high,
    };

    /// Force per code, N.
    #[must_use]
    pub fn newton_per_code(&self) -> f64 {
        f64::from(self.reference.0) / 65_536.0 / (self.volt_per_newton * self.gain)
    }
}

pub(super) struct Quantiser {
    code_per_newton: f64,
    zero: f64,
    rails: (f64, f64),
}

impl Quantiser {
    pub(super) fn new(front_end: &FrontEnd) -> Self {
        Self {
            code_per_newton: 1.0 / front_end.newton_per_code(),
            zero: f64::from(front_end.zero_code),
            rails: (f64::from(front_end.lower_rail), f64::from(front_end.upper_rail)),
        }
    }

    pub(super) fn convert(&self, newtons: &[f64], codes: &mut [AdcCode]) {
        for (newton, code) in newtons.iter().zip(codes) {
            let exact = newton * self.code_per_newton + self.zero;
            // Within the rails it is positive, so that cutting after half a code is rounding.
            *code = (exact.clamp(self.rails.0, self.rails.1) + 0.5) as AdcCode;
        }
    }

    pub(super) fn lower_rail(&self) -> AdcCode {
        self.rails.0 as AdcCode
    }

    pub(super) fn upper_rail(&self) -> AdcCode {
        self.rails.1 as AdcCode
    }
}
