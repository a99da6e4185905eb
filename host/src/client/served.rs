//! A toy bus for tests: the firmware's own SDO server over a table of objects, in virtual time, with faults on the
//! way.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use thud_firmware::board::Frame;
use thud_firmware::dictionary::{PRODUCT_CODE, index};
use thud_firmware::sdo::{Entries, Opened, SdoServer, Stream, VALUE};
use zencan_common::sdo::AbortCode;

use crate::bus::{Bus, BusError, Counters, Stamped};

/// Objects of a node.
#[derive(Clone, Default)]
pub struct Table(pub BTreeMap<(u16, u8), Vec<u8>>);

impl Table {
    /// A node that says who it is.
    pub fn of(serial: u32) -> Self {
        let mut table = Self::default();
        table.put(index::IDENTITY, 2, &PRODUCT_CODE.to_le_bytes());
        table.put(index::IDENTITY, 4, &serial.to_le_bytes());
        table
    }

    /// Sets an object.
    pub fn put(&mut self, index: u16, sub: u8, bytes: &[u8]) {
        self.0.insert((index, sub), bytes.to_vec());
    }
}

impl Entries for Table {
    fn open(&mut self, index: u16, sub: u8, value: &mut [u8; VALUE]) -> Result<Opened, AbortCode> {
        let bytes = self.0.get(&(index, sub)).ok_or(AbortCode::NoSuchObject)?;
        if bytes.len() <= VALUE {
            value[..bytes.len()].copy_from_slice(bytes);
            return Ok(Opened::Value(bytes.len()));
        }
        // The slot names the object, so that pieces can be found again.
        let slot = self.0.keys().position(|key| *key == (index, sub)).unwrap() as u8;
        Ok(Opened::Stream(Stream { slot, generation: 0, length: bytes.len() as u32 }))
    }

    fn read(&mut self, stream: Stream, offset: u32, into: &mut [u8]) -> Result<(), AbortCode> {
        let bytes = self.0.values().nth(stream.slot.into()).ok_or(AbortCode::GeneralError)?;
        into.copy_from_slice(&bytes[offset as usize..][..into.len()]);
        Ok(())
    }

    fn write(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), AbortCode> {
        *self.0.get_mut(&(index, sub)).ok_or(AbortCode::NoSuchObject)? = data.to_vec();
        Ok(())
    }

    fn writable(&self, index: u16, sub: u8) -> Result<(), AbortCode> {
        self.0.contains_key(&(index, sub)).then_some(()).ok_or(AbortCode::NoSuchObject)
    }
}

/// Changes a frame on its way, or loses it (`false`).
pub type Fault = Box<dyn FnMut(&mut Frame) -> bool>;

/// The bus.
pub struct ServedBus {
    nodes: Vec<(u8, SdoServer, Table)>,
    waiting: VecDeque<Frame>,
    now: Duration,
    fault: Fault,
    counters: Counters,
    echoed: bool,
    owed: Vec<Frame>,
}

/// Time of a frame of eight bytes at 1 Mbit/s.
const FRAME: Duration = Duration::from_micros(130);

impl ServedBus {
    /// Nodes with these ids and objects, and a bus without faults.
    pub fn new(nodes: Vec<(u8, Table)>) -> Self {
        let nodes = nodes.into_iter().map(|(id, table)| (id, SdoServer::new(), table)).collect();
        Self {
            nodes,
            waiting: VecDeque::new(),
            now: Duration::ZERO,
            fault: Box::new(|_| true),
            counters: Counters::default(),
            echoed: false,
            owed: Vec::new(),
        }
    }

    /// With another master that asks everything too, at the same time.
    pub fn echoed(mut self) -> Self {
        self.echoed = true;
        self
    }

    /// An answer that is owed to another master: it comes when the same object is asked for next.
    pub fn owe(&mut self, answer: Frame) {
        self.owed.push(answer);
    }

    /// With faults.
    pub fn with(mut self, fault: impl FnMut(&mut Frame) -> bool + 'static) -> Self {
        self.fault = Box::new(fault);
        self
    }

    /// A frame that somebody else sends.
    pub fn hear(&mut self, frame: Frame) {
        self.waiting.push_back(frame);
    }

    fn put(&mut self, mut frame: Frame) {
        if (self.fault)(&mut frame) {
            self.waiting.push_back(frame);
        }
    }
}

impl Bus for ServedBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.now += FRAME;
        self.counters.sent += 1;
        let mut frame = *frame;
        if !(self.fault)(&mut frame) {
            return Ok(());
        }
        self.waiting.extend(self.owed.extract_if(.., |answer| answer.data[1..4] == frame.data[1..4]));
        let now_ms = self.now.as_millis() as u64;
        for again in [false, true] {
            if again && !self.echoed {
                break;
            }
            let mut answers = Vec::new();
            for (id, server, table) in &mut self.nodes {
                if frame.id == 0x600 + u16::from(*id)
                    && let Some(data) = server.receive(frame.bytes(), now_ms, table)
                {
                    answers.push(Frame { id: 0x580 + u16::from(*id), len: 8, data });
                }
            }
            if again {
                self.waiting.push_back(frame);
            }
            answers.into_iter().for_each(|answer| self.put(answer));
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = self.now + timeout;
        loop {
            if let Some(frame) = self.waiting.pop_front() {
                self.now += FRAME;
                self.counters.received += 1;
                return Ok(Some(Stamped { frame, at: self.now }));
            }
            let mut segments = Vec::new();
            for (id, server, table) in &mut self.nodes {
                if let Some(data) = server.segment(table) {
                    segments.push(Frame { id: 0x580 + u16::from(*id), len: 8, data });
                }
            }
            if segments.is_empty() {
                self.now = deadline.max(self.now);
                return Ok(None);
            }
            segments.into_iter().for_each(|segment| self.put(segment));
        }
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn describe(&self) -> String {
        "toy bus".to_owned()
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }
}
