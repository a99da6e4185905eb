//! The configuration of a sensor over the bus: read as a whole, changed as a whole.
//!
//! ```text
//! discard ─▶ write each changed setting (staged) ─▶ apply ─▶ read back
//!                    │ refused                        │ refused
//!                    └──────▶ why? (0x2011) ─▶ discard ◀┘      the sensor goes on with what it had
//! ```
//!
//! The sensor is the judge: values go to it as they were typed, and what it refuses comes back as a sentence with
//! the range that it permits.

use std::time::Duration;

use serde::Serialize;
use thud_firmware::configuration::{Configuration, ContactKind, FilterProfile};
use thud_firmware::configuration_lock::{self, Key};
use thud_firmware::dictionary::{APPLY, DISCARD, index};
use thud_firmware::limits::{LimitsProfile, Region};
use thud_firmware::units::{Hertz, Kilogram, Newton, NewtonPerMetre, Second, Volt};

use super::sdo::{Sdo, SdoError};
use super::{Client, ClientError, Nmt};
use crate::settings::CHAIN_RANGE;

/// A setting's value as its object holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Raw {
    /// UNSIGNED8.
    U8(u8),
    /// UNSIGNED16.
    U16(u16),
    /// UNSIGNED32.
    U32(u32),
    /// REAL32.
    F32(f32),
}

impl Raw {
    fn number(self) -> f32 {
        match self {
            Self::U8(value) => value.into(),
            Self::U16(value) => value.into(),
            Self::U32(value) => value as f32,
            Self::F32(value) => value,
        }
    }

    /// Reads an object of the same type.
    fn read_alike(self, sdo: &mut Sdo<'_>, index: u16, sub: u8) -> Result<Self, SdoError> {
        Ok(match self {
            Self::U8(_) => Self::U8(sdo.read(index, sub)?),
            Self::U16(_) => Self::U16(sdo.read(index, sub)?),
            Self::U32(_) => Self::U32(sdo.read(index, sub)?),
            Self::F32(_) => Self::F32(sdo.read(index, sub)?),
        })
    }

    fn append_to(self, bytes: &mut Vec<u8>) {
        match self {
            Self::U8(value) => bytes.push(value),
            Self::U16(value) => bytes.extend(value.to_le_bytes()),
            Self::U32(value) => bytes.extend(value.to_le_bytes()),
            Self::F32(value) => bytes.extend(value.to_le_bytes()),
        }
    }

    fn write(self, sdo: &mut Sdo<'_>, index: u16, sub: u8) -> Result<(), SdoError> {
        match self {
            Self::U8(value) => sdo.write(index, sub, value),
            Self::U16(value) => sdo.write(index, sub, value),
            Self::U32(value) => sdo.write(index, sub, value),
            Self::F32(value) => sdo.write(index, sub, value),
        }
    }
}

/// One setting: its object, and how it is shown.
pub struct Item {
    /// Name, for a person and in JSON.
    pub name: &'static str,
    /// Index of its object.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// Unit in which it is shown.
    pub unit: &'static str,
    /// The value in a configuration.
    pub get: fn(&Configuration) -> Raw,
    /// Puts a value into a configuration; `None` if it is none of the choices.
    set: fn(&mut Configuration, Raw) -> Option<()>,
    /// The name of a choice.
    choice: Option<fn(u8) -> Option<&'static str>>,
}

impl Item {
    /// The value with its unit, or the name of the choice.
    #[must_use]
    pub fn show(&self, raw: Raw) -> String {
        if let (Some(choice), Raw::U8(number)) = (self.choice, raw) {
            return choice(number).map_or_else(|| number.to_string(), str::to_owned);
        }
        if self.is_mass() && raw.number() == 0.0 {
            return "unknown".to_owned();
        }
        self.with_unit(raw.number())
    }

    fn is_mass(&self) -> bool {
        (self.index, self.sub) == (index::MASS_SETTINGS, 1)
    }

    fn with_unit(&self, value: f32) -> String {
        let shown = shortest(value);
        if self.unit.is_empty() { shown } else { format!("{shown} {}", self.unit) }
    }
}

/// A number in six digits, which is what REAL32 holds.
fn shortest(value: f32) -> String {
    let rounded: f32 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded != 0.0 && (rounded.abs() < 1e-4 || rounded.abs() >= 1e7) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

/// A setting that is a number.
macro_rules! number {
    ($name:literal, $index:ident : $sub:literal, $unit:literal, $raw:ident, $($path:ident).+ $(, $wrap:ident)?) => {
        Item {
            name: $name,
            index: index::$index,
            sub: $sub,
            unit: $unit,
            get: |c| Raw::$raw(number!(@get c.$($path).+ $(, $wrap)?)),
            set: |c, raw| {
                let Raw::$raw(value) = raw else { return None };
                c.$($path).+ = number!(@wrap value $(, $wrap)?);
                Some(())
            },
            choice: None,
        }
    };
    (@get $value:expr) => { $value };
    (@get $value:expr, $wrap:ident) => { $value.0 };
    (@wrap $value:expr) => { $value };
    (@wrap $value:expr, $wrap:ident) => { $wrap($value) };
}

/// A setting that is one of some choices.
macro_rules! choice {
    ($name:literal, $index:ident : $sub:literal, $get:expr, $set:expr, $names:expr) => {
        Item {
            name: $name,
            index: index::$index,
            sub: $sub,
            unit: "",
            get: |c| Raw::U8($get(c)),
            set: |c, raw| {
                let Raw::U8(number) = raw else { return None };
                $set(c, number)
            },
            choice: Some($names),
        }
    };
}

fn contact_from(number: u8) -> Option<ContactKind> {
    [ContactKind::Free, ContactKind::Clamped].into_iter().find(|contact| *contact as u8 == number)
}

/// Every setting, in the order of the dictionary.
pub static ITEMS: [Item; 21] = [
    choice!(
        "region",
        JUDGEMENT: 1,
        |c: &Configuration| c.region.map_or(0, |region| region as u8),
        |c: &mut Configuration, number| {
            c.region = if number == 0 { None } else { Some(Region::from_number(number)?) };
            Some(())
        },
        |number| if number == 0 { Some("none") } else { Region::from_number(number).map(Region::name) }
    ),
    choice!(
        "contact",
        JUDGEMENT: 2,
        |c: &Configuration| c.contact as u8,
        |c: &mut Configuration, number| { c.contact = contact_from(number)?; Some(()) },
        |number| contact_from(number).map(crate::settings::contact_word)
    ),
    choice!(
        "limits",
        JUDGEMENT: 3,
        |c: &Configuration| c.limits as u8,
        |c: &mut Configuration, number| { c.limits = LimitsProfile::from_number(number)?; Some(()) },
        |number| LimitsProfile::from_number(number).map(LimitsProfile::name)
    ),
    number!("body stiffness", JUDGEMENT: 4, "N/m", F32, body_stiffness, NewtonPerMetre),
    choice!(
        "filter",
        JUDGEMENT: 5,
        |c: &Configuration| c.filter as u8,
        |c: &mut Configuration, number| { c.filter = FilterProfile::from_number(number)?; Some(()) },
        |number| FilterProfile::from_number(number).map(FilterProfile::name)
    ),
    number!("relative uncertainty", JUDGEMENT: 6, "", F32, relative_uncertainty),
    Item {
        name: "effective mass",
        index: index::MASS_SETTINGS,
        sub: 1,
        unit: "kg",
        get: |c| Raw::F32(c.effective_mass.map_or(0.0, |mass| mass.0)),
        set: |c, raw| {
            let Raw::F32(mass) = raw else { return None };
            c.effective_mass = (mass != 0.0).then_some(Kilogram(mass));
            Some(())
        },
        choice: None,
    },
    number!("longest age of a received mass", MASS_SETTINGS: 2, "ms", U32, effective_mass_max_age_ms),
    number!("onset multiple", DETECTION: 1, "times the noise", F32, onset_multiple),
    number!("onset minimum", DETECTION: 2, "N", F32, onset_minimum, Newton),
    number!("sample rate", CHAIN: 1, "Hz", F32, chain.sample_rate, Hertz),
    number!("force per code", CHAIN: 2, "N", F32, chain.newton_per_code),
    number!("zero code", CHAIN: 3, "", U16, chain.zero_code),
    number!("clip low", CHAIN: 4, "", U16, chain.clip_low),
    number!("clip high", CHAIN: 5, "", U16, chain.clip_high),
    number!("time constant", CHAIN: 6, "s", F32, chain.time_constant, Second),
    number!("bias low", CHAIN: 7, "V", F32, chain.bias_low, Volt),
    number!("bias high", CHAIN: 8, "V", F32, chain.bias_high, Volt),
    number!("delay", CHAIN: 9, "s", F32, chain.delay, Second),
    number!("node id", NODE: 1, "", U8, node.node_id),
    number!("heartbeat", NODE: 2, "ms", U16, node.heartbeat_ms),
];

/// The configuration that is in force, and its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Active {
    /// Its values.
    pub configuration: Configuration,
    /// Counts up with each applied configuration.
    pub revision: u32,
    /// Its hash.
    pub hash: u32,
}

/// One line of what a configuration changed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Name of the setting.
    pub setting: &'static str,
    /// Value before, with its unit.
    pub old: String,
    /// Value after.
    pub new: String,
}

/// What a configuration did.
#[derive(Clone, Debug)]
pub struct Configured {
    /// Before.
    pub before: Active,
    /// After, as read back.
    pub after: Active,
    /// Settings that differ.
    pub changes: Vec<Change>,
    /// Somebody had written settings and not applied them; they were discarded first.
    pub discarded_foreign: bool,
    /// It was armed (Operational): it was disarmed for the change and armed again.
    pub disarmed: bool,
    /// It is also in flash.
    pub stored: bool,
}

/// What to set, as typed: values go to the sensor unjudged.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    values: Vec<(&'static str, Raw)>,
}

impl Wanted {
    /// Adds a setting by its name in [`ITEMS`].
    pub fn set(&mut self, name: &'static str, raw: Raw) {
        self.values.push((name, raw));
    }

    /// The settings that differ from those in force, as a signed change carries them.
    fn signed_settings(&self, before: &Active) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (name, raw) in &self.values {
            let Some(item) = ITEMS.iter().find(|item| item.name == *name) else { continue };
            if (item.get)(&before.configuration) != *raw {
                bytes.extend(item.index.to_le_bytes());
                bytes.push(item.sub);
                raw.append_to(&mut bytes);
            }
        }
        bytes
    }

    /// Whether there is nothing to set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// CiA 301, "because of the present device state": the sensor is Operational.
const ARMED: u32 = 0x0800_0022;
/// CiA 301, "because of local control": the sensor wants its key.
const LOCKED: u32 = 0x0800_0021;

/// Bits of 0x2010:2.
const STAGED: u8 = 1;
const NOT_STORED: u8 = 2;
/// Flash is written between impacts; erasing a page takes about 25 ms.
const STORING: Duration = Duration::from_secs(3);

impl Client {
    /// The configuration of a node.
    ///
    /// # Errors
    /// [`ClientError::Sdo`]; a choice that this version does not know counts as a damaged transfer.
    pub fn read_configuration(&mut self, node: u8) -> Result<Active, ClientError> {
        let mut configuration = Configuration::DEFAULT;
        let mut sdo = self.sdo(node);
        for item in &ITEMS {
            let raw = (item.get)(&Configuration::DEFAULT).read_alike(&mut sdo, item.index, item.sub)?;
            (item.set)(&mut configuration, raw).ok_or_else(|| SdoError::Torn {
                node,
                index: item.index,
                sub: item.sub,
                what: format!("{} {raw:?} is not known to this version", item.name),
            })?;
        }
        let revision = sdo.read(index::TRANSACTION, 3)?;
        let hash = sdo.read(index::TRANSACTION, 4)?;
        Ok(Active { configuration, revision, hash })
    }

    /// Changes settings of a node, all or none, and reads back what is then in force. An armed sensor is disarmed (made
    /// Pre-operational) for it and armed again, whatever becomes of the change. With a key the change is signed.
    ///
    /// # Errors
    /// [`ClientError::Refused`] with the range that is permitted; then nothing was changed. [`ClientError::Locked`].
    pub fn configure(&mut self, node: u8, wanted: &Wanted, key: Option<&Key>) -> Result<Configured, ClientError> {
        self.disarmed(node, |client| client.configure_disarmed(node, wanted, key))
            .map(|(configured, disarmed)| Configured { disarmed, ..configured })
    }

    /// Locks the configuration of a node with a key; with another one in force, that one has to be given. `None` as the new key
    /// unlocks. Returns whether the sensor was disarmed for it.
    ///
    /// # Errors
    /// [`ClientError::Locked`].
    pub fn lock(&mut self, node: u8, new: Option<&Key>, key: Option<&Key>) -> Result<bool, ClientError> {
        let new = new.copied().unwrap_or_default();
        let write = |client: &mut Self| {
            if client.is_locked(node)? {
                let mut settings = index::LOCK.to_le_bytes().to_vec();
                settings.push(4);
                settings.extend(new);
                return client.write_signed(node, &settings, key);
            }
            let written = client.sdo(node).download(index::LOCK, 4, &new);
            client.explained(node, written, None)
        };
        self.disarmed(node, write).map(|((), disarmed)| disarmed)
    }

    /// Does what an armed sensor refuses: disarms it if it has to be, and arms it again. Returns whether it had to be.
    fn disarmed<T>(
        &mut self,
        node: u8,
        mut change: impl FnMut(&mut Self) -> Result<T, ClientError>,
    ) -> Result<(T, bool), ClientError> {
        match change(self) {
            Err(ClientError::Armed { .. }) => {}
            other => return other.map(|done| (done, false)),
        }
        self.nmt(Nmt::PreOperational, node)?;
        let done = change(self);
        self.nmt(Nmt::Start, node)?;
        done.map(|done| (done, true))
    }

    fn is_locked(&mut self, node: u8) -> Result<bool, ClientError> {
        Ok(self.sdo(node).read::<u8>(index::LOCK, 1)? != 0)
    }

    fn configure_disarmed(&mut self, node: u8, wanted: &Wanted, key: Option<&Key>) -> Result<Configured, ClientError> {
        let discarded_foreign = self.sdo(node).read::<u8>(index::TRANSACTION, 2)? & STAGED != 0;
        if discarded_foreign {
            let discarded = self.sdo(node).write(index::TRANSACTION, 1, DISCARD);
            self.explained(node, discarded, None)?;
        }
        let before = self.read_configuration(node)?;

        if self.is_locked(node)? {
            let settings = wanted.signed_settings(&before);
            if !settings.is_empty() {
                self.write_signed(node, &settings, key)?;
            }
        } else if let Err(error) = self.stage_and_apply(node, wanted, &before) {
            // Whatever was staged goes; where the bus itself failed, the sensor still has its old configuration.
            let _ = self.sdo(node).write(index::TRANSACTION, 1, DISCARD);
            return Err(error);
        }

        let deadline = self.line.now() + STORING;
        let mut stored = false;
        while !stored && self.line.now() < deadline {
            let state: u8 = self.sdo(node).read(index::TRANSACTION, 2)?;
            stored = state & NOT_STORED == 0;
            if !stored {
                self.line.listen(Duration::from_millis(20))?;
            }
        }
        let after = self.read_configuration(node)?;
        let changes = ITEMS
            .iter()
            .filter_map(|item| {
                let (old, new) = ((item.get)(&before.configuration), (item.get)(&after.configuration));
                (old != new).then(|| Change { setting: item.name, old: item.show(old), new: item.show(new) })
            })
            .collect();
        Ok(Configured { before, after, changes, discarded_foreign, disarmed: false, stored })
    }

    fn stage_and_apply(&mut self, node: u8, wanted: &Wanted, before: &Active) -> Result<(), ClientError> {
        let mut different = false;
        for (name, raw) in &wanted.values {
            let Some(item) = ITEMS.iter().find(|item| item.name == *name) else { continue };
            if (item.get)(&before.configuration) == *raw {
                continue;
            }
            different = true;
            let written = raw.write(&mut self.sdo(node), item.index, item.sub);
            self.explained(node, written, Some((item, *raw)))?;
        }
        if different {
            let applied = self.sdo(node).write(index::TRANSACTION, 1, APPLY);
            self.explained(node, applied, None)?;
        }
        Ok(())
    }

    /// One change, signed with the key and the next counter.
    fn write_signed(&mut self, node: u8, settings: &[u8], key: Option<&Key>) -> Result<(), ClientError> {
        let key = key.ok_or(ClientError::Locked { node, why: "and no key was given" })?;
        let serial: u32 = self.sdo(node).read(index::IDENTITY, 4)?;
        let counter = self.sdo(node).read::<u32>(index::LOCK, 2)?.saturating_add(1);
        let mut change = counter.to_le_bytes().to_vec();
        change.extend(settings);
        change.extend(configuration_lock::tag(key, serial, counter, settings));
        let written = self.sdo(node).download(index::LOCK, 3, &change);
        match self.explained(node, written, None) {
            // Its answer was lost and it was asked again: then it had been taken, and the counter says so.
            Err(ClientError::Locked { .. }) if self.sdo(node).read::<u32>(index::LOCK, 2)? == counter => Ok(()),
            Err(ClientError::Locked { node, .. }) => Err(ClientError::Locked { node, why: "and this is not its key" }),
            other => other,
        }
    }

    /// A refusal becomes a sentence with what is permitted.
    fn explained(
        &mut self,
        node: u8,
        result: Result<(), SdoError>,
        written: Option<(&Item, Raw)>,
    ) -> Result<(), ClientError> {
        match result {
            Ok(()) => Ok(()),
            Err(SdoError::Aborted { code: ARMED, .. }) => Err(ClientError::Armed { node }),
            Err(SdoError::Aborted { code: LOCKED, .. }) => Err(ClientError::Locked { node, why: "by a key" }),
            Err(error @ SdoError::Aborted { .. }) => {
                let sentence = match self.refusal(node, written) {
                    Some(sentence) => format!("{sentence}, SDO abort {:08X}h)", error.abort_code().unwrap_or_default()),
                    None => error.to_string(),
                };
                Err(ClientError::Refused { sentence })
            }
            Err(other) => Err(other.into()),
        }
    }

    /// The last refusal as the node tells it; `None` where it has nothing to say about this setting.
    fn refusal(&mut self, node: u8, written: Option<(&Item, Raw)>) -> Option<String> {
        let mut sdo = self.sdo(node);
        let object: u32 = sdo.read(index::REFUSAL, 2).ok()?;
        let reason: u8 = sdo.read(index::REFUSAL, 3).ok()?;
        let lowest: f32 = sdo.read(index::REFUSAL, 4).ok()?;
        let highest: f32 = sdo.read(index::REFUSAL, 5).ok()?;
        let offered: f32 = sdo.read(index::REFUSAL, 6).ok()?;
        let (index, sub) = ((object >> 8) as u16, object as u8);
        if let Some((item, _)) = written
            && (item.index, item.sub) != (index, sub)
        {
            return None;
        }
        let item = ITEMS.iter().find(|item| (item.index, item.sub) == (index, sub))?;
        Some(refusal_sentence(node, item, reason, lowest, highest, offered))
    }
}

/// The sensor's refusal in words, up to where the abort code belongs.
fn refusal_sentence(node: u8, item: &Item, reason: u8, lowest: f32, highest: f32, offered: f32) -> String {
    let permitted = if lowest.is_finite() && highest.is_finite() && lowest <= highest && highest > 0.0 {
        let zero = if item.is_mass() { "0 (unknown) or " } else { "" };
        format!("{zero}{} to {} is permitted", shortest(lowest), item.with_unit(highest))
    } else {
        "it contradicts the other settings".to_owned()
    };
    let offered = item.choice.map_or_else(|| item.with_unit(offered), |_| format!("{offered}"));
    let name = item.name;
    let object = format!("object 0x{:04X}:{}, node {node}", item.index, item.sub);
    match reason {
        1 => format!("{name} {offered} is too low: {permitted} ({object}"),
        2 => format!("{name} {offered} is too high: {permitted} ({object}"),
        3 => format!("{name} {offered} does not exist: {permitted} ({object}"),
        // The codes and the bias are one setting to the sensor: it names the first of them.
        4 if item.index == index::CHAIN && item.sub != 1 => {
            format!("the settings of the chain contradict each other: {CHAIN_RANGE} ({object}")
        }
        4 if item.index == index::CHAIN => format!(
            "sample rate {offered} is too low for the filter: at least ten times the filter's corner is needed ({object}"
        ),
        4 => format!("{name} {offered} contradicts the other settings ({object}"),
        other => format!("{name} {offered} is refused for reason {other}: {permitted} ({object}"),
    }
}

#[cfg(test)]
mod tests {
    use thud_firmware::dictionary::object::OBJECTS;
    use zencan_common::objects::DataType;

    use super::*;

    fn item(name: &str) -> &'static Item {
        ITEMS.iter().find(|item| item.name == name).unwrap()
    }

    #[test]
    fn every_setting_of_the_dictionary_is_here_with_its_type() {
        let settings = OBJECTS.iter().filter(|object| (0x2000..0x2010).contains(&object.index));
        let subs: Vec<_> = settings.flat_map(|object| object.subs.iter().map(move |sub| (object.index, sub))).collect();
        assert_eq!(subs.len(), ITEMS.len());
        for ((index, sub), item) in subs.iter().zip(&ITEMS) {
            assert_eq!((*index, sub.sub), (item.index, item.sub), "{}", item.name);
            let kind = match (item.get)(&Configuration::DEFAULT) {
                Raw::U8(_) => DataType::UInt8,
                Raw::U16(_) => DataType::UInt16,
                Raw::U32(_) => DataType::UInt32,
                Raw::F32(_) => DataType::Real32,
            };
            assert_eq!(kind, sub.kind, "{}", item.name);
        }
    }

    #[test]
    fn what_is_set_is_got_again() {
        for item in &ITEMS {
            let mut configuration = Configuration::DEFAULT;
            let other = match (item.get)(&configuration) {
                Raw::U8(_) => Raw::U8(1),
                Raw::U16(value) => Raw::U16(value + 1),
                Raw::U32(value) => Raw::U32(value + 1),
                Raw::F32(value) => Raw::F32(value + 1.0),
            };
            (item.set)(&mut configuration, other).expect(item.name);
            assert_eq!((item.get)(&configuration), other, "{}", item.name);
        }
    }

    #[test]
    fn a_choice_that_does_not_exist_is_refused() {
        let mut configuration = Configuration::DEFAULT;
        assert_eq!((item("region").set)(&mut configuration, Raw::U8(13)), None);
        assert_eq!(configuration, Configuration::DEFAULT);
    }

    #[test]
    fn values_are_shown_in_the_units_of_the_field() {
        assert_eq!(item("body stiffness").show(Raw::F32(25_000.0)), "25000 N/m");
        assert_eq!(item("relative uncertainty").show(Raw::F32(0.03)), "0.03");
        assert_eq!(item("effective mass").show(Raw::F32(0.0)), "unknown");
        assert_eq!(item("region").show(Raw::U8(5)), "chest");
        assert_eq!(item("filter").show(Raw::U8(0)), "iso-pas-5672");
    }

    #[test]
    fn a_refusal_says_what_is_permitted() {
        let sentence = refusal_sentence(32, item("body stiffness"), 1, 1e3, 1e6, 5.0);
        assert_eq!(
            sentence,
            "body stiffness 5 N/m is too low: 1000 to 1000000 N/m is permitted (object 0x2000:4, node 32"
        );
        let sentence = refusal_sentence(32, item("effective mass"), 2, 0.05, 1e3, 2e3);
        assert!(sentence.contains("0 (unknown) or 0.05 to 1000 kg is permitted"), "{sentence}");
    }
}
