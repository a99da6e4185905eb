//! The simulated board: what the firmware is given at each start, and what outlives it.
//!
//! ```text
//! power ─▶ start ─▶ parts ─▶ program (the firmware's tasks as one future) ─┬─ asks for a reset ─┐
//!            ▲                                                             ├─ watchdog bites ───┤
//!            └─────── tasks dropped, controller forgets, flash stays ◀─────┴─ power is cut ─────┘ (waits for power)
//! ```

use std::cell::{Cell, RefCell};
use std::pin::Pin;
use std::rc::Rc;

use embassy_time::{Duration, Instant};
use thud_firmware::board::{Identity, ResetCause};

use crate::adc::{Adc, Converter};
use crate::bus::{Bus, Controller, ControllerSettings};
use crate::chain::{Cable, ChainSettings, MeasuringChain};
use crate::flash::{Flash, PAGE};
use crate::force::ForceSource;
use crate::time::SlotId;
use crate::watchdog::IndependentWatchdog;

mod firmware;

pub use firmware::{commission, firmware};

/// What distinguishes a board from another one.
#[derive(Clone, Debug)]
pub struct BoardSettings {
    /// Serial number; messages and the bus's record call the board by it.
    pub serial: u32,
    /// The measuring chain in front of its ADC.
    pub chain: ChainSettings,
    /// Its CAN controller.
    pub controller: ControllerSettings,
    /// Bytes of flash for storage.
    pub flash_bytes: usize,
    /// How long the watchdog waits to be petted.
    pub watchdog_patience: Duration,
    /// Seed of its noise and of what torn flash operations leave.
    pub seed: u64,
}

impl BoardSettings {
    /// A board with the reference chain and no noise.
    #[must_use]
    pub fn new(serial: u32, seed: u64) -> Self {
        Self {
            serial,
            chain: ChainSettings::quiet(),
            controller: ControllerSettings::STM32G474,
            flash_bytes: 4 * PAGE,
            watchdog_patience: Duration::from_secs(1),
            seed,
        }
    }

    /// The same board with another chain.
    #[must_use]
    pub fn with_chain(self, chain: ChainSettings) -> Self {
        Self { chain, ..self }
    }
}

/// What a program finds when it starts.
pub struct Parts {
    /// The samples.
    pub samples: Adc,
    /// The CAN controller; clone it for each of its roles (transmit, receive, supervise).
    pub can: Controller,
    /// Flash for storage, all of it.
    pub flash: Flash,
    /// The watchdog, already awake.
    pub watchdog: IndependentWatchdog,
    /// Who the board is and why it started.
    pub identity: Identity,
}

/// A program from start to reset. It ends only to be reset, and says why.
pub type Life = Pin<Box<dyn Future<Output = ResetCause>>>;

/// What runs on a board: called at every start.
pub type Program = Box<dyn Fn(Parts) -> Life>;

/// A board. The world moves it; everything here can be asked or done between two runs of the world.
pub struct Board {
    settings: BoardSettings,
    program: Program,
    slot: SlotId,
    converter: Rc<RefCell<Converter>>,
    controller: Controller,
    flash: Flash,
    watchdog: IndependentWatchdog,
    /// Why the program ended, when it has.
    ended: Rc<Cell<Option<ResetCause>>>,
    powered: bool,
    starts: Vec<(Instant, ResetCause)>,
}

impl Board {
    pub(crate) fn new(
        settings: BoardSettings,
        force: impl ForceSource + 'static,
        program: Program,
        slot: SlotId,
        bus: &Bus,
    ) -> Self {
        let chain = MeasuringChain::new(&settings.chain, settings.seed);
        let controller = bus.attach(settings.name(), settings.controller);
        controller.connect(false);
        Self {
            converter: Rc::new(RefCell::new(Converter::new(chain, force))),
            controller,
            flash: Flash::new(settings.flash_bytes, settings.seed ^ u64::from(settings.serial)),
            watchdog: IndependentWatchdog::new(settings.watchdog_patience),
            ended: Rc::default(),
            powered: false,
            starts: Vec::new(),
            settings,
            program,
            slot,
        }
    }

    /// The future to run from now on.
    pub(crate) fn start(&mut self, now: Instant, cause: ResetCause) -> impl Future<Output = ()> + 'static {
        self.powered = true;
        self.starts.push((now, cause));
        self.flash.revive();
        self.converter.borrow_mut().start(now);
        self.controller.connect(true);
        self.watchdog.start(now);
        self.ended.set(None);
        let identity =
            Identity { serial: self.settings.serial, hardware_revision: 0, build: 0, reset_cause: cause, ended_at: 0 };
        let life = (self.program)(Parts {
            samples: Adc::new(self.converter.clone()),
            can: self.controller.clone(),
            flash: self.flash.clone(),
            watchdog: self.watchdog.clone(),
            identity,
        });
        let ended = self.ended.clone();
        async move { ended.set(Some(life.await)) }
    }

    pub(crate) fn stop(&mut self) {
        self.powered = false;
        self.controller.connect(false);
        self.watchdog.stop();
    }

    /// What the board must go through now, if anything.
    pub(crate) fn due(&self, now: Instant) -> Option<Due> {
        if !self.powered {
            return None;
        }
        if self.flash.is_dead() {
            return Some(Due::PowerLost);
        }
        if let Some(cause) = self.ended.get() {
            return Some(Due::Reset(cause));
        }
        self.watchdog.bites_at().is_some_and(|at| at <= now).then_some(Due::Reset(ResetCause::Watchdog))
    }

    pub(crate) fn next_event(&self) -> Option<Instant> {
        self.watchdog.bites_at()
    }

    pub(crate) fn slot(&self) -> SlotId {
        self.slot
    }

    /// What distinguishes it.
    #[must_use]
    pub fn settings(&self) -> &BoardSettings {
        &self.settings
    }

    /// Whether it has power. It loses it on [`crate::world::World::power_off`] and when a power cut ordered from its
    /// flash takes place.
    #[must_use]
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// When and why it started, each time.
    #[must_use]
    pub fn starts(&self) -> &[(Instant, ResetCause)] {
        &self.starts
    }

    /// Number of its node on the bus.
    #[must_use]
    pub fn node(&self) -> usize {
        self.controller.number()
    }

    /// Its flash: to look at, and to order a power cut.
    #[must_use]
    pub fn flash(&self) -> &Flash {
        &self.flash
    }

    /// Breaks or mends the cable of its cell.
    pub fn set_cable(&self, cable: Cable) {
        self.converter.borrow_mut().chain().set_cable(cable);
    }

    /// Makes its ADC lose samples; see [`Converter::lose`].
    pub fn lose_samples(&self, at: u64, samples: u32) {
        self.converter.borrow_mut().lose(at, samples);
    }

    /// Makes its ADC stand still until the next reset; see [`Converter::hang`].
    pub fn hang_adc(&self) {
        self.converter.borrow_mut().hang();
    }

    /// Samples lost since it exists.
    #[must_use]
    pub fn lost_samples(&self) -> u64 {
        self.converter.borrow().lost()
    }

    /// The world's instant of a sample, counted since the latest start.
    #[must_use]
    pub fn instant_of(&self, sample: u64) -> Instant {
        self.converter.borrow().instant_of(sample)
    }
}

impl BoardSettings {
    /// The board's name on the bus and in messages.
    #[must_use]
    pub fn name(&self) -> String {
        format!("board {}", self.serial)
    }
}

/// What happens to a board by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    Reset(ResetCause),
    PowerLost,
}
