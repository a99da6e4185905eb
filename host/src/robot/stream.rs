//! Sending the effective mass to a sensor while the robot moves, as its controller would: RPDO 1, docs/can.
//!
//! A received mass grows old (0x2001:2, 100 ms unless configured otherwise), so it is sent again and again, also where
//! it does not change. The sensor takes it while it is Operational only; what it took, refused and missed is read from
//! it afterwards.

use std::time::Duration;

use serde::Serialize;
use thud_firmware::configuration::Setting;
use thud_firmware::dictionary::index;
use thud_firmware::units::Kilogram;

use crate::client::{Client, ClientError};

/// What the sensor has counted of received masses: 0x2101:4 to 6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Received {
    /// Values that it took.
    pub taken: u32,
    /// Values that it refused as out of range.
    pub refused: u32,
    /// Sequence numbers that never came.
    pub missed: u32,
}

impl Received {
    /// Reads the counters of a sensor.
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn read(client: &mut Client, node: u8) -> Result<Self, ClientError> {
        let mut sdo = client.sdo(node);
        Ok(Self {
            taken: sdo.read(index::RECEIVED_MASS, 4)?,
            refused: sdo.read(index::RECEIVED_MASS, 5)?,
            missed: sdo.read(index::RECEIVED_MASS, 6)?,
        })
    }

    /// What was counted since an earlier reading.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            taken: self.taken.wrapping_sub(earlier.taken),
            refused: self.refused.wrapping_sub(earlier.refused),
            missed: self.missed.wrapping_sub(earlier.missed),
        }
    }
}

/// Whether a sensor would take this mass, kg.
#[must_use]
pub fn is_sendable(mass_kg: f64) -> bool {
    Setting::EffectiveMass.range().is_some_and(|(low, high)| (f64::from(low)..=f64::from(high)).contains(&mass_kg))
}

/// Sends masses at times of the bus's clock, with a sequence that goes on where the last sender's ended.
pub struct Sender {
    node: u8,
    sequence: u16,
    started: Duration,
    sent: u32,
}

impl Sender {
    /// A sender to this node; its time begins now.
    ///
    /// # Errors
    /// [`ClientError::Sdo`].
    pub fn start(client: &mut Client, node: u8) -> Result<Self, ClientError> {
        let last: u16 = client.sdo(node).read(index::RECEIVED_MASS, 2)?;
        Ok(Self { node, sequence: last.wrapping_add(1), started: client.line().now(), sent: 0 })
    }

    /// How many frames were sent.
    #[must_use]
    pub fn sent(&self) -> u32 {
        self.sent
    }

    /// Waits until this time after the start, and sends a mass.
    ///
    /// # Errors
    /// [`ClientError::Bus`].
    pub fn send_at(&mut self, client: &mut Client, after: Duration, mass_kg: f64) -> Result<(), ClientError> {
        let due = self.started + after;
        loop {
            let left = due.saturating_sub(client.line().now());
            if left.is_zero() {
                break;
            }
            client.line().hear(left)?;
        }
        client.send_effective_mass(self.node, Kilogram(mass_kg as f32), self.sequence)?;
        self.sequence = self.sequence.wrapping_add(1);
        self.sent += 1;
        Ok(())
    }
}
