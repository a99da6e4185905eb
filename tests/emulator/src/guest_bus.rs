//! The emulated board's bus as a bus of the host tool: guest time moves while the host waits.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use embassy_time::Instant;
use thud::bus::{Bus, BusError, Counters, Stamped};
use thud_firmware::board::{BusState, Frame, Received};
use thud_sim::bus::HostPort;

use crate::emulator::Emulator;

/// A host on the bus of an emulator.
pub struct GuestBus {
    emulator: Rc<RefCell<Emulator>>,
    port: HostPort,
    opened: Instant,
    counters: Counters,
}

impl GuestBus {
    /// Attaches a host.
    #[must_use]
    pub fn new(emulator: Rc<RefCell<Emulator>>) -> Self {
        let port = emulator.borrow().bus().attach_host("host");
        let opened = emulator.borrow().now();
        Self { emulator, port, opened, counters: Counters::default() }
    }

    fn since(&self, moment: Instant) -> Duration {
        Duration::from_micros(moment.as_micros().saturating_sub(self.opened.as_micros()))
    }
}

impl Bus for GuestBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.port.send(frame);
        self.counters.sent += 1;
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let mut emulator = self.emulator.borrow_mut();
        let timeout_us = u64::try_from(timeout.as_micros()).unwrap_or(u64::MAX / 4);
        let deadline = emulator.now() + embassy_time::Duration::from_micros(timeout_us);
        loop {
            if self.port.status().state == BusState::BusOff {
                self.port.recover();
            }
            let Some(arrival) = emulator.run_until_arrival(&self.port, deadline) else { return Ok(None) };
            match arrival.received {
                Received::Frame(frame) => {
                    self.counters.received += 1;
                    return Ok(Some(Stamped { frame, at: self.since(arrival.at) }));
                }
                Received::Lost(count) => self.counters.lost += u64::from(count),
            }
        }
    }

    fn now(&self) -> Duration {
        self.since(self.emulator.borrow().now())
    }

    fn describe(&self) -> String {
        "the emulated board's bus".to_owned()
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }
}
