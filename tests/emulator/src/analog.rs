//! What the pins of the ADCs see.

use thud_firmware::board::AdcCode;
use thud_sim::chain::{Cable, MeasuringChain};
use thud_sim::force::ForceSource;

use crate::moment::{Picoseconds, SECOND};

/// Volts at full scale of a converter; VREF+ is VDDA on the board.
const REFERENCE_V: f32 = 3.3;
/// What divides the bias of the cell before its pin (see the firmware's `conversion`).
const BIAS_DIVIDER: f32 = 8.0;

/// The force at the cell and the chain before the pins, asked sample by sample.
pub struct FrontEnd {
    force: Box<dyn ForceSource>,
    chain: MeasuringChain,
    period: Picoseconds,
    kept: Option<Vec<AdcCode>>,
}

impl FrontEnd {
    /// This chain, pressed on by this force.
    #[must_use]
    pub fn new(chain: MeasuringChain, force: impl ForceSource + 'static) -> Self {
        let period = (SECOND as f64 / f64::from(chain.sample_rate().0)).round() as Picoseconds;
        Self { force: Box::new(force), chain, period, kept: None }
    }

    /// The time between two samples for which the chain's filters are made.
    #[must_use]
    pub fn period(&self) -> Picoseconds {
        self.period
    }

    /// The next sample of the force, whose middle lies at `at`: the sum of 16 conversions of 12 bits.
    pub fn force_code(&mut self, at: Picoseconds) -> AdcCode {
        let mut newton = [0.0];
        let mut code = [0];
        self.force.fill(at as f64 / SECOND as f64, self.period as f64 / SECOND as f64, &mut newton);
        self.chain.convert(&mut newton, &mut code);
        if let Some(kept) = &mut self.kept {
            kept.push(code[0]);
        }
        code[0]
    }

    /// The bias of the cell, 12 bits.
    #[must_use]
    pub fn bias_code(&self) -> u16 {
        let volt = self.chain.bias().0 / BIAS_DIVIDER;
        (volt / REFERENCE_V * 4096.0).round().clamp(0.0, 4095.0) as u16
    }

    /// Breaks or mends the cable.
    pub fn set_cable(&mut self, cable: Cable) {
        self.chain.set_cable(cable);
    }

    /// Keeps every code from now on.
    pub fn keep_codes(&mut self) {
        self.kept.get_or_insert_default();
    }

    /// The codes since they are kept, and begins anew.
    pub fn take_codes(&mut self) -> Vec<AdcCode> {
        self.kept.as_mut().map(std::mem::take).unwrap_or_default()
    }
}
