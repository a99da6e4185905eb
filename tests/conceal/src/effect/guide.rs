//! The piece's guide.

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;

pub(super) fn friction(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let presliding = draw.log_uniform(4e-6, 15e-6);
    Shaped::new(
        (0.5, 60.0),
        move |s, i, world| {
            world.guide.presliding_m = presliding;
            if touched[i] {
                world.guide.sliding_n += s;
                world.guide.breakaway_n += s;
            }
        },
        move |s| vec![parameter("force", "N", s), parameter("presliding", "m", presliding)],
    )
}

pub(super) fn load_dependent(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let presliding = draw.log_uniform(4e-6, 15e-6);
    Shaped::new(
        (0.01, 0.6),
        move |s, i, world| {
            world.guide.presliding_m = presliding;
            if touched[i] {
                world.guide.load_share = s;
            }
        },
        move |s| vec![parameter("share", "", s), parameter("presliding", "m", presliding)],
    )
}

pub(super) fn stiction(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let ratio = draw.uniform(1.6, 2.1);
    let stribeck = draw.log_uniform(0.01, 0.04);
    let presliding = draw.log_uniform(4e-6, 15e-6);
    Shaped::new(
        (0.5, 60.0),
        move |s, i, world| {
            world.guide.presliding_m = presliding;
            if touched[i] {
                world.guide.stribeck_m_per_s = stribeck;
                world.guide.sliding_n += s;
                world.guide.breakaway_n += s * ratio;
            }
        },
        move |s| {
            vec![
                parameter("sliding_force", "N", s),
                parameter("breakaway_force", "N", s * ratio),
                parameter("stribeck_speed", "m/s", stribeck),
            ]
        },
    )
}
