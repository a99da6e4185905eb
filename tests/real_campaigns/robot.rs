//! A UR10e drives a tool of 6.86 kg straight down onto a force sensor on a bench, under two controllers at two speeds (Gadringer, Gattringer,
//! Mueller, doi 10.5194/ms-13-361-2022): the robot's own force control, and the robot in position control with a pneumatic flange
//! between robot and tool. Force at 1250 Hz.
//!
//! Baseline: one mass meets one spring, and that is all. Half of an arm of 33.5 kg and the tool, 24 kg, to 30 %, is the standard's
//! estimate for every drive, whatever the controller; metal on a sensor on a bench, 5 N/µm to a factor of two (70 % in one deviation).
//!
//! The force rings at 560 to 625 Hz, at the very end of what 1250 Hz can show. Neighbouring samples are averaged (¼, ½, ¼), as one would before
//! looking at anything slower.

use super::{Belief, Campaign, Entry, Expected, Real, channel, series};

const ROBOT: [(&str, f64); 2] = [("ur_gain1_v0.10", 0.1), ("ur_gain1_v0.25", 0.25)];
const FLANGE: [(&str, f64); 2] = [("acf_ramp0.1s_fzero10N_v0.10", 0.1), ("acf_ramp0.1s_fzero10N_v0.25", 0.25)];

/// Until when a recording is kept for a look at the first hit alone, s: the second comes 45 ms later at the earliest.
const FIRST_HIT_S: f64 = 0.03;

fn campaign(
    drives: Vec<(&'static str, f64, &'static str)>,
    until_s: f64,
) -> impl Fn(&std::path::Path, &std::path::Path) -> Campaign {
    move |recordings, folder| {
        let entries = drives
            .iter()
            .enumerate()
            .map(|(number, (drive, speed, configuration))| {
                let force = channel(&recordings.join(format!("ur10e_direct_contact/force_{drive}.csv")), "force_N");
                let file = format!("{:03}.csv", number + 1);
                let kept = force
                    .windows(3)
                    .map(|three| (three[1].0, 0.25 * three[0].1 + 0.5 * three[1].1 + 0.25 * three[2].1));
                series(&folder.join(&file), "force_N", kept.take_while(|(time_s, _)| *time_s <= until_s));
                Entry {
                    file,
                    speed_m_per_s: Belief(*speed, 0.02 * speed),
                    mass_kg: Belief(24.0, 7.0),
                    configuration: Some(configuration),
                }
            })
            .collect();
        Campaign {
            kind: "impact",
            body_n_per_m: Some(Belief(5e6, 3.5e6)),
            sample_rate_hz: 1250.0,
            noise_rms: 0.3,
            full_scale: 2000.0,
            observed: "force_N",
            entries,
        }
    }
}

pub fn all() -> Vec<Real> {
    let of = |drives: [(&'static str, f64); 2], name: &'static str| drives.map(|(drive, speed)| (drive, speed, name));
    let both = of(ROBOT, "own force control").into_iter().chain(of(FLANGE, "flange"));
    vec![
        Real {
            name: "ur10e-own-force-control".to_owned(),
            about: "a robot drives onto a sensor and goes on pushing with 100 N",
            documented: "the controller goes on pushing (100 N wanted); bounce and second hit; ringing of the sensor's mount",
            expected: Expected::Names(&["robot-push"]),
            make: Box::new(campaign(of(ROBOT, "own force control").to_vec(), 0.5)),
        },
        Real {
            name: "ur10e-flange".to_owned(),
            about: "the same with a pneumatic flange between robot and tool",
            documented: "the flange goes on pushing (100 N wanted); second hit after 45 to 55 ms; ringing",
            expected: Expected::Names(&["robot-push"]),
            make: Box::new(campaign(of(FLANGE, "flange").to_vec(), 0.5)),
        },
        Real {
            name: "ur10e-both-first-hit".to_owned(),
            about: "the first 30 ms of all four drives",
            documented: "same tool, same speeds: with the flange only what lies before it hits (0.8 to 2.4 N s), else the arm too (2.2 to 5.6 N s)",
            expected: Expected::Names(&[
                "pose-dependent-mass",
                "frame-compliance",
                "moving-piece-inertia",
                "joint-elasticity",
            ]),
            make: Box::new(campaign(both.collect(), FIRST_HIT_S)),
        },
    ]
}
