//! The CANopen node as a state machine without I/O: frames in, frames into the outbox.
//!
//! ```text
//! frame ─┬─ NMT ───────▶ state, boot-up
//!        ├─ LSS ───────▶ lss::LssSlave
//!        ├─ SDO ───────▶ sdo::SdoServer ──▶ dictionary
//!        ├─ RPDO 1 ────▶ effective mass            (Operational only)
//!        └─ TIME
//! poll  ─┬─ faults ────▶ EMCY
//!        ├─ event log ─▶ TPDO 2 to 6, one event at a time, none overwritten   (Operational only)
//!        ├─ heartbeat
//!        └─ segments of a block upload, while there is room
//! ```
//!
//! Messages are those of `zencan-common`. Its node, `zencan-node` 0.0.5, is not used: it reads the heartbeat's period only once, sends
//! the state pre-operational for boot-up instead of 0, has no EMCY and no TIME, stores a PDO that came before the node was
//! Operational and applies it later, lets a TPDO's second value overwrite a first one that has not been sent; for its SDO server
//! see [`crate::sdo`], for its LSS slave [`crate::lss`]. A node id from LSS takes effect at the reset of communication, as CiA 305 has
//! it, because a master resets a node under its old id.

use zencan_common::lss::LssResponse;
use zencan_common::messages::{LSS_RESP_ID, NmtCommandSpecifier};
use zencan_common::nmt::NmtState;

use crate::board::{Frame, Listened, ResetCause};
use crate::capture::SlotId;
use crate::dictionary::access::{FORECAST_TPDO, NodeObjects, STREAM_TPDO, TIME_ID, TimeReceived, View};
use crate::dictionary::frame::{self, MassFrame, PARTS, Part};
use crate::dictionary::{PRODUCT_CODE, REVISION_NUMBER};
use crate::emergency::Fault;
use crate::lss::{Asked, LssSlave, NO_ID, NOT_STORED};
use crate::sdo::SdoServer;
use crate::shared::{Report, Shared};
use crate::storage::Loaded;

const NMT_ID: u16 = 0x000;
const LSS_REQUEST: u16 = 0x7E5;
const LSS_RESPONSE: u16 = 0x7E4;
/// A curve is kept for its upload this long: 4 096 segments one by one over a slow adapter take half a minute.
const LONGEST_UPLOAD_MS: u64 = 60_000;
/// SDO frames that may wait in the outbox at once; more would only wait there instead of in the capture.
const SDO_WINDOW: usize = 4;

/// The node.
pub struct CanOpenNode<const N: usize> {
    shared: &'static Shared<N>,
    lss: LssSlave,
    objects: NodeObjects,
    sdo: SdoServer,
    next_heartbeat_ms: u64,
    /// Number of the next event to be sent.
    next_event: u32,
    /// Slot whose curve is being uploaded, and since when.
    reserved: Option<(u8, u64)>,
    /// Node id assigned over LSS, or none, that holds from the next reset of communication on.
    pending_id: Option<Option<u8>>,
}

impl<const N: usize> CanOpenNode<N> {
    /// A node that boots up with the active configuration's node id.
    #[must_use]
    pub fn new(shared: &'static Shared<N>) -> Self {
        let settings = shared.active().configuration.node;
        let mut node = Self {
            shared,
            lss: LssSlave::new([0, PRODUCT_CODE, REVISION_NUMBER, shared.identity.serial]),
            objects: NodeObjects::new(settings),
            sdo: SdoServer::new(),
            next_heartbeat_ms: 0,
            next_event: 1,
            reserved: None,
            pending_id: None,
        };
        match shared.identity.reset_cause {
            ResetCause::Watchdog => shared.report(Report::Raised(Fault::Watchdog, 0)),
            ResetCause::Panic => shared.report(Report::Raised(Fault::Panic, shared.identity.ended_at)),
            _ => {}
        }
        if shared.loaded == Loaded::Unreadable {
            shared.report(Report::Raised(Fault::Configuration, 0));
        }
        node.boot(Some(settings.node_id), 0);
        node
    }

    /// NMT state.
    #[must_use]
    pub fn state(&self) -> NmtState {
        self.objects.nmt
    }

    /// Node id; `None` while LSS has taken it away.
    #[must_use]
    pub fn node_id(&self) -> Option<u8> {
        self.objects.node_id
    }

    /// What it listens to now: NMT, LSS, TIME, its SDO server, the effective mass. It has no use for SYNC: no PDO is synchronous.
    #[must_use]
    pub fn listens_to(&self) -> Listened {
        let sdo = self.objects.node_id.map(|id| 0x600 + u16::from(id));
        [Some(NMT_ID), Some(LSS_REQUEST), Some(TIME_ID), sdo, self.objects.rpdo.id()]
    }

    /// Takes a frame from the bus.
    pub fn receive(&mut self, frame: &Frame, now_ms: u64) {
        let own = |base: u16| self.objects.node_id.is_some_and(|id| frame.id == base + u16::from(id));
        let operational = self.objects.nmt == NmtState::Operational;
        if frame.id == NMT_ID {
            if let &[command, to] = frame.bytes() {
                self.command(command, to, now_ms);
            }
        } else if frame.id == LSS_REQUEST {
            let asked =
                frame.bytes().try_into().ok().and_then(|request| self.lss.receive(request, self.objects.node_id));
            if let Some(asked) = asked {
                self.serve_lss(asked, now_ms);
            }
        } else if own(0x600) {
            // CiA 301: no SDO while stopped.
            if self.objects.nmt != NmtState::Stopped {
                let mut view = View { shared: self.shared, node: &mut self.objects, now_ms };
                let answer = self.sdo.receive(frame.bytes(), now_ms, &mut view);
                self.answer(answer);
                self.route();
                self.reserve(now_ms);
            }
        } else if operational && self.objects.rpdo.id() == Some(frame.id) {
            match MassFrame::decode(frame.bytes()) {
                Ok(mass) => {
                    let mut view = View { shared: self.shared, node: &mut self.objects, now_ms };
                    // A value out of range is counted in the object.
                    let _ = view.take_mass(mass, true);
                }
                Err(_) => self.shared.report(Report::Raised(Fault::PdoLength, u32::from(frame.len))),
            }
        } else if frame.id == TIME_ID
            && let [a, b, c, d, low, high] = *frame.bytes()
        {
            self.objects.time = TimeReceived {
                // The upper four bits are reserved.
                milliseconds: u32::from_le_bytes([a, b, c, d]) & 0x0FFF_FFFF,
                days: u16::from_le_bytes([low, high]),
                index: self.shared.detector().next_index,
            };
        }
    }

    /// Does what time, the sensor and room in the outbox allow; to be called whenever one of them changes.
    pub fn poll(&mut self, now_ms: u64) {
        self.tell_faults();
        self.send_events();
        self.heartbeat(now_ms);
        let expired = self.sdo.expire(now_ms);
        self.answer(expired);
        self.send_segments(now_ms);
        self.reserve(now_ms);
    }

    /// When [`Self::poll`] is due again at the latest, ms.
    #[must_use]
    pub fn due_ms(&self, now_ms: u64) -> u64 {
        let idle = now_ms + 100;
        if self.objects.heartbeat_ms == 0 { idle } else { self.next_heartbeat_ms.clamp(now_ms + 1, idle) }
    }

    /// Obeys an NMT command to this node or to all.
    fn command(&mut self, command: u8, to: u8, now_ms: u64) {
        // Without an id there is nobody whom a command could mean, and all are those that have one.
        if self.objects.node_id.is_none_or(|id| to != 0 && to != id) {
            return;
        }
        let Ok(command) = NmtCommandSpecifier::from_byte(command) else { return };
        let before = self.objects.nmt;
        self.objects.nmt = match command {
            NmtCommandSpecifier::Start => NmtState::Operational,
            NmtCommandSpecifier::Stop => NmtState::Stopped,
            NmtCommandSpecifier::EnterPreOp => NmtState::PreOperational,
            NmtCommandSpecifier::ResetApp | NmtCommandSpecifier::ResetComm => {
                let stored = Some(self.shared.active().configuration.node.node_id);
                let id = self.pending_id.take().unwrap_or(stored);
                return self.boot(id, now_ms);
            }
        };
        if before != NmtState::Operational && self.objects.nmt == NmtState::Operational {
            // What happened before stays in the log; what happens from now on is sent.
            self.next_event = self.shared.log.lock(|log| log.borrow().next_number());
        }
        self.route();
    }

    /// Resets communication and says so by the boot-up message, with the node id that holds from now on.
    fn boot(&mut self, node_id: Option<u8>, now_ms: u64) {
        let heartbeat_ms = self.shared.active().configuration.node.heartbeat_ms;
        self.sdo.reset();
        self.objects.reset_communication(node_id.filter(|id| (1..=127).contains(id)), heartbeat_ms);
        self.objects.nmt = NmtState::PreOperational;
        self.next_heartbeat_ms = now_ms + u64::from(heartbeat_ms);
        if let Some(frame) = self.objects.node_id.and_then(|id| Frame::new(0x700 + u16::from(id), &[0])) {
            // Refused only when the outbox is full of more urgent frames; it counts that.
            let _ = self.shared.send(frame);
        }
        self.route();
    }

    fn serve_lss(&mut self, asked: Asked, now_ms: u64) {
        let answer = match asked {
            Asked::Answer(answer) => answer,
            Asked::NodeId(id) => {
                self.pending_id = Some(id);
                LssResponse::ConfigureNodeIdAck { error: 0, spec_error: 0 }
            }
            Asked::Store => {
                let error = if self.store_node_id() { 0 } else { NOT_STORED };
                LssResponse::StoreConfigurationAck { error, spec_error: 0 }
            }
        };
        if let Some(frame) = Frame::new(LSS_RESPONSE, answer.to_can_message(LSS_RESP_ID).data()) {
            // Refused only when the outbox is full of more urgent frames; the master then runs into its timeout.
            let _ = self.shared.send(frame);
        }
        // A node without an id has nothing to go on with under it.
        if let (None, Some(Some(id))) = (self.objects.node_id, self.pending_id) {
            self.pending_id = None;
            self.boot(Some(id), now_ms);
        }
    }

    /// Takes the node id into the stored configuration. It is configuration like any other: not while armed, not without the key.
    fn store_node_id(&self) -> bool {
        let node_id = self.pending_id.unwrap_or(self.objects.node_id).unwrap_or(NO_ID);
        let may = self.objects.nmt != NmtState::Operational && self.shared.lock().is_some_and(|lock| !lock.is_locked());
        let applied = may.then(|| self.shared.settings.lock(|settings| settings.borrow_mut().assign_node_id(node_id)));
        let Some(Ok(stamped)) = applied else { return false };
        self.shared.configure.signal(stamped);
        self.shared.store.signal(());
        true
    }

    /// Says to the sampler where alarms and the stream go.
    fn route(&self) {
        let sends = self.objects.nmt == NmtState::Operational;
        self.shared.route_alarm(self.objects.tpdos[0].id().filter(|_| sends));
        self.shared.route_forecast(self.objects.tpdos[FORECAST_TPDO].id().filter(|_| sends));
        let streams = sends && self.objects.decimation > 0;
        let stream = self.objects.tpdos[STREAM_TPDO].id().filter(|_| streams);
        self.shared.route_stream(stream.map(|id| (self.objects.decimation, id)));
    }

    /// The curve that is being uploaded stays until that is over.
    fn reserve(&mut self, now_ms: u64) {
        let uploaded = self.sdo.stream().map(|stream| stream.slot);
        if uploaded != self.reserved.map(|(slot, _)| slot) {
            self.reserved = uploaded.map(|slot| (slot, now_ms));
        }
        let patient = self.reserved.filter(|(_, since)| now_ms.saturating_sub(*since) < LONGEST_UPLOAD_MS);
        self.shared.captures.reserve(patient.map(|(slot, _)| SlotId(slot)));
    }

    fn answer(&self, answer: Option<[u8; 8]>) {
        if let (Some(data), Some(id)) = (answer, self.objects.node_id) {
            let frame = Frame { id: 0x580 + u16::from(id), len: 8, data };
            // Refused only when the outbox is full of more urgent frames; the master then runs into its timeout.
            let _ = self.shared.send(frame);
        }
    }

    fn tell_faults(&mut self) {
        while let Ok(report) = self.shared.reports.try_receive() {
            let told = match report {
                Report::Raised(fault, detail) => self.objects.faults.raise(fault, detail),
                Report::Cleared(fault) => self.objects.faults.clear(fault),
            };
            // CiA 301: no EMCY while stopped; the history keeps it.
            if let (Some(emergency), Some(id), true) =
                (told, self.objects.node_id, self.objects.nmt != NmtState::Stopped)
            {
                let frame = Frame { id: 0x80 + u16::from(id), len: 8, data: emergency.encode() };
                let _ = self.shared.send_urgent(frame);
            }
        }
    }

    fn send_events(&mut self) {
        if self.objects.nmt != NmtState::Operational {
            return;
        }
        loop {
            // An event goes out whole or waits in the log; and it waits for the one before, because the outbox goes by
            // identifier: the first parts of a burst would overtake the last parts of what happened earlier.
            let ids = self.objects.tpdos.map(|pdo| pdo.id());
            let least_urgent = ids[1..STREAM_TPDO].iter().flatten().max().copied().unwrap_or(0);
            let may = self.shared.with_outbox(|outbox| {
                // Bulk that others on the bus keep from being sent gives way.
                outbox.room_for(least_urgent) >= PARTS
                    && ids[1..STREAM_TPDO].iter().flatten().all(|id| outbox.waiting(*id) == 0)
            });
            if !may {
                return;
            }
            let (event, first, last) = self.shared.log.lock(|log| {
                let log = log.borrow();
                (log.get(self.next_event).copied(), log.first(), log.last())
            });
            let Some(event) = event else {
                if self.next_event <= last {
                    let gone = first.saturating_sub(self.next_event);
                    self.shared.count(|counters| counters.not_sent = counters.not_sent.saturating_add(gone));
                    self.next_event = first;
                    continue;
                }
                return;
            };
            let rate = self.shared.active().configuration.chain.sample_rate;
            self.objects.event = frame::encode(&event, rate);
            for part in Part::ALL {
                let place = part as usize;
                if let Some(frame) =
                    self.objects.tpdos[1 + place].id().and_then(|id| Frame::new(id, &self.objects.event[place]))
                {
                    let _ = self.shared.send(frame);
                }
            }
            self.next_event = self.next_event.wrapping_add(1);
        }
    }

    fn heartbeat(&mut self, now_ms: u64) {
        let (Some(id), period @ 1..) = (self.objects.node_id, u64::from(self.objects.heartbeat_ms)) else { return };
        if now_ms < self.next_heartbeat_ms && self.next_heartbeat_ms <= now_ms + period {
            return;
        }
        let state = match self.objects.nmt {
            NmtState::Stopped => 4,
            NmtState::Operational => 5,
            _ => 127,
        };
        // One that still waits says the same: on a bus that has no room for them, they must not fill the outbox.
        let waits = self.shared.with_outbox(|outbox| outbox.waiting(0x700 + u16::from(id)) > 0);
        if let Some(frame) = Frame::new(0x700 + u16::from(id), &[state]).filter(|_| !waits) {
            let _ = self.shared.send(frame);
        }
        // In step with the first one, unless a whole period was missed.
        let next = self.next_heartbeat_ms + period;
        self.next_heartbeat_ms = if next > now_ms && next <= now_ms + period { next } else { now_ms + period };
    }

    fn send_segments(&mut self, now_ms: u64) {
        let Some(id) = self.objects.node_id.map(|id| 0x580 + u16::from(id)) else { return };
        while self.sdo.is_sending() {
            let (room, waiting) = self.shared.with_outbox(|outbox| (outbox.room(), outbox.waiting(id)));
            // An event must always find room beside a download.
            if waiting >= SDO_WINDOW || room <= PARTS {
                return;
            }
            let mut view = View { shared: self.shared, node: &mut self.objects, now_ms };
            let segment = self.sdo.segment(&mut view);
            self.answer(segment);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::board::Identity;
    use crate::capture::Captures;

    const SERIAL: u32 = 0x0102_0304;

    fn node() -> (CanOpenNode<64>, &'static Shared<64>) {
        let reset_cause = ResetCause::Watchdog;
        let identity = Identity { serial: SERIAL, hardware_revision: 1, build: 0, reset_cause, ended_at: 0 };
        let captures = Box::leak(Box::new(Captures::new()));
        let shared = Box::leak(Box::new(Shared::new(identity, Loaded::Unreadable, captures)));
        (CanOpenNode::new(shared), shared)
    }

    fn sent(shared: &Shared<64>) -> Vec<Frame> {
        core::iter::from_fn(|| shared.with_outbox(|outbox| outbox.pop())).collect()
    }

    #[test]
    fn what_went_wrong_before_the_start_is_told_at_the_start() {
        let (mut node, shared) = node();
        node.poll(0);
        let told: Vec<_> = sent(shared)
            .iter()
            .filter(|frame| frame.id == 0xA0)
            .map(|frame| u16::from_le_bytes([frame.data[0], frame.data[1]]))
            .collect();
        assert_eq!(told, [Fault::Watchdog.code(), Fault::Configuration.code()]);
    }

    #[test]
    fn the_time_is_taken() {
        let (mut node, _) = node();
        node.receive(&Frame::new(0x100, &[0x10, 0x27, 0, 0xF0, 0x34, 0x12]).unwrap(), 0);
        assert_eq!(node.objects.time, TimeReceived { milliseconds: 10_000, days: 0x1234, index: 0 });
        node.receive(&Frame::new(0x100, &[0; 5]).unwrap(), 0);
        assert_eq!(node.objects.time.days, 0x1234, "a short one is no time");
    }

    fn event(impact: u32) -> crate::event::Event {
        use crate::event::{Event, Flags, Severity};
        use crate::units::{Newton, NewtonSecond, SampleInstant, Second};
        Event {
            number: 0,
            impact,
            contact: 0,
            flags: Flags::empty(),
            contact_instant: SampleInstant::default(),
            peak_instant: SampleInstant::default(),
            raw_peak: Newton(10.0),
            peak: Newton(9.0),
            impulse: NewtonSecond(0.1),
            duration: Second(0.02),
            noise: Newton(0.1),
            severity: Severity::default(),
            configuration_revision: 1,
            configuration_hash: 1,
        }
    }

    #[test]
    fn a_burst_of_events_is_sent_whole_and_what_left_the_log_is_counted() {
        let (mut node, shared) = node();
        node.receive(&Frame::new(0, &[1, 0]).unwrap(), 0);
        node.poll(0);
        sent(shared);
        let fill = |count: u32| {
            for impact in 0..count {
                shared.log.lock(|log| log.borrow_mut().push(event(impact)));
            }
        };
        fill(40);
        let mut assembly = frame::Assembly::new();
        let mut numbers = Vec::new();
        loop {
            node.poll(0);
            let Some(frame) = shared.with_outbox(|outbox| outbox.pop()) else { break };
            if let Some((part, _)) = Part::of(frame.id) {
                numbers.extend(assembly.push(part, frame.bytes()).unwrap().map(|event| event.number));
            }
        }
        assert_eq!((numbers, assembly.incomplete()), ((1..=40).collect(), 0));
        assert_eq!(shared.with_outbox(|outbox| outbox.losses()), crate::outbox::Losses::default());
        fill(crate::shared::EVENTS as u32 + 7);
        node.poll(0);
        assert_eq!(shared.counters().not_sent, 7);
    }

    #[test]
    fn a_node_without_an_id_is_silent_and_found_by_fast_scan() {
        let (mut node, shared) = node();
        let lss = |node: &mut CanOpenNode<64>, bytes: [u8; 8]| {
            node.receive(&Frame::new(LSS_REQUEST, &bytes).unwrap(), 0);
            node.poll(60_000);
            sent(shared)
        };
        lss(&mut node, [0x04, 1, 0, 0, 0, 0, 0, 0]);
        lss(&mut node, [0x11, 0xFF, 0, 0, 0, 0, 0, 0]);
        node.receive(&Frame::new(0, &[0x82, 0]).unwrap(), 0);
        assert_eq!(node.node_id(), None);
        assert_eq!(lss(&mut node, [0x04, 0, 0, 0, 0, 0, 0, 0]), [], "no heartbeat without an id");
        // A bit and a field that do not exist, which are no part of an identity.
        assert_eq!(lss(&mut node, [0x51, 0, 0, 0, 0, 40, 0, 0]), []);
        assert_eq!(lss(&mut node, [0x51, 0, 0, 0, 0, 0, 9, 9]), []);
        let identity = [0, PRODUCT_CODE, REVISION_NUMBER, SERIAL];
        assert_eq!(lss(&mut node, [0x51, 0, 0, 0, 0, 0x80, 0, 0]).len(), 1);
        for (field, number) in (0u8..).zip(identity) {
            let [a, b, c, d] = number.to_le_bytes();
            let next = (field + 1) % 4;
            assert_eq!(lss(&mut node, [0x51, a, b, c, d, 0, field, next]).len(), 1, "field {field}");
        }
        lss(&mut node, [0x11, 0x42, 0, 0, 0, 0, 0, 0]);
        assert_eq!(node.node_id(), Some(0x42));
        node.receive(&Frame::new(0x642, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]).unwrap(), 0);
        assert!(sent(shared).iter().any(|frame| frame.id == 0x5C2));
    }

    #[test]
    fn an_impossible_id_is_refused_over_lss_and_the_old_one_stays() {
        let (mut node, shared) = node();
        let before = node.node_id();
        let lss = |node: &mut CanOpenNode<64>, bytes: [u8; 8]| {
            node.receive(&Frame::new(LSS_REQUEST, &bytes).unwrap(), 0);
            sent(shared)
                .into_iter()
                .filter(|frame| frame.id == LSS_RESPONSE)
                .map(|frame| frame.data)
                .collect::<Vec<_>>()
        };
        assert_eq!(lss(&mut node, [0x11, 0, 0, 0, 0, 0, 0, 0]), [[0; 8]; 0], "waiting, it does not answer");
        lss(&mut node, [0x04, 1, 0, 0, 0, 0, 0, 0]);
        for impossible in [0, 128, 0xA1, 254] {
            assert_eq!(lss(&mut node, [0x11, impossible, 0, 0, 0, 0, 0, 0]), [[0x11, 1, 0, 0, 0, 0, 0, 0]]);
            assert_eq!(node.node_id(), before);
        }
        assert_eq!(lss(&mut node, [0x11, 0x42, 0, 0, 0, 0, 0, 0]), [[0x11, 0, 0, 0, 0, 0, 0, 0]]);
        assert_eq!(node.node_id(), before, "until its communication is reset");
        sent(shared);
        node.receive(&Frame::new(0, &[0x82, before.unwrap()]).unwrap(), 0);
        assert_eq!(node.node_id(), Some(0x42));
        assert!(sent(shared).iter().any(|frame| frame.id == 0x742 && frame.bytes() == [0]), "it boots up");
    }

    /// Frames that this node listens to, more often with a meaningful first byte than by chance.
    fn frames() -> impl Strategy<Value = Frame> {
        let id = prop::sample::select(std::vec![0x000u16, 0x7E5, 0x620, 0x620, 0x620, 0x220, 0x100, 0x631, 0x080]);
        let first = prop_oneof![
            any::<u8>(),
            prop::sample::select(std::vec![
                0x40, 0x2F, 0x23, 0x21, 0x60, 0x70, 0x00, 0x10, 0xA4, 0xA3, 0xA2, 0xA1, 0xC6, 0x80, 0x04, 0x11, 0x17,
                0x51, 0x40, 0x41, 0x42, 0x43, 0x01, 0x82,
            ]),
        ];
        let index = prop_oneof![
            any::<u16>(),
            (0..crate::dictionary::object::OBJECTS.len()).prop_map(|n| crate::dictionary::object::OBJECTS[n].index),
            // NMT to everybody or this node, LSS node ids.
            prop::sample::select(std::vec![0x0000, 0x0020, 0x0031, 0x00FF]),
        ];
        (id, first, index, 0u8..14, any::<[u8; 4]>(), 0usize..10).prop_map(|(id, first, index, sub, data, length)| {
            let [low, high] = index.to_le_bytes();
            let bytes = [first, low, high, sub, data[0], data[1], data[2], data[3]];
            Frame::new(id, &bytes[..if length > 7 { 8 } else { length }]).unwrap()
        })
    }

    /// What a filter keeps out must not be missed: whatever else comes changes nothing and is answered by nothing.
    #[test]
    fn a_frame_that_is_not_listened_to_is_no_matter() {
        let (mut node, shared) = node();
        node.receive(&Frame::new(NMT_ID, &[1, 0]).unwrap(), 0);
        node.poll(0);
        sent(shared);
        assert_eq!(node.listens_to(), [Some(0), Some(0x7E5), Some(0x100), Some(0x620), Some(0x220)]);
        let before = std::format!("{:?}", node.objects);
        let heard = node.listens_to();
        let mut others = 0;
        for id in (0..0x800).filter(|id| !heard.contains(&Some(*id))) {
            for first in [0x00, 0x01, 0x11, 0x23, 0x40, 0x60, 0x80, 0x82, 0xA0, 0xFF] {
                node.receive(&Frame::new(id, &[first, 0x20, 0x10, 1, 4, 0x20, 0x41, 0]).unwrap(), 0);
            }
            others += 1;
        }
        assert_eq!((others, sent(shared).len()), (0x800 - 5, 0));
        assert_eq!(std::format!("{:?}", node.objects), before);
        // A service that has lost its identifier has no filter.
        node.objects.rpdo.cob_id |= 1 << 31;
        node.objects.node_id = None;
        assert_eq!(node.listens_to()[3..], [None, None]);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]
        #[test]
        fn no_frames_make_the_node_panic_or_fall_silent(
            frames in prop::collection::vec((frames(), 0u64..800), 1..120),
        ) {
            let (mut node, shared) = node();
            let mut now = 0;
            for (frame, pause) in frames {
                now += pause;
                node.receive(&frame, now);
                node.poll(now);
                if pause % 3 == 0 {
                    sent(shared);
                }
            }
            // Whatever was left open expires, and the node answers again unless it was stopped or lost its id.
            now += 2 * crate::sdo::TIMEOUT_MS;
            node.poll(now);
            sent(shared);
            node.receive(&Frame::new(0, &[128, 0]).unwrap(), now);
            if let Some(id) = node.node_id() {
                sent(shared);
                node.receive(&Frame::new(0x600 + u16::from(id), &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]).unwrap(), now);
                let answers = sent(shared);
                prop_assert_eq!(answers.len(), 1);
                prop_assert_eq!(answers[0].data, [0x43, 0x18, 0x10, 4, 0x04, 0x03, 0x02, 0x01]);
            }
        }
    }
}
