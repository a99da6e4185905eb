//! The robot goes on pushing: its controller still wants to be behind the rig.
//!
//! F(t) = F_0·(1 − e^(−t/τ)) on the robot from the first contact on: the position error, and with it the
//! torque, grows while the rig holds the robot up, until the controller's limit.
//!
//! Source: first-order rise to a plateau, the simplest form of a torque-limited position controller.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Motion};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "robot-push",
    group: Group::Robot,
    site: Site::Drive,
    equation: "F(t) = F_0·(1 − exp(−t/τ)) on the robot from first contact",
    source: "torque-limited position control; up to about 150 N",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "the plateau of the push",
            null: Some(0.0),
            range: (0.0, 600.0),
            plausible: (1.0, 150.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "rise_time_s",
            unit: "s",
            meaning: "time constant of its rise",
            null: None,
            range: (1e-4, 5.0),
            plausible: (0.005, 0.3),
            typical: 0.015,
            scale: Scale::Logarithmic,
            search: Search::OfContactTime,
        },
    ],
    signature: "a longer pulse, a higher late force, contact that does not end but comes to rest at F_0, hits again",
    confused_with: &["joint-elasticity", "pose-dependent-mass"],
    separated_by: "stop the robot at contact by command: the plateau goes",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.drives.push(Box::new(Push { force_n: effect.value(0), rise_time_s: effect.value(1) }));
}

#[derive(Debug)]
struct Push {
    force_n: f64,
    rise_time_s: f64,
}

impl Drive for Push {
    fn force_n(&self, motion: Motion) -> f64 {
        if motion.time_s <= 0.0 { 0.0 } else { -self.force_n * (-motion.time_s / self.rise_time_s).exp_m1() }
    }
}
