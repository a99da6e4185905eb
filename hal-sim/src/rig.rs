//! The impact rig: a robot runs into a padded, sprung piece on a load cell.
//!
//! ```text
//!                    x →                  x_p →
//!   robot m_R ──v──▶ ( pad k_p ( piece m_p )──body springs k_b──[ load cell ]── base
//!   (link─joint─tip)              guide: friction
//! ```
//!
//! The ideal rig, which the standard implies and the diagnosis calls the baseline, has a massless piece and no
//! loss: m_R·ẍ = −k·x + m_R·g while touching, 1/k = 1/k_p + 1/k_b, F = k·x. Without gravity that is a half sine:
//! peak v·√(k·m_R), duration π·√(m_R/k), impulse 2·m_R·v. Everything beyond it is a
//! [mechanism](crate::mechanism). In SI units, `f64`, the same result every time.
//!
//! Time zero is the first contact; for [`Kind::Fall`] it is the release. Positions are positive in the direction
//! of the impact and zero at first contact. The piece is measured from its own rest, so that its weight is
//! already in the springs.
//!
//! How it is solved: the motion is cut at every event (contact, separation, a stop, sticking, sliding), so that each
//! stretch between two events has a smooth right-hand side, and each stretch has a dense output, on which the next event is
//! located. Where the equations are linear they are solved in closed form, by the exponential of their matrix; else by an
//! adaptive method: Verner's 6(5), or Rodas where a massless piece meets a force that depends on its rate, which is
//! stiff.

mod assembly;
mod creep;
mod impact;
mod integrate;
mod motion;
mod propagate;
mod rosenbrock;
mod springs;
mod trajectory;

use crate::mechanism::Effect;

pub use assembly::{
    Assembly, Ceiling, Deformation, Drive, Element, ForceLaw, Frame, Guide, Joint, Motion, Neck, NeckCourse, Piece,
    Response, Stage, Sway, Trigger, Which,
};
pub use impact::{Contact, Impact, Kink, Quantity, Truth};
pub use integrate::{Accuracy, Effort};
pub use springs::{PAD_A10, PAD_A30, PAD_A70, Pad, SPRINGS_N_PER_M, SpringSet, pad_of, spring_set_of};

/// What kind of experiment it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A robot runs into the fixed rig.
    #[default]
    Impact,
    /// A mass falls on it.
    Drop,
    /// Free flight, no rig.
    Fall,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Impact, Self::Drop, Self::Fall];

    /// The name that files use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Impact => "impact",
            Self::Drop => "drop",
            Self::Fall => "fall",
        }
    }

    /// The kind with this name, if there is one.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Gravity where none is stated, m/s²: none along a robot's impact, standard gravity in a drop and a fall.
    #[must_use]
    pub const fn default_gravity_m_per_s2(self) -> f64 {
        match self {
            Self::Impact => 0.0,
            Self::Drop | Self::Fall => STANDARD_GRAVITY_M_PER_S2,
        }
    }
}

/// Standard gravity, m/s² (CGPM 1901).
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The rig, as far as it is the same for every impact of a campaign, and as far as the baseline knows it: the mass of the
/// moving piece is a parameter of the mechanism `moving-piece-inertia`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    /// What kind of experiment it is.
    pub kind: Kind,
    /// Stiffness of the body springs together, N/m.
    pub body_stiffness_n_per_m: f64,
    /// Stiffness of the pad in series with them, N/m; `None`: no pad.
    pub pad_stiffness_n_per_m: Option<f64>,
    /// Gravity along the direction of the impact, m/s²; it acts on the robot or the falling mass.
    pub gravity_m_per_s2: f64,
}

/// One impact's conditions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Speed at first contact, m/s; for [`Kind::Fall`] the speed at release.
    pub speed_m_per_s: f64,
    /// Effective mass of the robot along the impact, or the falling mass, kg.
    pub effective_mass_kg: f64,
    /// Number of the robot's configuration (pose) within the campaign.
    pub configuration: u32,
    /// Place of the impact in the campaign, from 0, for what depends on history.
    pub order: u32,
}

impl Approach {
    /// Where something depends on the speed, it is stated at this one, m/s: the reduced speed of a robot under manual control (ISO 10218-1).
    pub const REDUCED_SPEED_M_PER_S: f64 = 0.25;

    /// Below this speed a pad is pressed, not hit, m/s.
    const PRESSING_M_PER_S: f64 = 0.005;

    /// How fast it hits, m/s, where only the logarithm of that or one over it counts: no more slowly than a press is.
    #[must_use]
    pub fn hits_m_per_s(&self) -> f64 {
        self.speed_m_per_s.abs().max(Self::PRESSING_M_PER_S)
    }

    /// An impact at this speed (m/s) of this mass (kg), the first of its campaign.
    #[must_use]
    pub fn new(speed_m_per_s: f64, effective_mass_kg: f64) -> Self {
        Self { speed_m_per_s, effective_mass_kg, configuration: 0, order: 0 }
    }

    /// The speed after a free fall from rest: v = √(2·g·h), m/s.
    #[must_use]
    pub fn dropped_from(height_m: f64, mass_kg: f64) -> Self {
        Self::new((2.0 * STANDARD_GRAVITY_M_PER_S2 * height_m).sqrt(), mass_kg)
    }

    pub(crate) fn check(&self) -> Result<(), RigError> {
        require("the speed at contact", self.speed_m_per_s, "m/s", -100.0, 100.0)?;
        require("the effective mass", self.effective_mass_kg, "kg", 1e-4, 1e4)
    }
}

impl Rig {
    /// An impact rig with these springs (N/m), no pad, no gravity.
    #[must_use]
    pub fn impact(body_stiffness_n_per_m: f64) -> Self {
        Self { kind: Kind::Impact, body_stiffness_n_per_m, pad_stiffness_n_per_m: None, gravity_m_per_s2: 0.0 }
    }

    /// The same rig with a pad (N/m) in series.
    #[must_use]
    pub fn with_pad(self, stiffness_n_per_m: f64) -> Self {
        Self { pad_stiffness_n_per_m: Some(stiffness_n_per_m), ..self }
    }

    /// A mass falls on these springs (N/m).
    #[must_use]
    pub fn drop(body_stiffness_n_per_m: f64) -> Self {
        Self { kind: Kind::Drop, gravity_m_per_s2: STANDARD_GRAVITY_M_PER_S2, ..Self::impact(body_stiffness_n_per_m) }
    }

    /// Free flight: nothing is met.
    #[must_use]
    pub fn fall() -> Self {
        Self { kind: Kind::Fall, ..Self::drop(1.0) }
    }

    /// Stiffness of springs and pad in series, N/m: paper 1, eq. 17.
    #[must_use]
    pub fn effective_stiffness_n_per_m(&self) -> f64 {
        match self.pad_stiffness_n_per_m {
            Some(pad) => 1.0 / (1.0 / self.body_stiffness_n_per_m + 1.0 / pad),
            None => self.body_stiffness_n_per_m,
        }
    }

    /// Simulates one impact from first contact (or release) until `until_s` after it, and as much longer as its log has lost.
    ///
    /// # Errors
    /// A quantity that is no physical value, or a motion that the solver cannot follow; the message says which.
    pub fn strike(
        &self,
        approach: &Approach,
        effects: &[Effect],
        until_s: f64,
        accuracy: Accuracy,
    ) -> Result<Impact, RigError> {
        require("the end of the simulation", until_s, "s", 1e-6, 1e4)?;
        let assembly = Assembly::new(self, approach, effects)?;
        let ahead_s = assembly::ahead_s(&assembly.log);
        integrate::integrate(assembly, until_s + ahead_s, accuracy)
    }

    pub(crate) fn check(&self) -> Result<(), RigError> {
        require("the stiffness of the body springs", self.body_stiffness_n_per_m, "N/m", 1.0, 1e9)?;
        require("gravity along the impact", self.gravity_m_per_s2, "m/s²", -100.0, 100.0)?;
        self.pad_stiffness_n_per_m.map_or(Ok(()), |pad| require("the stiffness of the pad", pad, "N/m", 1.0, 1e9))
    }
}

fn require(what: &'static str, value: f64, unit: &'static str, low: f64, high: f64) -> Result<(), RigError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(RigError::OutOfRange { what, value, unit, low, high }) }
}

/// Why an impact cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// A quantity that is no physical value.
    #[error("{what} is {value} {unit}; {low} to {high} {unit} is possible")]
    OutOfRange {
        /// Which quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest possible value.
        low: f64,
        /// Largest possible value.
        high: f64,
    },
    /// More states than the solver is built for.
    #[error("the mechanisms together have {states} states; {most} are possible")]
    TooManyStates {
        /// How many they have.
        states: usize,
        /// How many are possible.
        most: usize,
    },
    /// The motion changes its form without end, as in an infinite series of ever smaller bounces.
    #[error("more than {most} changes of contact or friction until {time_s} s after first contact")]
    Chattering {
        /// When it was given up, s after first contact.
        time_s: f64,
        /// The most that is followed.
        most: usize,
    },
    /// The solver gave up.
    #[error("the solver stopped at {time_s} s after first contact: {reason}")]
    Solver {
        /// When, s after first contact.
        time_s: f64,
        /// What it said.
        reason: String,
    },
}
