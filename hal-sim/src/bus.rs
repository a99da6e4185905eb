//! A CAN bus with real bits: arbitration, errors, bus-off, and who heard what when.
//!
//! ```text
//!  idle ─▶ all who have a frame start together, the lowest identifier stays ─▶ end of frame ─▶ intermission ─▶ …
//!                                    └─ a disturbed bit, a collision, nobody acknowledges ─▶ error flag ─▶ again
//! ```
//!
//! Every frame takes as many bit times as its bits with stuffing make ([`bit_stream`]), and a frame on the wire is
//! not interrupted. Propagation time and clock tolerance are not modelled: all nodes sample the same bit at the same
//! instant, and a frame is received at the end of its last bit (a real receiver takes it one bit earlier).

use std::cell::RefCell;
use std::rc::Rc;

use embassy_time::Instant;

pub mod bit_stream;
mod controller;
mod disturbance;
mod error_counters;
mod host_port;
mod record;
mod traffic;
mod wire;

pub use controller::{Controller, ControllerSettings, SeenError, SendingOrder};
pub use disturbance::Disturbance;
pub use host_port::{Arrival, HostPort};
pub use record::{Attempt, Outcome, Statistics};
pub use traffic::Traffic;
use wire::Wire;

/// Bits per second on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitRate {
    bit_us: u64,
}

/// A bit rate that the simulation cannot keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0} bit/s is no bit rate of the simulated bus: a bit must last a whole number of microseconds, as at 1000000, 500000, 250000, 125000, 100000, 50000, 20000 or 10000 bit/s (not at the 800000 of CiA 301)"
)]
pub struct NoSuchBitRate(pub u32);

impl BitRate {
    /// 1 Mbit/s, the sensor's usual rate.
    pub const MEGABIT: Self = Self { bit_us: 1 };

    /// This many bits per second.
    ///
    /// # Errors
    /// When a bit would not last a whole number of microseconds.
    pub const fn per_second(bits: u32) -> Result<Self, NoSuchBitRate> {
        if bits == 0 || 1_000_000 % bits != 0 {
            return Err(NoSuchBitRate(bits));
        }
        Ok(Self { bit_us: (1_000_000 / bits) as u64 })
    }

    /// Duration of one bit, µs.
    #[must_use]
    pub const fn bit_us(self) -> u64 {
        self.bit_us
    }
}

/// A bus; clones are the same bus.
#[derive(Clone)]
pub struct Bus {
    wire: Rc<RefCell<Wire>>,
}

impl Bus {
    /// A bus on which nobody is yet. The seed is for disturbances and for generated traffic.
    #[must_use]
    pub fn new(rate: BitRate, seed: u64) -> Self {
        Self { wire: Rc::new(RefCell::new(Wire::new(rate, seed))) }
    }

    /// Connects a CAN controller; it takes part after 11 recessive bits.
    #[must_use]
    pub fn attach(&self, name: impl Into<String>, settings: ControllerSettings) -> Controller {
        let node = self.wire.borrow_mut().attach(name.into(), settings);
        Controller::new(self.wire.clone(), node)
    }

    /// Connects a host, as a CAN adapter on a computer would be.
    #[must_use]
    pub fn attach_host(&self, name: impl Into<String>) -> HostPort {
        HostPort::new(self.attach(name, ControllerSettings::HOST_ADAPTER))
    }

    /// Connects a node that loads the bus.
    pub fn attach_traffic(&self, name: impl Into<String>, traffic: Traffic) {
        let mut wire = self.wire.borrow_mut();
        let node = wire.attach(name.into(), ControllerSettings::HOST_ADAPTER);
        wire.load_with(node, traffic);
    }

    /// Disturbs frames from now on, in the place of what disturbed them before.
    pub fn disturb(&self, disturbance: Disturbance) {
        self.wire.borrow_mut().disturb(disturbance);
    }

    /// Keeps a record of every attempt to send, from now on, until it is taken. Off by default: it grows.
    pub fn keep_record(&self) {
        self.wire.borrow_mut().keep_record();
    }

    /// Takes the record so far, in the order of ends.
    #[must_use]
    pub fn take_record(&self) -> Vec<Attempt> {
        self.wire.borrow_mut().take_record()
    }

    /// Totals since the bus was made.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.wire.borrow().statistics()
    }

    /// The bit rate.
    #[must_use]
    pub fn rate(&self) -> BitRate {
        self.wire.borrow().rate()
    }

    /// Name of the node with this number, as [`Attempt::senders`] gives them.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn node_name(&self, node: usize) -> String {
        self.wire.borrow().node_name(node).to_owned()
    }

    /// The instant to which it has been brought.
    #[must_use]
    pub fn now(&self) -> Instant {
        Instant::from_micros(self.wire.borrow().now())
    }

    /// What is due until and at `now` takes its course; whoever moves the bus (a [`crate::world::World`], an emulator) calls
    /// this before what is connected to it runs.
    pub fn advance(&self, now: Instant) {
        self.wire.borrow_mut().advance(now.as_micros());
    }

    /// If the bus is free, whoever has a frame starts; to be called when everything else at `now` has happened.
    pub fn arbitrate(&self, now: Instant) {
        self.wire.borrow_mut().arbitrate(now.as_micros());
    }

    /// When something will happen next on the bus by itself.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        self.wire.borrow().next_event().map(Instant::from_micros)
    }
}

#[cfg(test)]
mod tests;
