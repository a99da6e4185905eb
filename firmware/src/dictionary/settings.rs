//! The configuration transaction: settings are staged one by one and take effect as one.
//!
//! ```text
//! write 0x2000…0x2004 ──▶ staged ──apply──▶ validated as a whole ──▶ active, next revision, to be stored
//!            │                                       │
//!            └── impossible by itself ──▶ refused ◀──┘ nothing is half-applied; 0x2011 says why
//! ```

use zencan_common::sdo::AbortCode;

use super::index;
use super::value::{Value, f32_from, u8_from, u16_from, u32_from};
use crate::configuration::{Configuration, ContactKind, FilterProfile, Invalid, Setting};
use crate::detector::Stamped;
use crate::limits::{LimitsProfile, Region};
use crate::storage;
use crate::units::{Hertz, Kilogram, Newton, NewtonPerMetre, Second, Volt};

/// Why the last write or apply was refused, object 0x2011.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Refusal {
    /// Refusals since power-up.
    pub count: u32,
    /// Index of the setting's object.
    pub index: u16,
    /// Its sub-index.
    pub sub: u8,
    /// 1 too low, 2 too high, 3 no such value, 4 contradiction; 0 nothing was refused yet.
    pub reason: u8,
    /// Lowest permitted value, NaN where there is no range.
    pub lowest: f32,
    /// Highest permitted value, NaN where there is no range.
    pub highest: f32,
    /// The value that was refused.
    pub offered: f32,
}

/// The object that holds a setting.
#[must_use]
pub const fn object_of(setting: Setting) -> (u16, u8) {
    match setting {
        Setting::Region => (index::JUDGEMENT, 1),
        Setting::Contact => (index::JUDGEMENT, 2),
        Setting::Limits => (index::JUDGEMENT, 3),
        Setting::BodyStiffness => (index::JUDGEMENT, 4),
        Setting::Filter => (index::JUDGEMENT, 5),
        Setting::RelativeUncertainty => (index::JUDGEMENT, 6),
        Setting::EffectiveMass => (index::MASS_SETTINGS, 1),
        Setting::EffectiveMassMaxAge => (index::MASS_SETTINGS, 2),
        Setting::OnsetMultiple => (index::DETECTION, 1),
        Setting::OnsetMinimum => (index::DETECTION, 2),
        Setting::SampleRate => (index::CHAIN, 1),
        Setting::NewtonPerCode => (index::CHAIN, 2),
        Setting::ChainRange => (index::CHAIN, 3),
        Setting::TimeConstant => (index::CHAIN, 6),
        Setting::ChainDelay => (index::CHAIN, 9),
        Setting::NodeId => (index::NODE, 1),
        Setting::Heartbeat => (index::NODE, 2),
    }
}

/// Lowest and highest value that the setting at this object can have, as EDS files want them: for a choice its first and last
/// number, 0 where it stands for "none". `None` where every value of the type is possible or another setting decides.
#[must_use]
pub fn limits(object: u16, sub: u8) -> Option<(f32, f32)> {
    let last = |number: usize| Some((0.0, number as f32));
    match (object, sub) {
        (index::RECEIVED_MASS, 1) => Setting::EffectiveMass.range(),
        (index::STREAM, 1) => Some((0.0, f32::from(crate::stream::MOST))),
        (index::TRANSACTION, 1) => Some((f32::from(super::APPLY), f32::from(super::DISCARD))),
        at => match Setting::ALL.into_iter().find(|setting| object_of(*setting) == at)? {
            // 0: no region.
            Setting::Region => last(Region::ALL.len()),
            Setting::Contact => last(ContactKind::Clamped as usize),
            Setting::Limits => last(LimitsProfile::ALL.len() - 1),
            Setting::Filter => last(FilterProfile::ALL.len() - 1),
            // 0: unknown.
            Setting::EffectiveMass => Setting::EffectiveMass.range().map(|(_, high)| (0.0, high)),
            number => number.range(),
        },
    }
}

/// The active configuration, what has been written since, and what was refused.
#[derive(Clone, Debug)]
pub struct Settings {
    active: Stamped,
    staged: Option<Configuration>,
    refusal: Refusal,
    stored: bool,
}

impl Settings {
    /// Starts with what storage held.
    #[must_use]
    pub const fn new(active: Stamped) -> Self {
        let refusal =
            Refusal { count: 0, index: 0, sub: 0, reason: 0, lowest: f32::NAN, highest: f32::NAN, offered: f32::NAN };
        Self { active, staged: None, refusal, stored: true }
    }

    /// What impacts are judged by.
    #[must_use]
    pub fn active(&self) -> Stamped {
        self.active
    }

    /// Object 0x2010:2.
    #[must_use]
    pub fn state(&self) -> u8 {
        u8::from(self.staged.is_some()) | u8::from(!self.stored) << 1
    }

    /// What was refused last.
    #[must_use]
    pub fn refusal(&self) -> Refusal {
        self.refusal
    }

    /// The configuration of this revision is in flash.
    pub fn mark_stored(&mut self, revision: u32) {
        self.stored |= self.active.revision == revision;
    }

    /// A setting as staged, or as active where nothing is staged.
    #[must_use]
    pub fn read(&self, object: u16, sub: u8) -> Option<Value> {
        let configuration = self.staged.as_ref().unwrap_or(&self.active.configuration);
        let chain = &configuration.chain;
        Some(match (object, sub) {
            (index::JUDGEMENT, 1) => Value::U8(configuration.region.map_or(0, |region| region as u8)),
            (index::JUDGEMENT, 2) => Value::U8(configuration.contact as u8),
            (index::JUDGEMENT, 3) => Value::U8(configuration.limits as u8),
            (index::JUDGEMENT, 4) => Value::F32(configuration.body_stiffness.0),
            (index::JUDGEMENT, 5) => Value::U8(configuration.filter as u8),
            (index::JUDGEMENT, 6) => Value::F32(configuration.relative_uncertainty),
            (index::MASS_SETTINGS, 1) => Value::F32(configuration.effective_mass.map_or(0.0, |mass| mass.0)),
            (index::MASS_SETTINGS, 2) => Value::U32(configuration.effective_mass_max_age_ms),
            (index::DETECTION, 1) => Value::F32(configuration.onset_multiple),
            (index::DETECTION, 2) => Value::F32(configuration.onset_minimum.0),
            (index::CHAIN, 1) => Value::F32(chain.sample_rate.0),
            (index::CHAIN, 2) => Value::F32(chain.newton_per_code),
            (index::CHAIN, 3) => Value::U16(chain.zero_code),
            (index::CHAIN, 4) => Value::U16(chain.clip_low),
            (index::CHAIN, 5) => Value::U16(chain.clip_high),
            (index::CHAIN, 6) => Value::F32(chain.time_constant.0),
            (index::CHAIN, 7) => Value::F32(chain.bias_low.0),
            (index::CHAIN, 8) => Value::F32(chain.bias_high.0),
            (index::CHAIN, 9) => Value::F32(chain.delay.0),
            (index::NODE, 1) => Value::U8(configuration.node.node_id),
            (index::NODE, 2) => Value::U16(configuration.node.heartbeat_ms),
            _ => return None,
        })
    }

    /// Stages a setting.
    ///
    /// # Errors
    /// [`AbortCode::ValueTooLow`], [`AbortCode::ValueTooHigh`] or [`AbortCode::InvalidValue`] for a value that is impossible
    /// by itself, a length mismatch, or [`AbortCode::NoSuchSubIndex`].
    pub fn write(&mut self, object: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        let mut staged = self.staged.unwrap_or(self.active.configuration);
        let chain = &mut staged.chain;
        // The setting whose range decides, and the value as a number for the refusal.
        let (setting, offered) = match (object, sub) {
            (index::JUDGEMENT, 1) => {
                let number = u8_from(data)?;
                staged.region = match number {
                    0 => None,
                    _ => Some(self.choice(Setting::Region, number, Region::from_number(number))?),
                };
                (Setting::Region, f32::from(number))
            }
            (index::JUDGEMENT, 2) => {
                let number = u8_from(data)?;
                let contact = match number {
                    0 => Some(ContactKind::Free),
                    1 => Some(ContactKind::Clamped),
                    _ => None,
                };
                staged.contact = self.choice(Setting::Contact, number, contact)?;
                (Setting::Contact, f32::from(number))
            }
            (index::JUDGEMENT, 3) => {
                let number = u8_from(data)?;
                staged.limits = self.choice(Setting::Limits, number, LimitsProfile::from_number(number))?;
                (Setting::Limits, f32::from(number))
            }
            (index::JUDGEMENT, 4) => {
                let stiffness = f32_from(data)?;
                staged.body_stiffness = NewtonPerMetre(stiffness);
                (Setting::BodyStiffness, stiffness)
            }
            (index::JUDGEMENT, 5) => {
                let number = u8_from(data)?;
                staged.filter = self.choice(Setting::Filter, number, FilterProfile::from_number(number))?;
                (Setting::Filter, f32::from(number))
            }
            (index::JUDGEMENT, 6) => {
                staged.relative_uncertainty = f32_from(data)?;
                (Setting::RelativeUncertainty, staged.relative_uncertainty)
            }
            (index::MASS_SETTINGS, 1) => {
                let mass = f32_from(data)?;
                if mass == 0.0 {
                    staged.effective_mass = None;
                    self.staged = Some(staged);
                    return Ok(());
                }
                staged.effective_mass = Some(Kilogram(mass));
                (Setting::EffectiveMass, mass)
            }
            (index::MASS_SETTINGS, 2) => {
                let age = u32_from(data)?;
                staged.effective_mass_max_age_ms = age;
                (Setting::EffectiveMassMaxAge, age as f32)
            }
            (index::DETECTION, 1) => {
                staged.onset_multiple = f32_from(data)?;
                (Setting::OnsetMultiple, staged.onset_multiple)
            }
            (index::DETECTION, 2) => {
                staged.onset_minimum = Newton(f32_from(data)?);
                (Setting::OnsetMinimum, staged.onset_minimum.0)
            }
            (index::CHAIN, 1) => {
                chain.sample_rate = Hertz(f32_from(data)?);
                (Setting::SampleRate, chain.sample_rate.0)
            }
            (index::CHAIN, 2) => {
                chain.newton_per_code = f32_from(data)?;
                (Setting::NewtonPerCode, chain.newton_per_code)
            }
            (index::CHAIN, 3..=5) => {
                let code = u16_from(data)?;
                *match sub {
                    3 => &mut chain.zero_code,
                    4 => &mut chain.clip_low,
                    _ => &mut chain.clip_high,
                } = code;
                (Setting::ChainRange, f32::from(code))
            }
            (index::CHAIN, 6) => {
                chain.time_constant = Second(f32_from(data)?);
                (Setting::TimeConstant, chain.time_constant.0)
            }
            (index::CHAIN, 7 | 8) => {
                let bias = f32_from(data)?;
                *if sub == 7 { &mut chain.bias_low } else { &mut chain.bias_high } = Volt(bias);
                if !bias.is_finite() {
                    return Err(self.refuse(Invalid::NoSuchValue(Setting::ChainRange), (object, sub), bias));
                }
                (Setting::ChainRange, bias)
            }
            (index::CHAIN, 9) => {
                chain.delay = Second(f32_from(data)?);
                (Setting::ChainDelay, chain.delay.0)
            }
            (index::NODE, 1) => {
                staged.node.node_id = u8_from(data)?;
                (Setting::NodeId, f32::from(staged.node.node_id))
            }
            (index::NODE, 2) => {
                staged.node.heartbeat_ms = u16_from(data)?;
                (Setting::Heartbeat, f32::from(staged.node.heartbeat_ms))
            }
            _ => return Err(AbortCode::NoSuchSubIndex),
        };
        if let Some((low, high)) = setting.range() {
            let invalid = if offered.is_nan() {
                Some(Invalid::NoSuchValue(setting))
            } else if offered < low {
                Some(Invalid::TooLow(setting))
            } else if offered > high {
                Some(Invalid::TooHigh(setting))
            } else {
                None
            };
            if let Some(invalid) = invalid {
                return Err(self.refuse(invalid, (object, sub), offered));
            }
        }
        self.staged = Some(staged);
        Ok(())
    }

    /// Makes what was staged the active configuration, as a whole.
    ///
    /// # Errors
    /// The abort code; the active configuration is as before, and what was staged stays so that it can be mended.
    pub fn apply(&mut self) -> Result<Stamped, AbortCode> {
        let staged = self.staged.unwrap_or(self.active.configuration);
        if let Err(invalid) = staged.validate() {
            let setting = match invalid {
                Invalid::TooLow(setting)
                | Invalid::TooHigh(setting)
                | Invalid::NoSuchValue(setting)
                | Invalid::Contradiction(setting) => setting,
            };
            let object = object_of(setting);
            let offered = match self.read(object.0, object.1) {
                Some(Value::F32(value)) => value,
                Some(Value::U32(value)) => value as f32,
                Some(Value::U16(value)) => f32::from(value),
                Some(Value::U8(value)) => f32::from(value),
                _ => f32::NAN,
            };
            return Err(self.refuse(invalid, object, offered));
        }
        self.staged = None;
        if staged != self.active.configuration || self.active.revision == 0 {
            self.active = storage::stamp(staged, self.active.revision.wrapping_add(1));
            self.stored = false;
        }
        Ok(self.active)
    }

    /// Forgets what was staged.
    pub fn discard(&mut self) {
        self.staged = None;
    }

    /// Makes the defaults active.
    ///
    /// # Errors
    /// Never while the defaults are valid, which a test sees to.
    pub fn restore(&mut self) -> Result<Stamped, AbortCode> {
        self.staged = Some(Configuration::DEFAULT);
        self.apply()
    }

    /// Takes a node id that was assigned over LSS into the active configuration.
    ///
    /// # Errors
    /// See [`Settings::apply`].
    pub fn assign_node_id(&mut self, node_id: u8) -> Result<Stamped, AbortCode> {
        let staged = self.staged.take();
        let mut configuration = self.active.configuration;
        configuration.node.node_id = node_id;
        self.staged = Some(configuration);
        let applied = self.apply();
        // What somebody else is about to configure goes on, with the new id.
        self.staged = staged.map(|mut staged| {
            staged.node.node_id = node_id;
            staged
        });
        applied
    }

    fn choice<T>(&mut self, setting: Setting, number: u8, choice: Option<T>) -> Result<T, AbortCode> {
        match choice {
            Some(choice) => Ok(choice),
            None => Err(self.refuse(Invalid::NoSuchValue(setting), object_of(setting), f32::from(number))),
        }
    }

    fn refuse(&mut self, invalid: Invalid, (index, sub): (u16, u8), offered: f32) -> AbortCode {
        let (reason, setting, code) = match invalid {
            Invalid::TooLow(setting) => (1, setting, AbortCode::ValueTooLow),
            Invalid::TooHigh(setting) => (2, setting, AbortCode::ValueTooHigh),
            Invalid::NoSuchValue(setting) => (3, setting, AbortCode::InvalidValue),
            Invalid::Contradiction(setting) => (4, setting, AbortCode::IncompatibleParameter),
        };
        let (lowest, highest) = setting.range().unwrap_or((f32::NAN, f32::NAN));
        let count = self.refusal.count.saturating_add(1);
        self.refusal = Refusal { count, index, sub, reason, lowest, highest, offered };
        code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings::new(storage::stamp(Configuration::DEFAULT, 5))
    }

    #[test]
    fn staged_settings_take_effect_together() {
        let mut settings = settings();
        settings.write(index::JUDGEMENT, 1, &[10]).unwrap();
        settings.write(index::JUDGEMENT, 4, &75_000.0f32.to_le_bytes()).unwrap();
        assert_eq!(settings.active().configuration, Configuration::DEFAULT);
        assert_eq!(settings.read(index::JUDGEMENT, 1), Some(Value::U8(10)));
        assert_eq!(settings.state(), 1);
        let applied = settings.apply().unwrap();
        assert_eq!(applied.revision, 6);
        assert_eq!(applied.configuration.region, Some(Region::Hand));
        assert_eq!(applied.hash, storage::hash(&applied.configuration));
        assert_eq!(settings.state(), 2, "to be stored");
        settings.mark_stored(6);
        assert_eq!(settings.state(), 0);
    }

    #[test]
    fn an_impossible_value_is_refused_at_once_with_its_range() {
        let mut settings = settings();
        let refused = settings.write(index::JUDGEMENT, 4, &500.0f32.to_le_bytes());
        assert_eq!(refused, Err(AbortCode::ValueTooLow));
        let expected = Refusal {
            count: 1,
            index: 0x2000,
            sub: 4,
            reason: 1,
            lowest: 1_000.0,
            highest: 1_000_000.0,
            offered: 500.0,
        };
        assert_eq!(settings.refusal(), expected);
        assert_eq!(settings.write(index::JUDGEMENT, 1, &[13]), Err(AbortCode::InvalidValue));
        assert_eq!(settings.write(index::JUDGEMENT, 1, &[1, 0]), Err(AbortCode::DataTypeMismatchLengthHigh));
        assert_eq!(settings.state(), 0, "nothing was staged");
    }

    #[test]
    fn a_contradiction_leaves_everything_as_it_was() {
        let mut settings = settings();
        settings.write(index::JUDGEMENT, 1, &[3]).unwrap();
        settings.write(index::CHAIN, 4, &40_000u16.to_le_bytes()).unwrap();
        assert_eq!(settings.apply(), Err(AbortCode::IncompatibleParameter));
        assert_eq!(settings.active(), storage::stamp(Configuration::DEFAULT, 5));
        assert_eq!((settings.refusal().index, settings.refusal().reason), (0x2003, 4));
        settings.discard();
        assert_eq!(settings.read(index::JUDGEMENT, 1), Some(Value::U8(0)));
    }

    #[test]
    fn every_setting_object_reads_back_what_was_written() {
        for object in super::super::object::OBJECTS.iter().filter(|object| (0x2000..=0x2004).contains(&object.index)) {
            for sub in object.subs {
                let mut settings = settings();
                let mut bytes = [0; 8];
                let value = settings.read(object.index, sub.sub).unwrap();
                let length = value.write_to(&mut bytes);
                assert_eq!(length, sub.size(), "{:#06X}:{}", object.index, sub.sub);
                settings.write(object.index, sub.sub, &bytes[..length]).unwrap();
                assert_eq!(settings.read(object.index, sub.sub), Some(value));
            }
        }
    }

    #[test]
    fn the_limits_that_are_published_are_those_that_are_enforced() {
        let bytes = |object: u16, sub: u8, value: f32| {
            let kind = super::super::object::find(object).and_then(|found| found.sub(sub)).unwrap();
            let mut bytes = [0; 4];
            match kind.size() {
                1 => bytes[0] = value as u8,
                2 => bytes[..2].copy_from_slice(&(value as u16).to_le_bytes()),
                _ if kind.kind == zencan_common::objects::DataType::UInt32 => {
                    bytes = (value as u32).to_le_bytes();
                }
                _ => bytes = value.to_le_bytes(),
            }
            std::vec::Vec::from(&bytes[..kind.size()])
        };
        let mut checked = 0;
        for object in super::super::object::OBJECTS.iter().filter(|object| (0x2000..=0x2004).contains(&object.index)) {
            for sub in object.subs {
                let Some((low, high)) = limits(object.index, sub.sub) else {
                    let mut settings = settings();
                    let _ = settings.write(object.index, sub.sub, &bytes(object.index, sub.sub, f32::MAX));
                    assert_ne!(settings.refusal().reason, 2, "{:#06X}:{} has a highest value", object.index, sub.sub);
                    continue;
                };
                checked += 1;
                for inside in [low, high] {
                    let written = settings().write(object.index, sub.sub, &bytes(object.index, sub.sub, inside));
                    assert_eq!(written, Ok(()), "{:#06X}:{} = {inside}", object.index, sub.sub);
                }
                // The next value above that the type has, if it has one.
                let above =
                    if sub.kind == zencan_common::objects::DataType::Real32 { high * 1.001 } else { high + 1.0 };
                if high < 65_535.0 || sub.size() == 4 {
                    let written = settings().write(object.index, sub.sub, &bytes(object.index, sub.sub, above));
                    assert!(written.is_err(), "{:#06X}:{} = {above}", object.index, sub.sub);
                }
            }
        }
        assert_eq!(checked, 16, "all settings but the codes and voltages of the chain, which limit one another");
    }

    #[test]
    fn an_lss_id_goes_past_an_open_transaction() {
        let mut settings = settings();
        settings.write(index::JUDGEMENT, 1, &[3]).unwrap();
        let applied = settings.assign_node_id(0x11).unwrap();
        assert_eq!((applied.configuration.node.node_id, applied.configuration.region), (0x11, None));
        assert_eq!(settings.apply().unwrap().configuration.region, Some(Region::Neck));
        assert_eq!(settings.active().configuration.node.node_id, 0x11);
    }
}
