//! Free fall.

use super::{Shaped, parameter};
use crate::draw::Draw;
use crate::plan::Plan;

pub(super) fn drag(draw: &mut Draw, plan: &Plan, touched: &[bool]) -> Shaped {
    let touched = touched.to_vec();
    // Balls of other size, so the configurations differ.
    let areas: Vec<f64> = plan.configurations.iter().map(|_| draw.uniform(0.6, 1.4)).collect();
    let of: Vec<usize> = plan.recordings.iter().map(|r| r.configuration).collect();
    let listed = areas.clone();
    Shaped::new(
        (1e-3, 0.5),
        move |s, i, world| {
            if touched[i] {
                world.drag_n_s2_per_m2 = s * areas[of[i]];
            }
        },
        move |s| {
            let mut list = vec![parameter("drag", "N·s²/m²", s * listed.iter().sum::<f64>() / 3.0)];
            for (index, area) in listed.iter().enumerate() {
                list.push(parameter(&format!("drag_of_configuration_{}", index + 1), "N·s²/m²", s * area));
            }
            list
        },
    )
}

pub(super) fn spin(_: &mut Draw, _: &Plan, _: &[bool]) -> Shaped {
    Shaped::new((0.1, 20.0), move |s, _, world| world.spin_m_per_s3 = s, |s| vec![parameter("lift_growth", "m/s³", s)])
}
