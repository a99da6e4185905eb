//! The table under the rig yields and swings: a second body below the springs.
//!
//! ```text
//!  piece──body springs──[mass on cell m_c][load cell]──[frame m_f]──k_f, c_f──ground
//! ```
//!
//! m_f·ẍ_f = S + F_f − k_f·x_f − c_f·ẋ_f, the stroke is x_p − x_f, k_f = 1/compliance, c_f = 2ζ·√(k_f·m_f). The cell stands
//! between springs and frame: it bears the springs' force and, since it swings with the frame, the inertia of what is
//! screwed on its measuring side: F = S − m_c·ẍ_f. By the latter the swing is seen after release as well. A cell under all of the frame,
//! m_c = m_f, bears k_f·x_f + c_f·ẋ_f. A gauge of the robot's position that is part of the rig shows x − x_f.
//!
//! Source: two bodies; stands and tables of 10 to 30 kg on 1 to 20 N/µm swing at 40 to 300 Hz; a bench rig's own plate has 2 kg.

use super::{Effect, Group, Mechanism, Needed, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Frame};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "frame-compliance",
    group: Group::Bodies,
    site: Site::Base,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &["compliance_m_per_N"],
    equation: "m_f·d²x_f/dt² = S + F_f − x_f/C − c_f·dx_f/dt, c_f = 2ζ·sqrt(m_f/C); the cell bears S − m_c·d²x_f/dt²",
    source: "two bodies; 1 to 20 N/µm, 10 to 30 kg, 40 to 300 Hz",
    parameters: &[
        Parameter {
            name: "compliance_m_per_N",
            unit: "m/N",
            meaning: "how far the frame yields per force, C = 1/k_f",
            null: Some(0.0),
            range: (1e-9, 1e-5),
            plausible: (3e-8, 2e-6),
            typical: 2e-7,
            scale: Scale::Logarithmic,
            search: Search::Resonance,
        },
        Parameter {
            name: "mass_kg",
            unit: "kg",
            meaning: "mass m_f that swings",
            null: None,
            range: (0.5, 1000.0),
            plausible: (2.0, 40.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[8.0, 20.0, 45.0]),
        },
        Parameter {
            name: "damping_ratio",
            unit: "1",
            meaning: "damping ζ of the frame's own mode",
            null: None,
            range: (0.0, 0.7),
            plausible: (0.003, 0.15),
            typical: 0.03,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "mass_on_cell_kg",
            unit: "kg",
            meaning: "mass m_c between springs and cell, part of m_f",
            null: None,
            range: (0.0, 1000.0),
            plausible: (0.02, 50.0),
            typical: 0.02,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[0.02, 10.0]),
        },
        Parameter {
            meaning: "what a gauge of the robot's position stands on: 0 the ground, 1 the frame",
            search: Search::FormWith(Needed::Position, &[0.0, 1.0], 1),
            ..Parameter::GAUGE
        },
    ],
    signature: "a slight ring at one frequency from the first instant on, which goes on after release; the stiffness seems a little lower",
    confused_with: &["moving-piece-inertia", "joint-elasticity", "mains-hum"],
    separated_by: "a tap on the frame excites it; a mass added to the piece leaves its frequency, other springs hardly move it",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let (stiffness_n_per_m, mass_kg) = (1.0 / effect.value(0), effect.value(1));
    assembly.frame = Some(Frame {
        mass_kg,
        stiffness_n_per_m,
        damping_ns_per_m: 2.0 * effect.value(2) * (stiffness_n_per_m * mass_kg).sqrt(),
        on_cell_kg: effect.value(3),
        bears_gauge: effect.form(4) == 1,
    });
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Quantity, Rig};

    /// Two masses on two springs: the robot's motion is the sum of the two modes of the pair.
    #[test]
    fn robot_and_frame_swing_in_their_two_modes() {
        let (k, mass, speed, frame_kg, frame_k) = (75e3_f64, 6.0, 0.3, 15.0, 2e6);
        let effect = "frame-compliance:compliance_m_per_N=5e-7,mass_kg=15,damping_ratio=0,mass_on_cell_kg=0";
        let impact = strike(Rig::impact(k), speed, mass, &[effect]);
        // λ = ω²: (k − λm)(k + k_f − λm_f) = k²; shape x_f/x = 1 − λm/k.
        let (b, c) = (k / mass + (k + frame_k) / frame_kg, k * frame_k / (mass * frame_kg));
        let root = (b * b - 4.0 * c).sqrt();
        let modes = [(b - root) / 2.0, (b + root) / 2.0].map(|square| (square.sqrt(), 1.0 - square * mass / k));
        // x = Σ a·sin(ωt): Σ a·ω = v and Σ a·ω·shape = 0.
        let share = -modes[1].1 / (modes[0].1 - modes[1].1);
        let amplitudes = [speed * share / modes[0].0, speed * (1.0 - share) / modes[1].0];
        let end = impact.contact_intervals()[0].1.unwrap();
        for part in 0..50 {
            let time = end * f64::from(part) / 50.0;
            let stroke: f64 =
                modes.iter().zip(amplitudes).map(|((w, shape), a)| a * (w * time).sin() * (1.0 - shape)).sum();
            near("force", impact.force_n(time), k * stroke, 2e-4);
        }
    }

    /// Without a pad the robot's way from the frame is the springs' stroke, as long as they touch.
    #[test]
    fn a_gauge_on_the_frame_shows_the_way_from_there() {
        let frame = |gauge: u32| {
            let effect =
                format!("frame-compliance:compliance_m_per_N=5e-7,mass_kg=15,damping_ratio=0.02,gauge={gauge}");
            strike(Rig::impact(75e3), 0.3, 6.0, &[&effect])
        };
        let (ground, rig) = (frame(0), frame(1));
        let end = rig.contact_intervals()[0].1.unwrap();
        let mut farthest = 0.0_f64;
        for part in 1..40 {
            let time = end * f64::from(part) / 40.0;
            let (on_ground, on_rig) = (ground.value(Quantity::Position, time), rig.value(Quantity::Position, time));
            near("stroke", on_rig, rig.value(Quantity::Stroke, time), 1e-12);
            near("force", rig.force_n(time), ground.force_n(time), 1e-9);
            farthest = farthest.max(on_ground - on_rig);
        }
        // What comes quickly presses it in by up to twice what the same force does at rest.
        let at_rest = 5e-7 * rig.truth().peak_n;
        assert!((at_rest..2.0 * at_rest).contains(&farthest), "{farthest}, at rest {at_rest}");
        near("before", rig.value(Quantity::Position, -0.1), ground.value(Quantity::Position, -0.1), 1e-12);
        let after = end + 0.01;
        assert!((ground.value(Quantity::Position, after) - rig.value(Quantity::Position, after)).abs() > 1e-8);
    }

    /// A pad's loss makes the equations those of the solver: the frame's place, which a stiff frame multiplies by 10⁸ N/m on a cell that bears its
    /// mass, is followed as exactly as the force. Against Runge and Kutta's classical method in steps of 10 µs.
    #[test]
    fn a_stiff_frame_on_the_cell_is_followed_as_exactly_as_the_force() {
        let (k, mass, frame_kg, frame_k, ratio, alpha) = (10e3_f64, 6.0, 23.0, 1e8_f64, 0.08, 0.01);
        let effects = [
            "frame-compliance:compliance_m_per_N=1e-8,mass_kg=23,damping_ratio=0.08,mass_on_cell_kg=23",
            "hunt-crossley-damping:alpha_s_per_m=0.01",
        ];
        let impact = strike(Rig::impact(k), 0.6, mass, &effects);
        let damping = 2.0 * ratio * (frame_k * frame_kg).sqrt();
        let contact = |[x, v, y, w]: [f64; 4]| k * (x - y) * (1.0 + 1.5 * alpha * (v - w));
        let rates = |state: [f64; 4]| {
            let [_, v, y, w] = state;
            [v, -contact(state) / mass, w, (contact(state) - frame_k * y - damping * w) / frame_kg]
        };
        let step_s = 1e-5;
        let along =
            |state: [f64; 4], by: [f64; 4], part: f64| std::array::from_fn(|i| state[i] + part * step_s * by[i]);
        let mut state: [f64; 4] = [0.0, 0.6, 0.0, 0.0];
        for step in 1..7000_u32 {
            let first = rates(state);
            let second = rates(along(state, first, 0.5));
            let third = rates(along(state, second, 0.5));
            let fourth = rates(along(state, third, 1.0));
            let mean = std::array::from_fn(|i| (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]) / 6.0);
            state = along(state, mean, 1.0);
            near("cell", impact.force_n(f64::from(step) * step_s), frame_k * state[2] + damping * state[3], 2e-3);
        }
    }

    /// What the cell carries shows the free swing at the frame's frequency, damped by its ratio; without it the cell is
    /// silent after release.
    #[test]
    fn the_swing_goes_on_after_release_on_what_the_cell_carries() {
        let with = |kg: f64| {
            let effect =
                format!("frame-compliance:compliance_m_per_N=2e-7,mass_kg=20,damping_ratio=0.01,mass_on_cell_kg={kg}");
            strike(Rig::impact(75e3).with_pad(900e3), 0.3, 6.0, &[&effect])
        };
        let (silent, swinging) = (with(0.0), with(0.5));
        let end = silent.contact_intervals()[0].1.unwrap();
        assert_eq!(silent.force_n(end + 0.01), 0.0);
        let pulsation = (5e6_f64 / 20.0).sqrt() * (1.0_f64 - 1e-4).sqrt();
        let period = std::f64::consts::TAU / pulsation;
        let decay = (-std::f64::consts::TAU * 0.01 / (1.0_f64 - 1e-4).sqrt()).exp();
        let mut highest = 0.0_f64;
        for part in 0..20 {
            let time = end + 0.01 + f64::from(part) * 1e-3;
            near("next period", swinging.force_n(time + period), decay * swinging.force_n(time), 1e-4);
            highest = highest.max(swinging.force_n(time).abs());
        }
        assert!(highest > 0.05, "{highest}");
    }

    /// A stiff frame is none; a heavy piece, friction and damping do not change that.
    #[test]
    fn a_stiff_frame_is_no_frame() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let stiff = "frame-compliance:compliance_m_per_N=1e-9,mass_kg=20,damping_ratio=0.3,mass_on_cell_kg=0";
        let others =
            ["moving-piece-inertia", "guide-friction", "hunt-crossley-damping", "pad-relaxation", "joint-elasticity"];
        for other in others {
            let (without, with) = (strike(rig, 0.25, 6.0, &[other]), strike(rig, 0.25, 6.0, &[other, stiff]));
            for part in 1..60 {
                let time = f64::from(part) * 1e-3;
                near(other, with.force_n(time), without.force_n(time), 0.02);
            }
        }
        // On a bare spring friction holds the robot on the frame, and there they swing as one.
        let held = ["guide-friction:force_N=40", "robot-push:force_N=30,servo_stiffness_N_per_m=30000"];
        let soft = "frame-compliance:compliance_m_per_N=1e-6,mass_kg=20,damping_ratio=0.1,mass_on_cell_kg=0";
        let impact = strike(Rig::impact(25e3), 0.05, 6.0, &[held[0], held[1], soft]);
        near("pressed by", impact.value(Quantity::ContactForce, 0.299), 30.0, 0.5);
    }
}
