//! A simulated sensor on a simulated rig: the firmware's own tasks on a simulated board, and robots that run into it on
//! request.
//!
//! ```text
//! strike ─▶ rig ─N─▶ chain ─codes─▶ firmware ─▶ CAN ─▶ SimulatedBus (virtual time)
//!                                                └───▶ live, to another bus in real time
//! ```

use std::cell::RefCell;
use std::rc::Rc;

use thud_firmware::configuration::Configuration;
use thud_firmware::storage::NotStored;
use thud_sim::board::{BoardSettings, commission, firmware};
use thud_sim::bus::BitRate;
use thud_sim::chain::ChainSettings;
use thud_sim::force::Blows;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Rig, RigError};
use thud_sim::world::{BoardId, World};

use crate::bus::simulated::SimulatedBus;

pub mod live;
pub mod request;

/// A blow begins so long after it was ordered, so that no sample of it has been converted yet.
const LEAD_S: f64 = 0.010;
/// An impact is followed for so long: the transient window of 0.5 s, a held contact after it, and rebounds.
const FOLLOWED_S: f64 = 1.5;

/// What is simulated.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Starts all random numbers.
    pub seed: u64,
    /// Serial number of the board.
    pub serial: u32,
    /// What the board holds in flash when it is switched on.
    pub configuration: Configuration,
    /// The measuring chain as it really is.
    pub chain: ChainSettings,
    /// The rig as it really is.
    pub rig: Rig,
    /// What the rig has beyond the ideal impact.
    pub effects: Vec<Effect>,
}

/// A world with one sensor in it.
pub struct SimulatedSensor {
    world: Rc<RefCell<World>>,
    board: BoardId,
    blows: Blows,
    rig: Rig,
    effects: Vec<Effect>,
}

impl SimulatedSensor {
    /// Stores the configuration in its flash and switches it on.
    ///
    /// # Errors
    /// [`NotStored`], which an empty flash never gives.
    pub fn new(setup: Setup) -> Result<Self, NotStored> {
        let mut world = World::new(BitRate::MEGABIT, setup.seed);
        let blows = Blows::new();
        let settings = BoardSettings::new(setup.serial, setup.seed).with_chain(setup.chain);
        let board = world.add_board(settings, blows.clone(), firmware);
        // The board reads its flash when the world first runs.
        commission(world.board(board).flash(), setup.configuration)?;
        Ok(Self { world: Rc::new(RefCell::new(world)), board, blows, rig: setup.rig, effects: setup.effects })
    }

    /// The world that it lives in.
    #[must_use]
    pub fn world(&self) -> &Rc<RefCell<World>> {
        &self.world
    }

    /// Its board in that world.
    #[must_use]
    pub fn board(&self) -> BoardId {
        self.board
    }

    /// A host's access to its bus.
    #[must_use]
    pub fn bus(&self) -> SimulatedBus {
        SimulatedBus::new(self.world.clone())
    }

    /// Lets a robot run into the rig, 10 ms from now; what truly happens then, and when it begins, seconds of the world.
    ///
    /// # Errors
    /// [`RigError`] when speed or mass is no physical value.
    pub fn strike(&self, approach: &Approach) -> Result<(f64, Rc<Impact>), RigError> {
        let impact = Rc::new(self.rig.strike(approach, &self.effects, FOLLOWED_S, Accuracy::default())?);
        let begins_s = self.world.borrow().now().as_micros() as f64 * 1e-6 + LEAD_S;
        let force = impact.clone();
        self.blows.strike(begins_s, FOLLOWED_S, move |since_s| force.force_n(since_s));
        Ok((begins_s, impact))
    }
}
