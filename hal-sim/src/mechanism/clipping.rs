//! The chain has an end: above it every sample has the same value.
//!
//! y = max(−L, min(F, L)).
//!
//! Source: rails of amplifier and converter.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "clipping",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: true,
    equation: "y = max(−L, min(F, L))",
    source: "rails of amplifier and converter; a range that was set too small",
    parameters: &[Parameter {
        name: "limit_N",
        unit: "N",
        meaning: "largest force that passes, of either sign",
        null: Some(f64::INFINITY),
        range: (1.0, 1e5),
        plausible: (50.0, 2500.0),
        typical: 200.0,
        scale: Scale::Logarithmic,
        search: Search::OfPeak,
    }],
    signature: "a flat top at one force, in the strongest recordings only",
    confused_with: &["force-ceiling", "end-stop"],
    separated_by: "equal samples to the last code; a force ceiling of the robot rings and depends on the pose",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Rails { limit_n: effect.value(0) }));
}

#[derive(Debug)]
struct Rails {
    limit_n: f64,
}

impl Stage for Rails {
    fn apply(&self, _times_s: &[f64], signal_n: &mut [f64]) {
        for signal in signal_n {
            *signal = signal.clamp(-self.limit_n, self.limit_n);
        }
    }
}
