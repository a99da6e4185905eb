//! The piece pushes the air out of its housing, and sucks it back: a drag by the square of its speed.
//!
//! F = c·v·√(v² + v_l²), v the rate of the stroke. Through an opening turbulent flow has a pressure loss by the square of
//! the speed; below v_l it is laminar and the loss is proportional to it, without which a massless piece could not be
//! balanced at its turning point. The housing stands on the cell, which bears the air's pressure like the springs' force.
//!
//! Source: pressure loss of an orifice; 1 N at 0.25 m/s, which is c = 16 N·s²/m².

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

/// Speed of the piece below which the flow through the vents is laminar, m/s: a piece of 40 mm drives air twenty
/// times as fast through 2 mm gaps, whose Reynolds number is then some 10³.
const LAMINAR_BELOW_M_PER_S: f64 = 0.02;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "air-damping",
    group: Group::Contact,
    site: Site::Spring,
    equation: "F = c·v·sqrt(v² + (0.02 m/s)²), v the rate of the stroke of the body springs",
    source: "orifice loss of the air in the housing; 1 N at 0.25 m/s",
    parameters: &[Parameter {
        name: "drag_Ns2_per_m2",
        unit: "N·s²/m²",
        meaning: "force per square of the speed",
        null: Some(0.0),
        range: (0.0, 2000.0),
        plausible: (1.0, 100.0),
        typical: 16.0,
        scale: Scale::Logarithmic,
        search: Search::Strength,
    }],
    signature: "a step of the force at contact that grows with the square of the speed, and less force on the way out",
    confused_with: &["viscous-damping", "hunt-crossley-damping", "guide-friction"],
    separated_by: "open or block the vents; four times the loss of force at twice the speed, where a dashpot has twice",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.spring.laws.push(Box::new(Vents { drag_ns2_per_m2: effect.value(0) }));
}

#[derive(Debug)]
struct Vents {
    drag_ns2_per_m2: f64,
}

impl ForceLaw for Vents {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        let speed = deformation.rate_m_per_s.hypot(LAMINAR_BELOW_M_PER_S);
        let square = deformation.rate_m_per_s * deformation.rate_m_per_s;
        Response {
            force_n: self.drag_ns2_per_m2 * deformation.rate_m_per_s * speed,
            damping_ns_per_m: self.drag_ns2_per_m2 * (speed + square / speed),
            ..Response::default()
        }
    }

    fn depends_on_rate(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// To first order the loss is ∫c·v²·√(v² + v_l²)dt over the ideal half cosine of the speed.
    #[test]
    fn it_takes_what_its_drag_works_on_the_ideal_motion() {
        let (k, mass, speed, drag) = (25e3, 6.0, 0.3, 0.05);
        let pulsation = (k / mass as f64).sqrt();
        let parts = 20_000;
        let power = |part: i32| {
            let rate = speed * (std::f64::consts::PI * (f64::from(part) + 0.5) / f64::from(parts)).cos();
            drag * rate * rate * rate.hypot(LAMINAR_BELOW_M_PER_S)
        };
        let work = (0..parts).map(power).sum::<f64>() * std::f64::consts::PI / pulsation / f64::from(parts);
        let contact = strike(Rig::impact(k), speed, mass, &["air-damping:drag_Ns2_per_m2=0.05"]).truth().contacts[0];
        near("loss", contact.loss_j, work, 2e-3 * work);
    }

    /// At first contact the piece is as fast as the robot, or (behind a pad) as fast as the balance lets it.
    #[test]
    fn the_force_at_contact_grows_with_the_square_of_the_speed() {
        let drag = "air-damping:drag_Ns2_per_m2=16";
        for speed in [0.1_f64, 0.2, 0.4] {
            let bare = strike(Rig::impact(25e3), speed, 6.0, &[drag]);
            let expected = 16.0 * speed * speed.hypot(LAMINAR_BELOW_M_PER_S);
            near("step", bare.force_n(0.0), expected, 1e-9);
            let padded = strike(Rig::impact(25e3).with_pad(80e3), speed, 6.0, &[drag]);
            // m·ẍ = −P throughout, and the springs' energy is given back: what is lost is lost in the vents.
            let contact = padded.truth().contacts[0];
            let energy = 0.5 * 6.0 * speed * speed;
            let lost = energy - 0.5 * 6.0 * contact.speed_after_m_per_s.powi(2);
            near("loss", contact.loss_j, lost, 1e-5 * energy);
            assert!(lost > 0.0);
        }
    }
}
