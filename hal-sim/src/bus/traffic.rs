//! Other people's frames, to load the bus.

use std::ops::RangeInclusive;

use rand::{Rng as _, RngExt as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Exp1};
use thud_firmware::board::Frame;

use super::bit_stream::{INTERMISSION, wire_bits};

/// A node that sends random data.
#[derive(Clone, Debug, PartialEq)]
pub struct Traffic {
    /// Share of the bus's time that the frames ask for, 0 to 1. From 1 on there is always one waiting.
    pub load: f64,
    /// Identifiers, drawn evenly.
    pub identifiers: RangeInclusive<u16>,
    /// Numbers of data bytes, drawn evenly.
    pub lengths: RangeInclusive<u8>,
}

impl Traffic {
    /// Frames of 8 bytes with identifiers less urgent than 0x100, at this load.
    #[must_use]
    pub const fn with_load(load: f64) -> Self {
        Self { load, identifiers: 0x100..=0x7FF, lengths: 8..=8 }
    }
}

/// Traffic as it goes on.
pub(super) struct Generator {
    pub(super) node: usize,
    traffic: Traffic,
    random: ChaCha8Rng,
    due_us: f64,
}

/// Frames kept waiting at full load: as soon as one has gone there is the next.
const BACKLOG: usize = 2;

impl Generator {
    pub(super) fn new(node: usize, traffic: Traffic, random: ChaCha8Rng, now: u64) -> Self {
        Self { node, traffic, random, due_us: now as f64 }
    }

    /// When the next frame is due; `None` where a full load only follows the bus.
    pub(super) fn next(&self) -> Option<u64> {
        (self.traffic.load > 0.0 && self.traffic.load < 1.0).then(|| self.due_us.ceil() as u64)
    }

    /// The frame that is due now, if one is and `waiting` frames of it are still unsent.
    pub(super) fn due(&mut self, now: u64, waiting: usize, bit_us: u64) -> Option<Frame> {
        if self.traffic.load >= 1.0 {
            return (waiting < BACKLOG).then(|| self.draw());
        }
        if self.next()? > now {
            return None;
        }
        let frame = self.draw();
        let mean_us = f64::from(wire_bits(&frame) + INTERMISSION) * bit_us as f64 / self.traffic.load;
        let wait: f64 = Exp1.sample(&mut self.random);
        self.due_us += mean_us * wait;
        Some(frame)
    }

    fn draw(&mut self) -> Frame {
        let id = self.random.random_range(self.traffic.identifiers.clone());
        let len = self.random.random_range(self.traffic.lengths.clone()).min(8);
        let mut bytes = [0; 8];
        self.random.fill_bytes(&mut bytes[..usize::from(len)]);
        Frame { id: id & 0x7FF, len, data: bytes }
    }
}
