//! A whole event as bytes, as 0x2200:5 gives it: fixed layout, versioned, with a CRC.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | version of this layout, 1 |
//! | 1 | u8 | contact: 0 the blow, n its n-th rebound |
//! | 2 | u16 | flags |
//! | 4 | u32 | number |
//! | 8 | u32 | impact |
//! | 12 | u8 | verdict |
//! | 13 | u8 | 0 |
//! | 14 | u16 | start of the board it was sensed in (0x2402:6), low 16 bits; 0 unknown |
//! | 16 | u64 | contact instant, whole samples |
//! | 24 | u64 | peak instant, whole samples |
//! | 32 | f32 | contact instant, fraction of a sample |
//! | 36 | f32 | peak instant, fraction |
//! | 40 | f32 | raw peak, N |
//! | 44 | f32 | peak, N |
//! | 48 | f32 | impulse, N·s |
//! | 52 | f32 | duration, s |
//! | 56 | f32 | noise, N |
//! | 60 | f32 | transient force, N |
//! | 64 | f32 | scaling S |
//! | 68 | f32 | scaled force, N |
//! | 72 | f32 | quasi-static force, N; NaN none |
//! | 76 | f32 | transient limit, N; NaN none |
//! | 80 | f32 | quasi-static limit, N; NaN none |
//! | 84 | f32 | effective mass, kg; NaN none |
//! | 88 | u32 | age of the mass, ms; 0xFFFFFFFF none |
//! | 92 | f32 | expanded uncertainty, N |
//! | 96 | f32 | stroke, m |
//! | 100 | f32 | energy, J |
//! | 104 | u32 | configuration revision |
//! | 108 | u32 | configuration hash |
//! | 112 | u32 | CRC-32 (ISO-HDLC) of bytes 0 to 111 |
//!
//! All little-endian.

use crate::event::{Event, Flags, Severity, Verdict};
use crate::units::{Joule, Kilogram, Metre, Newton, NewtonSecond, SampleInstant, Second};

/// Bytes of a record.
pub const LENGTH: usize = 116;
/// Version of the layout.
pub const VERSION: u8 = 1;

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
const NO_AGE: u32 = u32::MAX;

/// Bytes are not such a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Malformed {
    /// A record has [`LENGTH`] bytes, these were as many.
    Length(usize),
    /// This version is not known here.
    Version(u8),
    /// The CRC does not fit.
    Crc,
    /// The verdict has a number that no verdict has.
    Verdict(u8),
    /// A flag is set that is not known here.
    Flags(u16),
}

impl core::fmt::Display for Malformed {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length(found) => write!(f, "the event record has {found} bytes instead of {LENGTH}"),
            Self::Version(found) => write!(f, "the event record has version {found}, only {VERSION} can be read"),
            Self::Crc => f.write_str("the event record's CRC does not fit its bytes"),
            Self::Verdict(number) => write!(f, "the event record has verdict {number}; 0 to 3 exist"),
            Self::Flags(bits) => write!(f, "the event record has unknown flags 0x{bits:04X}"),
        }
    }
}

impl core::error::Error for Malformed {}

struct Writer {
    bytes: [u8; LENGTH],
    at: usize,
}

impl Writer {
    fn put(&mut self, bytes: &[u8]) {
        self.bytes[self.at..self.at + bytes.len()].copy_from_slice(bytes);
        self.at += bytes.len();
    }

    fn f32(&mut self, value: f32) {
        self.put(&value.to_le_bytes());
    }

    fn u32(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }
}

/// The event's record; `start` counts the starts of the board, because numbers begin anew with each.
#[must_use]
pub fn encode(event: &Event, start: u32) -> [u8; LENGTH] {
    let severity = &event.severity;
    let newtons = |force: Option<Newton>| force.map_or(f32::NAN, |force| force.0);
    let mut to = Writer { bytes: [0; LENGTH], at: 0 };
    to.put(&[VERSION, event.contact]);
    to.put(&event.flags.bits().to_le_bytes());
    to.u32(event.number);
    to.u32(event.impact);
    let [low, high, ..] = start.to_le_bytes();
    to.put(&[severity.verdict as u8, 0, low, high]);
    to.put(&event.contact_instant.index.to_le_bytes());
    to.put(&event.peak_instant.index.to_le_bytes());
    to.f32(event.contact_instant.fraction);
    to.f32(event.peak_instant.fraction);
    to.f32(event.raw_peak.0);
    to.f32(event.peak.0);
    to.f32(event.impulse.0);
    to.f32(event.duration.0);
    to.f32(event.noise.0);
    to.f32(severity.transient.0);
    to.f32(severity.scaling);
    to.f32(severity.scaled.0);
    to.f32(newtons(severity.quasi_static));
    to.f32(newtons(severity.transient_limit));
    to.f32(newtons(severity.quasi_static_limit));
    to.f32(severity.effective_mass.map_or(f32::NAN, |mass| mass.0));
    to.u32(severity.effective_mass_age_ms.unwrap_or(NO_AGE));
    to.f32(severity.expanded_uncertainty.0);
    to.f32(severity.stroke.0);
    to.f32(severity.energy.0);
    to.u32(event.configuration_revision);
    to.u32(event.configuration_hash);
    let crc = CRC.checksum(&to.bytes[..LENGTH - 4]);
    to.u32(crc);
    to.bytes
}

/// Reads a record.
///
/// # Errors
/// [`Malformed`] says what is wrong with it.
pub fn decode(bytes: &[u8]) -> Result<Event, Malformed> {
    let bytes: &[u8; LENGTH] = bytes.try_into().map_err(|_| Malformed::Length(bytes.len()))?;
    if bytes[0] != VERSION {
        return Err(Malformed::Version(bytes[0]));
    }
    let four = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
    let u32_at = |at: usize| u32::from_le_bytes(four(at));
    let f32_at = |at: usize| f32::from_le_bytes(four(at));
    let u64_at = |at: usize| u64::from(u32_at(at)) | u64::from(u32_at(at + 4)) << 32;
    let newtons = |at: usize| Some(f32_at(at)).filter(|force| !force.is_nan()).map(Newton);
    if CRC.checksum(&bytes[..LENGTH - 4]) != u32_at(LENGTH - 4) {
        return Err(Malformed::Crc);
    }
    let flags = u16::from_le_bytes([bytes[2], bytes[3]]);
    Ok(Event {
        number: u32_at(4),
        impact: u32_at(8),
        contact: bytes[1],
        flags: Flags::from_bits(flags).ok_or(Malformed::Flags(flags))?,
        contact_instant: SampleInstant { index: u64_at(16), fraction: f32_at(32) },
        peak_instant: SampleInstant { index: u64_at(24), fraction: f32_at(36) },
        raw_peak: Newton(f32_at(40)),
        peak: Newton(f32_at(44)),
        impulse: NewtonSecond(f32_at(48)),
        duration: Second(f32_at(52)),
        noise: Newton(f32_at(56)),
        severity: Severity {
            verdict: Verdict::from_number(bytes[12]).ok_or(Malformed::Verdict(bytes[12]))?,
            transient: Newton(f32_at(60)),
            scaling: f32_at(64),
            scaled: Newton(f32_at(68)),
            quasi_static: newtons(72),
            transient_limit: newtons(76),
            quasi_static_limit: newtons(80),
            effective_mass: newtons(84).map(|mass| Kilogram(mass.0)),
            effective_mass_age_ms: Some(u32_at(88)).filter(|age| *age != NO_AGE),
            expanded_uncertainty: Newton(f32_at(92)),
            stroke: Metre(f32_at(96)),
            energy: Joule(f32_at(100)),
        },
        configuration_revision: u32_at(104),
        configuration_hash: u32_at(108),
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn event(seed: f32, some: bool) -> Event {
        Event {
            number: 0x0102_0304,
            impact: 77,
            contact: 3,
            flags: Flags::REBOUND | Flags::SHORT_PULSE,
            contact_instant: SampleInstant { index: 1 << 40 | 5, fraction: 0.25 },
            peak_instant: SampleInstant { index: 1 << 40 | 99, fraction: 0.75 },
            raw_peak: Newton(seed),
            peak: Newton(seed * 0.9),
            impulse: NewtonSecond(seed * 0.01),
            duration: Second(0.02),
            noise: Newton(0.3),
            severity: Severity {
                verdict: Verdict::Fail,
                transient: Newton(seed),
                scaling: 0.9,
                scaled: Newton(seed * 0.9),
                quasi_static: some.then_some(Newton(1.0)),
                transient_limit: some.then_some(Newton(280.0)),
                quasi_static_limit: some.then_some(Newton(140.0)),
                effective_mass: some.then_some(Kilogram(4.5)),
                effective_mass_age_ms: some.then_some(12),
                expanded_uncertainty: Newton(3.0),
                stroke: Metre(0.01),
                energy: Joule(1.5),
            },
            configuration_revision: 9,
            configuration_hash: 0xDEAD_BEEF,
        }
    }

    #[test]
    fn the_layout_is_as_documented() {
        let record = encode(&event(250.0, true), 0x1_0203);
        assert_eq!(record[0], VERSION);
        assert_eq!(record[14..16], [0x03, 0x02]);
        assert_eq!(record[4..8], 0x0102_0304u32.to_le_bytes());
        assert_eq!(record[40..44], 250.0f32.to_le_bytes());
        assert_eq!(record[84..88], 4.5f32.to_le_bytes());
        assert_eq!(record[108..112], 0xDEAD_BEEFu32.to_le_bytes());
    }

    proptest! {
        #[test]
        fn a_record_comes_back_whole(seed in -1e6f32..1e6, some in any::<bool>()) {
            let event = event(seed, some);
            prop_assert_eq!(decode(&encode(&event, 3)), Ok(event));
        }

        #[test]
        fn one_wrong_bit_is_seen(at in 0usize..LENGTH * 8) {
            let mut record = encode(&event(250.0, true), 0x1_0203);
            record[at / 8] ^= 1 << (at % 8);
            prop_assert!(decode(&record).is_err());
        }

        #[test]
        fn no_bytes_make_the_decoder_panic(bytes in prop::collection::vec(any::<u8>(), 0..130)) {
            let _ = decode(&bytes);
        }
    }
}
