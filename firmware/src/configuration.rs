//! What can be set: one value, validated as a whole, separate from all state.
//!
//! A configuration takes effect between impacts, never inside one. Every event carries the revision and the
//! hash of the one it was judged by.

use serde::{Deserialize, Serialize};

use crate::limits::{LimitsProfile, Region};
use crate::units::{Hertz, Kilogram, Newton, NewtonPerMetre, Second, Volt};

/// Whether the struck body is free to move, ISO/PAS 5672.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum ContactKind {
    /// The body part can recoil: the transient peak is scaled by S.
    #[default]
    Free = 0,
    /// The body part is clamped: nothing is scaled.
    Clamped = 1,
}

/// Which filter the judged force passes through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum FilterProfile {
    /// ISO/PAS 5672 as publicly described: zero-phase fourth order (two-pole Butterworth forward and back),
    /// −3 dB at 100 Hz. Equals CFC 60 of SAE J211. Recalled, not verified against the printed standard.
    #[default]
    IsoPas5672 = 0,
    /// CFC 100 of SAE J211: the same shape, −3 dB at 165 Hz.
    Cfc100 = 1,
    /// CFC 180: −3 dB at 300 Hz.
    Cfc180 = 2,
    /// No filter: the judged peak is the raw one.
    None = 3,
}

impl FilterProfile {
    /// All profiles.
    pub const ALL: [Self; 4] = [Self::IsoPas5672, Self::Cfc100, Self::Cfc180, Self::None];

    /// The name that the command line and files use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::IsoPas5672 => "iso-pas-5672",
            Self::Cfc100 => "cfc-100",
            Self::Cfc180 => "cfc-180",
            Self::None => "none",
        }
    }

    /// The profile with this name, if there is one.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| profile.name() == name)
    }

    /// The profile with this number on the wire, if there is one.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| *profile as u8 == number)
    }

    /// −3 dB frequency of the forward-and-back cascade; `None` where nothing is filtered.
    #[must_use]
    pub const fn corner(self) -> Option<Hertz> {
        match self {
            Self::IsoPas5672 => Some(Hertz(100.0)),
            Self::Cfc100 => Some(Hertz(165.0)),
            Self::Cfc180 => Some(Hertz(300.0)),
            Self::None => None,
        }
    }
}

/// The measuring chain in front of the ADC: what turns newtons into counts.
///
/// [`Chain::REFERENCE`] derives each number; a calibration certificate replaces `newton_per_code`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chain {
    /// Samples per second.
    pub sample_rate: Hertz,
    /// Force per ADC code.
    pub newton_per_code: f32,
    /// Code at no force.
    pub zero_code: u16,
    /// Codes at or below this are clipped.
    pub clip_low: u16,
    /// Codes at or above this are clipped.
    pub clip_high: u16,
    /// Effective discharge time constant of cell and readout together, τ_eff = (Σ 1/τᵢ)⁻¹.
    pub time_constant: Second,
    /// Lowest healthy bias voltage of the IEPE cell.
    pub bias_low: Volt,
    /// Highest healthy bias voltage.
    pub bias_high: Volt,
    /// By how much the codes lag behind the force: the group delay of the front end for slow signals, subtracted from
    /// every reported instant. Zero for curves that passed no filter, such as replayed ones: [`Chain::undelayed`].
    pub delay: Second,
}

impl Chain {
    /// PCB 208C03 (2.248 mV/N, ±2224 N, bias 8–14 V, τ ≥ 2000 s) on the reference front end.
    ///
    /// Gain 0.32 puts ±5 V of the cell onto ±1.6 V around the middle of the ADC's 3.3 V; 16 bits after hardware
    /// oversampling give 3.3 V / 65536 = 50.35 µV a code; 50.35 µV / (2.248 mV/N · 0.32) = 0.0700 N a code, a full scale
    /// of ±2293 N. The front end is DC-coupled after the cell, so its τ is the cell's.
    pub const REFERENCE: Self = Self {
        sample_rate: Hertz(20_000.0),
        newton_per_code: 3.3 / 65_536.0 / (2.248e-3 * 0.32),
        zero_code: 32_768,
        // The amplifier's rails stop short of the ADC's: 16 codes (1.1 N) at either end.
        clip_low: 16,
        clip_high: u16::MAX - 16,
        time_constant: Second(2000.0),
        bias_low: Volt(8.0),
        bias_high: Volt(14.0),
        // The anti-alias filter, a second-order Butterworth at 8 kHz: φ(ω) = −atan(√2·x/(1 − x²)), x = ω/ω_c, so
        // −dφ/dω = √2/ω_c = √2/(2π·8 kHz) at low frequency. At 600 Hz it is 0.6 % more.
        delay: Second(core::f32::consts::SQRT_2 / (core::f32::consts::TAU * 8_000.0)),
    };

    /// The same chain where nothing delays the curve, as when a recording is replayed past the anti-alias filter.
    #[must_use]
    pub const fn undelayed(self) -> Self {
        Self { delay: Second(0.0), ..self }
    }
}

/// Node settings on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NodeSettings {
    /// CANopen node id, 1 to 127. Takes effect at the next reset.
    pub node_id: u8,
    /// Heartbeat period, ms; 0 for none.
    pub heartbeat_ms: u16,
}

/// Everything that can be set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// Body region; `None` until somebody has chosen one, and then there is no verdict.
    pub region: Option<Region>,
    /// Free or clamped.
    pub contact: ContactKind,
    /// Which limits apply.
    pub limits: LimitsProfile,
    /// Stiffness of the body spring as assembled in the rig; the pad is never credited.
    pub body_stiffness: NewtonPerMetre,
    /// Effective mass of the robot where none is received while it moves; `None` if unknown.
    pub effective_mass: Option<Kilogram>,
    /// A received effective mass older than this at onset is stale, ms.
    pub effective_mass_max_age_ms: u32,
    /// Filter of the judged force.
    pub filter: FilterProfile,
    /// An onset is this many times the tracked noise.
    pub onset_multiple: f32,
    /// No onset below this force, however quiet the signal is.
    pub onset_minimum: Newton,
    /// Relative expanded uncertainty (k = 2) of the force, the guard band on both sides of a limit.
    pub relative_uncertainty: f32,
    /// The measuring chain.
    pub chain: Chain,
    /// Node settings.
    pub node: NodeSettings,
}

impl Default for Configuration {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Configuration {
    /// What a sensor holds that nobody has configured.
    pub const DEFAULT: Self = Self {
        region: None,
        contact: ContactKind::Free,
        limits: LimitsProfile::IsoTs15066,
        body_stiffness: NewtonPerMetre(25_000.0),
        effective_mass: None,
        // A controller that streams at 10 Hz or faster never goes stale.
        effective_mass_max_age_ms: 100,
        filter: FilterProfile::IsoPas5672,
        onset_multiple: 6.0,
        // Seven codes of the reference chain: below this the quantiser speaks, not the force.
        onset_minimum: Newton(0.5),
        // 1 % full-scale linearity of the cell [208C03] and 2 % of calibration and mounting, added in squares
        // and rounded up.
        relative_uncertainty: 0.03,
        chain: Chain::REFERENCE,
        node: NodeSettings { node_id: 0x20, heartbeat_ms: 500 },
    };

    /// Checks every range and every combination.
    ///
    /// # Errors
    /// The first thing that is wrong; nothing is half-applied.
    pub fn validate(&self) -> Result<(), Invalid> {
        within(Setting::BodyStiffness, self.body_stiffness.0)?;
        if let Some(mass) = self.effective_mass {
            within(Setting::EffectiveMass, mass.0)?;
        }
        within(Setting::EffectiveMassMaxAge, self.effective_mass_max_age_ms as f32)?;
        within(Setting::OnsetMultiple, self.onset_multiple)?;
        within(Setting::OnsetMinimum, self.onset_minimum.0)?;
        within(Setting::RelativeUncertainty, self.relative_uncertainty)?;
        within(Setting::SampleRate, self.chain.sample_rate.0)?;
        within(Setting::NewtonPerCode, self.chain.newton_per_code)?;
        within(Setting::TimeConstant, self.chain.time_constant.0)?;
        within(Setting::ChainDelay, self.chain.delay.0)?;
        within(Setting::NodeId, f32::from(self.node.node_id))?;
        within(Setting::Heartbeat, f32::from(self.node.heartbeat_ms))?;
        let chain = &self.chain;
        let codes_in_order = chain.clip_low < chain.zero_code && chain.zero_code < chain.clip_high;
        if !codes_in_order || chain.bias_low >= chain.bias_high {
            return Err(Invalid::Contradiction(Setting::ChainRange));
        }
        if let Some(corner) = self.filter.corner()
            && chain.sample_rate.0 < 10.0 * corner.0
        {
            return Err(Invalid::Contradiction(Setting::SampleRate));
        }
        Ok(())
    }
}

/// A setting by its name, to say which one was wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is the field of the same name")]
pub enum Setting {
    BodyStiffness,
    EffectiveMass,
    EffectiveMassMaxAge,
    OnsetMultiple,
    OnsetMinimum,
    RelativeUncertainty,
    SampleRate,
    NewtonPerCode,
    TimeConstant,
    ChainRange,
    ChainDelay,
    NodeId,
    Heartbeat,
    Region,
    Contact,
    Limits,
    Filter,
}

impl Setting {
    /// All settings.
    pub const ALL: [Self; 17] = [
        Self::BodyStiffness,
        Self::EffectiveMass,
        Self::EffectiveMassMaxAge,
        Self::OnsetMultiple,
        Self::OnsetMinimum,
        Self::RelativeUncertainty,
        Self::SampleRate,
        Self::NewtonPerCode,
        Self::TimeConstant,
        Self::ChainRange,
        Self::ChainDelay,
        Self::NodeId,
        Self::Heartbeat,
        Self::Region,
        Self::Contact,
        Self::Limits,
        Self::Filter,
    ];

    /// Lowest and highest permitted value, where the setting is a number.
    #[must_use]
    pub const fn range(self) -> Option<(f32, f32)> {
        Some(match self {
            // The rig holds 10 to 150 N/mm; others up to a stiff dummy.
            Self::BodyStiffness => (1_000.0, 1_000_000.0),
            // From a fingertip-sized gripper to a large industrial arm.
            Self::EffectiveMass => (0.05, 1_000.0),
            Self::EffectiveMassMaxAge => (1.0, 60_000.0),
            // Below 3 the noise itself triggers, above 50 the toe of a slow hit is lost.
            Self::OnsetMultiple => (3.0, 50.0),
            Self::OnsetMinimum => (0.0, 100.0),
            Self::RelativeUncertainty => (0.0, 0.5),
            // The verdict filter needs ten samples per period of its corner; the ADC reaches 250 kS/s.
            Self::SampleRate => (1_000.0, 250_000.0),
            Self::NewtonPerCode => (1e-4, 10.0),
            Self::TimeConstant => (0.01, 1e6),
            // None, to a front end that lets little more than the verdict filter's 100 Hz pass.
            Self::ChainDelay => (0.0, 0.002),
            Self::NodeId => (1.0, 127.0),
            Self::Heartbeat => (0.0, 65_535.0),
            Self::ChainRange | Self::Region | Self::Contact | Self::Limits | Self::Filter => return None,
        })
    }
}

/// Why a configuration was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Invalid {
    /// Below the setting's range.
    TooLow(Setting),
    /// Above the setting's range.
    TooHigh(Setting),
    /// Not a number, or not one of the choices.
    NoSuchValue(Setting),
    /// Each value is possible, but not together with the others.
    Contradiction(Setting),
}

fn within(setting: Setting, value: f32) -> Result<(), Invalid> {
    let Some((low, high)) = setting.range() else { return Ok(()) };
    if value.is_nan() {
        Err(Invalid::NoSuchValue(setting))
    } else if value < low {
        Err(Invalid::TooLow(setting))
    } else if value > high {
        Err(Invalid::TooHigh(setting))
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid() {
        assert_eq!(Configuration::DEFAULT.validate(), Ok(()));
    }

    #[test]
    fn each_end_of_each_range_is_named() {
        let mut configuration = Configuration::DEFAULT;
        configuration.onset_multiple = 2.9;
        assert_eq!(configuration.validate(), Err(Invalid::TooLow(Setting::OnsetMultiple)));
        configuration.onset_multiple = f32::NAN;
        assert_eq!(configuration.validate(), Err(Invalid::NoSuchValue(Setting::OnsetMultiple)));
        configuration = Configuration::DEFAULT;
        configuration.effective_mass = Some(Kilogram(2_000.0));
        assert_eq!(configuration.validate(), Err(Invalid::TooHigh(Setting::EffectiveMass)));
    }

    #[test]
    fn a_chain_may_have_no_delay_but_not_a_negative_one() {
        let mut configuration = Configuration::DEFAULT;
        assert!((configuration.chain.delay.0 - 28.13e-6).abs() < 1e-8, "{:?}", configuration.chain.delay);
        configuration.chain = configuration.chain.undelayed();
        assert_eq!(configuration.validate(), Ok(()));
        configuration.chain.delay = Second(-1e-6);
        assert_eq!(configuration.validate(), Err(Invalid::TooLow(Setting::ChainDelay)));
        configuration.chain.delay = Second(0.003);
        assert_eq!(configuration.validate(), Err(Invalid::TooHigh(Setting::ChainDelay)));
    }

    #[test]
    fn a_filter_that_the_sample_rate_cannot_carry_is_a_contradiction() {
        let mut configuration = Configuration::DEFAULT;
        configuration.filter = FilterProfile::Cfc180;
        configuration.chain.sample_rate = Hertz(2_000.0);
        assert_eq!(configuration.validate(), Err(Invalid::Contradiction(Setting::SampleRate)));
    }
}
