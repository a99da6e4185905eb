//! Friction of the guide that grows with the load: an impact off the axis presses the piece against its guide.
//!
//! F_f = μ_g·P, P the contact force. A piece of guided length L that is hit by e beside its axis is pressed with
//! e·P/L at both ends, so that μ_g = 2·μ·e/L.
//!
//! Source: balance of moments on the guided piece.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "load-dependent-friction",
    group: Group::Guide,
    site: Site::Guide,
    lasting: true,
    equation: "F_f = coefficient·P·sgn(dx_p/dt) while sliding; coefficient = 2·μ·e/L",
    source: "moment of an off-axis impact; μ 0.1 to 0.4, e/L up to 0.4",
    parameters: &[Parameter {
        name: "coefficient",
        unit: "1",
        meaning: "friction per contact force",
        null: Some(0.0),
        range: (0.0, 0.9),
        plausible: (0.002, 0.3),
        typical: 0.03,
        scale: Scale::Logarithmic,
        search: Search::Strength,
    }],
    signature: "a wedge-shaped loop of force over stroke: its width grows with the force",
    confused_with: &["hunt-crossley-damping", "guide-friction", "pad-relaxation"],
    separated_by: "hit at another distance from the axis; the loop's width over force does not depend on the speed",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.guide.load_coefficient += effect.value(0);
}
