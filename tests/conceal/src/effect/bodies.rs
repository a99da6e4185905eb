//! Bodies that the baseline has not.

use std::f64::consts::TAU;

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;

pub(super) fn piece(draw: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    let ratio = draw.uniform(0.01, 0.05);
    Shaped::new(
        (0.03, 0.5),
        move |s, _, world| {
            if s > world.piece.mass_kg {
                world.piece.mass_kg = s;
                world.piece.damping_ratio = ratio;
                world.piece.rest_damping_ratio = ratio;
            }
        },
        move |s| vec![parameter("mass", "kg", s), parameter("damping_ratio", "", ratio)],
    )
}

pub(super) fn frame(draw: &mut Draw, _: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    let mass = draw.uniform(8.0, 30.0);
    let ratio = draw.uniform(0.01, 0.05);
    // The scale is the compliance in units of 0.1 µm/N, 1/(10 N/µm).
    let stiffness = |s: f64| 1e7 / s;
    Shaped::new(
        (1.0, 12.0),
        move |s, i, world| {
            if touched[i] {
                world.frame = Some(crate::world::Frame {
                    mass_kg: mass,
                    stiffness_n_per_m: stiffness(s),
                    lifted_share: 1.0,
                    damping_ratio: ratio,
                });
            }
        },
        move |s| {
            vec![
                parameter("stiffness", "N/m", stiffness(s)),
                parameter("mass", "kg", mass),
                parameter("frequency", "Hz", (stiffness(s) / mass).sqrt() / TAU),
                parameter("damping_ratio", "", ratio),
            ]
        },
    )
}
