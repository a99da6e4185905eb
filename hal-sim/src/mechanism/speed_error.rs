//! The robot is not as fast at contact as its controller says.
//!
//! v = v_said·(1 + ε·(v_0/v_said)ⁿ), for every impact: a wrong scale is a part of the speed (n = 0), a speed that is read before or after the
//! robot has come to it, or off a gate whose own delay is not known, is off by about the same at every speed (n = 1). A robot that overshoots is
//! the more off the faster it is (n = −1), and where the way is too short to come to a speed, which takes v²/2a, by its square (n = −2). v_0 is
//! 250 mm/s, the reduced speed of ISO 10218-1, so that ε means as much in all of them.
//!
//! Source: comparison of robot controllers with independent gates: 2 to 10 %.

use super::{Effect, Group, Mechanism, Needed, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

/// Reduced speed, ISO 10218-1, m/s.
const REDUCED_M_PER_S: f64 = 0.25;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "speed-error",
    group: Group::Robot,
    site: Site::InitialCondition,
    lasting: false,
    exact: true,
    by_configuration: &["relative"],
    by_recording: &["relative"],
    used_in: &[],
    sized: &[],
    equation: "v = v_said·(1 + ε·(v_0/v_said)ⁿ), v_0 = 0.25 m/s; n = 0: a part of the speed, n = 1: the same at every speed, n = −1 and −2: a part that grows with the speed or its square",
    source: "path-velocity error of a robot, 2 to 10 %",
    parameters: &[
        Parameter {
            name: "relative",
            unit: "1",
            meaning: "error ε of the speed, at 0.25 m/s where it is not the same part of every speed",
            null: Some(0.0),
            range: (-0.5, 0.5),
            plausible: (-0.1, 0.1),
            typical: 0.04,
            scale: Scale::Linear,
            search: Search::Strength,
        },
        Parameter {
            name: "exponent",
            meaning: "n: 0 where the error is a part of the speed, 1 where it is the same at every speed, −1 or −2 where the part grows with the speed or its square; others are rounded",
            range: (-2.0, 1.0),
            plausible: (-2.0, 1.0),
            search: Search::FormWith(Needed::Speeds, &[0.0, 1.0, -1.0, -2.0], 1),
            ..Parameter::EITHER
        },
    ],
    signature: "peak and impulse are off by the same ratio in every recording, or by more the slower or the faster it is; the duration is right",
    confused_with: &["gain-error", "pose-dependent-mass"],
    separated_by: "an independent gate; a dead weight on the cell tells the gain",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let speed = &mut assembly.approach.speed_m_per_s;
    let power = 1 - effect.value(1).round() as i32;
    // Away from where it comes from: a robot that hits comes on.
    *speed += effect.value(0) * REDUCED_M_PER_S * speed.signum() * (speed.abs() / REDUCED_M_PER_S).powi(power);
}
