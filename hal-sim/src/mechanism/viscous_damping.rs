//! A dashpot beside the pad's spring (Kelvin–Voigt).
//!
//! F = F_el(δ) + c·δ̇. The contact force begins with a step c·v₀. Behind a massless piece the cell sees it smoothed by
//! (k_pad + k_body)/c; without a pad the dashpot is beside the body springs and the cell sees the step itself.
//!
//! Source: Kelvin–Voigt element.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "viscous-damping",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    equation: "F = F_el(δ) + c·dδ/dt",
    source: "Kelvin–Voigt; 5 to 100 N·s/m",
    parameters: &[Parameter {
        name: "damping_Ns_per_m",
        unit: "N·s/m",
        meaning: "the dashpot",
        null: Some(0.0),
        range: (0.0, 2000.0),
        plausible: (1.0, 100.0),
        typical: 20.0,
        scale: Scale::Logarithmic,
        search: Search::Strength,
    }],
    signature: "a step of the force at contact, proportional to the speed; the pulse ends while the pad is still pressed",
    confused_with: &["hunt-crossley-damping", "moving-piece-inertia", "guide-friction"],
    separated_by: "the step is proportional to the speed and does not ring",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let element = assembly.pad.as_mut().unwrap_or(&mut assembly.spring);
    element.damping_ns_per_m += effect.value(0);
}
