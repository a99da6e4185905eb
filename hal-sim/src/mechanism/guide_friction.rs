//! Dry friction of the piece in its guide.
//!
//! The piece sticks while less than F_c is needed to hold it, and slides against F_c. On a massless piece in
//! series with pad and spring this is a play operator: while it sticks only the pad yields, and the stroke of
//! the spring lags behind the robot's by F_c/k. Whether the cell sees the friction depends on what the guide
//! stands on, which `cell_share` says; the spring's force it always sees. When the robot has gone, friction holds a massless
//! piece where it is, at F_c. A real one is left with some momentum: at F_c − v·√(m·k) as long as that is little, and anywhere
//! between −F_c and F_c beyond. F_c·rest_share^(v/0.25 m/s) is both on average.
//!
//! Source: C. A. Coulomb; play operator: M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996), ch. 2.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

/// Where the friction goes: to the cell or past it.
pub(super) const CELL_SHARE: Parameter = Parameter {
    name: "cell_share",
    unit: "1",
    meaning: "part of the friction that flows through the load cell: 0 when the guide stands beside it, 1 when on it",
    null: None,
    range: (0.0, 1.0),
    plausible: (0.0, 1.0),
    typical: 0.0,
    scale: Scale::Linear,
    search: Search::Typical,
};

/// What friction still holds when the robot has gone.
pub(super) const REST_SHARE: Parameter = Parameter {
    name: "rest_share",
    unit: "1",
    meaning: "part of the sliding friction that the springs still press with after a release at 0.25 m/s: 1 for a piece without mass",
    null: None,
    range: (0.0, 1.0),
    plausible: (0.0, 1.0),
    typical: 1.0,
    scale: Scale::Linear,
    search: Search::Typical,
};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "guide-friction",
    group: Group::Guide,
    site: Site::Guide,
    lasting: true,
    equation: "F_f = F_c·sgn(dx_p/dt) while sliding, |F_f| ≤ F_c while sticking",
    source: "Coulomb friction with true sticking; 0.5 to 10 N for a printed guide",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "sliding friction",
            null: Some(0.0),
            range: (0.0, 60.0),
            plausible: (0.1, 10.0),
            typical: 2.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        CELL_SHARE,
        REST_SHARE,
    ],
    signature: "a loop of constant width in force over stroke, a short plateau at the turning point, a rest of up to F_c after release",
    confused_with: &["hunt-crossley-damping", "load-dependent-friction", "stiction", "piezo-discharge"],
    separated_by: "the loop's width depends neither on speed nor on force; the sign of the rest after release",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.guide.coulomb_n += effect.value(0);
    assembly.guide.stands_on_cell(effect.value(1));
    assembly.guide.rest_share = effect.value(2);
}
