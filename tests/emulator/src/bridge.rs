//! The emulated board in real time on a bus that other programs share.
//!
//! ```text
//! simulated bus ─▶ frames of the board ─▶ shared bus (udp_multicast) ─▶ the others
//!       ▲                                      │
//!       └──────── frames for the board ◀───────┴─▶ `thud hit` ─▶ rig
//! ```
//!
//! Guest time follows wall time as long as this computer can; where it cannot, guest time falls behind and says so.

use std::rc::Rc;
use std::time::{Duration, Instant};

use thud::bus::{Bus, BusError};
use thud::simulated_sensor::request::{Answer, Request};
use thud_firmware::board::{BusState, Received};
use thud_sim::bus::HostPort;
use thud_sim::force::Blows;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Rig, RigError};

use crate::emulator::Emulator;

/// Pause between two looks at the shared bus while guest time is up to date.
const TICK: Duration = Duration::from_millis(1);
/// Guest time that is made up for between two looks at the shared bus.
const STRIDE: embassy_time::Duration = embassy_time::Duration::from_millis(5);
/// From a request to the contact, s of guest time.
const LEAD_S: f64 = 0.01;
/// How long an impact is followed, s.
const FOLLOWED_S: f64 = 1.0;

/// The board on a shared bus.
pub struct Bridge {
    emulator: Emulator,
    port: HostPort,
    bus: Box<dyn Bus>,
    blows: Blows,
    rig: Rig,
    effects: Vec<Effect>,
    approach: Approach,
    began: Instant,
    behind: Duration,
    lost: u64,
}

impl Bridge {
    /// Puts a board on a bus; `blows` is what presses on its cell, `rig` and `approach` what a request without details means.
    #[must_use]
    pub fn new(emulator: Emulator, bus: Box<dyn Bus>, blows: Blows, rig: Rig, approach: Approach) -> Self {
        let port = emulator.bus().attach_host("bridge");
        Self {
            emulator,
            port,
            bus,
            blows,
            rig,
            effects: Vec::new(),
            approach,
            began: Instant::now(),
            behind: Duration::ZERO,
            lost: 0,
        }
    }

    /// Gives the rig these mechanisms beyond the ideal impact.
    #[must_use]
    pub fn with_effects(self, effects: Vec<Effect>) -> Self {
        Self { effects, ..self }
    }

    /// Lives for about a millisecond.
    ///
    /// # Errors
    /// [`BusError`] when the shared bus fails.
    pub fn live(&mut self) -> Result<(), BusError> {
        while let Some(stamped) = self.bus.receive(Duration::ZERO)? {
            match Request::decode(&stamped.frame) {
                Some(request) => self.requested(&request)?,
                None if Answer::decode(&stamped.frame).is_some() => {}
                None => self.port.send(&stamped.frame),
            }
        }
        let elapsed = embassy_time::Duration::from_micros(self.began.elapsed().as_micros() as u64);
        let due = embassy_time::Instant::MIN + elapsed;
        let now = self.emulator.now();
        if due > now {
            self.emulator.run_until(due.min(now + STRIDE));
        }
        let now = self.emulator.now();
        let behind = Duration::from_micros(due.as_micros().saturating_sub(now.as_micros()));
        self.behind = self.behind.max(behind);
        if self.port.status().state == BusState::BusOff {
            self.port.recover();
        }
        while let Some(arrival) = self.port.receive() {
            match arrival.received {
                Received::Frame(frame) => self.bus.send(&frame)?,
                Received::Lost(count) => self.lost += u64::from(count),
            }
        }
        if behind.is_zero() {
            std::thread::sleep(TICK);
        }
        Ok(())
    }

    /// Lets the robot run into the rig now; the highest force that will truly reach the cell, N.
    ///
    /// # Errors
    /// [`RigError`] when speed or mass is no physical value.
    pub fn hit(&mut self, speed_m_per_s: Option<f64>, mass_kg: Option<f64>) -> Result<f64, RigError> {
        let approach = Approach {
            speed_m_per_s: speed_m_per_s.unwrap_or(self.approach.speed_m_per_s),
            effective_mass_kg: mass_kg.unwrap_or(self.approach.effective_mass_kg),
            ..self.approach
        };
        let impact = Rc::new(self.rig.strike(&approach, &self.effects, FOLLOWED_S, Accuracy::default())?);
        let begins_s = self.emulator.now().as_micros() as f64 * 1e-6 + LEAD_S;
        let peak_n = impact.truth().peak_n;
        self.blows.strike(begins_s, FOLLOWED_S, move |since_s| impact.force_n(since_s));
        Ok(peak_n)
    }

    fn requested(&mut self, request: &Request) -> Result<(), BusError> {
        let peak_n = self.hit(request.speed_m_per_s, request.mass_kg).ok();
        self.bus.send(&Answer { node: request.node.unwrap_or(0), peak_n, number: request.number }.encode())
    }

    /// The board.
    #[must_use]
    pub fn emulator(&self) -> &Emulator {
        &self.emulator
    }

    /// The shared bus.
    #[must_use]
    pub fn bus(&self) -> &dyn Bus {
        self.bus.as_ref()
    }

    /// Wall time since it began.
    #[must_use]
    pub fn age(&self) -> Duration {
        self.began.elapsed()
    }

    /// By how much guest time was behind wall time at worst.
    #[must_use]
    pub fn behind(&self) -> Duration {
        self.behind
    }

    /// Frames that were lost between the two buses.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }
}
