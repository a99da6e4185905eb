//! The robot is not as fast at contact as its controller says.
//!
//! v = v_said·(1 + ε), the same for every impact.
//!
//! Source: comparison of robot controllers with independent gates: 2 to 10 %.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "speed-error",
    group: Group::Robot,
    site: Site::InitialCondition,
    equation: "v = v_said·(1 + ε)",
    source: "path-velocity error of a robot, 2 to 10 %",
    parameters: &[Parameter {
        name: "relative",
        unit: "1",
        meaning: "error of the speed",
        null: Some(0.0),
        range: (-0.5, 0.5),
        plausible: (-0.1, 0.1),
        typical: 0.04,
        scale: Scale::Linear,
        search: Search::Strength,
    }],
    signature: "peak and impulse are off by the same ratio in every recording, the duration is right",
    confused_with: &["gain-error", "pose-dependent-mass"],
    separated_by: "an independent gate; a dead weight on the cell tells the gain",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.approach.speed_m_per_s *= 1.0 + effect.value(0);
}
