//! The robot's links still sway when it arrives: its speed is not the commanded one, and it goes on changing.
//!
//! ẋ_free = v + A·e^(−ζωt)·cos(√(1−ζ²)·ωt + φ), ω = 2πf, ζ = 0 where it hardly dies away within a contact, so that
//! the contact begins at v + A·cos φ, and during it every body of the robot is accelerated by −ω·A·sin(ωt + φ) (with ζ = 0), as by gravity:
//! the heavy links hardly feel the rig. A lighter one, of a part μ of the effective mass behind a joint of that mode, is at −A/(ω·μ)·sin φ ahead of the tip when that meets the rig,
//! −A/μ·cos φ faster, and answers the contact as an elastic joint does. The n-th impact of a campaign
//! has φ = φ₀ + n·Δφ, which may be anything where the approach differs; where the same program always meets the rig at the same moment of
//! its sway, every impact has φ₀. A is the same in every impact, or another in each
//! configuration, as one pose sways more than another, or in proportion to the speed of approach, as what starting to that speed leaves behind.
//!
//! Source: paper 2, link modes of 1 to 13 Hz; two bodies on a spring and a dashpot, whose momentum is kept.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Effect, Group, Mechanism, Needed, Parameter, Scale, Search, Site};
use crate::rig::{Approach, Assembly, Sway};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "link-oscillation",
    group: Group::Robot,
    site: Site::Robot,
    lasting: false,
    exact: false,
    by_configuration: &["amplitude_m_per_s"],
    by_recording: &[],
    used_in: &[
        ("link_fraction", "answers", &[1.0]),
        ("with_speed", "repeats", &[0.0]),
        ("phase_rad", "repeats", &[0.0]),
        ("phase_step_rad", "repeats", &[0.0]),
        ("common_phase_rad", "repeats", &[1.0]),
        ("damping_ratio", "decays", &[1.0]),
    ],
    sized: &[],
    equation: "dx_free/dt = v + A·exp(−ζωt)·cos(sqrt(1 − ζ²)·ωt + φ), ω = 2πf, ζ = 0 unless it dies away, A or A·v/(0.25 m/s), φ = φ_0 + n·Δφ, n the place of the impact in the campaign, or one φ for all; a link that answers: tip m_R(1−μ) and link m_R·μ on k_j = ω²·m_R·μ(1−μ)",
    source: "paper 2: link modes of 1 to 13 Hz",
    parameters: &[
        Parameter {
            name: "amplitude_m_per_s",
            unit: "m/s",
            meaning: "amplitude of the sway's velocity",
            null: Some(0.0),
            range: (0.0, 1.0),
            plausible: (0.001, 0.06),
            typical: 0.015,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "frequency_Hz",
            unit: "Hz",
            meaning: "frequency of the sway",
            null: None,
            range: (0.1, 50.0),
            plausible: (1.0, 13.0),
            typical: 5.0,
            scale: Scale::Logarithmic,
            search: Search::OfLines,
        },
        Parameter {
            name: "phase_rad",
            meaning: "phase φ_0 at the first impact's contact; 0 where the sway is fastest towards the rig",
            ..Parameter::ANGLE
        },
        Parameter {
            name: "phase_step_rad",
            meaning: "from one impact's phase to the next one's",
            typical: 2.4,
            search: Search::Held,
            ..Parameter::ANGLE
        },
        Parameter {
            name: "answers",
            meaning: "what sways: 0 links too heavy to feel the rig, 1 a mass behind a joint, which answers the contact",
            ..Parameter::EITHER
        },
        Parameter {
            name: "link_fraction",
            unit: "1",
            meaning: "part μ of the effective mass that answers",
            null: None,
            range: (1e-4, 0.95),
            plausible: (0.005, 0.5),
            typical: 0.05,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "with_speed",
            meaning: "amplitude: 0 the same in every impact, 1 in proportion to the speed of approach and as stated at 0.25 m/s",
            search: Search::FormWith(Needed::Speeds, &[0.0, 1.0], 1),
            ..Parameter::EITHER
        },
        Parameter {
            name: "repeats",
            meaning: "0: every impact comes at a phase of its own, 1: all at the same moment of the same sway",
            search: Search::LaterForm(&[1.0]),
            ..Parameter::EITHER
        },
        Parameter {
            name: "common_phase_rad",
            meaning: "phase at the contact of every impact; 0 where the sway is fastest towards the rig",
            search: Search::OneOf(&[-FRAC_PI_2, 0.0, FRAC_PI_2, PI]),
            ..Parameter::ANGLE
        },
        Parameter {
            name: "damping_ratio",
            unit: "1",
            meaning: "damping ζ with which it dies away",
            null: None,
            range: (0.0, 0.3),
            plausible: (0.003, 0.1),
            typical: 0.02,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "decays",
            meaning: "0: it goes on as it is, 1: it dies away",
            search: Search::LaterForm(&[1.0]),
            ..Parameter::EITHER
        },
    ],
    signature: "sway of displacement and speed before contact; peaks that scatter more than the speed is uncertain, slow pulses the most",
    confused_with: &["speed-error", "joint-elasticity", "robot-push"],
    separated_by: "motion in free air; the error is one of speed and not of its ratio, and repeats with the sway",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    // At another speed a program comes at another moment.
    let (with_speed, phase_rad) = match effect.form(7) {
        1 => (false, effect.value(8)),
        _ => (effect.form(6) == 1, effect.value(2) + f64::from(assembly.approach.order) * effect.value(3)),
    };
    let times = if with_speed { assembly.approach.speed_m_per_s / Approach::REDUCED_SPEED_M_PER_S } else { 1.0 };
    assembly.sway = Some(Sway {
        link_fraction: if effect.form(4) == 1 { effect.value(5) } else { 0.0 },
        amplitude_m_per_s: effect.value(0) * times,
        pulsation_per_s: TAU * effect.value(1),
        phase_rad,
        damping_ratio: if effect.form(10) == 1 { effect.value(9) } else { 0.0 },
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::tests::{near, strike, strike_as};
    use crate::rig::{Quantity, Rig};

    const EFFECT: &str = "link-oscillation:amplitude_m_per_s=0.02,frequency_Hz=7,phase_rad=0.5,phase_step_rad=1";

    /// Where nothing is met the velocity is that of the law, before and after time zero.
    #[test]
    fn free_motion_sways_as_written() {
        let order = 3;
        let sway = |time: f64| 0.02 * (TAU * 7.0 * time + 0.5 + f64::from(order)).cos();
        let rig = Rig { gravity_m_per_s2: 0.0, ..Rig::fall() };
        let fall = strike_as(rig, Approach { order, ..Approach::new(0.2, 6.0) }, &[EFFECT]);
        let hit = strike_as(Rig::impact(25e3), Approach { order, ..Approach::new(0.2, 6.0) }, &[EFFECT]);
        for part in 0..30 {
            let time = f64::from(part) * 0.01;
            near("after", fall.value(Quantity::Velocity, time), 0.2 + sway(time), 1e-7);
            near("before", hit.value(Quantity::Velocity, -time), 0.2 + sway(-time), 1e-12);
        }
        let (from, to) = (hit.value(Quantity::Position, -1e-6), hit.value(Quantity::Position, 1e-6));
        near("no step at contact", (to - from) / 2e-6, 0.2 + sway(0.0), 1e-4);
    }

    /// At the speed that it is stated for, and at twice that speed.
    #[test]
    fn a_sway_may_grow_with_the_speed() {
        let grows = format!("{EFFECT},with_speed=1");
        let rig = Rig { gravity_m_per_s2: 0.0, ..Rig::fall() };
        for (speed, amplitude) in [(0.25, 0.02), (0.5, 0.04)] {
            let fall = strike_as(rig, Approach { order: 3, ..Approach::new(speed, 6.0) }, &[&grows]);
            for part in 0..30 {
                let time = 0.01 * f64::from(part);
                let sways = speed + amplitude * (TAU * 7.0 * time + 0.5 + 3.0).cos();
                near("free", fall.value(Quantity::Velocity, time), sways, 1e-6);
            }
        }
    }

    /// Whatever number an impact has.
    #[test]
    fn the_same_program_may_always_come_at_the_same_moment() {
        let repeats = format!("{EFFECT},repeats=1,common_phase_rad=-0.8");
        let rig = Rig { gravity_m_per_s2: 0.0, ..Rig::fall() };
        for order in [0, 5] {
            let fall = strike_as(rig, Approach { order, ..Approach::new(0.2, 6.0) }, &[&repeats]);
            near("free", fall.value(Quantity::Velocity, 0.1), 0.2 + 0.02 * (TAU * 0.7 - 0.8).cos(), 1e-6);
        }
    }

    /// A light link is none that answers; a heavy one leaves the free motion of the tip as it was.
    #[test]
    fn a_link_that_answers_sways_as_written_until_it_meets_the_rig() {
        let answers = |fraction: &str| format!("{EFFECT},answers=1,link_fraction={fraction}");
        let light = strike(Rig::impact(25e3), 0.2, 6.0, &[&answers("1e-4")]);
        let none = strike(Rig::impact(25e3), 0.2, 6.0, &[EFFECT]);
        for part in 0..20 {
            let time = 2e-3 * f64::from(part);
            near("force", light.force_n(time), none.force_n(time), 0.02);
        }
        let rig = Rig { gravity_m_per_s2: 0.0, ..Rig::fall() };
        let fall = strike(rig, 0.2, 6.0, &[&answers("0.3")]);
        for part in 0..30 {
            let time = f64::from(part) * 0.01;
            let sways = 0.2 + 0.02 * (TAU * 7.0 * time + 0.5).cos();
            near("free", fall.value(Quantity::Velocity, time), sways, 1e-6);
        }
    }

    /// By e^(−ζωt), the sway of links too heavy to feel the rig and that of two bodies behind a damped joint alike; its position and
    /// acceleration are those of its velocity.
    #[test]
    fn a_sway_may_die_away() {
        let rig = Rig { gravity_m_per_s2: 0.0, ..Rig::fall() };
        let (dies, turns) = (0.1 * TAU * 7.0, 0.99_f64.sqrt() * TAU * 7.0);
        for answers in ["", ",answers=1,link_fraction=0.3"] {
            let effect = format!("{EFFECT},decays=1,damping_ratio=0.1{answers}");
            let fall = strike(rig, 0.2, 6.0, &[&effect]);
            let hit = strike(Rig::impact(25e3), 0.2, 6.0, &[&effect]);
            for part in 0..28 {
                let time = f64::from(part) * 0.01;
                let sway = |time: f64| 0.02 * (-dies * time).exp() * (turns * time + 0.5).cos();
                near("after", fall.value(Quantity::Velocity, time), 0.2 + sway(time), 1e-6);
                near("before", hit.value(Quantity::Velocity, -time), 0.2 + sway(-time), 1e-12);
                for (shown, of) in [(&fall, time + 0.01), (&hit, -time - 0.01)] {
                    let rate = |quantity: Quantity| {
                        (shown.value(quantity, of + 1e-6) - shown.value(quantity, of - 1e-6)) / 2e-6
                    };
                    near("speed", rate(Quantity::Position), shown.value(Quantity::Velocity, of), 1e-5);
                    near("rate", rate(Quantity::Velocity), shown.value(Quantity::Acceleration, of), 1e-3);
                }
            }
        }
    }

    /// m·(ẍ + Aσ·sin(σt + φ)) = −k·x: an undamped oscillator, driven at the frequency of the sway.
    #[test]
    fn the_contact_is_a_driven_oscillator() {
        let (k, mass, speed) = (25e3_f64, 6.0, 0.25);
        let impact = strike(Rig::impact(k), speed, mass, &[EFFECT]);
        let (natural, sway) = ((k / mass).sqrt(), TAU * 7.0);
        // x = B·sin(σt + φ) + C·cos(ωt) + D·sin(ωt), B = −Aσ/(ω² − σ²), x(0) = 0, ẋ(0) = v + A·cos φ.
        let b = -0.02 * sway / (natural * natural - sway * sway);
        let c = -b * 0.5_f64.sin();
        let d = (speed + 0.02 * 0.5_f64.cos() - b * sway * 0.5_f64.cos()) / natural;
        let end = impact.contact_intervals()[0].1.unwrap();
        for part in 0..20 {
            let time = end * f64::from(part) / 20.0;
            let x = b * (sway * time + 0.5).sin() + c * (natural * time).cos() + d * (natural * time).sin();
            near("force", impact.force_n(time), k * x, 1e-4);
        }
    }
}
