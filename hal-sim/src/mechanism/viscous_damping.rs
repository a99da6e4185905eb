//! A dashpot beside the pad's spring (Kelvin–Voigt).
//!
//! F = F_el(δ) + c·δ̇. The contact force begins with a step c·v₀. Behind a massless piece the cell sees it smoothed by
//! (k_pad + k_body)/c; without a pad the dashpot is beside the body springs and the cell sees the step itself. A loss that pad and springs
//! share stands beside both together (`across` 1), and the cell sees the step behind a pad, too. (With a piece that has a mass of its own
//! it stands beside the pad: a piece that springs back as the robot leaves would touch it again and again.) Oil in the guide stands
//! beside the body springs alone (`across` 2): behind a pad the force begins as the pad's, k_pad·v₀·t, and bends to that of both in series
//! after c/(k_pad + k_body).
//!
//! Source: Kelvin–Voigt element.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::Assembly;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "viscous-damping",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "F = F_el(δ) + c·dδ/dt",
    source: "Kelvin–Voigt; 5 to 100 N·s/m",
    parameters: &[
        Parameter {
            name: "damping_Ns_per_m",
            unit: "N·s/m",
            meaning: "the dashpot",
            null: Some(0.0),
            range: (0.0, 1e5),
            plausible: (1.0, 100.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "across",
            meaning: "0: beside the pad, 1: beside pad and springs together, 2: beside the body springs; others are rounded",
            ..Parameter::ONE_OF_THREE
        },
    ],
    signature: "a step of the force at contact, proportional to the speed; the pulse ends while the pad is still pressed",
    confused_with: &["hunt-crossley-damping", "moving-piece-inertia", "guide-friction"],
    separated_by: "the step is proportional to the speed and does not ring",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let is_behind_pad = assembly.pad.is_some();
    let damping_ns_per_m = match effect.form(1) {
        1 if is_behind_pad && assembly.piece.is_none() => &mut assembly.across.damping_ns_per_m,
        2 => &mut assembly.spring.damping_ns_per_m,
        _ => &mut assembly.touched_mut().damping_ns_per_m,
    };
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

    /// c·u̇ = k_p·(x − u) − k_b·u, m·ẍ = −k_p·(x − u), by Heun's method in steps of 1 µs.
    #[test]
    fn beside_the_body_springs_it_holds_the_massless_piece() {
        let (springs, pad, mass, speed, damping) = (25e3, 80e3, 6.0, 0.3, 40.0);
        let impact =
            strike(Rig::impact(springs).with_pad(pad), speed, mass, &["viscous-damping:damping_Ns_per_m=40,across=2"]);
        let rates = |[x, v, u]: [f64; 3]| [v, -pad * (x - u) / mass, (pad * (x - u) - springs * u) / damping];
        let step_s = 1e-6;
        let (mut state, mut time_s) = ([0.0, speed, 0.0], 0.0);
        while time_s < 1e-4 || state[0] > state[2] {
            let first = rates(state);
            let there: [f64; 3] = std::array::from_fn(|place| state[place] + step_s * first[place]);
            let second = rates(there);
            state = std::array::from_fn(|place| state[place] + 0.5 * step_s * (first[place] + second[place]));
            time_s += step_s;
            if ((time_s / step_s).round() as u32).is_multiple_of(5000) {
                near("force", impact.force_n(time_s), pad * (state[0] - state[2]), 2e-3);
                near("speed", impact.value(Quantity::Velocity, time_s), state[1], 3e-6);
            }
        }
        let contacts = impact.truth().contacts;
        assert_eq!(contacts.len(), 1);
        near("end", contacts[0].end_s.unwrap(), time_s, 2e-6);
        near("after", impact.force_n(time_s + 0.005), 0.0, 1e-3);
    }

    /// The robot leaves where k·x + c·ẋ is zero; the springs come back as x·e^(−k·t/c).
    #[test]
    fn springs_that_a_dashpot_slows_come_back_after_the_robot_has_left() {
        let (springs, damping) = (25e3, 20.0);
        let impact = strike(Rig::impact(springs), 0.3, 6.0, &["viscous-damping:damping_Ns_per_m=20"]);
        let separates_s = impact.truth().contacts[0].end_s.unwrap();
        let left_m = impact.value(Quantity::Position, separates_s);
        assert!(left_m > 1e-4);
        for after_s in [1e-6, 0.0005, 0.001, 0.003] {
            let stroke_m = impact.value(Quantity::Stroke, separates_s + after_s);
            near("stroke", stroke_m, left_m * (-springs / damping * after_s).exp(), 2e-8);
            near("force", impact.force_n(separates_s + after_s), 0.0, 1e-3);
        }
    }
}
