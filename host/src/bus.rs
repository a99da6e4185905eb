//! Transports: how frames reach the bus and come back.
//!
//! ```text
//!              ┌─ SocketCanBus  Linux's own CAN interfaces (can0, vcan0)
//!              ├─ SlcanBus      an adapter that speaks ASCII on a serial port
//! dyn Bus ─────┼─ UdpBus        python-can's udp_multicast, for a bus without hardware
//!              ├─ LogBus        a candump log, played back
//!              └─ SimulatedBus  a simulated world in this process, advanced while the host waits
//! ```
//!
//! A transport has its own clock ([`Bus::now`]): wall time for a real bus, virtual time for a simulated one. Whoever
//! waits on a bus waits by that clock, so that the same code talks to both.
//!
//! What is lost or cannot be understood is counted ([`Counters`]), never silently skipped.

use std::time::Duration;

use serde::Serialize;
use thud_firmware::board::Frame;

pub mod address;
pub mod candump;
pub mod log;
pub mod option;
pub mod packet;
pub mod simulated;
pub mod slcan;
#[cfg(target_os = "linux")]
pub mod socket_can;
pub mod tap;
pub mod udp;

/// What a transport can hear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// A classic data frame with an 11-bit identifier.
    Frame(Frame),
    /// A frame of a kind that CANopen does not use, and why.
    Foreign(&'static str),
}

/// A frame and when it was received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped {
    /// The frame.
    pub frame: Frame,
    /// When this host received it, by the bus's clock.
    pub at: Duration,
}

/// What a transport counted since it was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Frames sent.
    pub sent: u64,
    /// Frames received and handed on.
    pub received: u64,
    /// Frames that were on the bus but lost before this program could read them (a full receive buffer).
    pub lost: u64,
    /// Commands or frames that an adapter refused.
    pub refused: u64,
    /// Packets or lines that are not a CAN frame at all, or a damaged one.
    pub malformed: u64,
    /// What was wrong with the last malformed packet.
    pub last_malformed: Option<String>,
    /// Good frames of kinds that CANopen does not use: extended identifiers, remote requests, CAN FD, error frames.
    pub foreign: u64,
}

/// A CAN bus as the host sees it. A transport does not hear its own frames.
pub trait Bus {
    /// Sends a frame.
    ///
    /// # Errors
    /// [`BusError::Send`] when the transport did not take it; it is then not on the bus.
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// The next frame, or `None` when none has come within `timeout` of the bus's clock.
    ///
    /// # Errors
    /// [`BusError::Receive`] when the transport is broken; a damaged packet is counted, not an error.
    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError>;

    /// The bus's clock, since it was opened.
    fn now(&self) -> Duration;

    /// What this bus is, for a person: the transport and its address.
    fn describe(&self) -> String;

    /// What was counted so far.
    fn counters(&self) -> Counters;

    /// Whether nothing will ever come any more: a log that was played to its end.
    fn ended(&self) -> bool {
        false
    }

    /// Whether others can only be listened to, because nobody is there who could answer.
    fn is_playback(&self) -> bool {
        false
    }
}

/// Why a transport could not be used.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum BusError {
    /// The bus could not be opened.
    #[error("cannot open the bus {bus}: {step}: {source}")]
    Open {
        /// The bus as [`Bus::describe`] would say it.
        bus: String,
        /// What was being done.
        step: &'static str,
        /// What the system said.
        source: std::io::Error,
        /// What would be right.
        #[help]
        help: Option<String>,
    },
    /// A frame could not be sent.
    #[error("cannot send on {bus}: {source}")]
    Send {
        /// The bus.
        bus: String,
        /// What the system said.
        source: std::io::Error,
        /// What would be right.
        #[help]
        help: Option<String>,
    },
    /// Nothing can be received.
    #[error("cannot receive from {bus}: {source}")]
    Receive {
        /// The bus.
        bus: String,
        /// What the system said.
        source: std::io::Error,
    },
}
