//! The moving piece has a mass: it rings between pad and springs when it is struck, and lags behind.
//!
//! m_p·ẍ_p = P(x − x_p) − S(x_p) − friction, the ring near √((k_pad + k_body)/m_p), after release near
//! √(k_body/m_p). A ring without loss of its own is never seen, so pad and springs bring material damping,
//! each stated as the damping ratio that it alone would give the ring (c = 2ζ√((k_pad + k_body)·m_p)).
//!
//! After release it returns to the place where it lies, and may swing through it or find a stop there, a felt or the housing: a spring of
//! κ·k_body with a damping ratio of its own, which the cell does not bear.
//!
//! The cell stands behind the springs, or in front of the piece, on the robot or under the pad: then it bears P, which begins with the pad's stiffness alone, and
//! nothing once the robot has left (`in_front`).
//!
//! The mass is a parameter here and not a field of [`Rig`](crate::rig::Rig): the rig is the baseline, which ignores
//! it, and a mass alone is no model, since how it rings depends on the damping and, without a pad, on the stiffness of the bare
//! contact. A campaign's `moving_mass_kg` is what the experimenter believes this parameter to be; a simulated campaign
//! has the piece move by naming this mechanism, with that mass as its value.
//!
//! Source: two-body model; paper 1, eq. 20–22, neglects the ring and so needs 40–190 g to explain its drop tests.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Element, Piece};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "moving-piece-inertia",
    group: Group::Bodies,
    site: Site::Piece,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("stop_ratio", "in_front", &[0.0]), ("stop_damping_ratio", "in_front", &[0.0])],
    sized: &[],
    equation: "m_p·d²x_p/dt² = P(x − x_p) − S(x_p); f ≈ √((k_pad + k_body)/m_p)/2π, c = 2ζ√((k_pad + k_body)·m_p)",
    source: "two bodies; a piece of 0.04 to 0.3 kg rings at 170 to 600 Hz",
    parameters: &[
        Parameter {
            name: "mass_kg",
            unit: "kg",
            meaning: "mass of the moving piece",
            null: Some(0.0),
            range: (1e-4, 2.5),
            plausible: (0.02, 0.4),
            typical: 0.12,
            scale: Scale::Logarithmic,
            search: Search::Resonance,
        },
        Parameter {
            name: "pad_damping_ratio",
            unit: "1",
            meaning: "damping of the ring by the pad alone",
            null: None,
            range: (0.0, 0.6),
            plausible: (0.005, 0.35),
            typical: 0.03,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "spring_damping_ratio",
            unit: "1",
            meaning: "damping of the ring by the springs alone",
            null: None,
            range: (0.0, 0.6),
            plausible: (0.001, 0.2),
            typical: 0.01,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "contact_stiffness_N_per_m",
            unit: "N/m",
            meaning: "stiffness of the bare contact; counts only where the rig has no pad",
            null: None,
            range: (1e5, 1e8),
            plausible: (5e5, 2e7),
            typical: 2e6,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[7e5, 5e6]),
        },
        Parameter {
            name: "stop_ratio",
            unit: "1",
            meaning: "stiffness of the stop that the piece returns to, over the springs'; 0: it swings through its place of rest",
            null: None,
            range: (0.0, 300.0),
            plausible: (0.003, 30.0),
            typical: 0.003,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[0.003, 10.0]),
        },
        Parameter {
            name: "stop_damping_ratio",
            unit: "1",
            meaning: "damping ratio of the piece on that stop: felt and rubber give back next to nothing (0.7, 5 % overshoot), a housing much",
            null: None,
            range: (0.02, 2.0),
            plausible: (0.15, 1.0),
            typical: 0.7,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "in_front",
            meaning: "where the cell is: 0 behind the springs, 1 in front of the piece, where it bears the contact",
            ..Parameter::EITHER
        },
    ],
    signature: "a ring from the first instant, damped within some cycles, and again, lower, after release; the cell lags",
    confused_with: &["frame-compliance", "viscous-damping", "mains-hum"],
    separated_by: "a mass added to the piece moves the frequency; a tap on the frame does not excite it",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let mass_kg = effect.value(0);
    let pad = assembly.pad.get_or_insert_with(|| Element::linear(effect.value(3)));
    let critical = 2.0 * ((pad.stiffness_n_per_m + assembly.spring.stiffness_n_per_m) * mass_kg).sqrt();
    pad.damping_ns_per_m += effect.value(1) * critical;
    assembly.spring.damping_ns_per_m += effect.value(2) * critical;
    let cell_in_front = effect.form(6) == 1;
    // A cell in front feels nothing of how the piece comes back.
    let stop_n_per_m = if cell_in_front { 0.0 } else { effect.value(4) * assembly.spring.stiffness_n_per_m };
    let stop_ns_per_m = 2.0 * effect.value(5) * (stop_n_per_m * mass_kg).sqrt();
    assembly.piece = Some(Piece { mass_kg, stop_n_per_m, stop_ns_per_m, cell_in_front });
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// In front of the piece the cell bears all that slows the robot, and first the pad alone; behind the springs at first nothing.
    #[test]
    fn a_cell_in_front_bears_the_contact() {
        let (springs, pad, speed, mass) = (25e3, 80e3, 0.4, 6.0);
        let piece = "moving-piece-inertia:mass_kg=0.2,pad_damping_ratio=0,spring_damping_ratio=0.05";
        let rig = Rig::impact(springs).with_pad(pad);
        let behind = strike(rig, speed, mass, &[piece]);
        let front = strike(rig, speed, mass, &[&format!("{piece},in_front=1")]);
        let early_s = 1e-4;
        near("pad alone", front.force_n(early_s), pad * speed * early_s, 0.01 * pad * speed * early_s);
        assert!(behind.force_n(early_s) < 0.1 * front.force_n(early_s));
        let truth = front.truth();
        let impulse: f64 = truth.contacts.iter().map(|contact| contact.impulse_ns).sum();
        let after = truth.contacts.last().unwrap().speed_after_m_per_s;
        near("impulse", impulse, mass * (speed - after), 1e-4 * impulse);
        near("left", front.force_n(truth.contacts.last().unwrap().end_s.unwrap() + 0.01), 0.0, 1e-12);
    }
}
