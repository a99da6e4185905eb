//! The emulated board with a force at its cell, on a simulated bus.
//!
//! ```text
//! loop: the bus, if free, lets the most urgent frame start ─▶ the chip runs to the bus's next event, or to the microsecond
//!       after it wants something from the bus ─▶ the bus catches up ─▶ frames and errors into the controller's registers
//! ```

use embassy_time::{Duration, Instant};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use thud_sim::bus::{Arrival, BitRate, Bus, Controller, ControllerSettings, HostPort, SendingOrder};
use thud_sim::chain::{ChainSettings, MeasuringChain};
use thud_sim::force::ForceSource;

use crate::analog::FrontEnd;
use crate::chip::fdcan::Request;
use crate::chip::flash::Bank2;
use crate::chip::{Chip, rcc};
use crate::image::Image;
use crate::log::Log;
use crate::machine::{Halt, Machine};
use crate::moment::{MICROSECOND, Picoseconds, microseconds_up};

/// The controller of the chip as the bus sees it; its FIFOs are the chip's own.
const CONTROLLER: ControllerSettings =
    ControllerSettings { mailboxes: 3, order: SendingOrder::Buffer, receive_depth: usize::MAX };

/// The log is read so often, as a debug probe would.
const LOG_EVERY: Picoseconds = 1_000 * MICROSECOND;

/// Why the board started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Power came.
    Power,
    /// The reset pin.
    Pin,
    /// The software asked for it.
    Software,
    /// The watchdog bit.
    Watchdog,
    /// The supply sagged; memory survived.
    BrownOut,
}

/// What distinguishes an emulated board.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The measuring chain.
    pub chain: ChainSettings,
    /// The chip's unique id, from which the serial number is made.
    pub unique_id: [u8; 12],
    /// Seed of noise, of the bus and of what torn flash operations leave.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { chain: ChainSettings::quiet(), unique_id: *b"\x21\x00\x3A\x00thud\x20\x53\x34\x31", seed: 1 }
    }
}

/// A board that runs an image, and its bus.
pub struct Emulator {
    machine: Machine,
    log: Log,
    bus: Bus,
    controller: Controller,
    powered: bool,
    log_due: Picoseconds,
    starts: Vec<(Instant, Start)>,
}

impl Emulator {
    /// Switches a board on, on a bus of its own.
    #[must_use]
    pub fn new(image: &Image, settings: &Settings, force: impl ForceSource + 'static) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        let bus = Bus::new(BitRate::MEGABIT, random.random());
        let controller = bus.attach("emulated board", CONTROLLER);
        controller.connect(false);
        let front_end = FrontEnd::new(MeasuringChain::new(&settings.chain, random.random()), force);
        let chip = Chip::new(front_end, Bank2::new(random.random()));
        Self {
            machine: Machine::new(image, chip, settings.unique_id),
            log: Log::new(image),
            bus,
            controller,
            powered: true,
            log_due: 0,
            starts: vec![(Instant::MIN, Start::Power)],
        }
    }

    /// The bus, to attach hosts and traffic and to disturb it.
    #[must_use]
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Number of the board's node on the bus.
    #[must_use]
    pub fn node(&self) -> usize {
        self.controller.number()
    }

    /// The processor.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The processor, to act on it.
    pub fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// The chip around the processor.
    #[must_use]
    pub fn chip(&self) -> &Chip {
        self.machine.chip()
    }

    /// The same, to act on it.
    pub fn chip_mut(&mut self) -> &mut Chip {
        self.machine.chip_mut()
    }

    /// Lines of the program's log.
    #[must_use]
    pub fn log(&self) -> &[String] {
        self.log.lines()
    }

    /// When and why the board started, each time.
    #[must_use]
    pub fn starts(&self) -> &[(Instant, Start)] {
        &self.starts
    }

    /// Whether it has power.
    #[must_use]
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// The present.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    /// Cuts the power.
    pub fn power_off(&mut self) {
        self.powered = false;
        self.controller.connect(false);
        self.machine.chip_mut().power_cycle();
        self.machine.lose_memory();
        self.log.reset();
    }

    /// Gives power.
    pub fn power_on(&mut self) {
        if !self.powered {
            self.powered = true;
            self.machine.chip_mut().now = self.bus.now().as_micros() * MICROSECOND;
            self.machine.restart();
            self.starts.push((self.now(), Start::Power));
        }
    }

    /// The supply sags for a moment: a reset by which memory keeps what it holds.
    pub fn brown_out(&mut self) {
        self.reset(rcc::flag::BROWN_OUT, Start::BrownOut);
    }

    /// Presses the reset button.
    pub fn press_reset(&mut self) {
        self.reset(rcc::flag::PIN, Start::Pin);
    }

    fn reset(&mut self, flag: u32, start: Start) {
        self.log.drain(&mut self.machine);
        self.log.reset();
        self.controller.connect(false);
        self.machine.chip_mut().reset(flag);
        self.machine.restart();
        self.starts.push((self.now(), start));
    }

    /// Runs for some time.
    pub fn run_for(&mut self, duration: Duration) {
        self.run_until(self.now() + duration);
    }

    /// Runs until `limit`.
    pub fn run_until(&mut self, limit: Instant) {
        while self.step(limit) {}
    }

    /// Runs until something has arrived at a host, or until `deadline`.
    pub fn run_until_arrival(&mut self, host: &HostPort, deadline: Instant) -> Option<Arrival> {
        loop {
            if let Some(arrival) = host.receive() {
                return Some(arrival);
            }
            if !self.step(deadline) {
                return host.receive();
            }
        }
    }

    /// One turn of the loop; whether there is more to do before `limit`.
    pub fn step(&mut self, limit: Instant) -> bool {
        self.bus.arbitrate(self.bus.now());
        let goal = self.bus.next_event().map_or(limit, |event| event.min(limit)).max(self.now());
        let reached = if self.powered { self.run_chip(goal) } else { goal };
        self.bus.advance(reached);
        if self.powered {
            self.couple();
        }
        reached < limit
    }

    /// Runs the chip to `goal`, or to the microsecond at which it wants something from the bus.
    fn run_chip(&mut self, goal: Instant) -> Instant {
        let goal = goal.as_micros() * MICROSECOND;
        let mut until = goal;
        loop {
            let due = until.min(self.log_due.max(self.machine.chip().now));
            let halt = self.machine.run_until(due);
            let now = self.machine.chip().now;
            if now >= self.log_due {
                self.log.drain(&mut self.machine);
                self.log_due = now + LOG_EVERY;
            }
            match halt {
                Halt::Due => {}
                Halt::ResetRequested => self.reset(rcc::flag::SOFTWARE, Start::Software),
                Halt::Watchdog => self.reset(rcc::flag::WATCHDOG, Start::Watchdog),
                Halt::PowerLost => {
                    self.power_off();
                    return Instant::from_micros(microseconds_up(now));
                }
            }
            if let Some(at) = self.machine.chip().can.wanted_at() {
                until = until.min(at);
            }
            // An instruction or two may lie beyond.
            if now >= until {
                return Instant::from_micros(until / MICROSECOND);
            }
        }
    }

    /// What the controller wants goes to the bus, and what the bus has for it comes back.
    fn couple(&mut self) {
        let chip = self.machine.chip_mut();
        for (_, request) in chip.can.take_requests() {
            match request {
                Request::Join => {
                    let rate = chip.rcc.fdcan_hz().map_or(0, |hertz| chip.can.bit_rate(hertz));
                    if rate == 1_000_000 {
                        self.controller.connect(true);
                    } else {
                        chip.violate(format!("the controller joins the bus of 1 Mbit/s at {rate} bit/s"));
                    }
                }
                Request::Leave => self.controller.connect(false),
                Request::Send { buffer, frame } => {
                    if self.controller.load_buffer(buffer, &frame).is_err() {
                        chip.violate("a fourth transmit buffer".into());
                    }
                }
                Request::Recover => {
                    use thud_firmware::board::CanSupervise as _;
                    self.controller.recover();
                }
            }
        }
        chip.can.sent(self.controller.waiting_buffers());
        while let Some(arrival) = self.controller.arrival() {
            if let thud_firmware::board::Received::Frame(frame) = arrival.received {
                chip.can.receive(&frame);
            }
        }
        let status = {
            use thud_firmware::board::CanSupervise as _;
            self.controller.status()
        };
        chip.can.set_status(status, self.controller.take_error());
        chip.update_lines();
    }
}
