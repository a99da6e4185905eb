//! The state of the bus and its rules: who may start, what becomes of a frame, who counts which error.

use std::collections::VecDeque;
use std::task::Waker;

use embassy_time::{Duration, Instant};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_firmware::board::{BusStatus, Frame, MailboxesFull, Received};

use super::bit_stream::{BitStream, INTERMISSION, RECESSIVE_TAIL, TAIL};
use super::error_counters::ErrorCounters;
use super::host_port::Arrival;
use super::traffic::Generator;
use super::{Attempt, BitRate, ControllerSettings, Disturbance, Outcome, SeenError, SendingOrder, Statistics, Traffic};

/// Recessive bits that prove the bus free.
const FREE: u64 = 11;
/// How many times [`FREE`] a node waits after bus-off.
const RECOVERY_SEQUENCES: u64 = 128;
/// Recessive bits that end an error frame.
const ERROR_DELIMITER: u32 = 8;
/// Bits that an error-passive node waits after its own frame, besides the intermission.
const SUSPENSION: u64 = 8;
/// From this bit on a disturbance falls into control field, data or CRC: 13 bits before, and two stuff bits at most.
const AFTER_ARBITRATION: u32 = 15;

pub(super) struct Wire {
    rate: BitRate,
    now: u64,
    nodes: Vec<Node>,
    phase: Phase,
    /// Since when nobody has sent a dominant bit; holds in `Phase::Idle` and `Phase::Intermission`.
    recessive_since: u64,
    generators: Vec<Generator>,
    disturbance: Disturbance,
    random: ChaCha8Rng,
    record: Option<Vec<Attempt>>,
    statistics: Statistics,
}

struct Node {
    name: String,
    settings: ControllerSettings,
    connected: bool,
    /// It counts recessive bits before it takes part.
    joining: Option<Joining>,
    counters: ErrorCounters,
    mailboxes: VecDeque<Waiting>,
    suspended_until: u64,
    emptied: bool,
    emptied_waker: Option<Waker>,
    arrivals: VecDeque<Arrival>,
    stored_frames: usize,
    arrival_waker: Option<Waker>,
    error: Option<SeenError>,
}

#[derive(Clone, Copy)]
struct Joining {
    sequences: u64,
    counted_from: u64,
}

#[derive(Clone, Copy)]
struct Waiting {
    frame: Frame,
    loaded: u64,
    /// Number of the transmit buffer, where a controller names them.
    buffer: u8,
}

enum Phase {
    Idle,
    Frame(Flight),
    ErrorFrame { until: u64 },
    Intermission { until: u64 },
}

/// A frame on the wire.
struct Flight {
    frame: Frame,
    stream: BitStream,
    senders: Vec<Sender>,
    loaded: u64,
    started: u64,
    decided_at: u64,
    fate: Fate,
}

#[derive(Clone, Copy)]
struct Sender {
    node: usize,
    mailbox: usize,
}

#[derive(Clone, Copy)]
enum Fate {
    Sent {
        /// A passive node that misread it and cannot stop it.
        deaf: Option<usize>,
    },
    Fails {
        /// The bit in which the error is seen.
        bit: u32,
        /// Error flags of all together, bits.
        flags: u32,
        outcome: Outcome,
        /// The receiver that was the only one to see it.
        alone: Option<usize>,
    },
}

impl Node {
    fn takes_part(&self) -> bool {
        self.connected && self.joining.is_none() && !self.counters.is_bus_off()
    }

    fn next_mailbox(&self) -> Option<usize> {
        match self.settings.order {
            SendingOrder::Loading => (!self.mailboxes.is_empty()).then_some(0),
            SendingOrder::Urgency => self
                .mailboxes
                .iter()
                .enumerate()
                .min_by_key(|(_, waiting)| waiting.frame.id)
                .map(|(mailbox, _)| mailbox),
            SendingOrder::Buffer => self
                .mailboxes
                .iter()
                .enumerate()
                .min_by_key(|(_, waiting)| (waiting.frame.id, waiting.buffer))
                .map(|(mailbox, _)| mailbox),
        }
    }

    /// Whether the frame was lost.
    fn deliver(&mut self, frame: Frame, at: Instant) -> bool {
        let lost = self.stored_frames >= self.settings.receive_depth;
        if !lost {
            self.stored_frames += 1;
            self.arrivals.push_back(Arrival { at, received: Received::Frame(frame) });
        } else if let Some(Arrival { received: Received::Lost(count), .. }) = self.arrivals.back_mut() {
            *count += 1;
        } else {
            self.arrivals.push_back(Arrival { at, received: Received::Lost(1) });
        }
        if let Some(waker) = self.arrival_waker.take() {
            waker.wake();
        }
        lost
    }

    fn emptied(&mut self, mailbox: usize) {
        self.mailboxes.remove(mailbox);
        self.emptied = true;
        if let Some(waker) = self.emptied_waker.take() {
            waker.wake();
        }
    }
}

impl Wire {
    pub(super) fn new(rate: BitRate, seed: u64) -> Self {
        Self {
            rate,
            now: 0,
            nodes: Vec::new(),
            phase: Phase::Idle,
            recessive_since: 0,
            generators: Vec::new(),
            disturbance: Disturbance::None,
            random: ChaCha8Rng::seed_from_u64(seed),
            record: None,
            statistics: Statistics::default(),
        }
    }

    pub(super) fn attach(&mut self, name: String, settings: ControllerSettings) -> usize {
        self.nodes.push(Node {
            name,
            settings,
            connected: true,
            joining: Some(Joining { sequences: 1, counted_from: self.now }),
            counters: ErrorCounters::default(),
            mailboxes: VecDeque::new(),
            suspended_until: 0,
            emptied: false,
            emptied_waker: None,
            arrivals: VecDeque::new(),
            stored_frames: 0,
            arrival_waker: None,
            error: None,
        });
        self.nodes.len() - 1
    }

    pub(super) fn connect(&mut self, node: usize, connected: bool) {
        if let Phase::Frame(flight) = &mut self.phase {
            let before = flight.senders.len();
            flight.senders.retain(|sender| sender.node != node);
            if before > 0 && flight.senders.is_empty() {
                // The bus falls silent; the others see it in the sixth recessive bit and send their flags.
                let bit = ((self.now - flight.started) / self.rate.bit_us()) as u32;
                flight.fate = Fate::Fails { bit, flags: 12, outcome: Outcome::Cut, alone: None };
                flight.decided_at = flight.started + u64::from(bit + 1) * self.rate.bit_us();
            }
        }
        let now = self.now;
        let node = &mut self.nodes[node];
        node.connected = connected;
        node.joining = connected.then_some(Joining { sequences: 1, counted_from: now });
        node.counters.reset();
        node.mailboxes.clear();
        node.suspended_until = 0;
        node.emptied = false;
        node.arrivals.clear();
        node.stored_frames = 0;
        node.error = None;
    }

    pub(super) fn load_with(&mut self, node: usize, traffic: Traffic) {
        let random = ChaCha8Rng::from_rng(&mut self.random);
        self.generators.push(Generator::new(node, traffic, random, self.now));
    }

    pub(super) fn disturb(&mut self, disturbance: Disturbance) {
        self.disturbance = disturbance;
    }

    pub(super) fn keep_record(&mut self) {
        self.record.get_or_insert_default();
    }

    pub(super) fn take_record(&mut self) -> Vec<Attempt> {
        self.record.as_mut().map(std::mem::take).unwrap_or_default()
    }

    pub(super) fn statistics(&self) -> Statistics {
        self.statistics
    }

    pub(super) fn now(&self) -> u64 {
        self.now
    }

    pub(super) fn rate(&self) -> BitRate {
        self.rate
    }

    pub(super) fn node_name(&self, node: usize) -> &str {
        &self.nodes[node].name
    }

    pub(super) fn free(&self, node: usize) -> usize {
        let node = &self.nodes[node];
        node.settings.mailboxes - node.mailboxes.len()
    }

    pub(super) fn unsent(&self, node: usize) -> usize {
        self.nodes[node].mailboxes.len()
    }

    pub(super) fn load(&mut self, node: usize, frame: &Frame) -> Result<(), MailboxesFull> {
        self.load_buffer(node, 0, frame)
    }

    pub(super) fn load_buffer(&mut self, node: usize, buffer: u8, frame: &Frame) -> Result<(), MailboxesFull> {
        if self.free(node) == 0 {
            return Err(MailboxesFull);
        }
        let loaded = self.now;
        self.nodes[node].mailboxes.push_back(Waiting { frame: *frame, loaded, buffer });
        Ok(())
    }

    pub(super) fn waiting_buffers(&self, node: usize) -> u32 {
        self.nodes[node].mailboxes.iter().fold(0, |bits, waiting| bits | 1 << waiting.buffer)
    }

    pub(super) fn take_error(&mut self, node: usize) -> Option<SeenError> {
        self.nodes[node].error.take()
    }

    pub(super) fn take_freed(&mut self, node: usize, waker: &Waker) -> bool {
        let node = &mut self.nodes[node];
        if std::mem::take(&mut node.emptied) {
            return true;
        }
        node.emptied_waker = Some(waker.clone());
        false
    }

    pub(super) fn has_arrivals(&self, node: usize) -> bool {
        !self.nodes[node].arrivals.is_empty()
    }

    pub(super) fn take(&mut self, node: usize) -> Option<Arrival> {
        let node = &mut self.nodes[node];
        let arrival = node.arrivals.pop_front()?;
        if matches!(arrival.received, Received::Frame(_)) {
            node.stored_frames -= 1;
        }
        Some(arrival)
    }

    pub(super) fn take_or_wake(&mut self, node: usize, waker: &Waker) -> Option<Arrival> {
        let arrival = self.take(node);
        if arrival.is_none() {
            self.nodes[node].arrival_waker = Some(waker.clone());
        }
        arrival
    }

    pub(super) fn status(&self, node: usize) -> BusStatus {
        self.nodes[node].counters.status()
    }

    pub(super) fn recover(&mut self, node: usize) {
        let counted_from = self.now;
        let node = &mut self.nodes[node];
        if node.connected && node.counters.is_bus_off() && node.joining.is_none() {
            node.joining = Some(Joining { sequences: RECOVERY_SEQUENCES, counted_from });
        }
    }

    /// When the bus will do something by itself.
    pub(super) fn next_event(&self) -> Option<u64> {
        let phase = match &self.phase {
            Phase::Frame(flight) => Some(flight.decided_at),
            Phase::ErrorFrame { until } | Phase::Intermission { until } => Some(*until),
            Phase::Idle => self
                .nodes
                .iter()
                .filter(|node| node.takes_part() && !node.mailboxes.is_empty())
                .map(|node| node.suspended_until.max(self.now))
                .min(),
        };
        let requested = self.generators.iter().filter_map(Generator::next).min();
        let joined = self.nodes.iter().filter_map(|node| self.joins_at(node)).min();
        [phase, requested, joined].into_iter().flatten().min()
    }

    /// When a node has counted enough recessive bits, if the bus stays as it is.
    fn joins_at(&self, node: &Node) -> Option<u64> {
        let joining = node.joining?;
        matches!(self.phase, Phase::Idle | Phase::Intermission { .. })
            .then(|| joining.counted_from.max(self.recessive_since) + joining.sequences * FREE * self.rate.bit_us())
    }

    /// Lets everything happen that is due until and at `now`.
    pub(super) fn advance(&mut self, now: u64) {
        assert!(now >= self.now, "the bus would run backwards: from {} µs to {now} µs", self.now);
        self.now = now;
        loop {
            match &self.phase {
                Phase::Frame(flight) if flight.decided_at <= now => {
                    let Phase::Frame(flight) = std::mem::replace(&mut self.phase, Phase::Idle) else { unreachable!() };
                    self.decide(flight);
                }
                Phase::ErrorFrame { until } if *until <= now => {
                    let until = *until;
                    self.intermission(until, ERROR_DELIMITER);
                }
                Phase::Intermission { until } if *until <= now => self.phase = Phase::Idle,
                _ => break,
            }
        }
        for index in 0..self.nodes.len() {
            if self.joins_at(&self.nodes[index]).is_some_and(|at| at <= now) {
                self.join(index);
            }
        }
        for index in 0..self.generators.len() {
            let node = self.generators[index].node;
            let bit_us = self.rate.bit_us();
            while let Some(frame) = self.generators[index].due(now, self.nodes[node].mailboxes.len(), bit_us) {
                // A generator's queue has no end.
                let _ = self.load(node, &frame);
            }
        }
    }

    fn join(&mut self, node: usize) {
        let node = &mut self.nodes[node];
        node.joining = None;
        node.counters.reset();
    }

    fn intermission(&mut self, from: u64, recessive_before: u32) {
        let bit_us = self.rate.bit_us();
        self.recessive_since = from - u64::from(recessive_before) * bit_us;
        self.phase = Phase::Intermission { until: from + u64::from(INTERMISSION) * bit_us };
    }

    /// If the bus is free, starts the most urgent frame of all that wait.
    pub(super) fn arbitrate(&mut self, now: u64) {
        if !matches!(self.phase, Phase::Idle) {
            return;
        }
        let mut senders = Vec::new();
        let mut lowest = u16::MAX;
        for (index, node) in self.nodes.iter().enumerate() {
            if !node.takes_part() || node.suspended_until > now {
                continue;
            }
            let Some(mailbox) = node.next_mailbox() else { continue };
            let id = node.mailboxes[mailbox].frame.id;
            if id < lowest {
                lowest = id;
                senders.clear();
            }
            if id == lowest {
                senders.push(Sender { node: index, mailbox });
            }
        }
        if senders.is_empty() {
            return;
        }
        for node in &mut self.nodes {
            if let Some(joining) = &mut node.joining {
                let recessive_us = now - joining.counted_from.max(self.recessive_since);
                joining.sequences -= (recessive_us / (FREE * self.rate.bit_us())).min(joining.sequences);
                joining.counted_from = now;
            }
        }
        self.start(senders);
    }

    fn start(&mut self, senders: Vec<Sender>) {
        let waiting = |sender: &Sender| self.nodes[sender.node].mailboxes[sender.mailbox];
        let first = waiting(&senders[0]);
        let stream = BitStream::of(&first.frame);
        let loaded = senders.iter().map(|sender| waiting(sender).loaded).min().unwrap_or(self.now);
        let collision = senders[1..]
            .iter()
            .filter_map(|sender| {
                let other = BitStream::of(&waiting(sender).frame);
                let bit = stream.first_difference(&other)?;
                // The dominant bit stays, and with it what that sender's frame had before it.
                let run = if stream.bit(bit) { other } else { stream }.run_ending_at(bit);
                Some((bit, 12 - run))
            })
            .min();
        let fate = match collision {
            Some((bit, flags)) => Fate::Fails { bit, flags, outcome: Outcome::Collided, alone: None },
            None => self.disturbed(&stream, &senders).unwrap_or_else(|| self.acknowledged(&stream, &senders)),
        };
        let bits = match fate {
            Fate::Sent { .. } => stream.wire_len(),
            Fate::Fails { bit, .. } => bit + 1,
        };
        let decided_at = self.now + u64::from(bits) * self.rate.bit_us();
        self.phase =
            Phase::Frame(Flight { frame: first.frame, stream, senders, loaded, started: self.now, decided_at, fate });
    }

    fn disturbed(&mut self, stream: &BitStream, senders: &[Sender]) -> Option<Fate> {
        let hit = match &mut self.disturbance {
            Disturbance::None => false,
            Disturbance::Probability(probability) => self.random.random_bool(probability.clamp(0.0, 1.0)),
            Disturbance::Next(0) => false,
            Disturbance::Next(attempts) => {
                *attempts -= 1;
                true
            }
            Disturbance::After(0) => {
                self.disturbance = Disturbance::None;
                true
            }
            Disturbance::After(attempts) => {
                *attempts -= 1;
                false
            }
            Disturbance::Receiver { node, attempts } => {
                let node = *node;
                let listens = self.nodes[node].takes_part() && senders.iter().all(|sender| sender.node != node);
                if *attempts == 0 || !listens {
                    return None;
                }
                *attempts -= 1;
                return Some(self.misread(stream, node));
            }
        };
        if !hit {
            return None;
        }
        let bit = self.random.random_range(AFTER_ARBITRATION..stream.stuffed_len());
        // The sender's flag is dominant, or recessive if it is passive. The others see an error in the sixth equal bit,
        // the flipped one and those before it counted, and answer with six bits of their own.
        let flag = self.nodes[senders[0].node].counters.is_passive();
        let flipped = !stream.bit(bit);
        let run = match (flipped == flag, stream.bit(bit - 1) == flag) {
            (true, true) => 1 + stream.run_ending_at(bit - 1),
            (true, false) => 1,
            (false, _) => 0,
        };
        Some(Fate::Fails { bit, flags: 12 - run, outcome: Outcome::Disturbed, alone: None })
    }

    /// One receiver finds the CRC wrong. If it is active, it says so after the acknowledgement, and all others
    /// answer one bit later; if it is passive, nobody notices.
    fn misread(&self, stream: &BitStream, node: usize) -> Fate {
        if self.nodes[node].counters.is_passive() {
            return Fate::Sent { deaf: Some(node) };
        }
        let bit = stream.stuffed_len() + 2;
        Fate::Fails { bit, flags: 7, outcome: Outcome::Misread, alone: Some(node) }
    }

    fn acknowledged(&self, stream: &BitStream, senders: &[Sender]) -> Fate {
        let heard = self
            .nodes
            .iter()
            .enumerate()
            .any(|(index, node)| node.takes_part() && senders.iter().all(|sender| sender.node != index));
        if heard {
            return Fate::Sent { deaf: None };
        }
        let acknowledgement_slot = stream.stuffed_len() + 1;
        Fate::Fails { bit: acknowledgement_slot, flags: 6, outcome: Outcome::NotAcknowledged, alone: None }
    }

    fn decide(&mut self, flight: Flight) {
        let bit_us = self.rate.bit_us();
        match flight.fate {
            Fate::Sent { deaf } => {
                self.sent(&flight, deaf);
                self.account(&flight, flight.decided_at, flight.stream.wire_len(), Outcome::Sent);
                self.intermission(flight.decided_at, RECESSIVE_TAIL);
            }
            Fate::Fails { bit, flags, outcome, alone } => {
                self.failed(&flight, outcome, alone);
                let until = flight.decided_at + u64::from(flags + ERROR_DELIMITER) * bit_us;
                self.suspend_passive(&flight, until);
                self.account(&flight, until, bit + 1 + flags + ERROR_DELIMITER, outcome);
                self.phase = Phase::ErrorFrame { until };
            }
        }
    }

    fn sent(&mut self, flight: &Flight, deaf: Option<usize>) {
        let at = Instant::from_micros(flight.decided_at);
        for sender in &flight.senders {
            let node = &mut self.nodes[sender.node];
            node.counters.transmitted();
            node.emptied(sender.mailbox);
        }
        self.suspend_passive(flight, flight.decided_at);
        for (index, node) in self.nodes.iter_mut().enumerate() {
            if !node.takes_part() || flight.senders.iter().any(|sender| sender.node == index) {
                continue;
            }
            if deaf == Some(index) {
                node.counters.receive_failed();
                continue;
            }
            node.counters.received();
            self.statistics.lost += u64::from(node.deliver(flight.frame, at));
        }
    }

    fn failed(&mut self, flight: &Flight, outcome: Outcome, alone: Option<usize>) {
        for (index, node) in self.nodes.iter_mut().enumerate() {
            if !node.takes_part() {
                continue;
            }
            if flight.senders.iter().any(|sender| sender.node == index) {
                match outcome {
                    Outcome::NotAcknowledged => {
                        node.error = Some(SeenError::Acknowledge);
                        node.counters.not_acknowledged();
                    }
                    _ => {
                        node.error = Some(SeenError::Bit);
                        node.counters.transmit_failed();
                    }
                }
            } else if alone == Some(index) {
                node.error = Some(SeenError::Crc);
                node.counters.alone_in_error();
            } else {
                node.error = Some(SeenError::Stuff);
                node.counters.receive_failed();
            }
        }
    }

    fn suspend_passive(&mut self, flight: &Flight, until: u64) {
        for sender in &flight.senders {
            let node = &mut self.nodes[sender.node];
            if node.counters.is_passive() {
                node.suspended_until = until + (u64::from(INTERMISSION) + SUSPENSION) * self.rate.bit_us();
            }
        }
    }

    fn account(&mut self, flight: &Flight, ended: u64, bits: u32, outcome: Outcome) {
        let statistics = &mut self.statistics;
        if outcome == Outcome::Sent {
            statistics.frames += 1;
        } else {
            statistics.failures += 1;
        }
        statistics.bits += u64::from(bits);
        statistics.busy += Duration::from_micros(u64::from(bits + INTERMISSION) * self.rate.bit_us());
        if let Some(record) = &mut self.record {
            record.push(Attempt {
                frame: flight.frame,
                senders: flight.senders.iter().map(|sender| sender.node).collect(),
                loaded: Instant::from_micros(flight.loaded),
                started: Instant::from_micros(flight.started),
                ended: Instant::from_micros(ended),
                bits,
                outcome,
            });
        }
    }
}

const _: () = assert!(
    TAIL == 2 + RECESSIVE_TAIL,
    "the tail is CRC delimiter, acknowledgement slot and what is recessive after it"
);
