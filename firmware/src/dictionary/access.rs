//! Reading and writing the dictionary: where each object's value lives.

use zencan_common::nmt::NmtState;
use zencan_common::objects::AccessType;
use zencan_common::sdo::AbortCode;

use super::frame::{ALARM_BASE, FORECAST_BASE, MASS_BASE, MassFrame, PARTS, Part};
use super::object::{self, Object};
use super::value::{Value, exactly, f32_from, u8_from, u16_from, u32_from};
use super::{APPLY, DISCARD, LOAD, PRODUCT_CODE, REVISION_NUMBER, SAVE, event_record, index};
use crate::capture::{Curve, SlotId};
use crate::configuration::{NodeSettings, Setting};
use crate::configuration_lock::{KEY, Rejected};
use crate::emergency::Faults;
use crate::sdo::{Entries, Opened, Stream, VALUE};
use crate::shared::Shared;
use crate::storage::Loaded;
use crate::stream::{self, STREAM_BASE};
use crate::units::Kilogram;

/// TPDOs: the alarm, the parts of an event, the stream, the forecast.
pub const TPDOS: usize = 3 + PARTS;
/// Which of them is the stream.
pub const STREAM_TPDO: usize = 1 + PARTS;
/// Which of them is the forecast.
pub const FORECAST_TPDO: usize = 2 + PARTS;

/// Communication parameters of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoCommunication {
    /// As 0x14xx:1 and 0x18xx:1 give it: 11 bits of identifier, bit 31 set when the PDO is not used.
    pub cob_id: u32,
    /// 254 or 255: on event.
    pub transmission: u8,
}

impl PdoCommunication {
    const UNUSED: u32 = 1 << 31;

    /// The identifier, if the PDO is used.
    #[must_use]
    pub fn id(&self) -> Option<u16> {
        (self.cob_id & Self::UNUSED == 0).then_some((self.cob_id & 0x7FF) as u16)
    }

    fn set(&mut self, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        match sub {
            1 => {
                let cob_id = u32_from(data)?;
                // Bit 30 only says that remote frames are not answered, which is always so; bit 29 would be 29-bit identifiers.
                let id = cob_id & !(Self::UNUSED | 1 << 30);
                let taken = matches!(id, 0x000 | 0x080 | 0x100 | 0x580..=0x5FF | 0x600..=0x67F | 0x700..);
                if cob_id & Self::UNUSED == 0 && taken || id > 0x7FF {
                    return Err(AbortCode::InvalidValue);
                }
                self.cob_id = cob_id;
            }
            2 => match u8_from(data)? {
                transmission @ 254..=255 => self.transmission = transmission,
                _ => return Err(AbortCode::InvalidValue),
            },
            _ => return Err(AbortCode::NoSuchSubIndex),
        }
        Ok(())
    }
}

/// The effective mass as received.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReceivedMass {
    /// The value and when it came, ms.
    pub latest: Option<(Kilogram, u64)>,
    /// Its sequence number.
    pub sequence: u16,
    /// Values taken.
    pub taken: u32,
    /// Values out of range.
    pub refused: u32,
    /// Sequence numbers skipped.
    pub missed: u32,
}

/// A TIME message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeReceived {
    /// Milliseconds after midnight.
    pub milliseconds: u32,
    /// Days since 1984-01-01.
    pub days: u16,
    /// Number of the next sample when it came.
    pub index: u64,
}

/// Objects that belong to the node rather than to the sensor: what a reset of communication resets, and what it counts.
#[derive(Clone, Debug)]
pub struct NodeObjects {
    /// Node id; `None` while LSS has taken it away.
    pub node_id: Option<u8>,
    /// NMT state.
    pub nmt: NmtState,
    /// Heartbeat period, ms.
    pub heartbeat_ms: u16,
    /// RPDO 1, the effective mass.
    pub rpdo: PdoCommunication,
    /// TPDO 1 the alarm, TPDO 2 to 6 the event's parts, TPDO 7 the stream, TPDO 8 the forecast.
    pub tpdos: [PdoCommunication; TPDOS],
    /// Samples in a value of the stream; 0 off.
    pub decimation: u16,
    /// Faults.
    pub faults: Faults,
    /// The latest event's frames.
    pub event: [[u8; 8]; PARTS],
    /// Event selected for reading; 0 the newest.
    pub selected: u32,
    /// The effective mass as received.
    pub mass: ReceivedMass,
    /// The latest TIME message.
    pub time: TimeReceived,
}

impl NodeObjects {
    /// What holds after power-up with these settings.
    #[must_use]
    pub fn new(settings: NodeSettings) -> Self {
        let unused = PdoCommunication { cob_id: PdoCommunication::UNUSED, transmission: 254 };
        let mut objects = Self {
            node_id: None,
            nmt: NmtState::Bootup,
            heartbeat_ms: 0,
            rpdo: unused,
            tpdos: [unused; TPDOS],
            decimation: 0,
            faults: Faults::new(),
            event: [[0; 8]; PARTS],
            selected: 0,
            mass: ReceivedMass::default(),
            time: TimeReceived::default(),
        };
        objects.reset_communication(Some(settings.node_id), settings.heartbeat_ms);
        objects
    }

    /// Gives the communication objects their values after a reset.
    pub fn reset_communication(&mut self, node_id: Option<u8>, heartbeat_ms: u16) {
        self.node_id = node_id;
        self.heartbeat_ms = heartbeat_ms;
        let on_event = |base: u16| PdoCommunication {
            cob_id: node_id.map_or(PdoCommunication::UNUSED, |id| u32::from(base) + u32::from(id)),
            transmission: 254,
        };
        self.rpdo = on_event(MASS_BASE);
        self.tpdos[0] = on_event(ALARM_BASE);
        for part in Part::ALL {
            self.tpdos[1 + part as usize] = on_event(part.base());
        }
        self.tpdos[STREAM_TPDO] = on_event(STREAM_BASE);
        self.tpdos[FORECAST_TPDO] = on_event(FORECAST_BASE);
        self.decimation = 0;
    }

    /// The PDO whose communication parameters stand at this index.
    fn pdo(&mut self, object: u16) -> Option<&mut PdoCommunication> {
        match object {
            index::RPDO_MASS => Some(&mut self.rpdo),
            _ => self.tpdos.get_mut(usize::from(object.checked_sub(index::TPDO_ALARM)?)),
        }
    }
}

/// The dictionary for the duration of one access.
pub struct View<'a, const N: usize> {
    /// The sensor.
    pub shared: &'a Shared<N>,
    /// The node.
    pub node: &'a mut NodeObjects,
    /// Now, ms since power-up.
    pub now_ms: u64,
}

/// The objects that each PDO carries, in the order of the frame; 0x1600 and 0x1A00 to 0x1A07.
#[must_use]
pub fn mapped(object: u16) -> Option<u16> {
    match object {
        index::RPDO_MASS_MAPPING => Some(index::RECEIVED_MASS),
        index::TPDO_ALARM_MAPPING => Some(index::ALARM),
        0x1A01..=0x1A05 => Some(index::EVENT + (object - 0x1A01)),
        0x1A06 => Some(index::SAMPLES),
        0x1A07 => Some(index::FORECAST),
        _ => None,
    }
}

impl<const N: usize> View<'_, N> {
    fn find(index: u16, sub: u8) -> Result<(&'static Object, Option<AccessType>), AbortCode> {
        let object = object::find(index).ok_or(AbortCode::NoSuchObject)?;
        match object.sub(sub) {
            Some(found) => Ok((object, Some(found.access))),
            None if sub == 0 && object.has_count() => Ok((object, None)),
            None => Err(AbortCode::NoSuchSubIndex),
        }
    }

    /// Reads a value of fixed length.
    ///
    /// # Errors
    /// The abort code.
    pub fn value(&mut self, object: u16, sub: u8) -> Result<Value, AbortCode> {
        if let Some(value) = self.shared.settings.lock(|settings| settings.borrow().read(object, sub)) {
            return Ok(value);
        }
        let node_id = self.node.node_id.map_or(0, u32::from);
        match object {
            0x1A00..=0x1A07 | index::RPDO_MASS_MAPPING => self.mapping(object, sub),
            index::RPDO_MASS | 0x1800..=0x1807 => {
                let pdo = self.node.pdo(object).ok_or(AbortCode::NoSuchObject)?;
                Ok(if sub == 1 { Value::U32(pdo.cob_id) } else { Value::U8(pdo.transmission) })
            }
            index::ALARM => Ok(self.slice(index::ALARM, sub, self.shared.last_alarm())),
            0x2110..=0x2114 => Ok(self.slice(object, sub, self.node.event[usize::from(object - index::EVENT)])),
            index::FORECAST => Ok(self.slice(index::FORECAST, sub, self.shared.last_forecast())),
            index::STREAM => Ok(Value::U16(self.node.decimation)),
            index::LOCK => Ok(match (sub, self.shared.lock()) {
                (1, None) => Value::U8(2),
                (1, Some(lock)) => Value::U8(u8::from(lock.is_locked())),
                (_, lock) => Value::U32(lock.map_or(0, |lock| lock.counter())),
            }),
            index::SAMPLES => Ok(self.slice(index::SAMPLES, sub, self.shared.last_samples())),
            0x2000..=0x20FF => self.transaction(object, sub),
            index::RECEIVED_MASS | index::TIME => self.received(object, sub),
            index::EVENT_LOG => self.shared.log.lock(|log| {
                let log = log.borrow();
                Ok(Value::U32(match sub {
                    1 => log.first(),
                    2 => log.last(),
                    3 => log.overwritten(),
                    _ => self.node.selected,
                }))
            }),
            0x2300 | 0x2301 => self.recording(SlotId((object - index::RECORDING) as u8), sub),
            index::LOSSES => Ok(Value::U32(self.loss(sub))),
            index::BUS => {
                let bus = self.shared.bus.lock(core::cell::Cell::get);
                Ok(match sub {
                    1 => Value::U8(bus.state as u8),
                    2 => Value::U16(bus.transmit_errors),
                    _ => Value::U16(bus.receive_errors),
                })
            }
            index::BOARD | index::DETECTOR => Ok(self.board(object, sub)),
            index::ERROR_REGISTER => Ok(Value::U8(self.node.faults.register())),
            index::ERROR_HISTORY if sub == 0 => Ok(Value::U8(self.node.faults.remembered() as u8)),
            index::ERROR_HISTORY => {
                self.node.faults.history(usize::from(sub) - 1).map(Value::U32).ok_or(AbortCode::NoData)
            }
            0x1000 => Ok(Value::U32(0)),
            index::DEVICE_NAME => Ok(Value::Text("thud impact sensor")),
            index::HARDWARE_VERSION => {
                Ok(Value::Text(HARDWARE.get(self.shared.identity.hardware_revision as usize).unwrap_or(&"unknown")))
            }
            index::SOFTWARE_VERSION => Ok(Value::Text(env!("CARGO_PKG_VERSION"))),
            index::STORE | index::RESTORE => Ok(Value::U32(1)),
            // Bit 31: consumes TIME.
            index::TIME_COB_ID => Ok(Value::U32(1 << 31 | TIME_ID as u32)),
            index::EMERGENCY_COB_ID => Ok(Value::U32(0x80 + node_id)),
            index::HEARTBEAT => Ok(Value::U16(self.node.heartbeat_ms)),
            index::IDENTITY => Ok(Value::U32(match sub {
                1 => 0,
                2 => PRODUCT_CODE,
                3 => REVISION_NUMBER,
                _ => self.shared.identity.serial,
            })),
            index::SDO_SERVER => Ok(Value::U32(if sub == 1 { 0x600 } else { 0x580 } + node_id)),
            _ => Err(AbortCode::NoSuchObject),
        }
    }

    fn mapping(&self, object: u16, sub: u8) -> Result<Value, AbortCode> {
        let target = mapped(object).and_then(object::find).ok_or(AbortCode::NoSuchObject)?;
        let entry = target.sub(sub).ok_or(AbortCode::NoSuchSubIndex)?;
        let bits = entry.size() as u32 * 8;
        Ok(Value::U32(u32::from(target.index) << 16 | u32::from(sub) << 8 | bits))
    }

    /// The bytes of a mapped sub-object within its frame.
    fn slice(&self, object: u16, sub: u8, frame: [u8; 8]) -> Value {
        let subs = object::find(object).map_or(&[][..], |object| object.subs);
        let start: usize = subs.iter().take_while(|entry| entry.sub < sub).map(object::Sub::size).sum();
        let size = subs.iter().find(|entry| entry.sub == sub).map_or(0, object::Sub::size);
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(&frame[start..start + size]);
        Value::Bytes(bytes, size as u8)
    }

    fn transaction(&self, object: u16, sub: u8) -> Result<Value, AbortCode> {
        self.shared.settings.lock(|settings| {
            let settings = settings.borrow();
            let refusal = settings.refusal();
            Ok(match (object, sub) {
                (index::TRANSACTION, 2) => Value::U8(settings.state()),
                (index::TRANSACTION, 3) => Value::U32(settings.active().revision),
                (index::TRANSACTION, 4) => Value::U32(settings.active().hash),
                (index::REFUSAL, 1) => Value::U32(refusal.count),
                (index::REFUSAL, 2) => Value::U32(u32::from(refusal.index) << 8 | u32::from(refusal.sub)),
                (index::REFUSAL, 3) => Value::U8(refusal.reason),
                (index::REFUSAL, 4) => Value::F32(refusal.lowest),
                (index::REFUSAL, 5) => Value::F32(refusal.highest),
                (index::REFUSAL, 6) => Value::F32(refusal.offered),
                _ => return Err(AbortCode::NoSuchSubIndex),
            })
        })
    }

    fn received(&self, object: u16, sub: u8) -> Result<Value, AbortCode> {
        let (mass, time) = (&self.node.mass, &self.node.time);
        Ok(match (object, sub) {
            (index::RECEIVED_MASS, 1) => Value::F32(mass.latest.map_or(0.0, |(mass, _)| mass.0)),
            (index::RECEIVED_MASS, 2) => Value::U16(mass.sequence),
            (index::RECEIVED_MASS, 3) => Value::U32(
                mass.latest
                    .map_or(u32::MAX, |(_, at)| u32::try_from(self.now_ms.saturating_sub(at)).unwrap_or(u32::MAX - 1)),
            ),
            (index::RECEIVED_MASS, 4) => Value::U32(mass.taken),
            (index::RECEIVED_MASS, 5) => Value::U32(mass.refused),
            (index::RECEIVED_MASS, 6) => Value::U32(mass.missed),
            (index::TIME, 1) => Value::U32(time.milliseconds),
            (index::TIME, 2) => Value::U16(time.days),
            (index::TIME, 3) => Value::U64(time.index),
            _ => return Err(AbortCode::NoSuchSubIndex),
        })
    }

    fn recording(&self, slot: SlotId, sub: u8) -> Result<Value, AbortCode> {
        let recording = self.intact(slot);
        if sub == 1 {
            return Ok(Value::U8(u8::from(recording.is_ok())));
        }
        let recording = recording?;
        Ok(match sub {
            2 => Value::U32(recording.impact),
            3 => Value::U64(recording.first_index),
            4 => Value::U32(recording.length),
            5 => Value::U32(recording.crc),
            6 => Value::F32(recording.sample_rate.0),
            7 => Value::F32(recording.newton_per_code),
            8 => Value::F32(recording.zero),
            9 => Value::U64(recording.onset_index),
            10 => Value::U32(recording.revision),
            11 => Value::U32(recording.hash),
            _ => return Err(AbortCode::NoSuchSubIndex),
        })
    }

    /// What is known about the curve in a slot, while the slot still holds that curve.
    fn intact(&self, slot: SlotId) -> Result<crate::shared::Recording, AbortCode> {
        let recording = self.shared.recording(slot).ok_or(AbortCode::NoData)?;
        let curve = self.shared.captures.curve(slot);
        if curve.first_index() == recording.first_index && curve.len() == recording.length as usize {
            Ok(recording)
        } else {
            Err(AbortCode::NoData)
        }
    }

    fn loss(&self, sub: u8) -> u32 {
        let counters = self.shared.counters();
        let outbox = self.shared.with_outbox(|outbox| outbox.losses());
        match sub {
            1 => counters.overruns,
            2 => counters.lost_samples,
            3 => outbox.evicted,
            4 => outbox.refused.saturating_add(counters.faults_untold),
            5 => counters.not_received,
            6 => self.shared.log.lock(|log| log.borrow().overwritten()),
            7 => counters.torn_downloads.saturating_add(self.shared.captures.lost_curves().not_kept),
            8 => counters.bus_off,
            9 => counters.not_evaluated,
            10 => counters.alarms_withheld,
            11 => counters.not_sent,
            12 => counters.storage_failures,
            13 => counters.stream_dropped,
            _ => counters.changes_rejected,
        }
    }

    fn board(&self, object: u16, sub: u8) -> Value {
        let detector = self.shared.detector();
        match (object, sub) {
            (index::BOARD, 1) => Value::U32((self.now_ms / 1000) as u32),
            (index::BOARD, 2) => Value::U64(detector.next_index),
            (index::BOARD, 3) => Value::U8(self.shared.identity.reset_cause as u8),
            (index::BOARD, 4) => Value::U32(self.shared.identity.hardware_revision),
            (index::BOARD, 6) => Value::U64(self.shared.identity.build),
            (index::BOARD, 7) => Value::U32(crate::dictionary::object::hash()),
            (index::BOARD, 8) => Value::U32(self.shared.start()),
            (index::BOARD, _) => Value::U8(match self.shared.loaded {
                Loaded::Found(_) => 0,
                Loaded::Nothing => 1,
                Loaded::Unreadable => 2,
            }),
            (_, 1) => Value::F32(detector.zero),
            (_, 2) => Value::F32(detector.noise.0),
            (_, 3) => Value::F32(detector.hum.0),
            (_, 4) => Value::U8(u8::from(detector.settled)),
            (_, 5) => Value::U8(u8::from(detector.impact_open)),
            _ => Value::F32(detector.threshold.0),
        }
    }

    /// Takes an effective mass, from an RPDO (with its sequence number) or an SDO.
    ///
    /// # Errors
    /// [`AbortCode::ValueTooLow`], [`AbortCode::ValueTooHigh`], [`AbortCode::InvalidValue`].
    pub fn take_mass(&mut self, frame: MassFrame, counted: bool) -> Result<(), AbortCode> {
        let mass = &mut self.node.mass;
        if counted {
            if mass.taken.wrapping_add(mass.refused) > 0 {
                let skipped = frame.sequence.wrapping_sub(mass.sequence).wrapping_sub(1);
                // More than half the range is a controller that began anew (or a repetition), not a loss.
                if skipped < 0x8000 {
                    mass.missed = mass.missed.saturating_add(u32::from(skipped));
                }
            }
            mass.sequence = frame.sequence;
        }
        let (low, high) = Setting::EffectiveMass.range().unwrap_or((0.0, f32::MAX));
        let value = frame.mass.0;
        if !(value >= low && value <= high) {
            mass.refused = mass.refused.saturating_add(1);
            return Err(if value < low {
                AbortCode::ValueTooLow
            } else if value > high {
                AbortCode::ValueTooHigh
            } else {
                AbortCode::InvalidValue
            });
        }
        mass.taken = mass.taken.saturating_add(1);
        mass.latest = Some((frame.mass, self.now_ms));
        self.shared.mass.signal(frame.mass);
        Ok(())
    }

    /// Whether this object may be written now: what is configuration not while armed, and not without the key.
    fn may_write(&self, object: u16, sub: u8) -> Result<(), AbortCode> {
        let settings = matches!(object, 0x2000..=0x2004 | index::TRANSACTION | index::STORE | index::RESTORE);
        let pdo = matches!(object, index::RPDO_MASS | 0x1800..=0x1807);
        let lock = object == index::LOCK;
        if (settings || pdo || lock) && self.node.nmt == NmtState::Operational {
            return Err(AbortCode::CantStoreDeviceState);
        }
        let open = self.shared.lock().is_some_and(|lock| !lock.is_locked());
        if (settings || pdo || lock && sub != 3) && !open {
            return Err(AbortCode::CantStoreLocalControl);
        }
        Ok(())
    }

    /// A signed change: all of its settings or none.
    fn change(&mut self, change: &[u8]) -> Result<(), AbortCode> {
        let serial = self.shared.identity.serial;
        let accepted = self.shared.with_lock(|lock| lock.as_mut().map(|lock| lock.accept(serial, change)));
        let entries = match accepted {
            Some(Ok(entries)) => entries,
            Some(Err(Rejected::TooShort)) => return Err(AbortCode::DataTypeMismatchLengthLow),
            Some(Err(_)) | None => {
                self.shared.count(|counters| counters.changes_rejected = counters.changes_rejected.saturating_add(1));
                return Err(AbortCode::CantStoreLocalControl);
            }
        };
        // The counter is used from now on, whatever becomes of the settings.
        self.shared.store.signal(());
        self.shared.settings.lock(|settings| settings.borrow_mut().discard());
        let staged = self.stage(entries);
        let done = staged.and_then(|staged| if staged { self.apply(false) } else { Ok(()) });
        if done.is_err() {
            self.shared.settings.lock(|settings| settings.borrow_mut().discard());
            return done;
        }
        for (object, sub, value) in entries.flatten() {
            if let (index::LOCK, 4, Ok(key)) = (object, sub, <[u8; KEY]>::try_from(value)) {
                self.set_key(key);
            }
        }
        Ok(())
    }

    /// Stages the settings of a change; whether there was any.
    fn stage(&mut self, entries: crate::configuration_lock::Settings<'_>) -> Result<bool, AbortCode> {
        let mut staged = false;
        for entry in entries {
            let (object, sub, value) = entry.map_err(|_| AbortCode::NoSuchObject)?;
            if object != index::LOCK {
                self.shared.settings.lock(|settings| settings.borrow_mut().write(object, sub, value))?;
                staged = true;
            }
        }
        Ok(staged)
    }

    fn set_key(&mut self, key: [u8; KEY]) {
        self.shared.with_lock(|lock| {
            if let Some(lock) = lock {
                lock.set_key(key);
            }
        });
        self.shared.store.signal(());
    }

    /// Makes what was staged active and lets the detector and storage know.
    fn apply(&mut self, restore: bool) -> Result<(), AbortCode> {
        let stamped = self.shared.settings.lock(|settings| {
            let mut settings = settings.borrow_mut();
            if restore { settings.restore() } else { settings.apply() }
        })?;
        self.node.heartbeat_ms = stamped.configuration.node.heartbeat_ms;
        self.shared.configure.signal(stamped);
        self.shared.store.signal(());
        Ok(())
    }
}

/// COB-ID of TIME.
pub const TIME_ID: u16 = 0x100;

/// Hardware revisions by number.
const HARDWARE: [&str; 2] = ["simulated", "NUCLEO-G474RE with IEPE front end"];

impl<const N: usize> Entries for View<'_, N> {
    fn open(&mut self, object: u16, sub: u8, value: &mut [u8; VALUE]) -> Result<Opened, AbortCode> {
        let (found, access) = Self::find(object, sub)?;
        match access {
            None => {
                value[0] = found.highest();
                return Ok(Opened::Value(1));
            }
            Some(access) if !access.is_readable() => return Err(AbortCode::WriteOnly),
            Some(_) => {}
        }
        match (object, sub) {
            (index::EVENT_LOG, 5) => {
                let event = self.shared.log.lock(|log| {
                    let log = log.borrow();
                    let number = if self.node.selected == 0 { log.last() } else { self.node.selected };
                    log.get(number).copied()
                });
                let record = event_record::encode(&event.ok_or(AbortCode::NoData)?, self.shared.start());
                value[..record.len()].copy_from_slice(&record);
                Ok(Opened::Value(record.len()))
            }
            (0x2300 | 0x2301, 12) => {
                let slot = (object - index::RECORDING) as u8;
                let recording = self.intact(SlotId(slot))?;
                Ok(Opened::Stream(Stream { slot, generation: recording.impact, length: recording.length * 2 }))
            }
            _ => Ok(Opened::Value(self.value(object, sub)?.write_to(value))),
        }
    }

    fn read(&mut self, stream: Stream, offset: u32, into: &mut [u8]) -> Result<(), AbortCode> {
        let slot = SlotId(stream.slot);
        let recording = self.intact(slot).ok().filter(|recording| recording.impact == stream.generation);
        let read = recording.and_then(|recording| {
            let curve = self.shared.captures.curve(slot);
            if curve.first_index() != recording.first_index {
                return None;
            }
            // A piece may begin and end in the middle of a sample.
            let (mut at, mut filled) = (offset as usize, 0);
            while filled < into.len() {
                let mut codes = [0; 8];
                let wanted = (at % 2 + into.len() - filled).div_ceil(2).min(codes.len());
                if curve.read(at / 2, &mut codes[..wanted]) != wanted {
                    return None;
                }
                for byte in codes[..wanted].iter().flat_map(|code| code.to_le_bytes()).skip(at % 2) {
                    if let Some(place) = into.get_mut(filled) {
                        *place = byte;
                        filled += 1;
                    }
                }
                at = offset as usize + filled;
            }
            Some(())
        });
        if read.is_none() {
            self.shared.count(|counters| counters.torn_downloads = counters.torn_downloads.saturating_add(1));
            return Err(AbortCode::CantStoreDeviceState);
        }
        if offset as usize + into.len() >= stream.length as usize {
            self.shared.captures.mark_fetched(slot);
        }
        Ok(())
    }

    fn writable(&self, index: u16, sub: u8) -> Result<(), AbortCode> {
        match Self::find(index, sub)?.1 {
            Some(access) if access.is_writable() => self.may_write(index, sub),
            _ => Err(AbortCode::ReadOnly),
        }
    }

    fn write(&mut self, object: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        self.writable(object, sub)?;
        match (object, sub) {
            (0x2000..=0x2004, _) => {
                self.shared.settings.lock(|settings| settings.borrow_mut().write(object, sub, data))
            }
            (index::TRANSACTION, 1) => match u8_from(data)? {
                APPLY => self.apply(false),
                DISCARD => {
                    self.shared.settings.lock(|settings| settings.borrow_mut().discard());
                    Ok(())
                }
                _ => Err(AbortCode::InvalidValue),
            },
            (index::STORE, 1) => match u32_from(data)? {
                SAVE => {
                    self.shared.store.signal(());
                    Ok(())
                }
                _ => Err(AbortCode::CantStore),
            },
            (index::RESTORE, 1) => match u32_from(data)? {
                LOAD => self.apply(true),
                _ => Err(AbortCode::CantStore),
            },
            (index::ERROR_HISTORY, 0) => match u8_from(data)? {
                0 => {
                    self.node.faults.forget();
                    Ok(())
                }
                _ => Err(AbortCode::InvalidValue),
            },
            (index::HEARTBEAT, 0) => {
                self.node.heartbeat_ms = u16_from(data)?;
                Ok(())
            }
            (index::RPDO_MASS | 0x1800..=0x1807, _) => {
                self.node.pdo(object).ok_or(AbortCode::NoSuchObject)?.set(sub, data)
            }
            (index::LOCK, 3) => self.change(data),
            (index::LOCK, 4) => {
                self.set_key(exactly(data)?);
                Ok(())
            }
            (index::STREAM, 1) => match u16_from(data)? {
                decimation if decimation <= stream::MOST => {
                    self.node.decimation = decimation;
                    Ok(())
                }
                _ => Err(AbortCode::ValueTooHigh),
            },
            (index::RECEIVED_MASS, 1) => {
                let mass = Kilogram(f32_from(data)?);
                self.take_mass(MassFrame { mass, sequence: 0 }, false)
            }
            (index::RECEIVED_MASS, 2) => {
                self.node.mass.sequence = u16_from(data)?;
                Ok(())
            }
            (index::EVENT_LOG, 4) => {
                self.node.selected = u32_from(data)?;
                Ok(())
            }
            _ => Err(AbortCode::NoSuchObject),
        }
    }
}

#[cfg(test)]
mod tests {
    use zencan_common::objects::PdoMappable;

    use super::*;

    #[test]
    fn every_mapping_names_exactly_the_mappable_sub_objects_and_fills_at_most_a_frame() {
        for mapping in object::OBJECTS.iter().filter(|object| mapped(object.index).is_some()) {
            let target = mapped(mapping.index).and_then(object::find).unwrap();
            let carried: std::vec::Vec<_> =
                target.subs.iter().filter(|sub| !matches!(sub.pdo, PdoMappable::None)).collect();
            assert_eq!(mapping.subs.len(), carried.len(), "0x{:04X}", mapping.index);
            assert!(carried.iter().map(|sub| sub.size()).sum::<usize>() <= 8);
            assert!(mapping.subs.iter().zip(carried).all(|(entry, sub)| entry.sub == sub.sub));
        }
        assert_eq!(object::OBJECTS.iter().filter(|object| mapped(object.index).is_some()).count(), 1 + TPDOS);
    }

    #[test]
    fn an_identifier_that_belongs_to_another_service_is_refused() {
        let mut pdo = PdoCommunication { cob_id: 0x200, transmission: 254 };
        for taken in [0u32, 0x80, 0x100, 0x5A0, 0x620, 0x720, 0x7E5, 0x800, 1 << 29 | 0x181] {
            assert_eq!(pdo.set(1, &taken.to_le_bytes()), Err(AbortCode::InvalidValue), "0x{taken:X}");
        }
        assert_eq!(pdo.id(), Some(0x200));
        pdo.set(1, &(1u32 << 31).to_le_bytes()).unwrap();
        assert_eq!(pdo.id(), None);
        pdo.set(1, &0x01Fu32.to_le_bytes()).unwrap();
        assert_eq!(pdo.id(), Some(0x01F));
        assert_eq!(pdo.set(2, &[1]), Err(AbortCode::InvalidValue), "synchronous transmission is not offered");
    }
}
