//! A dashpot beside the pad's spring (Kelvin–Voigt).
//!
//! F = F_el(δ) + c·δ̇. The contact force begins with a step c·v₀. Behind a massless piece the cell sees it smoothed by
//! (k_pad + k_body)/c; without a pad the dashpot is beside the body springs and the cell sees the step itself. A loss that pad and springs
//! share stands beside both together (`across`), and the cell sees the step behind a pad, too. (With a piece that has a mass of its own
//! it stands beside the pad: a piece that springs back as the robot leaves would touch it again and again.)
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
    parameters: &[
        Parameter {
            name: "damping_Ns_per_m",
            unit: "N·s/m",
            meaning: "the dashpot",
            null: Some(0.0),
            range: (0.0, 2000.0),
            plausible: (1.0, 100.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "across",
            meaning: "0: beside the pad, 1: beside pad and springs together; others are rounded",
            ..Parameter::EITHER
        },
    ],
    signature: "a step of the force at contact, proportional to the speed; the pulse ends while the pad is still pressed",
    confused_with: &["hunt-crossley-damping", "moving-piece-inertia", "guide-friction"],
    separated_by: "the step is proportional to the speed and does not ring",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let is_across = effect.value(1).round() == 1.0 && assembly.pad.is_some() && assembly.piece.is_none();
    let damping_ns_per_m =
        if is_across { &mut assembly.across_ns_per_m } else { &mut assembly.touched_mut().damping_ns_per_m };
    *damping_ns_per_m += effect.value(0);
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Quantity, Rig};

    /// m·ẍ + c·ẋ + k·x = 0 until k·x + c·ẋ is zero: x = (v/ω_d)·e^(−γt)·sin ω_d·t.
    #[test]
    fn across_pad_and_springs_it_damps_one_oscillator() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let (k, mass, speed, damping) = (rig.effective_stiffness_n_per_m(), 6.0_f64, 0.3, 20.0);
        let fading = damping / 2.0 / mass;
        let pulsation = (k / mass - fading * fading).sqrt();
        let at = |time_s: f64| {
            let swing = speed / pulsation * (-fading * time_s).exp();
            let x = swing * (pulsation * time_s).sin();
            (x, swing * pulsation * (pulsation * time_s).cos() - fading * x)
        };
        for others in [&[][..], &["guide-friction:force_N=1e-5"], &["hunt-crossley-damping:alpha_s_per_m=1e-6"]] {
            let dashpot = "viscous-damping:damping_Ns_per_m=20,across=1";
            let with: Vec<&str> = others.iter().copied().chain([dashpot]).collect();
            let impact = strike(rig, speed, mass, &with);
            near("step", impact.force_n(0.0), damping * speed, 1e-3);
            for time_s in [0.002, 0.01, 0.02, 0.03] {
                let (x, v) = at(time_s);
                near("force", impact.force_n(time_s), k * x + damping * v, 2e-3);
                near("speed", impact.value(Quantity::Velocity, time_s), v, 1e-6);
            }
            let contacts = impact.truth().contacts;
            assert_eq!(contacts.len(), 1, "{others:?}");
            let (x, v) = at(contacts[0].end_s.unwrap());
            near("end", k * x + damping * v, 0.0, 2e-3);
            assert!(v < 0.0);
            near("after", impact.force_n(contacts[0].end_s.unwrap() + 0.01), 0.0, 1e-3);
        }
    }
}
