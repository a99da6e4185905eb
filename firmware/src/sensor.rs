//! The whole sensor as one value: blocks in, signals out, events on request.
//!
//! The tasks of the board hold its parts separately, because sampling runs at interrupt priority and evaluation
//! does not; a replay or a benchmark, which has no interrupts, holds it whole. Both run the same code.

use heapless::Vec;

use crate::board::{AdcCode, BlockInfo, Overrun};
use crate::capture::{CAPTURE, Captures, Curve, LostCurves};
use crate::detector::{Detector, ImpactContext, Signals, Stamped};
use crate::event::Event;
use crate::impact::{self, CONTACTS};
use crate::units::{Kilogram, Newton};

/// Detector, captures and the numbering of events.
pub struct Sensor<const N: usize = CAPTURE> {
    detector: Detector<N>,
    captures: Captures<N>,
    next_event: u32,
}

impl<const N: usize> Sensor<N> {
    /// A sensor that settles first.
    #[must_use]
    pub const fn new(configuration: Stamped) -> Self {
        Self { detector: Detector::new(configuration), captures: Captures::new(), next_event: 1 }
    }

    /// Takes a block; see [`Detector::push`].
    pub fn push(&mut self, codes: &[AdcCode], info: &BlockInfo) -> Signals {
        self.detector.push(codes, info, &self.captures)
    }

    /// The same into a list; see [`Detector::push_into`].
    pub fn push_into(&mut self, codes: &[AdcCode], info: &BlockInfo, signals: &mut Signals) {
        self.detector.push_into(codes, info, &self.captures, signals);
    }

    /// Samples were lost; see [`Detector::overrun`].
    pub fn overrun(&mut self, overrun: Overrun) -> Signals {
        self.detector.overrun(overrun)
    }

    /// See [`Detector::configure`].
    pub fn configure(&mut self, configuration: Stamped) {
        self.detector.configure(configuration);
    }

    /// See [`Detector::impact_open`].
    #[must_use]
    pub fn impact_open(&self) -> bool {
        self.detector.impact_open()
    }

    /// See [`Detector::receive_effective_mass`].
    pub fn receive_effective_mass(&mut self, mass: Kilogram) {
        self.detector.receive_effective_mass(mass);
    }

    /// Noise of the idle signal, root mean square.
    #[must_use]
    pub fn noise(&self) -> Newton {
        self.detector.noise()
    }

    /// Whether zero, hum and noise are known well enough to judge by.
    #[must_use]
    pub fn settled(&self) -> bool {
        self.detector.settled()
    }

    /// Curves that were overwritten unseen.
    #[must_use]
    pub fn lost_curves(&self) -> LostCurves {
        self.captures.lost_curves()
    }

    /// Measures and judges a finished impact.
    pub fn evaluate(&mut self, context: &ImpactContext) -> Vec<Event, CONTACTS> {
        let events = impact::evaluate(&self.captures.curve(context.slot), context, self.next_event);
        self.captures.mark_evaluated(context.slot);
        self.next_event = self.next_event.wrapping_add(events.len() as u32);
        events
    }

    /// The captured curve of a finished impact, until the slot is needed again.
    pub fn curve(&self, context: &ImpactContext) -> impl Curve + '_ {
        self.captures.curve(context.slot)
    }
}
