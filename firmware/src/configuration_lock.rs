//! The lock on the configuration: without the key, reading works and writing is refused.
//!
//! ```text
//! change   counter UNSIGNED32 │ index UNSIGNED16, sub UNSIGNED8, value │ … │ tag 16 bytes     object 0x2012:3
//! tag      AES-128-CMAC(key, serial UNSIGNED32 ‖ counter ‖ settings)
//! ```
//!
//! CMAC: NIST SP 800-38B, RFC 4493. A change is all or nothing, for one device (its serial number) and once: its counter must be
//! above that of the last change that was properly signed, and the counter outlives the power. A value has as many bytes
//! as its object. The key is set by writing it to 0x2012:4 while nothing is locked, and replaced (or with zeros removed) by a
//! signed change that writes there. It then crosses the bus as it is: set it where nobody else listens. It cannot be read.
//!
//! What the lock is for: a robot cell's bus on which many can write. It does not hide anything, does not keep anybody from
//! disturbing the bus or resetting the node, and does not protect against somebody with a debug probe.

use aes::Aes128;
use cmac::{Cmac, KeyInit as _, Mac as _};

use crate::dictionary::{index, object};

/// Bytes of a key.
pub const KEY: usize = 16;
/// Bytes of a tag.
pub const TAG: usize = 16;
/// Bytes of a stored lock.
pub const RECORD: usize = 1 + 4 + 1 + KEY + 4;
/// Version of the stored layout.
const VERSION: u8 = 1;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// A key.
pub type Key = [u8; KEY];

/// Why a change is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejected {
    /// Shorter than a counter and a tag.
    TooShort,
    /// The tag is not that of this change, this device and this key; or there is no key.
    Tag,
    /// Properly signed, but not newer than the last one.
    Replayed,
    /// A setting that does not exist, or cut off.
    Settings,
}

/// The lock of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigurationLock {
    key: Option<Key>,
    counter: u32,
}

impl ConfigurationLock {
    /// As it leaves the factory.
    pub const OPEN: Self = Self { key: None, counter: 0 };

    /// Whether writing wants a key.
    #[must_use]
    pub fn is_locked(&self) -> bool {
        self.key.is_some()
    }

    /// Counter of the last change that was properly signed.
    #[must_use]
    pub fn counter(&self) -> u32 {
        self.counter
    }

    /// Sets a key, or with zeros removes it.
    pub fn set_key(&mut self, key: Key) {
        self.key = (key != [0; KEY]).then_some(key);
        // Among stored locks the one with the highest counter holds.
        self.counter = self.counter.saturating_add(1);
    }

    /// Checks a change against the key and the counter, which then counts as used; the settings in it.
    ///
    /// # Errors
    /// [`Rejected`]; nothing has changed then.
    pub fn accept<'a>(&mut self, serial: u32, change: &'a [u8]) -> Result<Settings<'a>, Rejected> {
        let (counter, rest) = change.split_first_chunk::<4>().ok_or(Rejected::TooShort)?;
        let (settings, given) = rest.split_last_chunk::<TAG>().ok_or(Rejected::TooShort)?;
        let counter = u32::from_le_bytes(*counter);
        let mac = mac(&self.key.ok_or(Rejected::Tag)?, serial, counter, settings);
        // In constant time, and the whole tag: nothing is learnt from how long it takes.
        mac.verify_slice(given).map_err(|_| Rejected::Tag)?;
        if counter <= self.counter {
            return Err(Rejected::Replayed);
        }
        self.counter = counter;
        Ok(Settings(settings))
    }

    /// As it is stored.
    #[must_use]
    pub fn encode(&self) -> [u8; RECORD] {
        let mut record = [0; RECORD];
        record[0] = VERSION;
        record[1..5].copy_from_slice(&self.counter.to_le_bytes());
        record[5] = u8::from(self.key.is_some());
        record[6..6 + KEY].copy_from_slice(&self.key.unwrap_or_default());
        let crc = CRC.checksum(&record[..RECORD - 4]);
        record[RECORD - 4..].copy_from_slice(&crc.to_le_bytes());
        record
    }

    /// Reads what was stored; `None` if it is no lock of this version.
    #[must_use]
    pub fn decode(record: &[u8]) -> Option<Self> {
        let record: &[u8; RECORD] = record.try_into().ok()?;
        let (content, crc) = record.split_last_chunk::<4>()?;
        if record[0] != VERSION || CRC.checksum(content) != u32::from_le_bytes(*crc) {
            return None;
        }
        let key = record[6..6 + KEY].try_into().ok()?;
        let counter = u32::from_le_bytes([record[1], record[2], record[3], record[4]]);
        Some(Self { key: (record[5] == 1).then_some(key), counter })
    }
}

fn mac(key: &Key, serial: u32, counter: u32, settings: &[u8]) -> Cmac<Aes128> {
    let mut mac = Cmac::<Aes128>::new(key.into());
    mac.update(&serial.to_le_bytes());
    mac.update(&counter.to_le_bytes());
    mac.update(settings);
    mac
}

/// The tag of a change, for whoever holds the key.
#[must_use]
pub fn tag(key: &Key, serial: u32, counter: u32, settings: &[u8]) -> [u8; TAG] {
    mac(key, serial, counter, settings).finalize().into_bytes().into()
}

/// Settings of an accepted change, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a>(&'a [u8]);

impl<'a> Iterator for Settings<'a> {
    type Item = Result<(u16, u8, &'a [u8]), Rejected>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let one = one(self.0);
        self.0 = one.map_or(&[], |(.., rest)| rest);
        Some(one.map(|(index, sub, value, _)| (index, sub, value)).ok_or(Rejected::Settings))
    }
}

fn one(settings: &[u8]) -> Option<(u16, u8, &[u8], &[u8])> {
    let ([low, high, sub], rest) = settings.split_first_chunk::<3>()?;
    let index = u16::from_le_bytes([*low, *high]);
    let size = match (index, *sub) {
        (index::LOCK, 4) => KEY,
        (index::JUDGEMENT..=index::NODE, sub) => object::find(index)?.sub(sub)?.size(),
        _ => return None,
    };
    let (value, rest) = rest.split_at_checked(size)?;
    Some((index, *sub, value, rest))
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const SERIAL: u32 = 77;
    const SECRET: Key = *b"a key of a test.";

    fn locked() -> ConfigurationLock {
        let mut lock = ConfigurationLock::OPEN;
        lock.set_key(SECRET);
        lock
    }

    fn change(key: &Key, serial: u32, counter: u32) -> Vec<u8> {
        let settings = [0x00, 0x20, 1, 5, 0x01, 0x20, 1, 0, 0, 0xC0, 0x40];
        let mut change = Vec::from(counter.to_le_bytes());
        change.extend(settings);
        change.extend(tag(key, serial, counter, &settings));
        change
    }

    #[test]
    fn cmac_is_that_of_rfc_4493() {
        let key = [0x2B, 0x7E, 0x15, 0x16, 0x28, 0xAE, 0xD2, 0xA6, 0xAB, 0xF7, 0x15, 0x88, 0x09, 0xCF, 0x4F, 0x3C];
        // Example 3, 40 bytes: the first eight stand in the places of serial number and counter.
        let message = [
            0x6B, 0xC1, 0xBE, 0xE2, 0x2E, 0x40, 0x9F, 0x96, 0xE9, 0x3D, 0x7E, 0x11, 0x73, 0x93, 0x17, 0x2A, 0xAE, 0x2D,
            0x8A, 0x57, 0x1E, 0x03, 0xAC, 0x9C, 0x9E, 0xB7, 0x6F, 0xAC, 0x45, 0xAF, 0x8E, 0x51, 0x30, 0xC8, 0x1C, 0x46,
            0xA3, 0x5C, 0xE4, 0x11,
        ];
        let wanted = [0xDF, 0xA6, 0x67, 0x47, 0xDE, 0x9A, 0xE6, 0x30, 0x30, 0xCA, 0x32, 0x61, 0x14, 0x97, 0xC8, 0x27];
        assert_eq!(tag(&key, 0xE2BE_C16B, 0x969F_402E, &message[8..]), wanted);
    }

    #[test]
    fn a_change_is_accepted_once() {
        let mut lock = locked();
        let change = change(&SECRET, SERIAL, 9);
        let settings: Result<Vec<_>, _> = lock.accept(SERIAL, &change).unwrap().collect();
        assert_eq!(settings.unwrap(), [(0x2000, 1, &[5][..]), (0x2001, 1, &[0, 0, 0xC0, 0x40][..])]);
        assert_eq!(lock.accept(SERIAL, &change).err(), Some(Rejected::Replayed));
        assert_eq!(lock.counter(), 9);
    }

    #[test]
    fn every_forgery_is_rejected_and_changes_nothing() {
        let good = change(&SECRET, SERIAL, 9);
        let mut forgeries: Vec<(Vec<u8>, Rejected)> =
            (0..good.len() * 8).map(|bit| (with_bit(&good, bit), Rejected::Tag)).collect();
        forgeries.push((change(&[1; KEY], SERIAL, 9), Rejected::Tag));
        forgeries.push((change(&SECRET, SERIAL + 1, 9), Rejected::Tag));
        for length in 0..good.len() {
            let truncated = if length < 4 + TAG { Rejected::TooShort } else { Rejected::Tag };
            forgeries.push((good[..length].to_vec(), truncated));
        }
        for (forgery, why) in forgeries {
            let mut lock = locked();
            assert_eq!(lock.accept(SERIAL, &forgery).err(), Some(why), "{forgery:02X?}");
            assert_eq!(lock, locked());
        }
        assert_eq!(
            ConfigurationLock::OPEN.clone().accept(SERIAL, &good).err(),
            Some(Rejected::Tag),
            "no key, no change"
        );
    }

    fn with_bit(change: &[u8], bit: usize) -> Vec<u8> {
        let mut change = change.to_vec();
        change[bit / 8] ^= 1 << (bit % 8);
        change
    }

    #[test]
    fn a_stored_lock_comes_back_and_a_damaged_one_does_not() {
        for lock in [ConfigurationLock::OPEN, locked()] {
            let record = lock.encode();
            assert_eq!(ConfigurationLock::decode(&record), Some(lock));
            for bit in 0..record.len() * 8 {
                assert_eq!(ConfigurationLock::decode(&with_bit(&record, bit)), None);
            }
        }
    }

    #[test]
    fn settings_that_do_not_exist_or_are_cut_off_end_the_list() {
        for settings in [&[0x00, 0x20][..], &[0x00, 0x20, 9, 1], &[0x18, 0x10, 1, 0, 0, 0, 0], &[0x01, 0x20, 1, 0, 0]] {
            let found: Vec<_> = Settings(settings).collect();
            assert_eq!(found, [Err(Rejected::Settings)]);
        }
    }
}
