//! A simulated world as a bus: it moves while the host waits.
//!
//! The world's clock is the bus's clock. [`Bus::receive`] lets the world run until a frame has arrived or the timeout
//! has passed in virtual time, hundreds of times faster than life and the same every time.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use embassy_time::Instant;
use thud_firmware::board::{BusState, Frame, Received};
use thud_sim::bus::HostPort;
use thud_sim::world::World;

use super::{Bus, BusError, Counters, Stamped};

/// The bus of a world in this process.
pub struct SimulatedBus {
    world: Rc<RefCell<World>>,
    port: HostPort,
    opened: Instant,
    counters: Counters,
}

impl SimulatedBus {
    /// Attaches a host to the world's bus.
    #[must_use]
    pub fn new(world: Rc<RefCell<World>>) -> Self {
        let port = world.borrow().bus().attach_host("host");
        let opened = world.borrow().now();
        Self { world, port, opened, counters: Counters::default() }
    }
}

impl Bus for SimulatedBus {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.port.send(frame);
        self.counters.sent += 1;
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let mut world = self.world.borrow_mut();
        let timeout_us = u64::try_from(timeout.as_micros()).unwrap_or(u64::MAX / 4);
        let deadline = world.now() + embassy_time::Duration::from_micros(timeout_us);
        loop {
            // Bus-off does not end by itself.
            if self.port.status().state == BusState::BusOff {
                self.port.recover();
            }
            let arrival = world.run_until_arrival(&self.port, deadline).map_err(|stuck| BusError::Receive {
                bus: "the simulated bus".to_owned(),
                source: io::Error::other(stuck.to_string()),
            })?;
            let Some(arrival) = arrival else { return Ok(None) };
            match arrival.received {
                Received::Frame(frame) => {
                    self.counters.received += 1;
                    return Ok(Some(Stamped { frame, at: since(self.opened, arrival.at) }));
                }
                Received::Lost(count) => self.counters.lost += u64::from(count),
            }
        }
    }

    fn now(&self) -> Duration {
        since(self.opened, self.world.borrow().now())
    }

    fn describe(&self) -> String {
        "the simulated bus".to_owned()
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }
}

fn since(opened: Instant, now: Instant) -> Duration {
    Duration::from_micros(now.as_micros().saturating_sub(opened.as_micros()))
}
