//! Damping that grows with depth: the pad loses energy in the loop between loading and unloading.
//!
//! F = F_el(δ)·(1 + (3/2)·α·δ̇) with F_el the elastic force. The force has no step at contact, unlike a
//! dashpot's. For one mass on one such spring the restitution is e ≈ 1/(1 + α·v₀); the often printed
//! e = 1 − α·v₀ is only its first order. Where a coefficient of restitution is stated instead, the same for every speed, the damping is
//! in proportion to 1/v₀ (law 1): then α is that at 0.25 m/s. Where pad and springs are one rubber, which one stiffness stands for, the loss is that
//! of both together (`whole`), in proportion to the speed of the robot.
//!
//! Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440; paper 1, eq. 9–12. Law 1: H. M. Lankarani, P. E. Nikravesh,
//! J. Mech. Des. 112 (1990) 369, F = F_el·(1 + ¾·(1 − e²)·δ̇/v₀).

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Approach, Assembly, Deformation, ForceLaw, Response, Which};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "hunt-crossley-damping",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "F = F_el(δ)·(1 + 1.5·α·dδ/dt); e ≈ 1/(1 + α·v0); law 1: α·0.25 m/s/v0 for α",
    source: "Hunt and Crossley, J. Appl. Mech. 42 (1975) 440; range from αv0 = 0 to 0.3 at 0.05 to 0.6 m/s; law 1: Lankarani and Nikravesh, J. Mech. Des. 112 (1990) 369",
    parameters: &[
        Parameter {
            name: "alpha_s_per_m",
            unit: "s/m",
            meaning: "loss per speed of approach",
            null: Some(0.0),
            range: (0.0, 5.0),
            plausible: (0.02, 1.0),
            typical: 0.2,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "law",
            meaning: "0: the loss grows with the speed of approach, 1: the same part of every impact, α at 0.25 m/s; others are rounded",
            ..Parameter::EITHER
        },
        Parameter::WHOLE,
    ],
    signature: "a pulse skewed to its front; the loop of force over stroke is a fraction of the energy that grows with speed",
    confused_with: &["pad-relaxation", "joint-elasticity", "guide-friction", "viscous-damping"],
    separated_by: "a sweep of speed: loop area over energy is proportional to the speed, for friction it falls with it",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let is_same_part = effect.form(1) == 1;
    let times = if is_same_part { Approach::REDUCED_SPEED_M_PER_S / assembly.approach.hits_m_per_s() } else { 1.0 };
    let which = Which::of(effect.form(2));
    assembly.obey(&HuntCrossley { alpha_s_per_m: effect.value(0) * times, which }, which);
}

#[derive(Clone, Debug)]
struct HuntCrossley {
    alpha_s_per_m: f64,
    which: Which,
}

impl ForceLaw for HuntCrossley {
    fn respond(&self, deformation: Deformation, elastic: Response, _states: &[f64]) -> Response {
        // A pad that sticks to the robot is pulled out with the same loss.
        let sign = if deformation.sticks { elastic.force_n.signum() } else { 1.0 };
        let loss = 1.5 * self.alpha_s_per_m * sign * deformation.scale(self.which);
        Response {
            force_n: loss * elastic.force_n * deformation.rate_m_per_s,
            stiffness_n_per_m: loss * elastic.stiffness_n_per_m * deformation.rate_m_per_s,
            damping_ns_per_m: loss * elastic.force_n,
            drift_n_per_s: loss * elastic.drift_n_per_s * deformation.rate_m_per_s,
        }
    }

    fn depends_on_rate(&self) -> bool {
        true
    }
}
