//! The client's end of the bus: every frame is kept for whoever needs it.
//!
//! While an SDO transfer waits for its answer, alarms and events keep arriving; they go to the inbox and are read
//! later by [`Line::next`]. The line also watches the SDO channels of all nodes: another master's requests are seen, so
//! that one's own wait for a quiet moment, and an answer that nobody asked for means that two devices share a node id.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use thud_firmware::board::Frame;
use zencan_common::sdo::SdoResponse;

use crate::bus::{Bus, BusError, Counters, Stamped};

/// SDO requests go to 0x600 + node id, answers come from 0x580 + node id (CiA 301, pre-defined connection set).
const SDO_REQUEST: u16 = 0x600;
const SDO_ANSWER: u16 = 0x580;
/// Heartbeats come from 0x700 + node id.
const HEARTBEAT: u16 = 0x700;

/// Frames that wait to be read; beyond that the oldest are dropped and counted. A million idle heartbeats would fit
/// into 24 MB, but nobody reads them then.
const INBOX: usize = 65_536;

/// A transfer of another master counts as going on until its channel was quiet for so long.
const QUIET: Duration = Duration::from_millis(50);

/// What is known of one node's SDO channel.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    /// When another master last asked something.
    foreign: Option<Duration>,
    /// How often others have asked something.
    foreign_requests: u32,
    /// Answers that may still come to requests which were given up.
    owed: u32,
    /// Answers that nobody asked for.
    surplus: u32,
    /// The last heartbeat: NMT state, and when.
    heartbeat: Option<(u8, Duration)>,
}

/// A bus with an inbox.
pub struct Line {
    bus: Box<dyn Bus>,
    inbox: VecDeque<Stamped>,
    channels: [Channel; 128],
    dropped: u64,
    /// In a log: what others read out of nodes, by node, index and sub-index.
    overheard: BTreeMap<(u8, u16, u8), [u8; 4]>,
    overheard_count: u64,
}

impl Line {
    /// The line over this bus.
    #[must_use]
    pub fn new(bus: Box<dyn Bus>) -> Self {
        Self {
            bus,
            inbox: VecDeque::new(),
            channels: [Channel::default(); 128],
            dropped: 0,
            overheard: BTreeMap::new(),
            overheard_count: 0,
        }
    }

    /// The bus's clock.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.bus.now()
    }

    /// The bus, for a person.
    #[must_use]
    pub fn describe(&self) -> String {
        self.bus.describe()
    }

    /// What the transport counted; frames that overflowed the inbox are among the lost.
    #[must_use]
    pub fn counters(&self) -> Counters {
        let mut counters = self.bus.counters();
        counters.lost += self.dropped;
        counters
    }

    /// Sends a frame.
    ///
    /// # Errors
    /// [`BusError::Send`].
    pub fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    /// The next frame that no transfer has taken; `None` when none comes within `timeout`.
    ///
    /// # Errors
    /// [`BusError::Receive`].
    pub fn next(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        if let Some(stamped) = self.inbox.pop_front() {
            return Ok(Some(stamped));
        }
        let deadline = self.now() + timeout;
        loop {
            let left = deadline.saturating_sub(self.now());
            match self.take(left)? {
                // An answer outside a transfer: counted by `take`, of no use to anybody.
                Some(stamped) if answers(&stamped.frame).is_some() => {}
                // A wait that a signal cut short is over as well.
                other => return Ok(other),
            }
            if self.now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// Whether nobody is there who could answer: a log is played back.
    #[must_use]
    pub fn is_playback(&self) -> bool {
        self.bus.is_playback()
    }

    /// Whether nothing that was heard during a transfer still waits to be read.
    #[must_use]
    pub fn is_read(&self) -> bool {
        self.inbox.is_empty()
    }

    /// Whether nothing will ever come any more.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.inbox.is_empty() && self.bus.ended()
    }

    /// While a log is played back: what an object of up to four bytes held when it was last read by whoever is in the log.
    #[must_use]
    pub fn overheard(&self, node: u8, index: u16, sub: u8) -> Option<[u8; 4]> {
        self.overheard.get(&(node, index, sub)).copied()
    }

    /// How many answers have been overheard so far.
    #[must_use]
    pub fn overheard_count(&self) -> u64 {
        self.overheard_count
    }

    /// Listens for a while and keeps nothing: what was heard is with the bus, which logs it.
    ///
    /// # Errors
    /// [`BusError::Receive`].
    pub fn hear(&mut self, timeout: Duration) -> Result<(), BusError> {
        self.inbox.clear();
        self.receive(timeout).map(drop)
    }

    /// How many answers of this node nobody had asked for: another device with the same id gave them.
    #[must_use]
    pub fn surplus_answers(&self, node: u8) -> u32 {
        self.channels[usize::from(node & 0x7F)].surplus
    }

    /// The node's NMT state as its last heartbeat said, and when it was heard.
    #[must_use]
    pub fn heartbeat(&self, node: u8) -> Option<(u8, Duration)> {
        self.channels[usize::from(node & 0x7F)].heartbeat
    }

    /// Before a transfer: what still lies on the channel is sorted out, and another master's transfer is let finish,
    /// for at most `patience`.
    pub(super) fn quiet(&mut self, node: u8, patience: Duration) -> Result<(), BusError> {
        let deadline = self.now() + patience;
        loop {
            while let Some(stamped) = self.take(Duration::ZERO)? {
                self.keep(stamped);
            }
            let busy_until = self.channels[usize::from(node)].foreign.map(|at| at + QUIET);
            match busy_until {
                Some(until) if until > self.now() && self.now() < deadline => {
                    if let Some(stamped) = self.take(until.saturating_sub(self.now()))? {
                        self.keep(stamped);
                    }
                }
                _ => return Ok(()),
            }
        }
    }

    /// Sends an SDO request.
    pub(super) fn ask(&mut self, node: u8, request: [u8; 8]) -> Result<(), BusError> {
        self.bus.send(&Frame { id: SDO_REQUEST + u16::from(node), len: 8, data: request })
    }

    /// The next SDO answer of this node; all else goes to the inbox.
    pub(super) fn answer(&mut self, node: u8, timeout: Duration) -> Result<Option<[u8; 8]>, BusError> {
        let deadline = self.now() + timeout;
        loop {
            let left = deadline.saturating_sub(self.now());
            if let Some(stamped) = self.receive(left)? {
                if stamped.frame.id == SDO_ANSWER + u16::from(node) && stamped.frame.len == 8 {
                    return Ok(Some(stamped.frame.data));
                }
                self.keep(stamped);
            }
            if self.now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// A request was given up: its answer may still come, and means nothing.
    pub(super) fn give_up(&mut self, node: u8) {
        self.channels[usize::from(node)].owed += 1;
    }

    /// Whether another master used this node's channel within the last `span`.
    pub(super) fn shared(&self, node: u8, span: Duration) -> bool {
        self.channels[usize::from(node)].foreign.is_some_and(|at| at + span >= self.now())
    }

    /// How often other masters have asked this node something, so far.
    pub(super) fn foreign_requests(&self, node: u8) -> u32 {
        self.channels[usize::from(node)].foreign_requests
    }

    /// An answer came that belongs to no request of ours.
    pub(super) fn unasked(&mut self, node: u8) {
        let shared = self.shared(node, Duration::from_secs(1));
        let channel = &mut self.channels[usize::from(node)];
        if channel.owed > 0 {
            channel.owed -= 1;
        } else if !shared {
            channel.surplus += 1;
        }
    }

    /// Receives, and notes what other masters ask and in which state nodes are.
    pub(super) fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let stamped = self.bus.receive(timeout)?;
        if let Some(Stamped { frame, at }) = stamped {
            if let Some(node) = node_of(&frame, SDO_REQUEST) {
                let channel = &mut self.channels[usize::from(node)];
                channel.foreign = Some(at);
                channel.foreign_requests = channel.foreign_requests.wrapping_add(1);
            } else if let (Some(node), [state]) = (node_of(&frame, HEARTBEAT), frame.bytes()) {
                self.channels[usize::from(node)].heartbeat = Some((*state, at));
            } else if let (true, Some(node)) = (self.bus.is_playback(), answers(&frame))
                && let Ok(SdoResponse::ConfirmUpload { e: true, index, sub, data, .. }) = frame.data.try_into()
            {
                self.overheard.insert((node, index, sub), data);
                self.overheard_count += 1;
            }
        }
        Ok(stamped)
    }

    /// Receives outside a transfer, where no answer is expected.
    fn take(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let stamped = self.receive(timeout)?;
        if let Some(node) = stamped.and_then(|stamped| answers(&stamped.frame)) {
            self.unasked(node);
        }
        Ok(stamped)
    }

    pub(super) fn keep(&mut self, stamped: Stamped) {
        if answers(&stamped.frame).is_some() {
            return;
        }
        if self.inbox.len() == INBOX {
            self.inbox.pop_front();
            self.dropped += 1;
        }
        self.inbox.push_back(stamped);
    }
}

/// The node whose SDO answer this is.
pub(super) fn answers(frame: &Frame) -> Option<u8> {
    node_of(frame, SDO_ANSWER)
}

/// The node of a frame whose identifier is `base` + node id.
pub(super) fn node_of(frame: &Frame, base: u16) -> Option<u8> {
    let node = frame.id.checked_sub(base)?;
    (1..=127).contains(&node).then_some(node as u8)
}
