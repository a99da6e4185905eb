//! The guide holds a resting piece with more than it rubs on a sliding one.
//!
//! Held as long as |F| ≤ ρ·F_c; sliding at v it rubs with F_c·(1 + (ρ − 1)·e^(−(v/v_s)²)). The rig's guide uses the speed that pad and springs
//! alone would give a piece without mass.
//!
//! Source: Stribeck's curve, B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083; F_s/F_c 1.1 to 2, v_s some mm/s
//! to some cm/s.

use super::guide_friction::{CELL_SHARE, CREEP, FORMS, GUIDE, PRESLIDING, REST_SHARE, Rubbing};
use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "stiction",
    group: Group::Guide,
    site: Site::Guide,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: FORMS,
    sized: &[],
    equation: "|F_f| ≤ F_s while sticking, (F_c + (F_s − F_c)·exp(−(v/v_s)²))·sgn(v) while sliding, F_s = ratio·F_c",
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
        CELL_SHARE,
        REST_SHARE,
        Parameter {
            name: "stribeck_m_per_s",
            unit: "m/s",
            meaning: "speed v_s over which friction falls from F_s to F_c",
            null: None,
            range: (1e-4, 1.0),
            plausible: (0.003, 0.1),
            typical: 0.02,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        GUIDE,
        PRESLIDING,
        CREEP,
    ],
    signature: "a dead zone at the start and at the turning point from which it breaks loose; a rest after release",
    confused_with: &["guide-friction", "clearance"],
    separated_by: "a slow push shows the fall of the force; a gap shows none",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let rubbing = Rubbing {
        coulomb_n: effect.value(0),
        static_ratio: effect.value(1),
        stribeck_m_per_s: effect.value(4),
        cell_share: effect.value(2),
        rest_share: effect.value(3),
        guide: effect.form(5),
        bristles: [6, 7].map(|place| effect.value(place)),
    };
    rubbing.enter(assembly);
}
