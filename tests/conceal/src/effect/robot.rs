//! The robot: what hangs behind the tip, and what its controller does.

use std::f64::consts::TAU;

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;
use crate::world::{Joint, Push, Reaction, Sway};

pub(super) fn joint(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let hz = draw.log_uniform(10.0, 28.0);
    let ratio = draw.uniform(0.02, 0.1);
    Shaped::new(
        (0.02, 0.7),
        move |s, i, world| {
            if touched[i] {
                world.robot.joint = Some(Joint { share: s, frequency_hz: hz, damping_ratio: ratio, backlash_m: 0.0 });
            }
        },
        move |s| {
            vec![parameter("share", "", s), parameter("frequency", "Hz", hz), parameter("damping_ratio", "", ratio)]
        },
    )
}

pub(super) fn sway(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let hz = draw.log_uniform(3.0, 13.0);
    let phases: Vec<f64> = plan.recordings.iter().map(|_| draw.uniform(0.0, TAU)).collect();
    Shaped::new(
        (3e-4, 0.02),
        move |s, i, world| {
            if touched[i] {
                let w = TAU * hz;
                // x = A·sin(ωt + φ): the sway is in the speed at contact as well.
                world.speed_m_per_s = (world.speed_m_per_s + s * w * phases[i].cos()).max(0.01);
                world.robot.sway = Some(Sway { amplitude_m: s, frequency_hz: hz, phase_rad: phases[i] });
            }
        },
        move |s| vec![parameter("amplitude", "m", s), parameter("frequency", "Hz", hz)],
    )
}

pub(super) fn push(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let stiffness = draw.log_uniform(5e3, 40e3);
    let until = draw.uniform(0.06, 0.4);
    Shaped::new(
        (3.0, 300.0),
        move |s, i, world| {
            if touched[i] {
                world.robot.push = Some(Push { stiffness_n_per_m: stiffness, limit_n: s, until_s: until });
            }
        },
        move |s| {
            vec![
                parameter("force", "N", s),
                parameter("servo_stiffness", "N/m", stiffness),
                parameter("until", "s", until),
            ]
        },
    )
}

pub(super) fn ceiling(_: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let (highest, largest) = reach(plan, touched);
    Shaped::new(
        (0.05, largest),
        move |s, _, world| world.robot.ceiling_n = Some(highest * (1.0 - s)),
        move |s| vec![parameter("force", "N", highest * (1.0 - s))],
    )
}

/// The highest peak, and how far below it something may begin so that it stays out of reach of the untouched.
pub(super) fn reach(plan: &Plan, touched: &[bool]) -> (f64, f64) {
    let peaks = (0..plan.recordings.len()).map(|i| plan.peak_n(i));
    let highest = peaks.clone().fold(0.0, f64::max);
    let others = peaks.zip(touched).filter(|(_, t)| !**t).map(|(p, _)| p).fold(0.0, f64::max);
    (highest, if others > 0.0 { (1.0 - others / highest) * 0.98 } else { 0.7 })
}

pub(super) fn reaction(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let peaks: Vec<f64> = (0..plan.recordings.len()).map(|i| plan.peak_n(i)).collect();
    let mut sorted = peaks;
    sorted.sort_by(f64::total_cmp);
    let threshold = draw.uniform(0.1, 0.5) * sorted[sorted.len() / 2];
    let delay = draw.uniform(0.005, 0.3 * plan.longest_touch_s().clamp(0.03, 0.09));
    let rise = draw.log_uniform(0.001, 0.005);
    Shaped::new(
        (5.0, 500.0),
        move |s, i, world| {
            if touched[i] {
                world.robot.reaction =
                    Some(Reaction { threshold_n: threshold, delay_s: delay, force_n: s, rise_s: rise });
            }
        },
        move |s| {
            vec![
                parameter("force", "N", s),
                parameter("threshold", "N", threshold),
                parameter("delay", "s", delay),
                parameter("rise", "s", rise),
            ]
        },
    )
}

pub(super) fn pose_mass(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    // One pose is off, in a direction of its own.
    let of: Vec<usize> = plan.recordings.iter().map(|r| r.configuration).collect();
    let all = touched.iter().all(|t| *t);
    let odd =
        if all { draw.index(plan.configurations.len()) } else { of[touched.iter().position(|t| *t).unwrap_or(0)] };
    let sign = draw.sign();
    Shaped::new(
        (0.1, 0.7),
        move |s, i, world| {
            if of[i] == odd {
                world.mass_kg *= (sign * s).exp();
            }
        },
        move |s| vec![parameter("mass_ratio", "", (sign * s).exp())],
    )
}

pub(super) fn speed_error(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let sign = draw.sign();
    Shaped::new(
        (0.05, 0.4),
        move |s, i, world| {
            if touched[i] {
                world.speed_m_per_s *= 1.0 + sign * s;
            }
        },
        move |s| vec![parameter("relative_error", "", sign * s)],
    )
}
