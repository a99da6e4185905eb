//! Friction of the guide that grows with the load: an impact off the axis presses the piece against its guide.
//!
//! F_f = μ_g·P, P the contact force. A piece of guided length L that is hit by e beside its axis is pressed with
//! e·P/L at both ends, so that μ_g = 2·μ·e/L. Whether the cell sees the friction depends on what the guide stands on, as with
//! any friction of the guide: on the cell it reads P, beside it what friction leaves of P.
//!
//! The guide holds rigidly or on bristles, as with any friction (`guide_friction.rs`): with y their bend by `presliding_m`, F_f = coefficient·P·y.
//!
//! Source: balance of moments on the guided piece.

use super::guide_friction::{CELL_SHARE, CREEP, PRESLIDING};
use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "load-dependent-friction",
    group: Group::Guide,
    site: Site::Guide,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("presliding_m", "bristles", &[1.0]), ("creep_m_per_s", "bristles", &[1.0])],
    sized: &[],
    equation: "F_f = coefficient·P·sgn(dx_p/dt) while sliding; coefficient = 2·μ·e/L",
    source: "moment of an off-axis impact; μ 0.1 to 0.4, e/L up to 0.4",
    parameters: &[
        Parameter {
            name: "coefficient",
            unit: "1",
            meaning: "friction per contact force",
            null: Some(0.0),
            range: (0.0, 0.9),
            plausible: (0.002, 0.3),
            typical: 0.03,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        CELL_SHARE,
        Parameter {
            name: "bristles",
            meaning: "how the guide holds: 0 rigidly, 1 on bristles that bend before they slide",
            ..Parameter::EITHER
        },
        PRESLIDING,
        CREEP,
    ],
    signature: "a wedge-shaped loop of force over stroke: its width grows with the force",
    confused_with: &["hunt-crossley-damping", "guide-friction", "pad-relaxation"],
    separated_by: "hit at another distance from the axis; the loop's width over force does not depend on the speed",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.guide.load_coefficient += effect.value(0);
    assembly.guide.stands_on_cell(effect.value(1));
    if effect.value(2) > 0.5 {
        assembly.guide.stands_on_bristles(effect.value(3), effect.value(4));
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Quantity, Rig};

    /// On the cell the guide brings it all that the robot presses with, beside it what friction leaves of that.
    #[test]
    fn the_cell_reads_what_the_guide_stands_on() {
        for (share, part) in [("0", 0.9), ("1", 1.0)] {
            let effect = format!("load-dependent-friction:coefficient=0.1,cell_share={share}");
            let impact = strike(Rig::impact(25e3), 0.25, 6.0, &[&effect]);
            let contact_n = impact.value(Quantity::ContactForce, 0.01);
            near("on the way in", impact.force_n(0.01), part * contact_n, 1e-9 * contact_n);
        }
    }

    /// Dahl's solid: y = 1 − e^(−x/z) on the way in.
    #[test]
    fn bristles_bend_before_they_rub() {
        let effect = "load-dependent-friction:coefficient=0.1,bristles=1,presliding_m=1e-3,creep_m_per_s=1e-6";
        let impact = strike(Rig::impact(25e3), 0.25, 6.0, &[effect]);
        for time_s in [1e-3, 4e-3, 1e-2] {
            let contact_n = impact.value(Quantity::ContactForce, time_s);
            let bend = 1.0 - (-impact.value(Quantity::Stroke, time_s) / 1e-3).exp();
            near("friction", contact_n - impact.force_n(time_s), 0.1 * bend * contact_n, 1e-3 * contact_n);
        }
    }
}
