//! The sensor as an object: find it, read it, configure it, follow it, download its curves.
//!
//! ```text
//! command ─▶ Client ─▶ find, settings, status, watch, recording ─▶ Sdo ─▶ Line ─▶ dyn Bus
//! ```
//!
//! Blocking and on the bus's own clock: the same code talks to a sensor on a real bus and to a simulated one in virtual
//! time. Objects, frames and their codecs are the firmware's own ([`thud_firmware::dictionary`]), so that both ends
//! cannot disagree.

use std::time::Duration;

use thud_firmware::board::Frame;

use crate::bus::address::BusAddress;
use crate::bus::{Bus, BusError, Counters};

pub mod emergency;
pub mod find;
pub mod line;
pub mod recording;
pub mod samples;
pub mod sdo;
#[cfg(test)]
mod served;
pub mod settings;
pub mod status;
pub mod watch;
pub mod words;

use find::Sensor;
use line::Line;
use sdo::{Sdo, SdoError};

/// What went wrong between the tool and a sensor.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ClientError {
    /// The transport failed.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Bus(#[from] BusError),
    /// An object could not be read or written.
    #[error(transparent)]
    Sdo(#[from] SdoError),
    /// Nobody answered.
    #[error("no sensor answers on {bus}")]
    #[diagnostic(help("{tried}"))]
    Nobody {
        /// The bus.
        bus: String,
        /// What was tried, what was heard, and how to get a sensor.
        tried: String,
    },
    /// Several answered and none was chosen.
    #[error("{} sensors are on the bus and none was chosen", nodes.len())]
    #[diagnostic(help("choose one: --node {}", list(nodes, " or --node ")))]
    Several {
        /// Their node ids.
        nodes: Vec<u8>,
    },
    /// Two devices share a node id.
    #[error("{} devices answer as node {node} (serial numbers {})", serials.len(), list(serials, ", "))]
    #[diagnostic(help(
        "each needs a node id of its own: take one off the bus and give the other another id with \
         `thud configure --node {node} --node-id ID`, then reset it"
    ))]
    Doubled {
        /// The id.
        node: u8,
        /// Serial numbers of those who answered.
        serials: Vec<u32>,
    },
    /// The sensor is Operational and refuses configuration.
    #[error("node {node} is armed (Operational) and refuses configuration (SDO abort 08000022h)")]
    #[diagnostic(help("another master keeps it Operational; `thud configure` disarms it for the change by itself"))]
    Armed {
        /// The node.
        node: u8,
    },
    /// The configuration is locked by a key.
    #[error("the configuration of node {node} is locked, {why} (SDO abort 08000021h)")]
    #[diagnostic(help("give the file with its key: --key FILE; nothing was changed, and reading needs no key"))]
    Locked {
        /// The node.
        node: u8,
        /// What is wrong with the key.
        why: &'static str,
    },
    /// A configuration was refused; nothing was applied.
    #[error("{sentence}")]
    #[diagnostic(help("nothing was changed; the sensor goes on with the configuration it had"))]
    Refused {
        /// Which setting, what was offered, what is permitted.
        sentence: String,
    },
    /// A recording could not be fetched whole.
    #[error("the curve of impact {impact} could not be fetched from node {node} in {tries} attempts: {last}")]
    Recording {
        /// The node.
        node: u8,
        /// The impact.
        impact: u32,
        /// How often it was tried.
        tries: u32,
        /// What was wrong at last.
        last: String,
    },
}

fn list<T: std::fmt::Display>(items: &[T], between: &str) -> String {
    items.iter().map(T::to_string).collect::<Vec<_>>().join(between)
}

/// NMT commands, CiA 301 7.2.8.3.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Nmt {
    /// To Operational: events and alarms are sent.
    Start = 1,
    /// To Stopped: neither PDO nor SDO.
    Stop = 2,
    /// To Pre-operational: SDO only.
    PreOperational = 128,
    /// Reset of the whole node, as after power-up.
    ResetNode = 129,
    /// Reset of communication.
    ResetCommunication = 130,
}

/// A bus with sensors on it.
pub struct Client {
    line: Line,
}

impl Client {
    /// A client on this bus.
    #[must_use]
    pub fn new(bus: Box<dyn Bus>) -> Self {
        Self { line: Line::new(bus) }
    }

    /// Opens the bus at this address.
    ///
    /// # Errors
    /// [`BusError::Open`].
    pub fn open(address: &BusAddress) -> Result<Self, BusError> {
        Ok(Self::new(address.open()?))
    }

    /// Everything received and not yet read, and the counters.
    pub fn line(&mut self) -> &mut Line {
        &mut self.line
    }

    /// The SDO channel to a node.
    pub fn sdo(&mut self, node: u8) -> Sdo<'_> {
        Sdo::new(&mut self.line, node)
    }

    /// What the transport counted.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.line.counters()
    }

    /// The sensors on the bus, ordered by node id; all of them, or the one asked for.
    ///
    /// # Errors
    /// [`ClientError::Nobody`] within 2 s of the bus's clock; [`ClientError::Doubled`].
    pub fn find(&mut self, node: Option<u8>) -> Result<Vec<Sensor>, ClientError> {
        find::find(&mut self.line, node)
    }

    /// The one sensor that is meant: the one asked for, or the only one there is.
    ///
    /// # Errors
    /// As [`Client::find`], and [`ClientError::Several`].
    pub fn the_sensor(&mut self, node: Option<u8>) -> Result<Sensor, ClientError> {
        let mut sensors = self.find(node)?;
        if sensors.len() > 1 {
            return Err(ClientError::Several { nodes: sensors.iter().map(|sensor| sensor.node).collect() });
        }
        Ok(sensors.remove(0))
    }

    /// Sends an NMT command to a node, or with 0 to all of them. NMT has no answer; the state shows in the heartbeat.
    ///
    /// # Errors
    /// [`BusError::Send`].
    pub fn nmt(&mut self, command: Nmt, node: u8) -> Result<(), BusError> {
        let mut data = [0; 8];
        data[..2].copy_from_slice(&[command as u8, node]);
        self.line.send(&Frame { id: 0, len: 2, data })
    }

    /// Sends the robot's effective mass as a robot controller does, by RPDO 1. `sequence` counts up by one with each.
    ///
    /// # Errors
    /// [`BusError::Send`].
    pub fn send_effective_mass(
        &mut self,
        node: u8,
        mass: thud_firmware::units::Kilogram,
        sequence: u16,
    ) -> Result<(), BusError> {
        use thud_firmware::dictionary::frame::{MASS_BASE, MassFrame};
        let bytes = MassFrame { mass, sequence }.encode();
        let mut data = [0; 8];
        data[..bytes.len()].copy_from_slice(&bytes);
        self.line.send(&Frame { id: MASS_BASE + u16::from(node), len: bytes.len() as u8, data })
    }

    /// Tells all nodes the time (TIME, CiA 301 7.2.6.2): ms after midnight and days since 1984-01-01, UTC.
    ///
    /// # Errors
    /// [`BusError::Send`].
    pub fn set_time(&mut self, since_1970: Duration) -> Result<(), BusError> {
        self.line.send(&time_frame(since_1970))
    }
}

/// Identifier of TIME.
const TIME: u16 = 0x100;
/// From 1970-01-01 to 1984-01-01: 14 years with three leap days.
const DAYS_1970_TO_1984: u64 = 14 * 365 + 3;

fn time_frame(since_1970: Duration) -> Frame {
    let days = (since_1970.as_secs() / 86_400).saturating_sub(DAYS_1970_TO_1984);
    let milliseconds = (since_1970.as_millis() % 86_400_000) as u32;
    let mut data = [0; 8];
    data[..4].copy_from_slice(&milliseconds.to_le_bytes());
    data[4..6].copy_from_slice(&(days.min(u64::from(u16::MAX)) as u16).to_le_bytes());
    Frame { id: TIME, len: 6, data }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod time_tests {
    use super::*;

    #[test]
    fn the_time_of_day_counts_from_1984() {
        // 1984-01-02 00:00:01.5 UTC is 441 849 600 + 1.5 s after 1970.
        let frame = time_frame(Duration::from_millis(441_849_601_500));
        assert_eq!(frame.bytes(), [0xDC, 0x05, 0, 0, 1, 0]);
    }

    #[test]
    fn a_choice_is_offered_among_several() {
        use miette::Diagnostic as _;
        let error = ClientError::Several { nodes: vec![32, 33] };
        assert_eq!(error.help().unwrap().to_string(), "choose one: --node 32 or --node 33");
    }
}
