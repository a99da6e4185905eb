//! What the contract's list does not have.

use std::f64::consts::TAU;

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;
use crate::world::{Frame, Joint};

pub(super) fn surge(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    // The coils' mass between two half springs: ω² = 4k/m. Heavier coils are slower and stronger.
    let k = plan.body_n_per_m;
    let ratio = draw.uniform(0.01, 0.04);
    Shaped::new(
        (0.02, 0.5),
        move |s, _, world| world.spring.surge = Some((s, ratio)),
        move |s| vec![parameter("coil_mass", "kg", s), parameter("frequency", "Hz", (4.0 * k / s).sqrt() / TAU)],
    )
}

pub(super) fn heat(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let tau = draw.log_uniform(0.02, 0.1);
    let sign = draw.sign();
    Shaped::new(
        (1.0, 1000.0),
        move |s, _, world| world.chain.heat = Some((sign * s, tau)),
        move |s| vec![parameter("shift", "N/J", sign * s), parameter("time_constant", "s", tau)],
    )
}

pub(super) fn tilt(_: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    // The tilt at the largest stroke, rad.
    let longest = (0..plan.recordings.len()).map(|i| plan.stroke_m(i)).fold(0.0, f64::max);
    Shaped::new(
        (0.2, 1.0),
        move |s, _, world| world.chain.tilt_rad_per_m = s / longest,
        move |s| vec![parameter("tilt", "rad/m", s / longest)],
    )
}

pub(super) fn creep(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    let k = plan.body_n_per_m;
    let fastest = draw.log_uniform(0.004, 0.02);
    Shaped::new(
        (0.02, 2.0),
        move |s, _, world| {
            for factor in [1.0, 6.0, 36.0, 216.0] {
                world.spring.creep.push((k * s / 4.0, fastest * factor));
            }
        },
        move |s| vec![parameter("share", "", s), parameter("fastest_time", "s", fastest)],
    )
}

pub(super) fn backlash(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let hz = draw.uniform(40.0, 90.0);
    let share = draw.uniform(0.3, 0.5);
    // With a joint this stiff the play is what counts.
    Shaped::new(
        (2e-4, 1e-2),
        move |s, _, world| {
            if s > 0.0 {
                world.robot.joint = Some(Joint {
                    share: share * (s / 1e-3).min(1.0),
                    frequency_hz: hz,
                    damping_ratio: 0.1,
                    backlash_m: s,
                });
            }
        },
        move |s| {
            vec![
                parameter("play", "m", s),
                parameter("share", "", share * (s / 1e-3).min(1.0)),
                parameter("frequency", "Hz", hz),
            ]
        },
    )
}

pub(super) fn cogging(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    let longest = (0..plan.recordings.len()).map(|i| plan.peak_n(i)).fold(0.0, f64::max)
        * (1.0 / plan.body_n_per_m + 1.0 / plan.pad_n_per_m);
    let pitch = longest * draw.uniform(0.15, 0.4);
    let phase = draw.uniform(0.0, TAU);
    Shaped::new(
        (2.0, 300.0),
        move |s, _, world| world.robot.cogging = Some((s, pitch, phase)),
        move |s| vec![parameter("amplitude", "N", s), parameter("pitch", "m", pitch)],
    )
}

pub(super) fn curved(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let sign = draw.sign();
    Shaped::new(
        (0.1, 10.0),
        move |s, _, world| world.chain.curvature = sign * s,
        move |s| vec![parameter("curvature_at_2000_N", "", sign * s)],
    )
}

pub(super) fn slip(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    let mut peaks: Vec<f64> = (0..plan.recordings.len()).map(|i| plan.peak_n(i)).collect();
    peaks.sort_by(f64::total_cmp);
    let at = peaks[peaks.len() / 2] * draw.uniform(0.6, 0.9);
    Shaped::new(
        (2e-5, 2e-3),
        move |s, _, world| world.robot.slip = Some((at, s)),
        move |s| vec![parameter("slip", "m", s), parameter("at_force", "N", at)],
    )
}

pub(super) fn soft_skin(_: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    // The layer's stroke over the pad's at the highest peak.
    let highest = (0..plan.recordings.len()).map(|i| plan.peak_n(i)).fold(0.0, f64::max);
    let reach = highest / plan.body_n_per_m;
    let q = move |s: f64| highest / (s * reach).powi(2);
    Shaped::new(
        (0.02, 1.0),
        move |s, _, world| {
            if s > 0.0 {
                world.pad.soft_layer_n_per_m2 = Some(q(s));
            }
        },
        move |s| vec![parameter("quadratic_stiffness", "N/m²", q(s))],
    )
}

pub(super) fn rocking(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let hz = draw.log_uniform(50.0, 150.0);
    let lifted = draw.uniform(0.1, 0.35);
    let ratio = draw.uniform(0.01, 0.04);
    Shaped::new(
        (1.0, 50.0),
        move |s, _, world| {
            let stiffness = 1e7 / s;
            world.frame = Some(Frame {
                mass_kg: stiffness / (TAU * hz).powi(2),
                stiffness_n_per_m: stiffness,
                lifted_share: lifted,
                damping_ratio: ratio,
            });
        },
        move |s| {
            vec![
                parameter("stiffness", "N/m", 1e7 / s),
                parameter("lifted_share", "", lifted),
                parameter("frequency", "Hz", hz),
            ]
        },
    )
}

pub(super) fn hysteresis(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    let longest = (0..plan.recordings.len()).map(|i| plan.stroke_m(i)).fold(0.0, f64::max);
    let turn = longest * draw.uniform(0.05, 0.15);
    Shaped::new(
        (0.01, 0.6),
        move |s, _, world| world.spring.loss = Some((s, turn)),
        move |s| vec![parameter("loss", "", s), parameter("turning_stroke", "m", turn)],
    )
}
