//! What happened on the bus, for tests, benches and people.

use embassy_time::{Duration, Instant};
use thud_firmware::board::Frame;

/// How an attempt to send ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everybody who listens has it.
    Sent,
    /// A bit was disturbed; it will be sent again.
    Disturbed,
    /// Another node sent another frame with the same identifier at the same time; both will try again.
    Collided,
    /// Nobody acknowledged.
    NotAcknowledged,
    /// A receiver misread it and destroyed it for all.
    Misread,
    /// The sender lost its power or was reset in the middle.
    Cut,
}

/// One attempt to send a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attempt {
    /// The frame.
    pub frame: Frame,
    /// Numbers of the nodes that sent it; more than one if they sent the same bits.
    pub senders: Vec<usize>,
    /// When the (first) sender put it into a mailbox.
    pub loaded: Instant,
    /// First edge of the start-of-frame bit.
    pub started: Instant,
    /// End of the end-of-frame field, or of the error delimiter.
    pub ended: Instant,
    /// Bits on the wire from `started` to `ended`.
    pub bits: u32,
    /// How it ended.
    pub outcome: Outcome,
}

/// Totals of a bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Frames sent with success.
    pub frames: u64,
    /// Attempts that ended in an error frame.
    pub failures: u64,
    /// Frames that a receiver had no room for.
    pub lost: u64,
    /// Time during which the bus was not free: frames, error frames and intermissions.
    pub busy: Duration,
    /// Bits of frames and error frames, without intermissions.
    pub bits: u64,
}

impl Statistics {
    /// Share of the time since `earlier` during which the bus was busy, 0 to 1.
    #[must_use]
    pub fn load_since(&self, earlier: &Self, elapsed: Duration) -> f64 {
        (self.busy - earlier.busy).as_micros() as f64 / elapsed.as_micros() as f64
    }
}
