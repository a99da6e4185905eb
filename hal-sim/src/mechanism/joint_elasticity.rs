//! The robot is not one mass: a part of it stands behind an elastic joint.
//!
//! ```text
//!  [link m_R·μ]──k_j,c_j──[tip m_R·(1−μ)]→ )pad)
//! ```
//!
//! k_j = (2πf)²·m_R·μ(1−μ) puts the free robot's own mode at f; the stiffness is the robot's property, so it
//! is scaled with the mass of the approach. A gauge of the robot's position shows the tip; its own encoders, at the motors, show the link.
//!
//! Source: lumped robot models for impacts (Caneschi et al., EuCoMeS 2024); 10–28 Hz joint modes of a KUKA iiwa.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Joint};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "joint-elasticity",
    group: Group::Robot,
    site: Site::Robot,
    lasting: true,
    exact: false,
    by_configuration: &["frequency_Hz"],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "tip m_R(1−μ) and link m_R·μ, F_j = k_j·Δx + c_j·Δv, k_j = (2πf)²·m_R·μ(1−μ), c_j = 2ζ·2πf·m_R·μ(1−μ)",
    source: "two-mass robot; joint modes of 10 to 28 Hz",
    parameters: &[
        Parameter {
            name: "link_fraction",
            unit: "1",
            meaning: "part of the effective mass behind the joint",
            null: Some(0.0),
            range: (0.0, 0.95),
            plausible: (0.005, 0.8),
            typical: 0.3,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "frequency_Hz",
            unit: "Hz",
            meaning: "mode of tip against link, in free air",
            null: None,
            range: (1.0, 200.0),
            plausible: (5.0, 60.0),
            typical: 18.0,
            scale: Scale::Logarithmic,
            search: Search::OfLines,
        },
        Parameter {
            name: "damping_ratio",
            unit: "1",
            meaning: "damping of that mode",
            null: None,
            range: (0.0, 0.7),
            plausible: (0.01, 0.15),
            typical: 0.04,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter { meaning: "where the robot's motion is read: 0 at the tip, 1 behind the joint", ..Parameter::GAUGE },
    ],
    signature: "another shape of the pulse, a double hump or a second hit while the link catches up; sway afterwards",
    confused_with: &["hunt-crossley-damping", "pad-relaxation", "frame-compliance", "robot-push"],
    separated_by: "it changes with the pose, not with the pad; the frequency stays when the springs change",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let pulsation_per_s = std::f64::consts::TAU * effect.value(1);
    let mass_kg = assembly.approach.effective_mass_kg;
    assembly.joint = Some(Joint::of_mode(mass_kg, effect.value(0), pulsation_per_s, effect.value(2)));
    assembly.link_bears_gauge |= effect.form(3) == 1;
}
