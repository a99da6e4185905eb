//! How hard a blow is going to be, told while the force still rises.
//!
//! ```text
//! force                       ╭──╮  peak = F₄/sin(ω·t₄) · (1 + what a few regression trees know)
//!                          ╭──╯  ╰
//!                    · F₄ ─┤
//!              · F₃        │  t: since the contact, which is where the line through F₁ and F₃ meets zero
//!         · F₂             │  ω = √(K/m_R): the rig's springs and the robot's mass, known before
//!     · F₁                 │
//! ──┴─1───2────3────4 ms───┴──▶ after the onset was noticed
//! ```
//!
//! The ideal impact is a half sine, F = F_peak·sin(ωt), so that one force at a known time gives the peak: the speed need not be
//! known. What the half sine leaves out (pads, inertia of the impact piece, damping, the onset's own lateness) is in trees that
//! were trained on simulated or recorded campaigns by `thud predict train` and written into `table` by `thud predict export`:
//! constants, evaluated in some hundred comparisons without allocation. The bound says within which share of the forecast the peak
//! fell in [`COVERED`] of the impacts that took no part in training.
//!
//! Nothing is judged by a forecast: it comes before the event, which is measured.

use crate::board::AdcCode;
use crate::event::Onset;
use crate::units::{Hertz, Kilogram, Newton, NewtonPerMetre, Second};

mod table;

pub use table::TABLE;

/// Forces that a forecast needs.
pub const INSTANTS: usize = 4;
/// When they are due after the onset was noticed.
pub const DUE: [Second; INSTANTS] = [Second(0.001), Second(0.002), Second(0.003), Second(0.004)];
/// Inputs of the trees.
pub const INPUTS: usize = 6;
/// Depth of each tree.
pub const DEPTH: usize = 4;
/// Decisions of a tree.
pub const DECISIONS: usize = (1 << DEPTH) - 1;
/// Leaves of a tree.
pub const LEAVES: usize = 1 << DEPTH;
/// Steps of a unit for each input: what is compared are whole numbers. sine's argument, two ratios of forces, N, kg, N/m.
pub const STEPS: [f32; INPUTS] = [8192.0, 8192.0, 8192.0, 32.0, 256.0, 0.1];
/// Steps of a unit for the leaves.
pub const LEAF_STEPS: f32 = 16_384.0;
/// The share of peaks that the bound covers.
pub const COVERED: f32 = 0.95;
/// Upper ends of the classes of F₄ that have a bound each; the last class has none. N.
pub const CLASSES: [f32; 3] = [5.0, 15.0, 50.0];
/// The sine's argument is held to this: beyond, the force is near its peak and the sine says nothing about when.
const ARGUMENT: (f32, f32) = (0.05, 1.45);
/// A force below this cannot be told from noise.
const LEAST: Newton = Newton(1.0);

/// A tree, level by level: the children of decision `i` are `2i + 1` (not above the threshold) and `2i + 2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tree {
    /// Which input is compared.
    pub input: [u8; DECISIONS],
    /// With what, in steps of that input.
    pub threshold: [i16; DECISIONS],
    /// What is added to the remainder, in steps.
    pub leaf: [i16; LEAVES],
}

/// Trees and bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table<'a> {
    /// What every forecast begins with, relative to the half sine.
    pub base: f32,
    /// The trees.
    pub trees: &'a [Tree],
    /// Relative to the forecast, for each class of F₄.
    pub bounds: [f32; CLASSES.len() + 1],
}

/// What is known before the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The robot's effective mass.
    pub mass: Kilogram,
    /// Stiffness of the body springs.
    pub stiffness: NewtonPerMetre,
}

/// The rise so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rise {
    /// Seconds after the onset was noticed.
    pub at: [f32; INSTANTS],
    /// Force above the true zero then, N.
    pub force: [f32; INSTANTS],
}

/// A peak that is still to come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Expected largest force, as the verdict filter will show it.
    pub peak: Newton,
    /// The peak is within the forecast ± this in [`COVERED`] of the cases.
    pub bound: Newton,
}

impl Rise {
    /// What the half sine expects, N, and ω·t₄; `None` where the force does not rise as a contact does.
    #[must_use]
    pub fn half_sine(&self, known: &Known) -> Option<(f32, f32)> {
        let [first, _, third, last] = self.force;
        let slope = (third - first) / (self.at[2] - self.at[0]);
        let possible = last > LEAST.0 && slope > 0.0 && known.mass.0 > 0.0 && known.stiffness.0 > 0.0;
        if !possible {
            return None;
        }
        // A line that meets zero long ago belongs to a force that hardly rises.
        let since_contact = (first / slope).clamp(0.0, DUE[3].0) + self.at[3] - self.at[0];
        let argument = libm::sqrtf(known.stiffness.0 / known.mass.0) * since_contact;
        let argument = argument.clamp(ARGUMENT.0, ARGUMENT.1);
        Some((last / crate::trigonometry::sin_cos(argument).0, argument))
    }

    /// What the trees compare, in steps: ω·t₄, F₂/F₄, F₃/F₄, F₄, m_R, K; with it what the half sine expects, N.
    #[must_use]
    pub fn inputs(&self, known: &Known) -> Option<([i16; INPUTS], f32)> {
        let (expected, argument) = self.half_sine(known)?;
        let last = self.force[3];
        let values = [argument, self.force[1] / last, self.force[2] / last, last, known.mass.0, known.stiffness.0];
        let mut steps = [0; INPUTS];
        for ((step, value), scale) in steps.iter_mut().zip(values).zip(STEPS) {
            // Saturates.
            *step = (value * scale) as i16;
        }
        Some((steps, expected))
    }
}

impl Tree {
    /// The leaf that these inputs lead to, in steps.
    #[must_use]
    pub fn leaf(&self, inputs: &[i16; INPUTS]) -> i16 {
        let mut at = 0;
        while at < DECISIONS {
            let input = inputs.get(usize::from(self.input[at])).copied().unwrap_or(0);
            at = 2 * at + 1 + usize::from(input > self.threshold[at]);
        }
        self.leaf[at - DECISIONS]
    }
}

impl Table<'_> {
    /// The forecast; `None` where the force does not rise as a contact does, or mass or stiffness are not known.
    #[must_use]
    pub fn forecast(&self, rise: &Rise, known: &Known) -> Option<Forecast> {
        let (inputs, expected) = rise.inputs(known)?;
        let steps: i32 = self.trees.iter().map(|tree| i32::from(tree.leaf(&inputs))).sum();
        let factor = 1.0 + self.base + steps as f32 / LEAF_STEPS;
        // The peak cannot be below what has been seen.
        let peak = (expected * factor).max(rise.force[3]);
        let class = class(rise.force[3]);
        Some(Forecast { peak: Newton(peak), bound: Newton(self.bounds[class] * peak) })
    }

    /// Bytes of the constants.
    #[must_use]
    pub const fn size(&self) -> usize {
        size_of::<Self>() + size_of_val(self.trees)
    }
}

/// Which bound belongs to a force F₄, N.
#[must_use]
pub fn class(force: f32) -> usize {
    CLASSES.iter().take_while(|end| force >= **end).count()
}

/// Gathers the rise from the blocks after an onset.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    impact: u32,
    noticed_at: u64,
    newton_per_code: f32,
    zero: f32,
    sample_rate: f32,
    next: usize,
    rise: Rise,
}

impl Watch {
    /// From an onset on; `zero` in codes.
    #[must_use]
    pub fn new(onset: &Onset, sample_rate: Hertz, newton_per_code: f32, zero: f32) -> Self {
        let Onset { impact, noticed_at, .. } = *onset;
        Self { impact, noticed_at, newton_per_code, zero, sample_rate: sample_rate.0, next: 0, rise: Rise::default() }
    }

    /// Number of the impact.
    #[must_use]
    pub fn impact(&self) -> u32 {
        self.impact
    }

    /// The onset's sample.
    #[must_use]
    pub fn noticed_at(&self) -> u64 {
        self.noticed_at
    }

    /// Takes a block; the rise, when this one completes it.
    ///
    /// The force at an instant is the mean of the first block that ends then or later.
    pub fn push(&mut self, codes: &[AdcCode], first_index: u64) -> Option<Rise> {
        let due = DUE.get(self.next)?;
        let samples = first_index.wrapping_sub(self.noticed_at) as i64 as f32;
        let count = codes.len() as f32;
        if samples + count < due.0 * self.sample_rate {
            return None;
        }
        let sum: i32 = codes.iter().map(|code| i32::from(*code)).sum();
        self.rise.at[self.next] = (samples + 0.5 * (count - 1.0)) / self.sample_rate;
        self.rise.force[self.next] = (sum as f32 / count - self.zero) * self.newton_per_code;
        self.next += 1;
        (self.next == INSTANTS).then_some(self.rise)
    }
}

#[cfg(test)]
mod tests;
