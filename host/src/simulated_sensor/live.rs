//! A simulated sensor in real time on a bus that other programs share.
//!
//! ```text
//! simulated bus ─▶ frames of the sensor ─▶ shared bus ─▶ the others
//!       ▲                                      │
//!       └──────── frames for the sensor ◀──────┴─▶ "hit it now" (request) ─▶ rig
//! ```
//!
//! The world is advanced to the time that has passed, about every millisecond; a computer that is too slow for it
//! falls behind, which is measured and said.

use std::time::{Duration, Instant};

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::Serialize;
use thud_firmware::board::{BusState, Received};
use thud_sim::bus::HostPort;
use thud_sim::rig::{Approach, RigError};

use super::SimulatedSensor;
use super::request::{Answer, Request};
use crate::bus::{Bus, BusError};

/// Pause between two advances of the world. Slept, not waited on the bus: the kernel rounds the timeout of a socket up to
/// its own tick of 4 ms or more, a sleep it does not.
const TICK: Duration = Duration::from_millis(1);
/// Heartbeats come from 0x700 + node id.
const HEARTBEAT: std::ops::RangeInclusive<u16> = 0x701..=0x77F;

/// An impact that was ordered, and what truly happens in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hit {
    /// When the contact begins, seconds since the sensor was switched on.
    pub contact_s: f64,
    /// Speed at contact.
    pub speed_m_per_s: f64,
    /// Effective mass.
    pub mass_kg: f64,
    /// Highest force that reaches the cell.
    #[serde(rename = "peak_N")]
    pub peak_n: f64,
    /// Its impulse.
    #[serde(rename = "impulse_Ns")]
    pub impulse_ns: f64,
    /// Contacts, rebounds included.
    pub contacts: usize,
}

/// Why the sensor cannot live on.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum LiveError {
    /// The shared bus failed.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Bus(#[from] BusError),
    /// The simulation got stuck.
    #[error("the simulated sensor is stuck: {0}")]
    Stuck(String),
}

/// A sensor that lives in real time.
pub struct LiveSensor {
    sensor: SimulatedSensor,
    port: HostPort,
    bus: Box<dyn Bus>,
    approach: Approach,
    scatter: f64,
    chance: ChaCha8Rng,
    node: u8,
    began: Instant,
    behind: Duration,
    lost: u64,
    bus_off: u64,
}

impl LiveSensor {
    /// Puts it on a bus. `approach` is the robot that hits it where a request names none; `node` the id it was
    /// configured with.
    #[must_use]
    pub fn new(sensor: SimulatedSensor, bus: Box<dyn Bus>, approach: Approach, node: u8) -> Self {
        let port = sensor.world().borrow().bus().attach_host("bridge");
        Self {
            sensor,
            port,
            bus,
            approach,
            scatter: 0.0,
            chance: ChaCha8Rng::seed_from_u64(0),
            node,
            began: Instant::now(),
            behind: Duration::ZERO,
            lost: 0,
            bus_off: 0,
        }
    }

    /// Scatters the speed of its own robot by this relative standard deviation from one hit to the next.
    #[must_use]
    pub fn with_scatter(self, scatter: f64, seed: u64) -> Self {
        Self { scatter, chance: ChaCha8Rng::seed_from_u64(seed), ..self }
    }

    /// Lives for about a millisecond; the hits that others requested meanwhile.
    ///
    /// # Errors
    /// [`LiveError`].
    pub fn live(&mut self) -> Result<Vec<Hit>, LiveError> {
        std::thread::sleep(TICK);
        let mut hits = Vec::new();
        while let Some(stamped) = self.bus.receive(Duration::ZERO)? {
            match Request::decode(&stamped.frame) {
                Some(request) if request.node.is_none_or(|node| node == self.node) => {
                    hits.extend(self.requested(&request)?);
                }
                Some(_) => {}
                None if Answer::decode(&stamped.frame).is_some() => {}
                None => self.port.send(&stamped.frame),
            }
        }

        let due = self.began.elapsed();
        self.sensor.world().borrow_mut().advance_to(due).map_err(|stuck| LiveError::Stuck(stuck.to_string()))?;
        self.behind = self.behind.max(self.began.elapsed().saturating_sub(due));
        // Two devices that send different data under one identifier drive each other off the bus (ISO 11898-1), and
        // our end of it does not come back by itself either.
        if self.port.status().state == BusState::BusOff {
            self.port.recover();
            self.bus_off += 1;
        }
        while let Some(arrival) = self.port.receive() {
            match arrival.received {
                Received::Frame(frame) => {
                    if HEARTBEAT.contains(&frame.id) {
                        self.node = (frame.id & 0x7F) as u8;
                    }
                    self.bus.send(&frame)?;
                }
                Received::Lost(count) => self.lost += u64::from(count),
            }
        }
        Ok(hits)
    }

    /// Hits it now, with the robot it was started with unless speed or mass is given.
    ///
    /// # Errors
    /// [`RigError`] when speed or mass is no physical value.
    pub fn hit(&mut self, speed_m_per_s: Option<f64>, mass_kg: Option<f64>) -> Result<Hit, RigError> {
        let normal: f64 = StandardNormal.sample(&mut self.chance);
        // Three standard deviations at most, so that a rare draw is no other robot.
        let scattered = self.approach.speed_m_per_s * (1.0 + self.scatter * normal.clamp(-3.0, 3.0));
        let approach = Approach {
            speed_m_per_s: speed_m_per_s.unwrap_or(scattered),
            effective_mass_kg: mass_kg.unwrap_or(self.approach.effective_mass_kg),
            ..self.approach
        };
        let (contact_s, impact) = self.sensor.strike(&approach)?;
        let truth = impact.truth();
        Ok(Hit {
            contact_s,
            speed_m_per_s: approach.speed_m_per_s,
            mass_kg: approach.effective_mass_kg,
            peak_n: truth.peak_n,
            impulse_ns: truth.contacts.first().map_or(0.0, |contact| contact.impulse_ns),
            contacts: truth.contacts.len(),
        })
    }

    fn requested(&mut self, request: &Request) -> Result<Option<Hit>, LiveError> {
        let hit = self.hit(request.speed_m_per_s, request.mass_kg).ok();
        let peak_n = hit.as_ref().map(|hit| hit.peak_n);
        self.bus.send(&Answer { node: self.node, peak_n, number: request.number }.encode())?;
        Ok(hit)
    }

    /// Node id, as its last heartbeat said it.
    #[must_use]
    pub fn node(&self) -> u8 {
        self.node
    }

    /// The bus it lives on.
    #[must_use]
    pub fn bus(&self) -> &dyn Bus {
        self.bus.as_ref()
    }

    /// The longest that an advance of the world took: by so much the sensor was behind real time at worst.
    #[must_use]
    pub fn behind(&self) -> Duration {
        self.behind
    }

    /// Frames of the sensor that were lost on the way to the shared bus.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// How often its end of the simulated bus went bus-off, which is what a second device with its node id does to it.
    #[must_use]
    pub fn bus_off(&self) -> u64 {
        self.bus_off
    }

    /// How long it has lived.
    #[must_use]
    pub fn age(&self) -> Duration {
        self.began.elapsed()
    }
}
