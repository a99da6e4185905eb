//! Following sensors: alarms, events, faults and losses as they happen, none twice and none silently missed.
//!
//! ```text
//! frames ─▶ parts of an event ─▶ number follows the last? ─ yes ─▶ event
//!                                        │ no
//!                                        ▼
//! log's newest number, asked now and then ─▶ missing ─ still, after a moment ─▶ read from the log ─▶ event
//!                                                                                     │ overwritten
//!                                                                                     ▼ lost
//! ```

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Serialize, Serializer};
use thud_firmware::board::Frame;
use thud_firmware::dictionary::frame::{
    self, ALARM_BASE, Alarm, Assembly, FORECAST_BASE, ForecastFrame, Part, Saturated, Summary,
};
use thud_firmware::dictionary::{event_record, index};
use thud_firmware::emergency::Emergency;
use thud_firmware::event::{Event, Flags, Verdict};
use thud_firmware::stream::{STREAM_BASE, Samples};
use thud_firmware::units::Hertz;

use super::find::{self, Sensor};
use super::line::node_of;
use super::samples::{SampleStream, Streamed};
use super::sdo::SdoError;
use super::status::nmt_state;
use super::{Client, ClientError, Nmt, emergency};

/// A number that was passed over is looked up in the log after so long: parts of events may overtake each other.
const PATIENCE: Duration = Duration::from_millis(300);
/// How often the log is asked for its newest number, so that an event is seen whose frames were all lost.
const POLL: Duration = Duration::from_secs(1);
/// How often it is looked whether something is due.
const LOOK: Duration = Duration::from_millis(10);
/// Node ids of the frames that are heard.
const EMERGENCY: u16 = 0x080;
const HEARTBEAT: u16 = 0x700;
/// Heartbeat of a node that has just started.
const BOOT_UP: u8 = 0;
/// A node is silent after so many missing heartbeats.
const MISSED_HEARTBEATS: u32 = 4;

/// How an event came to us.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// By its frames, as it happened.
    Frames,
    /// Its frames were lost; it was read from the sensor's log.
    Log,
}

/// A contact that was sensed. Times are the sensor's own, since its power-up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeenEvent {
    /// Node id.
    pub node: u8,
    /// Serial number.
    pub serial: u32,
    /// Number of the event, counted from 1 after each start.
    pub number: u32,
    /// Which start of the board it was sensed in; with serial and number it names the event for ever. 0 where it is not known.
    pub start: u32,
    /// Low 16 bits of the impact's number.
    pub impact: u16,
    /// 0 for the blow, n for its n-th rebound.
    pub contact: u8,
    /// Instant of contact.
    pub contact_s: f64,
    /// Instant of the raw peak.
    pub peak_s: f64,
    /// Filtered peak.
    #[serde(rename = "peak_N")]
    pub peak_n: f32,
    /// Raw peak.
    #[serde(rename = "raw_peak_N")]
    pub raw_peak_n: f32,
    /// Impulse.
    #[serde(rename = "impulse_Ns")]
    pub impulse_ns: f32,
    /// From contact to separation.
    pub duration_s: f32,
    /// S times the transient force.
    #[serde(rename = "scaled_N")]
    pub scaled_n: f32,
    /// Quasi-static force, if there is one.
    #[serde(rename = "quasi_static_N")]
    pub quasi_static_n: Option<f32>,
    /// Effective mass, if one is known.
    pub effective_mass_kg: Option<f32>,
    /// Its age at onset; `None` for a configured constant.
    pub effective_mass_age_ms: Option<u16>,
    /// Verdict.
    #[serde(serialize_with = "verdict_name")]
    pub verdict: Verdict,
    /// Flags.
    #[serde(serialize_with = "flag_names")]
    pub flags: Flags,
    /// Some value lay beyond the range of its frame and is given as the end of that range.
    #[serde(serialize_with = "saturated_bits")]
    pub saturated: Saturated,
    /// How it came.
    pub source: Source,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn verdict_name<S: Serializer>(verdict: &Verdict, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(verdict.name())
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn flag_names<S: Serializer>(flags: &Flags, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(flags.names())
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn saturated_bits<S: Serializer>(saturated: &Saturated, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bool(!saturated.is_empty())
}

/// What happened on the bus.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Happening {
    /// A contact began.
    Alarm {
        /// Node id.
        node: u8,
        /// When the force was seen, seconds since power-up.
        noticed_s: f64,
        /// The force then.
        #[serde(rename = "force_N")]
        force_n: f32,
        /// Low byte of the impact's number.
        impact: u8,
    },
    /// How hard the blow is going to be, told while its force rises.
    Forecast {
        /// Node id.
        node: u8,
        /// Low byte of the impact's number.
        impact: u8,
        /// Expected judged peak.
        #[serde(rename = "peak_N")]
        peak_n: f32,
        /// It is within this of the expected one in 95 of 100 impacts.
        #[serde(rename = "bound_N")]
        bound_n: f32,
        /// From the alarm's sample to the last one that it is from.
        after_s: f32,
        /// A value lay beyond its field's range.
        saturated: bool,
    },
    /// A contact was measured and judged.
    Event(Box<SeenEvent>),
    /// Events are gone: they were not received, and the log has overwritten them.
    Lost {
        /// Node id.
        node: u8,
        /// Their numbers.
        numbers: Vec<u32>,
    },
    /// A fault appeared or went.
    Emergency {
        /// Node id.
        node: u8,
        /// Error code of CiA 301.
        code: u16,
        /// In words.
        words: String,
    },
    /// A frame that should be understood was not.
    Malformed {
        /// Node id.
        node: u8,
        /// What was wrong.
        words: String,
    },
    /// The NMT state changed.
    State {
        /// Node id.
        node: u8,
        /// The state now.
        state: &'static str,
    },
    /// A sensor started (again): its numbers begin anew.
    Started {
        /// Node id.
        node: u8,
        /// Serial number.
        serial: u32,
    },
    /// No heartbeat came any more.
    Silent {
        /// Node id.
        node: u8,
    },
    /// Another device answers under the same id.
    Doubled {
        /// Node id.
        node: u8,
        /// Serial numbers of those who answer; a single one where the other has not answered yet.
        serials: Vec<u32>,
    },
}

/// Sensors that are followed.
pub struct Watch {
    followed: BTreeMap<u8, Followed>,
    /// Started sensors are set to Operational.
    start: bool,
    /// Nobody can be asked: what is known is what was heard. The sample rate of sensors that it was not heard of.
    only_heard: Option<Hertz>,
    /// When it was last looked what is due.
    looked: Duration,
    /// The last reset that another master ordered: for which node (0 all), and when.
    reset: Option<(u8, Duration)>,
}

struct Followed {
    sensor: Sensor,
    start: u32,
    assembly: Assembly,
    since: Duration,
    /// The newest event number that was seen or is missing.
    newest: u32,
    /// Whether that is known; otherwise the next event is where counting begins.
    counting: bool,
    /// Passed-over numbers, and since when.
    missing: BTreeMap<u32, Duration>,
    sample_rate: Hertz,
    /// A sample number and when it was read.
    sample: (u64, Duration),
    polled: Duration,
    heartbeat: Duration,
    heard: Duration,
    state: Option<u8>,
    silent: bool,
    surplus: u32,
    /// Serial numbers of the devices that share its id, as last told.
    doubled: Vec<u32>,
    stream: SampleStream,
    /// Answers to others that had been overheard when it was last looked among them.
    overheard: u64,
}

impl Followed {
    /// A sensor of which nothing is known but that it was heard.
    fn new(sensor: Sensor, sample_rate: Hertz, at: Duration) -> Self {
        Self {
            sensor,
            start: 0,
            assembly: Assembly::new(),
            since: at,
            newest: 0,
            counting: false,
            missing: BTreeMap::new(),
            sample_rate,
            sample: (0, at),
            polled: at,
            heartbeat: Duration::ZERO,
            heard: at,
            state: None,
            silent: false,
            surplus: 0,
            doubled: Vec::new(),
            stream: SampleStream::default(),
            overheard: 0,
        }
    }

    /// The full sample number whose low 32 bits these are: the one nearest to now; the low bits alone where nothing else is known.
    fn widen(&mut self, low: u32, now: Duration, only_heard: bool) -> u64 {
        if only_heard && self.sample.0 == 0 {
            self.sample = (low.into(), now);
        }
        let (at, read) = self.sample;
        let elapsed = now.saturating_sub(read).as_secs_f64() * f64::from(self.sample_rate.0);
        let expected = at + elapsed as u64;
        let ahead = low.wrapping_sub(expected as u32) as i32;
        expected.saturating_add_signed(ahead.into())
    }

    fn seconds(&self, index: u64, fraction: f32) -> f64 {
        (index as f64 + f64::from(fraction)) / f64::from(self.sample_rate.0)
    }

    /// The full event number whose low 16 bits these are: the one nearest to the newest.
    fn number(&self, low: u16) -> u32 {
        let ahead = low.wrapping_sub(self.newest as u16) as i16;
        self.newest.saturating_add_signed(ahead.into())
    }

    /// Whether this event is new to us; numbers that it passes over are missing from now on.
    fn is_new(&mut self, number: u32, now: Duration) -> bool {
        if number <= self.newest {
            return self.missing.remove(&number).is_some();
        }
        self.miss_up_to(number - 1, now);
        self.newest = number;
        true
    }

    fn miss_up_to(&mut self, last: u32, now: Duration) {
        for number in self.newest + 1..=last {
            self.missing.insert(number, now);
        }
        self.newest = self.newest.max(last);
    }

    fn seen(&self, number: u32, summary: &Summary, contact_index: u64, source: Source) -> SeenEvent {
        let contact_s = self.seconds(contact_index, summary.contact_fraction);
        SeenEvent {
            node: self.sensor.node,
            serial: self.sensor.serial,
            number,
            start: self.start,
            impact: summary.impact,
            contact: summary.contact,
            contact_s,
            peak_s: contact_s + f64::from(summary.time_to_peak.0),
            peak_n: summary.peak.0,
            raw_peak_n: summary.raw_peak.0,
            impulse_ns: summary.impulse.0,
            duration_s: summary.duration.0,
            scaled_n: summary.scaled.0,
            quasi_static_n: summary.quasi_static.map(|force| force.0),
            effective_mass_kg: summary.effective_mass.map(|mass| mass.0),
            effective_mass_age_ms: summary.effective_mass_age_ms,
            verdict: summary.verdict,
            flags: summary.flags,
            saturated: summary.saturated,
            source,
        }
    }
}

impl Watch {
    /// Follows these sensors from now on, and others that appear. With `start`, sensors that are not Operational are
    /// started, so that they send events.
    ///
    /// # Errors
    /// [`ClientError::Sdo`] when one does not answer.
    pub fn new(client: &mut Client, sensors: Vec<Sensor>, start: bool) -> Result<Self, ClientError> {
        let mut watch =
            Self { followed: BTreeMap::new(), start, only_heard: None, looked: Duration::ZERO, reset: None };
        for sensor in sensors {
            watch.follow(client, sensor)?;
        }
        Ok(watch)
    }

    /// What came of the sample streams, by node id; those that never streamed are not there.
    pub fn streamed(&self) -> impl Iterator<Item = (u8, Streamed)> {
        self.followed
            .iter()
            .map(|(node, followed)| (*node, followed.stream.streamed()))
            .filter(|(_, streamed)| streamed.values > 0)
    }

    /// Follows whoever is heard, without asking anybody anything, as a log wants it. Serial number and sample rate are
    /// taken from what others asked within hearing; `sample_rate` is for sensors of which it was not heard.
    ///
    /// An event that is not there cannot be read from the sensor: it is lost. Instants count from a multiple of 2³² samples
    /// (59.7 h at 20 kS/s), because frames carry the low 32 bits.
    #[must_use]
    pub fn listening(sample_rate: Hertz) -> Self {
        Self {
            followed: BTreeMap::new(),
            start: false,
            only_heard: Some(sample_rate),
            looked: Duration::ZERO,
            reset: None,
        }
    }

    /// The sensors that are followed.
    pub fn sensors(&self) -> impl Iterator<Item = &Sensor> {
        self.followed.values().map(|followed| &followed.sensor)
    }

    /// What happened, as soon as something has or after `timeout`.
    ///
    /// # Errors
    /// Only when the transport fails; a sensor that does not answer is a [`Happening`].
    pub fn next(&mut self, client: &mut Client, timeout: Duration) -> Result<Vec<Happening>, ClientError> {
        let mut happened = Vec::new();
        if let Some(stamped) = client.line.next(timeout)? {
            self.sort(client, &stamped.frame, stamped.at, &mut happened)?;
        }
        // What is due is due within tenths of seconds: not after each of thousands of frames.
        let now = client.line.now();
        // And not before what has come already: asking a sensor that does not answer takes seconds.
        let may = client.line.is_read() && now >= self.looked + LOOK;
        if may || now >= self.looked + POLL || client.line.ended() {
            self.looked = now;
            let nodes: Vec<u8> = self.followed.keys().copied().collect();
            for node in nodes {
                self.look_after(client, node, &mut happened)?;
            }
        }
        Ok(happened)
    }

    fn follow(&mut self, client: &mut Client, sensor: Sensor) -> Result<(), ClientError> {
        let node = sensor.node;
        if self.start {
            client.nmt(Nmt::Start, node)?;
        }
        let mut sdo = client.sdo(node);
        let newest = sdo.read(index::EVENT_LOG, 2)?;
        let sample_rate = Hertz(sdo.read(index::CHAIN, 1)?);
        let sample = sdo.read(index::BOARD, 2)?;
        let start = sdo.read(index::BOARD, 8)?;
        let heartbeat_ms: u16 = sdo.read(index::HEARTBEAT, 0)?;
        let now = client.line.now();
        let doubled = self.followed.remove(&node).map_or_else(Vec::new, |before| before.doubled);
        self.followed.insert(
            node,
            Followed {
                start,
                newest,
                counting: true,
                sample: (sample, now),
                heartbeat: Duration::from_millis(heartbeat_ms.into()),
                surplus: client.line.surplus_answers(node),
                doubled,
                ..Followed::new(sensor, sample_rate, now)
            },
        );
        Ok(())
    }

    /// A node that was heard, without asking it anything.
    fn hear(&mut self, client: &Client, node: u8, sample_rate: Hertz, at: Duration) -> &mut Followed {
        let read = |index, sub| client.line.overheard(node, index, sub);
        let unknown = || Followed::new(Sensor { node, serial: 0 }, sample_rate, at);
        let followed = self.followed.entry(node).or_insert_with(unknown);
        let overheard = client.line.overheard_count();
        if followed.overheard == overheard {
            // Nothing was asked since: a log has thousands of frames between two questions.
            return followed;
        }
        followed.overheard = overheard;
        if let Some(serial) = read(index::IDENTITY, 4) {
            followed.sensor.serial = u32::from_le_bytes(serial);
        }
        if let Some(start) = read(index::BOARD, 8) {
            followed.start = u32::from_le_bytes(start);
        }
        if let Some(rate) = read(index::CHAIN, 1).map(f32::from_le_bytes).filter(|rate| *rate > 0.0) {
            followed.sample_rate = Hertz(rate);
        }
        followed
    }

    /// One frame.
    fn sort(
        &mut self,
        client: &mut Client,
        frame: &Frame,
        at: Duration,
        happened: &mut Vec<Happening>,
    ) -> Result<(), ClientError> {
        if let Some(node) = node_of(frame, STREAM_BASE) {
            if let (Some(followed), Some(samples)) = (self.followed.get_mut(&node), Samples::decode(frame.bytes())) {
                followed.heard = at;
                followed.stream.push(&samples);
            }
            return Ok(());
        }
        if let Some(sample_rate) = self.only_heard {
            let event = Part::of(frame.id).map(|(_, node)| node);
            let heard = event.or_else(|| node_of(frame, HEARTBEAT)).or_else(|| node_of(frame, ALARM_BASE));
            if let Some(node) = heard {
                let followed = self.hear(client, node, sample_rate, at);
                if let (false, Some(_), [low, high, ..]) = (followed.counting, event, frame.bytes()) {
                    followed.newest = u32::from(u16::from_le_bytes([*low, *high])).saturating_sub(1);
                    followed.counting = true;
                }
            }
        }
        if let Some(node) = node_of(frame, HEARTBEAT) {
            return self.heartbeat(client, node, frame.bytes(), at, happened);
        }
        if let (0, [command, node]) = (frame.id, frame.bytes())
            && [Nmt::ResetNode as u8, Nmt::ResetCommunication as u8].contains(command)
        {
            self.reset = Some((*node, at));
            return Ok(());
        }
        if let Some(node) = node_of(frame, EMERGENCY) {
            if let Some(followed) = self.followed.get_mut(&node) {
                followed.heard = at;
                happened.push(match Emergency::decode(frame.bytes()) {
                    Some(emergency) => {
                        Happening::Emergency { node, code: emergency.code, words: emergency::sentence(&emergency) }
                    }
                    None => Happening::Malformed { node, words: "an EMCY frame does not have 8 bytes".to_owned() },
                });
            }
            return Ok(());
        }
        let only_heard = self.only_heard.is_some();
        if let Some(followed) = node_of(frame, ALARM_BASE).and_then(|node| self.followed.get_mut(&node)) {
            let node = followed.sensor.node;
            followed.heard = at;
            happened.push(match Alarm::decode(frame.bytes()) {
                Ok(alarm) => Happening::Alarm {
                    node,
                    noticed_s: {
                        let noticed = followed.widen(alarm.index, at, only_heard);
                        followed.seconds(noticed, 0.0)
                    },
                    force_n: alarm.force.0,
                    impact: alarm.impact,
                },
                Err(malformed) => Happening::Malformed { node, words: format!("alarm: {malformed}") },
            });
            return Ok(());
        }
        if let Some(followed) = node_of(frame, FORECAST_BASE).and_then(|node| self.followed.get_mut(&node)) {
            let node = followed.sensor.node;
            followed.heard = at;
            happened.push(match ForecastFrame::decode(frame.bytes()) {
                Ok(forecast) => Happening::Forecast {
                    node,
                    impact: forecast.impact,
                    peak_n: forecast.peak.0,
                    bound_n: forecast.bound.0,
                    after_s: f32::from(forecast.samples) / followed.sample_rate.0,
                    saturated: forecast.saturated,
                },
                Err(malformed) => Happening::Malformed { node, words: format!("forecast: {malformed}") },
            });
            return Ok(());
        }
        if let Some((part, node)) = Part::of(frame.id)
            && let Some(followed) = self.followed.get_mut(&node)
        {
            followed.heard = at;
            match followed.assembly.push(part, frame.bytes()) {
                Ok(None) => {}
                Ok(Some(summary)) => {
                    let number = followed.number(summary.number);
                    if followed.is_new(number, at) {
                        let contact = followed.widen(summary.contact_index, at, only_heard);
                        let event = followed.seen(number, &summary, contact, Source::Frames);
                        happened.push(Happening::Event(Box::new(event)));
                    }
                }
                Err(malformed) => {
                    happened.push(Happening::Malformed { node, words: format!("event ({part:?}): {malformed}") });
                }
            }
        }
        Ok(())
    }

    fn heartbeat(
        &mut self,
        client: &mut Client,
        node: u8,
        bytes: &[u8],
        at: Duration,
        happened: &mut Vec<Happening>,
    ) -> Result<(), ClientError> {
        let [state] = *bytes else { return Ok(()) };
        if let (true, Some(followed)) = (self.only_heard.is_some(), self.followed.get_mut(&node)) {
            followed.heard = at;
            if state & 0x7F == BOOT_UP {
                (followed.newest, followed.counting, followed.sample, followed.state) = (0, true, (0, at), None);
                followed.missing.clear();
                happened.push(Happening::Started { node, serial: followed.sensor.serial });
            } else if followed.state.replace(state) != Some(state) {
                happened.push(Happening::State { node, state: nmt_state(state) });
            }
            return Ok(());
        }
        let known = self.followed.contains_key(&node);
        if !known || state & 0x7F == BOOT_UP {
            // Somebody new, or somebody who begins anew.
            let found = match find::find(&mut client.line, Some(node)) {
                Ok(found) => found,
                Err(ClientError::Doubled { node, serials }) => {
                    self.tell_doubled(node, serials, happened);
                    return Ok(());
                }
                Err(ClientError::Bus(error)) => return Err(error.into()),
                // Another kind of device, or it does not answer yet; its next heartbeat gives another chance.
                Err(_) => return Ok(()),
            };
            for sensor in found {
                self.begin_anew(client, sensor, state & 0x7F == BOOT_UP, at, happened)?;
            }
            return Ok(());
        }
        let Some(followed) = self.followed.get_mut(&node) else { return Ok(()) };
        if at <= followed.since {
            // Heard before it was started, read after.
            return Ok(());
        }
        followed.heard = at;
        followed.silent = false;
        // Two devices in two states would be told as one that changes all the time.
        if followed.state.replace(state) != Some(state) && followed.doubled.is_empty() {
            happened.push(Happening::State { node, state: nmt_state(state) });
        }
        Ok(())
    }

    /// A sensor that is new, or that a boot-up was heard from.
    fn begin_anew(
        &mut self,
        client: &mut Client,
        sensor: Sensor,
        booted: bool,
        at: Duration,
        happened: &mut Vec<Happening>,
    ) -> Result<(), ClientError> {
        let Sensor { node, serial } = sensor;
        let before = self.followed.get(&node).map(|before| {
            let alive = at < before.heard + before.heartbeat * 2;
            (before.sensor.serial, before.sample.0, before.newest, before.missing.clone(), alive)
        });
        match self.follow(client, sensor) {
            Ok(()) => {}
            Err(ClientError::Bus(error) | ClientError::Sdo(SdoError::Bus(error))) => return Err(error.into()),
            // Its next heartbeat gives another chance.
            Err(_) => return Ok(()),
        }
        let Some(followed) = self.followed.get_mut(&node) else { return Ok(()) };
        let sample = followed.sample.0;
        match before {
            // Its samples count on: it has not started. A reset of communication alone was asked for on the bus;
            // otherwise it was another device that started under its id.
            Some((known, sample_before, newest, missing, _)) if known == serial && sample >= sample_before => {
                (followed.newest, followed.missing) = (newest, missing);
                let asked = self.reset.is_some_and(|(who, when)| (who == 0 || who == node) && at < when + POLL * 2);
                if booted && !asked {
                    self.tell_doubled(node, vec![serial], happened);
                }
            }
            // Another board under the id of one that was heard a moment ago: nobody swaps them so fast.
            Some((known, .., true)) if known != serial => self.tell_doubled(node, vec![known, serial], happened),
            _ => {
                if booted {
                    // Events that it had before we could ask are not missed: its numbers begin at 1.
                    let last = std::mem::replace(&mut followed.newest, 0);
                    followed.miss_up_to(last, at);
                }
                happened.push(Happening::Started { node, serial });
            }
        }
        Ok(())
    }

    /// Says once that these devices share an id.
    fn tell_doubled(&mut self, node: u8, mut serials: Vec<u32>, happened: &mut Vec<Happening>) {
        serials.sort_unstable();
        if let Some(followed) = self.followed.get_mut(&node)
            && followed.doubled != serials
        {
            followed.doubled.clone_from(&serials);
            happened.push(Happening::Doubled { node, serials });
        }
    }

    /// What is due for one sensor: its log's newest number, events that stayed missing, silence, doubles.
    fn look_after(&mut self, client: &mut Client, node: u8, happened: &mut Vec<Happening>) -> Result<(), ClientError> {
        let Some(followed) = self.followed.get_mut(&node) else { return Ok(()) };
        let now = client.line.now();
        if self.only_heard.is_some() {
            let ended = client.line.ended();
            let mut numbers = Vec::new();
            followed.missing.retain(|number, since| {
                let lost = ended || now >= *since + PATIENCE;
                numbers.extend(lost.then_some(*number));
                !lost
            });
            if !numbers.is_empty() {
                happened.push(Happening::Lost { node, numbers });
            }
            return Ok(());
        }

        let surplus = client.line.surplus_answers(node);
        if surplus > followed.surplus {
            followed.surplus = surplus;
            let serials = find::ask_all(&mut client.line, &[node], index::IDENTITY, 4)?;
            followed.surplus = client.line.surplus_answers(node);
            if let Some(serials) = serials.get(&node).filter(|serials| serials.len() > 1) {
                self.tell_doubled(node, serials.clone(), happened);
            }
        }
        let Some(followed) = self.followed.get_mut(&node) else { return Ok(()) };

        let patience = followed.heartbeat * MISSED_HEARTBEATS;
        if !followed.silent && !patience.is_zero() && now > followed.heard + patience.max(POLL) {
            followed.silent = true;
            happened.push(Happening::Silent { node });
        }

        if !followed.silent && now >= followed.polled + POLL {
            match client.sdo(node).read::<u32>(index::EVENT_LOG, 2) {
                Ok(last) => followed.miss_up_to(last, now),
                Err(SdoError::Bus(error)) => return Err(error.into()),
                // It does not answer now; silence shows in its heartbeat.
                Err(_) => {}
            }
            followed.polled = client.line.now();
        }

        let due: Vec<u32> =
            followed.missing.iter().filter(|(_, since)| now >= **since + PATIENCE).map(|(number, _)| *number).collect();
        let mut lost = Vec::new();
        for number in due {
            match client.logged_event(node, number) {
                Ok(Some(event)) => {
                    followed.missing.remove(&number);
                    let frames = frame::encode(&event, followed.sample_rate);
                    if let Ok(summary) = frame::decode(&frames) {
                        let seen = followed.seen(number, &summary, event.contact_instant.index, Source::Log);
                        happened.push(Happening::Event(Box::new(seen)));
                    }
                }
                Ok(None) => {
                    followed.missing.remove(&number);
                    lost.push(number);
                }
                Err(ClientError::Bus(error) | ClientError::Sdo(SdoError::Bus(error))) => return Err(error.into()),
                // Asked again later.
                Err(_) => {
                    followed.missing.insert(number, client.line.now());
                }
            }
        }
        if !lost.is_empty() {
            happened.push(Happening::Lost { node, numbers: lost });
        }
        Ok(())
    }
}

impl Client {
    /// An event from the sensor's log; `None` when it has been overwritten.
    ///
    /// # Errors
    /// [`ClientError::Sdo`], also when the record is damaged or another master selected another event meanwhile.
    pub fn logged_event(&mut self, node: u8, number: u32) -> Result<Option<Event>, ClientError> {
        let mut sdo = self.sdo(node);
        let first: u32 = sdo.read(index::EVENT_LOG, 1)?;
        if number < first {
            return Ok(None);
        }
        sdo.write(index::EVENT_LOG, 4, number)?;
        let record = sdo.upload(index::EVENT_LOG, 5)?;
        let torn = |what: String| SdoError::Torn { node, index: index::EVENT_LOG, sub: 5, what };
        let event = event_record::decode(&record).map_err(|malformed| torn(malformed.to_string()))?;
        if event.number != number {
            return Err(torn(format!("event {} came instead of {number}", event.number)).into());
        }
        Ok(Some(event))
    }

    /// All events that the sensor's log holds, oldest first.
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn logged_events(&mut self, node: u8) -> Result<Vec<Event>, ClientError> {
        let mut sdo = self.sdo(node);
        let first: u32 = sdo.read(index::EVENT_LOG, 1)?;
        let last: u32 = sdo.read(index::EVENT_LOG, 2)?;
        let mut events = Vec::new();
        for number in first.max(1)..=last {
            events.extend(self.logged_event(node, number)?);
        }
        Ok(events)
    }

    /// The blow of this impact from the sensor's log; `None` when it is not there (any more).
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn logged_blow(&mut self, node: u8, impact: u32) -> Result<Option<Event>, ClientError> {
        let mut sdo = self.sdo(node);
        let first: u32 = sdo.read(index::EVENT_LOG, 1)?;
        let last: u32 = sdo.read(index::EVENT_LOG, 2)?;
        // Most likely it is among the newest.
        for number in (first.max(1)..=last).rev() {
            match self.logged_event(node, number)? {
                Some(event) if event.impact == impact && event.contact == 0 => return Ok(Some(event)),
                Some(event) if event.impact < impact => return Ok(None),
                _ => {}
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed() -> Followed {
        let sensor = Sensor { node: 32, serial: 7 };
        Followed { start: 1, counting: true, ..Followed::new(sensor, Hertz(20_000.0), Duration::ZERO) }
    }

    #[test]
    fn a_gap_is_missing_until_it_comes_and_nothing_comes_twice() {
        let mut followed = followed();
        assert!(followed.is_new(1, Duration::ZERO));
        assert!(followed.is_new(4, Duration::ZERO));
        assert_eq!(followed.missing.keys().copied().collect::<Vec<_>>(), [2, 3]);
        assert!(followed.is_new(2, Duration::ZERO), "a late one is new");
        assert!(!followed.is_new(2, Duration::ZERO), "once");
        assert!(!followed.is_new(4, Duration::ZERO));
        assert_eq!(followed.missing.len(), 1);
    }

    #[test]
    fn numbers_are_widened_over_their_wrap() {
        let mut followed = followed();
        followed.newest = 0xFFFE;
        assert_eq!(followed.number(0x0001), 0x1_0001);
        assert_eq!(followed.number(0xFFFD), 0xFFFD);
    }

    #[test]
    fn samples_are_widened_after_days() {
        let mut followed = followed();
        // 2³² samples at 20 kS/s are 59.7 hours.
        followed.sample = ((1 << 32) - 1_000, Duration::from_secs(10));
        let after = Duration::from_secs(11);
        assert_eq!(followed.widen(18_990, after, false), (1 << 32) + 18_990);
        assert_eq!(followed.widen(0xFFFF_FFFF, after, false), (1 << 32) - 1);
    }
}
