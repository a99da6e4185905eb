//! The robot's own collision detection answers: a while after a contact force is passed it retracts.
//!
//! F = −F_r from the instant at which the contact force has passed F_th for a delay, on the robot.
//!
//! Source: threshold and delay of a collision monitor; reaction 5 to 30 ms after detection.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Motion, Trigger};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "collision-reaction",
    group: Group::Robot,
    site: Site::Drive,
    equation: "F = −F_r for t ≥ t(P = F_th) + delay, on the robot",
    source: "collision monitor; reaction after 5 to 30 ms",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "the retracting force F_r",
            null: Some(0.0),
            range: (0.0, 2000.0),
            plausible: (2.0, 300.0),
            typical: 40.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "threshold_N",
            unit: "N",
            meaning: "contact force that is noticed",
            null: None,
            range: (0.1, 2000.0),
            plausible: (5.0, 200.0),
            typical: 50.0,
            scale: Scale::Logarithmic,
            search: Search::OfPeak,
        },
        Parameter {
            name: "delay_s",
            unit: "s",
            meaning: "from there to the reaction",
            null: None,
            range: (0.0, 0.5),
            plausible: (0.002, 0.06),
            typical: 0.015,
            scale: Scale::Logarithmic,
            search: Search::OfContactTime,
        },
    ],
    signature: "nothing before a late instant, then a faster fall; only in impacts that pass the threshold",
    confused_with: &["pad-relaxation", "piezo-discharge", "joint-elasticity"],
    separated_by: "switch the reaction off; it starts at one force plus one delay, whatever the speed",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.drives.push(Box::new(Reaction {
        force_n: effect.value(0),
        trigger: Trigger { force_n: effect.value(1), delay_s: effect.value(2) },
    }));
}

#[derive(Debug)]
struct Reaction {
    force_n: f64,
    trigger: Trigger,
}

impl Drive for Reaction {
    fn force_n(&self, motion: Motion) -> f64 {
        if motion.since_trigger_s.is_some() { -self.force_n } else { 0.0 }
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn trigger(&self) -> Option<Trigger> {
        Some(self.trigger)
    }
}
