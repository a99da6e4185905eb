//! The robot's own collision detection answers: a while after a contact force is passed it retracts or stops.
//!
//! Retracting, F = −F_r·½·(1 + tanh((v + v_r)/(v_r/20))) on the robot of velocity v (positive towards the rig), from a delay after the
//! contact force has passed F_th: it is pulled back until it retreats at v_r, which its drives do not exceed. The rebound alone may be as
//! fast: then they do nothing. Stopping, F = −F_r·tanh(v/v_b): it is braked to a standstill and held there, on its rebound, too. A speed
//! controller does the same about v = −v_r: a rebound that is faster is braked. Within v_b of where it wants to be it is a dashpot of
//! F_r/v_b, beyond it gives what it can; brakes of dry friction have a small v_b. Current and brakes take their time: from that instant on the
//! force grows as 1 − e^(−t/t_r).
//!
//! Source: threshold and delay of a collision monitor, reaction 5 to 30 ms after detection and never within its cycle (1 ms; what answers at
//! once is friction); a retreat is a motion with a limit of speed, 0.25 m/s (reduced speed, ISO 10218-1) to some m/s; its corner rounded
//! by tanh. A protective stop is of category 0 (brakes) or 1 (controlled), IEC 60204-1. A drive's current follows within about 1 ms, a controller's
//! trajectory or a brake's armature within some more, up to tens.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Drive, Motion, Trigger};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "collision-reaction",
    group: Group::Robot,
    site: Site::Drive,
    lasting: false,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("retreat_m_per_s", "response", &[0.0, 2.0]), ("braking_m_per_s", "response", &[1.0, 2.0])],
    sized: &[],
    equation: "F = −F_r·½·(1 + tanh(20·(1 + v/v_r)))·(1 − exp(−s/t_r)), s = t − t(P = F_th) − delay ≥ 0, on the robot; stopping −F_r·tanh(v/v_b) in its place, at a controlled speed −F_r·tanh((v + v_r)/v_b)",
    source: "collision monitor; reaction after 5 to 30 ms; a retreat with a limit of speed, or a stop of category 0 or 1",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "the retracting or braking force F_r",
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
            range: (1e-3, 0.5),
            plausible: (0.005, 0.05),
            typical: 0.015,
            scale: Scale::Logarithmic,
            search: Search::WithinContact,
        },
        Parameter {
            name: "retreat_m_per_s",
            unit: "m/s",
            meaning: "the fastest retreat v_r",
            null: None,
            range: (0.01, 100.0),
            plausible: (0.1, 3.0),
            typical: 0.5,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "response",
            meaning: "what it does: 0 pulls back, 1 stops, 2 retracts at a controlled speed",
            ..Parameter::ONE_OF_THREE
        },
        Parameter {
            name: "braking_m_per_s",
            unit: "m/s",
            meaning: "how far from the speed it wants a stop or a speed controller gives all its force: v_b",
            null: None,
            range: (1e-3, 100.0),
            plausible: (2e-3, 0.5),
            typical: 0.02,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "rise_s",
            unit: "s",
            meaning: "time constant t_r with which the force sets in",
            null: None,
            range: (1e-6, 0.1),
            plausible: (1e-4, 0.02),
            typical: 1e-3,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
    ],
    signature: "nothing before a late instant, then a faster fall, or with a stop a slower one; only in impacts that pass the threshold",
    confused_with: &["pad-relaxation", "piezo-discharge", "joint-elasticity", "robot-push"],
    separated_by: "switch the reaction off; it starts at one force plus one delay, whatever the speed",
    enter,
};

/// Over which part of its speed the retreat's force fades.
const CORNER: f64 = 0.05;

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.drives.push(Box::new(Reaction {
        force_n: effect.value(0),
        trigger: Trigger { force_n: effect.value(1), delay_s: effect.value(2) },
        response: match effect.form(4) {
            0 => Response::PullBack { retreat_m_per_s: effect.value(3) },
            1 => Response::Control { speed_m_per_s: 0.0, within_m_per_s: effect.value(5) },
            _ => Response::Control { speed_m_per_s: -effect.value(3), within_m_per_s: effect.value(5) },
        },
        rise_s: effect.value(6),
    }));
}

#[derive(Debug)]
struct Reaction {
    force_n: f64,
    trigger: Trigger,
    response: Response,
    rise_s: f64,
}

#[derive(Clone, Copy, Debug)]
enum Response {
    PullBack { retreat_m_per_s: f64 },
    Control { speed_m_per_s: f64, within_m_per_s: f64 },
}

impl Drive for Reaction {
    fn force_n(&self, motion: Motion) -> f64 {
        let Some(since_s) = motion.since_trigger_s else { return 0.0 };
        let share = match self.response {
            Response::PullBack { retreat_m_per_s } => {
                let over = 1.0 + motion.velocity_m_per_s / retreat_m_per_s;
                0.5 * (1.0 + (over / CORNER).tanh())
            }
            Response::Control { speed_m_per_s, within_m_per_s } => {
                ((motion.velocity_m_per_s - speed_m_per_s) / within_m_per_s).tanh()
            }
        };
        self.force_n * share * (-since_s / self.rise_s).exp_m1()
    }

    fn trigger(&self) -> Option<Trigger> {
        Some(self.trigger)
    }
}
