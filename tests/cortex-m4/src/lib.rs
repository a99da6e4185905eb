//! The same run of the sensor on a desktop and on a Cortex-M4F: counts in, event records out.
//!
//! ```text
//! counts ─▶ Sensor::push, a block at a time ─▶ over ─▶ Sensor::evaluate ─▶ 128 bytes an event, as object 0x2200:5 gives them
//! ```
#![no_std]

use thud_firmware::board::{AdcCode, BLOCK, BlockInfo};
use thud_firmware::capture::CAPTURE;
use thud_firmware::configuration::Configuration;
use thud_firmware::detector::{Signal, Signals, Stamped};
use thud_firmware::dictionary::event_record::{self, LENGTH};
use thud_firmware::limits::Region;
use thud_firmware::sensor::Sensor;
use thud_firmware::units::{Kilogram, Volt};

/// The bytes of an event.
pub type Record = [u8; LENGTH];

/// The configuration that both sides run with: an adult's chest, a robot of 6 kg, the reference chain.
#[must_use]
pub fn configuration() -> Stamped {
    let configuration =
        Configuration { region: Some(Region::Chest), effective_mass: Some(Kilogram(6.0)), ..Configuration::DEFAULT };
    Stamped { configuration, revision: 1, hash: 0x7468_7564 }
}

/// Counts what work takes; the desktop does not.
pub trait Meter {
    /// Does the work, which is a push with or without an open impact.
    fn count<R>(&mut self, impact_open: bool, work: impl FnOnce() -> R) -> R;
}

/// Does not count.
pub struct Uncounted;

impl Meter for Uncounted {
    fn count<R>(&mut self, _: bool, work: impl FnOnce() -> R) -> R {
        work()
    }
}

/// A sensor and the number of the sample that comes next.
pub struct Run {
    sensor: Sensor<CAPTURE>,
    next_index: u64,
}

impl Run {
    /// At the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self { sensor: Sensor::new(configuration()), next_index: 0 }
    }

    /// Takes a block and tells the records of what ended in it. The push alone is metered.
    pub fn push(&mut self, codes: &[AdcCode], meter: &mut impl Meter, mut tell: impl FnMut(&Record)) {
        let info = BlockInfo { first_index: self.next_index, bias: Volt(11.0) };
        self.next_index += BLOCK as u64;
        let mut signals = Signals::new();
        meter.count(self.sensor.impact_open(), || self.sensor.push_into(codes, &info, &mut signals));
        for signal in &signals {
            if let Signal::Over(context) = signal {
                for event in self.sensor.evaluate(context) {
                    tell(&event_record::encode(&event));
                }
            }
        }
    }
}

impl Default for Run {
    fn default() -> Self {
        Self::new()
    }
}
