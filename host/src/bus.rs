//! Transports: how frames reach the bus and come back.
//!
//! ```text
//!              ┌─ UdpBus        python-can's udp_multicast, for a bus without hardware
//! dyn Bus ─────┤
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
pub mod option;
pub mod packet;
pub mod simulated;
pub mod udp;

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
    /// Packets that are not a CAN frame at all, or a damaged one.
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
