//! Pad and springs.

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;

pub(super) fn hunt_crossley(_: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    Shaped::new(
        (0.1, 1.0),
        move |s, i, world| {
            if touched[i] {
                world.pad.alpha_s_per_m += s;
            }
        },
        |s| vec![parameter("alpha", "s/m", s)],
    )
}

pub(super) fn viscous(_: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    Shaped::new(
        (10.0, 150.0),
        move |s, i, world| {
            if touched[i] {
                world.pad.dashpot_n_s_per_m += s;
            }
        },
        |s| vec![parameter("damping", "N·s/m", s)],
    )
}

pub(super) fn relaxation(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    // One branch near the pulse, the others a few times faster and slower, as a spectrum has them.
    let middle = draw.log_uniform(0.005, 0.3);
    let ratio = draw.uniform(2.0, 4.0);
    let weights = [draw.uniform(0.1, 0.3), 1.0, draw.uniform(0.1, 0.3)];
    let total: f64 = weights.iter().sum();
    let times = [middle / ratio, middle, middle * ratio];
    let pad = plan.pad_n_per_m;
    let branch = move |s: f64, j: usize| (s * weights[j] / total, times[j]);
    Shaped::new(
        (0.05, 0.8),
        move |s, _, world| {
            for j in 0..3 {
                let (share, tau) = branch(s, j);
                world.pad.branches.push((pad * share, tau));
            }
        },
        move |s| {
            let mut list = vec![parameter("share", "", s), parameter("relaxation_time", "s", middle)];
            for j in 0..3 {
                let (share, tau) = branch(s, j);
                list.push(parameter(&format!("branch_{}_share", j + 1), "", share));
                list.push(parameter(&format!("branch_{}_time", j + 1), "s", tau));
            }
            list
        },
    )
}

pub(super) fn rate_stiffening(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    // The rate at which the pad's stiffness was stated, as speed of compression.
    let reference = draw.log_uniform(0.05, 0.3);
    Shaped::new(
        (0.05, 0.5),
        move |s, _, world| world.pad.rate = Some((s, reference)),
        move |s| vec![parameter("growth", "", s), parameter("reference_speed", "m/s", reference)],
    )
}

#[expect(clippy::cast_precision_loss, reason = "few hits")]
pub(super) fn mullins(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let hits = draw.uniform(2.0, 5.0);
    Shaped::new(
        (0.2, 0.6),
        move |s, i, world| world.pad.stiffness_n_per_m *= 1.0 + s * (-(i as f64) / hits).exp(),
        move |s| vec![parameter("softening", "", s), parameter("hits", "", hits)],
    )
}

pub(super) fn hardening(draw: &mut Draw, plan: &Plan, _: &[bool]) -> Shaped {
    // The stroke that the pad would have at the highest peak, and the exponent of the law.
    let reach = (0..plan.recordings.len()).map(|i| plan.peak_n(i)).fold(0.0, f64::max) / plan.pad_n_per_m;
    let exponent = draw.pick(&[1.0, 1.0, 2.0]);
    Shaped::new(
        (0.05, 2.0),
        move |s, _, world| world.pad.lock = Some((reach / s, exponent)),
        move |s| vec![parameter("lock_stroke", "m", reach / s), parameter("exponent", "", exponent)],
    )
}

pub(super) fn end_stop(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    // The stop begins a share below the largest stroke; confined, it stays out of reach of the others.
    let mut strokes: Vec<f64> = (0..plan.recordings.len()).map(|i| plan.stroke_m(i)).collect();
    let out_of_reach = strokes.iter().zip(touched).filter(|(_, t)| !**t).map(|(s, _)| *s).fold(0.0, f64::max);
    strokes.sort_by(f64::total_cmp);
    let longest = strokes[strokes.len() - 1];
    let largest = if out_of_reach > 0.0 { (1.0 - out_of_reach / longest) * 0.98 } else { 0.6 };
    let stiffness = plan.body_n_per_m * draw.log_uniform(8.0, 40.0);
    let over = draw.uniform(1e-4, 4e-4);
    Shaped::new(
        (0.02, largest),
        move |s, _, world| world.spring.stop = Some((longest * (1.0 - s), stiffness, over)),
        move |s| {
            vec![
                parameter("stroke", "m", longest * (1.0 - s)),
                parameter("stiffness", "N/m", stiffness),
                parameter("soft_range", "m", over),
            ]
        },
    )
}

pub(super) fn clearance(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let loose = draw.uniform(0.5, 0.9);
    Shaped::new(
        (5e-5, 2e-3),
        move |s, i, world| {
            if touched[i] {
                world.spring.loose = Some((loose, s));
            }
        },
        move |s| vec![parameter("gap", "m", s), parameter("loose_share", "", loose)],
    )
}

pub(super) fn adhesion(_: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    Shaped::new(
        (2.0, 60.0),
        move |s, i, world| {
            if touched[i] {
                world.pad.pull_off_n = s;
            }
        },
        |s| vec![parameter("pull_off", "N", s)],
    )
}

pub(super) fn air(_: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    Shaped::new(
        (16.0, 400.0),
        move |s, i, world| {
            if touched[i] {
                world.spring.air_n_s2_per_m2 = s;
            }
        },
        |s| vec![parameter("quadratic_damping", "N·s²/m²", s)],
    )
}
