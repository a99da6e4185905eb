//! In one configuration the robot is not as heavy as its model says.
//!
//! m = m_said·(1 + ε) for impacts of the configuration with this number, m_said for all others. What all configurations
//! have in common is re-tuning (with free stiffnesses it cannot be told from them); what one of them has for itself is
//! not. A second wrong configuration is a second effect of the same kind.
//!
//! Source: effective masses of one arm in one pose from three public models differ by 40 %, and with the way the
//! orientation is held by another 35 %.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "pose-dependent-mass",
    group: Group::Robot,
    site: Site::InitialCondition,
    lasting: false,
    exact: true,
    by_configuration: &["relative"],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "m = m_said·(1 + ε) in the configuration with this number, m_said in the others; in every one, each with its ε, where that is −1",
    source: "spread of public models of one arm; held or free orientation",
    parameters: &[
        Parameter {
            name: "relative",
            unit: "1",
            meaning: "error of the effective mass in that configuration",
            null: Some(0.0),
            range: (-0.8, 4.0),
            plausible: (-0.4, 0.6),
            typical: 0.15,
            scale: Scale::Linear,
            search: Search::Strength,
        },
        Parameter {
            name: "configuration",
            unit: "1",
            meaning: "its number in the campaign, from 0; −1: every one; a whole number, others are rounded",
            null: None,
            range: (-1.0, 1e6),
            plausible: (0.0, 3.0),
            typical: 0.0,
            scale: Scale::Linear,
            search: Search::Whole(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]),
        },
    ],
    signature: "in the recordings of one pose peak and duration are off by the same ratio, √(1 + ε), the impulse by its square",
    confused_with: &["speed-error", "gain-error", "mullins-softening"],
    separated_by: "the duration changes with the mass, not with speed or gain; the same pose with a mass added",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let number = effect.value(1).round();
    if number < 0.0 || f64::from(assembly.approach.configuration) == number {
        assembly.approach.effective_mass_kg *= 1.0 + effect.value(0);
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike, strike_as};
    use crate::rig::{Approach, Rig};

    /// Peak and duration by √(1 + ε) and impulse by 1 + ε in that configuration, nothing in any other.
    #[test]
    fn one_configuration_is_heavier() {
        let rig = Rig::impact(25e3);
        let hit = |configuration: u32, effects: &[&str]| {
            strike_as(rig, Approach { configuration, ..Approach::new(0.25, 6.0) }, effects).truth().contacts[0]
        };
        let effect = ["pose-dependent-mass:relative=0.21,configuration=2"];
        let (ideal, heavier) = (hit(2, &[]), hit(2, &effect));
        near("peak", heavier.peak_n, 1.1 * ideal.peak_n, 1e-5);
        near("duration", heavier.end_s.unwrap(), 1.1 * ideal.end_s.unwrap(), 1e-8);
        near("impulse", heavier.impulse_ns, 1.21 * ideal.impulse_ns, 1e-6);
        assert_eq!(hit(1, &effect), hit(1, &[]));
        let every = ["pose-dependent-mass:relative=0.21,configuration=-1"];
        assert_eq!((hit(1, &every), hit(2, &every)), (heavier, heavier));
        // A joint that is named first splits the mass that there really is.
        let both = ["joint-elasticity", effect[0]];
        let joint_first = strike_as(rig, Approach { configuration: 2, ..Approach::new(0.25, 6.0) }, &both);
        let mass_first = strike(rig, 0.25, 6.0 * 1.21, &["joint-elasticity"]);
        near("with a joint", joint_first.truth().peak_n, mass_first.truth().peak_n, 1e-9);
    }
}
