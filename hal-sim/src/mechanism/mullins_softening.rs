//! The pad softens over its first hits: each breaks some of the bonds between rubber and filler.
//!
//! k(n) = k_∞·(1 + s·e^(−n/N₀)), n the number of hits that the pad has had since it rested, which is the impact's place
//! in the campaign. k_∞ is the rig's own stiffness: what a conditioned pad has. On a rig without a pad it is the springs
//! that settle. Where pad and springs are one rubber, which one stiffness stands for, all of it softens (`whole`).
//!
//! Source: L. Mullins, Rubber Chem. Technol. 42 (1969) 339; most of the softening happens in the first few cycles.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Which};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "mullins-softening",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "k(n) = k_∞·(1 + excess·exp(−n/N_0)), n the place of the impact in the campaign, from 0",
    source: "Mullins, Rubber Chem. Technol. 42 (1969) 339; 5 to 25 %, N_0 2 to 5",
    parameters: &[
        Parameter {
            name: "excess",
            unit: "1",
            meaning: "how much stiffer a rested pad is at its first hit",
            null: Some(0.0),
            range: (0.0, 3.0),
            plausible: (0.01, 0.4),
            typical: 0.15,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "hits",
            unit: "1",
            meaning: "hits after which 63 % of it are gone",
            null: None,
            range: (0.1, 1000.0),
            plausible: (1.0, 10.0),
            typical: 3.0,
            scale: Scale::Logarithmic,
            search: Search::Plausible,
        },
        Parameter::WHOLE,
    ],
    signature: "the first three to five recordings are stiffer, each less than the one before, whatever their speed",
    confused_with: &["rate-stiffening", "pose-dependent-mass", "gain-error"],
    separated_by: "the same impact again after ten others; a day of rest brings it back",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let factor = 1.0 + effect.value(0) * (-f64::from(assembly.approach.order) / effect.value(1)).exp();
    assembly.stiffen(factor, Which::of(effect.form(2)));
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike, strike_as};
    use crate::rig::{Approach, Rig};

    /// Each hit is an ideal one on a pad that is a little softer than the one before; a rested pad is 20 % stiffer.
    #[test]
    fn the_pad_of_the_nth_hit_has_the_stiffness_of_the_law() {
        let rig = Rig::impact(75e3).with_pad(80e3);
        for order in [0, 1, 2, 5, 40] {
            let approach = Approach { order, ..Approach::new(0.25, 6.0) };
            let peak = strike_as(rig, approach, &["mullins-softening:excess=0.2,hits=3"]).truth().peak_n;
            let pad = 80e3 * (1.0 + 0.2 * (-f64::from(order) / 3.0).exp());
            let ideal = 0.25 * (6.0 * rig.with_pad(pad).effective_stiffness_n_per_m()).sqrt();
            near("peak", peak, ideal, 1e-6 * ideal);
            // Or the springs behind it do.
            let peak = strike_as(rig, approach, &["mullins-softening:excess=0.2,hits=3,whole=2"]).truth().peak_n;
            let softens = Rig { body_stiffness_n_per_m: 75e3 / 80e3 * pad, ..rig };
            let ideal = 0.25 * (6.0 * softens.effective_stiffness_n_per_m()).sqrt();
            near("peak", peak, ideal, 1e-6 * ideal);
        }
    }

    /// What a law takes from the pad's stiffness it takes from that of this hit, whichever effect is named first.
    #[test]
    fn the_order_of_naming_does_not_matter() {
        let mut effects = ["hardening", "pad-relaxation", "moving-piece-inertia", "mullins-softening"];
        for rig in [Rig::impact(25e3).with_pad(80e3), Rig::impact(25e3)] {
            let one_way = strike(rig, 0.3, 6.0, &effects).truth();
            effects.reverse();
            near("peak", strike(rig, 0.3, 6.0, &effects).truth().peak_n, one_way.peak_n, 1e-5);
        }
    }
}
