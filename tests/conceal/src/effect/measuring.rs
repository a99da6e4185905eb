//! The measuring chain.

use std::f64::consts::TAU;

use super::robot::reach;
use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;

pub(super) fn discharge(_: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    Shaped::new(
        (0.2, 20.0),
        move |s, i, world| {
            if touched[i] {
                world.chain.discharge_s = Some(1.0 / s);
            }
        },
        |s| vec![parameter("time_constant", "s", 1.0 / s)],
    )
}

pub(super) fn drift(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let sign = draw.sign();
    Shaped::new(
        (0.3, 200.0),
        move |s, i, world| {
            if touched[i] {
                world.chain.drift_n_per_s += sign * s;
            }
        },
        move |s| vec![parameter("slope", "N/s", sign * s)],
    )
}

pub(super) fn clipping(_: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let (highest, largest) = reach(plan, touched);
    Shaped::new(
        (0.05, largest),
        move |s, _, world| world.chain.clip_n = highest * (1.0 - s),
        move |s| vec![parameter("level", "N", highest * (1.0 - s))],
    )
}

pub(super) fn lag(_: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    // Longer lag is lower corner: the scale is the time 1/(2π·f).
    Shaped::new(
        (3e-4, 4e-3),
        move |s, _, world| world.chain.lag_hz = Some(1.0 / (TAU * s)),
        |s| vec![parameter("corner", "Hz", 1.0 / (TAU * s))],
    )
}

pub(super) fn hum(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let third = draw.uniform(0.0, 0.3);
    let hz = plan.traces.hum_hz;
    Shaped::new(
        (0.05, 20.0),
        move |s, i, world| {
            if touched[i] {
                world.chain.hum[0] += s;
                world.chain.hum[3] = third;
            }
        },
        move |s| vec![parameter("amplitude", "N", s), parameter("frequency", "Hz", hz)],
    )
}

pub(super) fn gain(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let sign = draw.sign();
    Shaped::new(
        (0.15, 0.7),
        move |s, i, world| {
            if touched[i] {
                world.chain.gain *= (sign * s).exp();
            }
        },
        move |s| vec![parameter("gain", "", (sign * s).exp())],
    )
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "counts")]
pub(super) fn lost(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    // One gap in each touched recording, somewhere in the pulse; a gap has at least one sample.
    let rate = plan.rate_hz;
    let all = touched.iter().all(|t| *t);
    let gaps: Vec<Option<(usize, f64)>> = (0..plan.recordings.len())
        .map(|i| {
            let at = plan.recordings[i].sampling.contact_s + draw.uniform(0.1, 0.9) * plan.true_baseline(i).touch_s();
            let size = draw.uniform(0.5, 1.5);
            let here = if all { draw.chance(0.4) } else { touched[i] };
            here.then_some(((at * rate) as usize, size))
        })
        .collect();
    let sizes: Vec<f64> = gaps.iter().flatten().map(|g| g.1).collect();
    let count = move |s: f64, size: f64| (s * size * rate).round() as usize;
    Shaped::new(
        (5e-4, 0.02),
        move |s, i, world| {
            if let Some((at, size)) = gaps[i] {
                let count = count(s, size);
                if count > 0 {
                    world.chain.lost.push((at, count));
                }
            }
        },
        move |s| {
            let total: usize = sizes.iter().map(|size| count(s, *size)).sum();
            vec![parameter("lost_samples", "", total as f64)]
        },
    )
}
