//! The guide holds a resting piece with more than it rubs on a sliding one.
//!
//! Held as long as |F| ≤ ρ·F_c, sliding against F_c; the piece breaks loose with a jump of the force by (ρ − 1)·F_c.
//!
//! Source: Stribeck's curve with its falling part taken as a step; F_s/F_c 1.1 to 2.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "stiction",
    group: Group::Guide,
    site: Site::Guide,
    equation: "|F_f| ≤ F_s while sticking, F_c·sgn(dx_p/dt) while sliding, F_s = ratio·F_c",
    source: "Coulomb friction with a static level; F_s/F_c 1.1 to 2",
    parameters: &[
        Parameter {
            name: "force_N",
            unit: "N",
            meaning: "sliding friction F_c",
            null: Some(0.0),
            range: (0.0, 60.0),
            plausible: (0.1, 10.0),
            typical: 2.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "static_ratio",
            unit: "1",
            meaning: "F_s over F_c",
            null: None,
            range: (1.0, 5.0),
            plausible: (1.05, 2.0),
            typical: 1.5,
            scale: Scale::Linear,
            search: Search::Plausible,
        },
        super::guide_friction::CELL_SHARE,
        super::guide_friction::REST_SHARE,
    ],
    signature: "a dead zone at the start and at the turning point that ends with a jump; a rest after release",
    confused_with: &["guide-friction", "clearance"],
    separated_by: "a slow push shows the jump; a gap shows none",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.guide.coulomb_n += effect.value(0);
    assembly.guide.static_ratio = assembly.guide.static_ratio.max(effect.value(1));
    assembly.guide.cell_share = effect.value(2);
    assembly.guide.rest_share = effect.value(3);
}
