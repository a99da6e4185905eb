//! What the PDOs carry, in both directions: the firmware encodes, the host decodes, from this one file.
//!
//! ```text
//! byte        0        1        2        3        4        5        6        7
//! alarm       impact   flags    force 0.1 N       index of the sample (low 32 bits)
//! forecast    impact   flags    peak 0.1 N        bound 0.1 N       samples since onset
//! judgement   number            verdict  out of   flags             scaled 0.1 N
//!                                        range
//! force       number            peak 0.1 N        raw peak 0.1 N    impulse mN·s
//! instant     number            contact  fraction index of the contact (low 32 bits)
//!                                        1/256
//! course      number            duration 0.1 ms   to peak 0.01 ms   quasi-static 0.1 N
//! mass        number            impact            mass 0.02 kg      age ms
//! effective   mass kg (REAL32)                    sequence
//! mass (RPDO)
//! ```
//!
//! All little-endian. The five parts of an event share the low 16 bits of its number, so that a lost part is seen
//! and the event can be read from the log. A value beyond its field's range is sent as the nearest end of
//! the range, never wrapped, and its bit in [`Saturated`] is set. 0xFFFF where the table says so means "none", and the
//! largest number of such a field is 0xFFFE.

use crate::event::{Event, Flags, Onset, Verdict};
use crate::forecast::Forecast;
use crate::units::{Hertz, Kilogram, Newton, NewtonSecond, Second};

bitflags::bitflags! {
    /// Which values of an event lay beyond the range of their field.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Saturated: u8 {
        /// Scaled force.
        const SCALED = 1 << 0;
        /// Filtered peak.
        const PEAK = 1 << 1;
        /// Raw peak.
        const RAW_PEAK = 1 << 2;
        /// Impulse.
        const IMPULSE = 1 << 3;
        /// Duration.
        const DURATION = 1 << 4;
        /// Time to peak.
        const TIME_TO_PEAK = 1 << 5;
        /// Quasi-static force.
        const QUASI_STATIC = 1 << 6;
        /// Effective mass or its age.
        const MASS = 1 << 7;
    }
}

/// Bytes do not make such a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Malformed {
    /// It must have this many bytes.
    Length {
        /// What is right.
        expected: u8,
        /// What came.
        found: u8,
    },
    /// The verdict has a number that no verdict has.
    Verdict(u8),
    /// A reserved bit is set.
    Reserved,
}

impl core::fmt::Display for Malformed {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { expected, found } => write!(f, "the frame has {found} bytes instead of {expected}"),
            Self::Verdict(number) => write!(f, "verdict {number} does not exist; 0 to 3 do"),
            Self::Reserved => f.write_str("a reserved bit is set; a newer firmware may have sent this"),
        }
    }
}

impl core::error::Error for Malformed {}

/// What "none" is in a field that may be empty.
const NONE: u16 = 0xFFFF;

/// `value / step` rounded, kept within 0 to `most`; and whether it had to be kept.
fn steps(value: f32, per_unit: f32, most: u16) -> (u16, bool) {
    let steps = libm::roundf(value * per_unit);
    if steps.is_nan() {
        // Not a number can only be the product of a fault; the upper end is the safe side.
        (most, true)
    } else if steps < 0.0 {
        // Half a step below zero still rounds to it.
        (0, true)
    } else if steps > f32::from(most) {
        (most, true)
    } else {
        (steps as u16, false)
    }
}

fn bytes8(bytes: &[u8]) -> Result<[u8; 8], Malformed> {
    bytes.try_into().map_err(|_| Malformed::Length { expected: 8, found: bytes.len().min(255) as u8 })
}

fn word(data: &[u8; 8], at: usize) -> u16 {
    u16::from_le_bytes([data[at], data[at + 1]])
}

/// The bytes of a frame that begins with its impact's number and whether a value lay out of range, and these two.
fn of_impact(bytes: &[u8]) -> Result<([u8; 8], u8, bool), Malformed> {
    let data = bytes8(bytes)?;
    if data[1] & !1 != 0 {
        return Err(Malformed::Reserved);
    }
    Ok((data, data[0], data[1] & 1 != 0))
}

fn words(a: u16, b: u16, c: u16, d: u16) -> [u8; 8] {
    let mut data = [0; 8];
    for (field, value) in data.chunks_exact_mut(2).zip([a, b, c, d]) {
        field.copy_from_slice(&value.to_le_bytes());
    }
    data
}

/// TPDO 1: a contact began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alarm {
    /// Low byte of the impact's number.
    pub impact: u8,
    /// The force at that sample lay beyond ±3276.7 N.
    pub saturated: bool,
    /// Force at the sample that gave the alarm.
    pub force: Newton,
    /// That sample's number since power-up, low 32 bits.
    pub index: u32,
}

impl Alarm {
    /// Newtons in one step of the force.
    pub const STEP: Newton = Newton(0.1);

    /// The alarm for an onset, as its frame carries it.
    #[must_use]
    pub fn encode(onset: &Onset) -> [u8; 8] {
        let steps = libm::roundf(onset.force.0 * 10.0);
        // A float-to-integer conversion saturates and turns NaN into 0.
        let kept = if steps.is_nan() { i16::MAX } else { steps as i16 };
        let saturated = f32::from(kept) != steps;
        let mut data = [0; 8];
        data[0] = onset.impact as u8;
        data[1] = u8::from(saturated);
        data[2..4].copy_from_slice(&kept.to_le_bytes());
        data[4..8].copy_from_slice(&(onset.noticed_at as u32).to_le_bytes());
        data
    }

    /// Reads such a frame.
    ///
    /// # Errors
    /// [`Malformed::Length`], [`Malformed::Reserved`].
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let (data, impact, saturated) = of_impact(bytes)?;
        Ok(Self {
            impact,
            saturated,
            force: Newton(f32::from(i16::from_le_bytes([data[2], data[3]])) / 10.0),
            index: u32::from_le_bytes([data[4], data[5], data[6], data[7]]),
        })
    }
}

/// TPDO 8: how hard the blow is going to be, while the force rises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForecastFrame {
    /// Low byte of the impact's number.
    pub impact: u8,
    /// Peak or bound lay beyond 6553.5 N.
    pub saturated: bool,
    /// Expected judged peak, in steps of 0.1 N.
    pub peak: Newton,
    /// The peak is within this of the expected one in [`crate::forecast::COVERED`] of the impacts, in steps of 0.1 N.
    pub bound: Newton,
    /// From the sample that gave the alarm to the last one that the forecast is from.
    pub samples: u16,
}

impl ForecastFrame {
    /// Newtons in one step.
    pub const STEP: Newton = Newton(0.1);

    /// The frame of a forecast.
    #[must_use]
    pub fn encode(impact: u32, forecast: &Forecast, samples: u16) -> [u8; 8] {
        let (peak, peak_beyond) = steps(forecast.peak.0, 10.0, u16::MAX);
        let (bound, bound_beyond) = steps(forecast.bound.0, 10.0, u16::MAX);
        let flags = u8::from(peak_beyond || bound_beyond);
        words(u16::from_le_bytes([impact as u8, flags]), peak, bound, samples)
    }

    /// Reads such a frame.
    ///
    /// # Errors
    /// [`Malformed::Length`], [`Malformed::Reserved`].
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let (data, impact, saturated) = of_impact(bytes)?;
        Ok(Self {
            impact,
            saturated,
            peak: Newton(f32::from(word(&data, 2)) / 10.0),
            bound: Newton(f32::from(word(&data, 4)) / 10.0),
            samples: word(&data, 6),
        })
    }
}

/// The parts of an event, one TPDO each, TPDO 2 to 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Part {
    /// Verdict, flags, scaled force.
    Judgement = 0,
    /// Peaks and impulse.
    Force = 1,
    /// Instant of contact.
    Instant = 2,
    /// Duration, time to peak, quasi-static force.
    Course = 3,
    /// Impact, effective mass and its age.
    Mass = 4,
}

/// How many frames an event takes.
pub const PARTS: usize = 5;

impl Part {
    /// All parts.
    pub const ALL: [Self; PARTS] = [Self::Judgement, Self::Force, Self::Instant, Self::Course, Self::Mass];

    /// Default COB-ID without the node id.
    #[must_use]
    pub const fn base(self) -> u16 {
        match self {
            Self::Judgement => 0x280,
            Self::Force => 0x380,
            Self::Instant => 0x480,
            Self::Course => 0x300,
            Self::Mass => 0x400,
        }
    }

    /// Which part of which node's event this COB-ID carries by default.
    #[must_use]
    pub fn of(id: u16) -> Option<(Self, u8)> {
        let node = (id & 0x7F) as u8;
        let part = Self::ALL.into_iter().find(|part| part.base() == id & !0x7F)?;
        (node != 0).then_some((part, node))
    }
}

/// Default COB-ID of the alarm without the node id: the most urgent there is.
pub const ALARM_BASE: u16 = 0x000;
/// Default COB-ID of the forecast without the node id: after alarm and faults, before everything else.
pub const FORECAST_BASE: u16 = 0x180;
/// Default COB-ID of the effective mass without the node id.
pub const MASS_BASE: u16 = 0x200;

/// An event as its five frames carry it: rounded to their steps, kept within their ranges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Low 16 bits of the event's number.
    pub number: u16,
    /// Low 16 bits of the impact's number.
    pub impact: u16,
    /// 0 for the blow, n for its n-th rebound; 255 for any beyond.
    pub contact: u8,
    /// Which values lay beyond their range.
    pub saturated: Saturated,
    /// Flags of the event.
    pub flags: Flags,
    /// Verdict.
    pub verdict: Verdict,
    /// S times the transient force, in steps of 0.1 N.
    pub scaled: Newton,
    /// Filtered peak, in steps of 0.1 N.
    pub peak: Newton,
    /// Raw peak, in steps of 0.1 N.
    pub raw_peak: Newton,
    /// Impulse, in steps of 0.001 N·s.
    pub impulse: NewtonSecond,
    /// Low 32 bits of the sample number of the contact.
    pub contact_index: u32,
    /// Fraction of a sample after it, in steps of 1/256.
    pub contact_fraction: f32,
    /// Duration, in steps of 0.1 ms.
    pub duration: Second,
    /// From contact to raw peak, in steps of 0.01 ms.
    pub time_to_peak: Second,
    /// Quasi-static force, in steps of 0.1 N.
    pub quasi_static: Option<Newton>,
    /// Effective mass, in steps of 0.02 kg.
    pub effective_mass: Option<Kilogram>,
    /// Its age at onset, ms; `None` for a constant.
    pub effective_mass_age_ms: Option<u16>,
}

/// The five frames of an event, indexed by [`Part`]; `sample_rate` is that of the configuration it was measured with.
#[must_use]
pub fn encode(event: &Event, sample_rate: Hertz) -> [[u8; 8]; PARTS] {
    let mut saturated = Saturated::empty();
    let mut keep = |value: f32, per_unit: f32, most: u16, bit: Saturated| {
        let (steps, beyond) = steps(value, per_unit, most);
        saturated.set(bit, saturated.contains(bit) || beyond);
        steps
    };
    let severity = &event.severity;
    let scaled = keep(severity.scaled.0, 10.0, u16::MAX, Saturated::SCALED);
    let peak = keep(event.peak.0, 10.0, u16::MAX, Saturated::PEAK);
    let raw_peak = keep(event.raw_peak.0, 10.0, u16::MAX, Saturated::RAW_PEAK);
    let impulse = keep(event.impulse.0, 1000.0, u16::MAX, Saturated::IMPULSE);
    let duration = keep(event.duration.0, 10_000.0, u16::MAX, Saturated::DURATION);
    let time_to_peak = keep(event.time_to_peak(sample_rate).0, 100_000.0, u16::MAX, Saturated::TIME_TO_PEAK);
    let quasi_static =
        severity.quasi_static.map_or(NONE, |force| keep(force.0, 10.0, NONE - 1, Saturated::QUASI_STATIC));
    let mass = severity.effective_mass.map_or(NONE, |mass| keep(mass.0, 50.0, NONE - 1, Saturated::MASS));
    let age = match (severity.effective_mass, severity.effective_mass_age_ms) {
        (Some(_), Some(age)) => keep(age as f32, 1.0, NONE - 1, Saturated::MASS),
        _ => NONE,
    };

    let number = event.number as u16;
    // Rounding up to a whole sample would need a carry into the index; the largest fraction is 255/256.
    let fraction = (event.contact_instant.fraction * 256.0) as u8;
    let index = event.contact_instant.index as u32;
    let mut instant = words(number, 0, index as u16, (index >> 16) as u16);
    instant[2] = event.contact;
    instant[3] = fraction;
    [
        words(number, u16::from_le_bytes([severity.verdict as u8, saturated.bits()]), event.flags.bits(), scaled),
        words(number, peak, raw_peak, impulse),
        instant,
        words(number, duration, time_to_peak, quasi_static),
        words(number, event.impact as u16, mass, age),
    ]
}

/// Reads the five frames of an event; they must carry the same number, as [`Assembly`] sees to.
///
/// # Errors
/// [`Malformed::Verdict`], [`Malformed::Reserved`].
pub fn decode(frames: &[[u8; 8]; PARTS]) -> Result<Summary, Malformed> {
    let [judgement, force, instant, course, mass] = frames;
    let optional = |value: u16, per_unit: f32| (value != NONE).then(|| f32::from(value) / per_unit);
    let age = word(mass, 6);
    Ok(Summary {
        number: word(judgement, 0),
        impact: word(mass, 2),
        contact: instant[2],
        saturated: Saturated::from_bits_retain(judgement[3]),
        flags: Flags::from_bits(word(judgement, 4)).ok_or(Malformed::Reserved)?,
        verdict: Verdict::from_number(judgement[2]).ok_or(Malformed::Verdict(judgement[2]))?,
        scaled: Newton(f32::from(word(judgement, 6)) / 10.0),
        peak: Newton(f32::from(word(force, 2)) / 10.0),
        raw_peak: Newton(f32::from(word(force, 4)) / 10.0),
        impulse: NewtonSecond(f32::from(word(force, 6)) / 1000.0),
        contact_index: u32::from_le_bytes([instant[4], instant[5], instant[6], instant[7]]),
        contact_fraction: f32::from(instant[3]) / 256.0,
        duration: Second(f32::from(word(course, 2)) / 10_000.0),
        time_to_peak: Second(f32::from(word(course, 4)) / 100_000.0),
        quasi_static: optional(word(course, 6), 10.0).map(Newton),
        effective_mass: optional(word(mass, 4), 50.0).map(Kilogram),
        effective_mass_age_ms: (age != NONE).then_some(age),
    })
}

/// Puts the parts of one node's events together, in whatever order they come.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    pending: heapless::Deque<Pending, 4>,
    incomplete: u32,
}

#[derive(Clone, Debug)]
struct Pending {
    number: u16,
    parts: [Option<[u8; 8]>; PARTS],
}

impl Assembly {
    /// Nothing pending.
    #[must_use]
    pub const fn new() -> Self {
        Self { pending: heapless::Deque::new(), incomplete: 0 }
    }

    /// Takes a frame; the event once its last part has come.
    ///
    /// # Errors
    /// [`Malformed`] when the frame, or the event that it completes, cannot be read.
    pub fn push(&mut self, part: Part, bytes: &[u8]) -> Result<Option<Summary>, Malformed> {
        let data = bytes8(bytes)?;
        let number = word(&data, 0);
        if !self.pending.iter().any(|event| event.number == number) {
            if self.pending.is_full() {
                self.pending.pop_front();
                self.incomplete += 1;
            }
            // There is room: one was removed if it was full.
            let _ = self.pending.push_back(Pending { number, parts: [None; PARTS] });
        }
        let Some(event) = self.pending.iter_mut().find(|event| event.number == number) else { return Ok(None) };
        event.parts[part as usize] = Some(data);
        let [Some(a), Some(b), Some(c), Some(d), Some(e)] = event.parts else { return Ok(None) };
        self.pending.retain(|event| event.number != number);
        decode(&[a, b, c, d, e]).map(Some)
    }

    /// Events of which a part never came; they stand in the sensor's log.
    #[must_use]
    pub fn incomplete(&self) -> u32 {
        self.incomplete
    }
}

/// RPDO 1: how heavy the robot is at the contact point now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassFrame {
    /// Effective mass in the direction of motion.
    pub mass: Kilogram,
    /// Counts up with every frame, so that lost ones are seen.
    pub sequence: u16,
}

impl MassFrame {
    /// Bytes of the frame.
    pub const LENGTH: usize = 6;

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; Self::LENGTH] {
        let mut data = [0; Self::LENGTH];
        data[..4].copy_from_slice(&self.mass.0.to_le_bytes());
        data[4..].copy_from_slice(&self.sequence.to_le_bytes());
        data
    }

    /// Reads such a frame; whether the mass is possible is for [`crate::configuration::Setting::EffectiveMass`] to say.
    ///
    /// # Errors
    /// [`Malformed::Length`] when it is shorter; a longer one is permitted by CiA 301, what follows is ignored.
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        let [a, b, c, d, low, high, ..] = *bytes else {
            return Err(Malformed::Length { expected: Self::LENGTH as u8, found: bytes.len() as u8 });
        };
        Ok(Self { mass: Kilogram(f32::from_le_bytes([a, b, c, d])), sequence: u16::from_le_bytes([low, high]) })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::event::Severity;
    use crate::units::SampleInstant;

    fn onset(force: f32) -> Onset {
        Onset { impact: 0x1_02, noticed_at: 0x1_2345_6789, threshold: Newton(3.0), force: Newton(force) }
    }

    #[test]
    fn an_alarm_beyond_its_range_says_so() {
        let alarm = Alarm::decode(&Alarm::encode(&onset(5_000.0))).unwrap();
        assert_eq!((alarm.force, alarm.saturated), (Newton(3276.7), true));
        let alarm = Alarm::decode(&Alarm::encode(&onset(-5_000.0))).unwrap();
        assert_eq!((alarm.force, alarm.saturated), (Newton(-3276.8), true));
        let alarm = Alarm::decode(&Alarm::encode(&onset(12.34))).unwrap();
        assert_eq!(alarm, Alarm { impact: 2, saturated: false, force: Newton(12.3), index: 0x2345_6789 });
    }

    #[test]
    fn a_forecast_comes_back_or_says_that_it_saturated() {
        let frame = |peak, bound| {
            let forecast = Forecast { peak: Newton(peak), bound: Newton(bound) };
            ForecastFrame::decode(&ForecastFrame::encode(0x1_02, &forecast, 80)).unwrap()
        };
        let (peak, bound) = (Newton(123.4), Newton(6.5));
        assert_eq!(frame(123.41, 6.49), ForecastFrame { impact: 2, saturated: false, peak, bound, samples: 80 });
        let beyond = frame(7_000.0, 6.49);
        assert_eq!((beyond.peak, beyond.saturated), (Newton(6553.5), true));
        assert!(frame(f32::NAN, 1.0).saturated);
        assert_eq!(ForecastFrame::decode(&[0, 2, 0, 0, 0, 0, 0, 0]), Err(Malformed::Reserved));
    }

    #[test]
    fn wrong_lengths_are_named() {
        assert_eq!(Alarm::decode(&[0; 7]), Err(Malformed::Length { expected: 8, found: 7 }));
        assert_eq!(MassFrame::decode(&[0; 5]), Err(Malformed::Length { expected: 6, found: 5 }));
    }

    #[test]
    fn a_missing_part_is_counted() {
        let mut assembly = Assembly::new();
        for number in 0..6u16 {
            for part in &Part::ALL[1..] {
                assert_eq!(assembly.push(*part, &words(number, 0, 0, 0)), Ok(None));
            }
        }
        assert_eq!(assembly.incomplete(), 2, "four wait, two gave up");
    }

    prop_compose! {
        fn event()(
            (number, impact, contact, flags, verdict) in (any::<u32>(), any::<u32>(), any::<u8>(), 0u16..0x2000, 0u8..4),
            forces in prop::array::uniform4(-10.0f32..9000.0),
            (impulse, duration) in (-1.0f32..100.0, 0.0f32..10.0),
            (index, fraction, to_peak) in (0u64..1 << 40, 0.0f32..0.999, 0.0f32..20_000.0),
            (has_static, mass, age) in (any::<bool>(), prop::option::of(0.0f32..2000.0), prop::option::of(0u32..100_000)),
        ) -> Event {
            let contact_instant = SampleInstant { index, fraction };
            Event {
                number, impact, contact,
                flags: Flags::from_bits_truncate(flags),
                contact_instant,
                peak_instant: SampleInstant::from_offset(index, to_peak),
                raw_peak: Newton(forces[0]),
                peak: Newton(forces[1]),
                impulse: NewtonSecond(impulse),
                duration: Second(duration),
                noise: Newton(0.1),
                severity: Severity {
                    verdict: Verdict::from_number(verdict).unwrap(),
                    scaled: Newton(forces[2]),
                    quasi_static: has_static.then_some(Newton(forces[3])),
                    effective_mass: mass.map(Kilogram),
                    effective_mass_age_ms: age.filter(|_| mass.is_some()),
                    ..Severity::default()
                },
                configuration_revision: 1,
                configuration_hash: 2,
            }
        }
    }

    fn check(name: &str, sent: f32, read: f32, step: f32, least: f32, most: f32, beyond: bool) {
        // Half a step of rounding, and the resolution of a single-precision product.
        let kept = sent.clamp(least, most);
        assert!((kept - read).abs() <= step * 0.5 + kept.abs() * 3e-7, "{name}: {sent} became {read}");
        let outside = sent < least - step * 0.51 || sent > most + step * 0.51;
        let inside = sent > least - step * 0.49 && sent < most + step * 0.49;
        assert!((beyond || !outside) && (!beyond || !inside), "{name}: {sent} flagged {beyond}");
    }

    proptest! {
        #[test]
        fn an_event_comes_back_within_half_a_step_or_says_that_it_saturated(
            event in event(), order in Just(Part::ALL).prop_shuffle(),
        ) {
            let rate = Hertz(20_000.0);
            let frames = encode(&event, rate);
            let mut assembly = Assembly::new();
            let mut found = None;
            for part in order {
                prop_assert!(found.is_none());
                found = assembly.push(part, &frames[part as usize]).unwrap();
            }
            let read = found.expect("all five parts came");
            prop_assert_eq!(read.number, event.number as u16);
            prop_assert_eq!(read.impact, event.impact as u16);
            prop_assert_eq!(read.contact, event.contact);
            prop_assert_eq!(read.flags, event.flags);
            prop_assert_eq!(read.verdict, event.severity.verdict);
            prop_assert_eq!(read.contact_index, event.contact_instant.index as u32);
            prop_assert!((read.contact_fraction - event.contact_instant.fraction).abs() < 1.0 / 256.0);
            let is = |bit| read.saturated.contains(bit);
            check("scaled", event.severity.scaled.0, read.scaled.0, 0.1, 0.0, 6553.5, is(Saturated::SCALED));
            check("peak", event.peak.0, read.peak.0, 0.1, 0.0, 6553.5, is(Saturated::PEAK));
            check("raw peak", event.raw_peak.0, read.raw_peak.0, 0.1, 0.0, 6553.5, is(Saturated::RAW_PEAK));
            check("impulse", event.impulse.0, read.impulse.0, 1e-3, 0.0, 65.535, is(Saturated::IMPULSE));
            check("duration", event.duration.0, read.duration.0, 1e-4, 0.0, 6.5535, is(Saturated::DURATION));
            let to_peak = event.time_to_peak(rate).0;
            check("time to peak", to_peak, read.time_to_peak.0, 1e-5, 0.0, 0.65535, is(Saturated::TIME_TO_PEAK));
            prop_assert_eq!(read.quasi_static.is_some(), event.severity.quasi_static.is_some());
            if let (Some(sent), Some(got)) = (event.severity.quasi_static, read.quasi_static) {
                check("quasi-static", sent.0, got.0, 0.1, 0.0, 6553.4, is(Saturated::QUASI_STATIC));
            }
            prop_assert_eq!(read.effective_mass.is_some(), event.severity.effective_mass.is_some());
            prop_assert_eq!(read.effective_mass_age_ms.is_some(), event.severity.effective_mass_age_ms.is_some());
            if let (Some(sent), Some(got)) = (event.severity.effective_mass, read.effective_mass) {
                let age = event.severity.effective_mass_age_ms.unwrap_or(0);
                prop_assert_eq!(is(Saturated::MASS), got.0 >= 1310.68 && sent.0 > 1310.68 || age > 65_534);
                prop_assert!((got.0 - sent.0.min(1310.68)).abs() <= 0.0102);
                prop_assert_eq!(read.effective_mass_age_ms.map_or(0, u32::from), age.min(65_534));
            }
        }

        #[test]
        fn no_bytes_make_the_decoders_panic(parts in any::<[[u8; 8]; PARTS]>(), bytes in prop::collection::vec(any::<u8>(), 0..9)) {
            let _ = decode(&parts);
            let _ = Alarm::decode(&bytes);
            let _ = ForecastFrame::decode(&bytes);
            let _ = MassFrame::decode(&bytes);
            let _ = Assembly::new().push(Part::Force, &bytes);
        }

        #[test]
        fn a_mass_comes_back_to_the_bit(bits in any::<u32>(), sequence in any::<u16>()) {
            let sent = MassFrame { mass: Kilogram(f32::from_bits(bits)), sequence };
            let read = MassFrame::decode(&sent.encode()).unwrap();
            prop_assert_eq!(read.mass.0.to_bits(), bits);
            prop_assert_eq!(read.sequence, sequence);
        }
    }
}
