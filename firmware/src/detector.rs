//! The per-sample path: calibrate, track, detect, capture.
//!
//! Runs at interrupt priority on the board. It says that something began, and later that it is over; what it
//! was is [`crate::impact::evaluate`]'s work, on the captured curve, when there is time.

use heapless::Vec;

use crate::board::{AdcCode, BlockInfo, Overrun};
use crate::capture::{Captures, SlotId};
use crate::configuration::Configuration;
use crate::event::{Flags, Onset};
use crate::units::{Kilogram, Newton};

/// What the detector has to say after a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// A contact began: raise the alarm now.
    Onset(Onset),
    /// The impact is over and its curve stands in a slot: evaluate it.
    Over(ImpactContext),
    /// A fault of the chain appeared.
    FaultRaised(ChainFault),
    /// A fault of the chain has gone.
    FaultCleared(ChainFault),
    /// Samples were lost.
    Lost(u32),
}

/// Faults of the measuring chain that last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainFault {
    /// The IEPE bias left its range: cable broken or shorted.
    Bias,
    /// The signal sits at the end of its range while nothing touches.
    Clipped,
}

/// Signals of one block, in the order of time.
pub type Signals = Vec<Signal, 6>;

/// What the detector knew about an impact that the curve does not show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactContext {
    /// Number of the impact since power-up.
    pub impact: u32,
    /// Where its curve stands.
    pub slot: SlotId,
    /// The onset that opened it.
    pub onset: Onset,
    /// Configuration it began under, with its stamp.
    pub configuration: Stamped,
    /// Flags that the detector already knows (clipping, loss, bias, settling, held, truncated).
    pub flags: Flags,
    /// Noise of the idle signal before it, root mean square.
    pub noise: Newton,
    /// Effective mass latched at onset, with its age in ms where it was received.
    pub effective_mass: Option<(Kilogram, Option<u32>)>,
    /// Largest filtered force after the transient window, if the contact lasted that long.
    pub quasi_static: Option<Newton>,
}

/// A configuration with the stamp that every event carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped {
    /// The configuration.
    pub configuration: Configuration,
    /// Counts the changes since the device was made.
    pub revision: u32,
    /// CRC-32 of its stored form.
    pub hash: u32,
}

/// The per-sample state machine.
pub struct Detector<const N: usize> {
    #[expect(dead_code, reason = "skeleton")]
    active: Stamped,
}

impl<const N: usize> Detector<N> {
    /// A detector that settles first and is armed then.
    #[must_use]
    pub const fn new(configuration: Stamped) -> Self {
        Self { active: configuration }
    }

    /// Sets the configuration that takes effect as soon as no impact is open.
    pub fn configure(&mut self, configuration: Stamped) {
        self.active = configuration;
    }

    /// A robot controller said how heavy the robot is now.
    pub fn receive_effective_mass(&mut self, mass: Kilogram) {
        let _ = mass;
    }

    /// Whether an impact is open; nothing is written to flash meanwhile.
    #[must_use]
    pub fn impact_open(&self) -> bool {
        false
    }

    /// Takes a block.
    pub fn push(&mut self, codes: &[AdcCode], info: &BlockInfo, captures: &Captures<N>) -> Signals {
        let _ = (codes, info, captures);
        Signals::new()
    }

    /// Samples were lost before the next block.
    pub fn overrun(&mut self, overrun: Overrun) -> Signals {
        let _ = overrun;
        Signals::new()
    }
}
