//! The piece pushes the air out of its housing, and sucks it back: a drag by the square of its speed.
//!
//! F = c·v·|v|, v the rate of the stroke. Where the housing stands on the cell, that bears the air's pressure like the springs'
//! force; where it stands beside it, the cell feels the air only by how it slows the piece; `cell_share` says which.
//!
//! A massless piece behind a pad finds its balance with this drag within about 2c·v/(k_pad + k_body), 0.1 to 0.5 ms: so the drag begins.
//! Later that lag is left out, v is the rate at which the springs alone would share the robot's speed.
//!
//! A chamber that fills takes a moment: the pressure follows the flow with τ, dF/dt = (c·v·|v| − F)/τ (`fills`). Then it acts between piece and housing,
//! which stands on the cell.
//!
//! Source: pressure loss of a turbulent flow through an opening; 1 N at 0.25 m/s, which is c = 16 N·s²/m².

use super::guide_friction::CELL_SHARE;
use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "air-damping",
    group: Group::Contact,
    site: Site::Guide,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("cell_share", "fills", &[0.0]), ("fill_s", "fills", &[1.0])],
    sized: &[],
    equation: "F = c·v² as the body springs are pressed in at the rate v, −b·c·v² as they come back; where the chamber fills, dF/dt = (c·v² − F)/τ",
    source: "orifice loss of the air in the housing; 1 N at 0.25 m/s",
    parameters: &[
        Parameter {
            name: "drag_Ns2_per_m2",
            unit: "N·s²/m²",
            meaning: "force per square of the speed",
            null: Some(0.0),
            range: (0.0, 1000.0),
            plausible: (1.0, 100.0),
            typical: 16.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "cell_share",
            meaning: "part of the air's pressure that the load cell bears: 1 when the housing stands on it, 0 beside it",
            typical: 1.0,
            search: Search::OneOf(&[1.0, 0.0]),
            ..CELL_SHARE
        },
        Parameter {
            name: "back_share",
            unit: "1",
            meaning: "part b of the drag as the springs come back: 1 through one opening, less or more where a lip or a valve opens one way",
            null: None,
            range: (0.0, 2.0),
            plausible: (0.4, 1.6),
            typical: 1.0,
            scale: Scale::Linear,
            search: Search::Typical,
        },
        Parameter {
            name: "fill_s",
            unit: "s",
            meaning: "time τ in which the pressure follows the flow",
            null: None,
            range: (1e-5, 0.02),
            plausible: (3e-5, 3e-3),
            typical: 5e-4,
            scale: Scale::Logarithmic,
            search: Search::Plausible,
        },
        Parameter {
            name: "fills",
            meaning: "0: the air's pressure is there at once, 1: the chamber fills and stands on the cell; others are rounded",
            search: Search::LaterForm(&[1.0]),
            ..Parameter::EITHER
        },
    ],
    signature: "a step of the force at contact that grows with the square of the speed, and less force on the way out",
    confused_with: &["viscous-damping", "hunt-crossley-damping", "guide-friction"],
    separated_by: "open or block the vents; at twice the speed four times the force is lost, where a dashpot takes twice",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    if effect.form(4) == 1 {
        let (drag_ns2_per_m2, back_share, fill_s) = (effect.value(0), effect.value(2), effect.value(3));
        assembly.spring.laws.push(Box::new(Chamber { drag_ns2_per_m2, back_share, fill_s }));
        return;
    }
    assembly.guide.air_ns2_per_m2 += effect.value(0);
    assembly.guide.air_cell_share = effect.value(1);
    assembly.guide.air_back_share = effect.value(2);
}

/// A chamber that fills.
#[derive(Debug)]
struct Chamber {
    drag_ns2_per_m2: f64,
    back_share: f64,
    fill_s: f64,
}

impl ForceLaw for Chamber {
    /// How fast its force changes a massless piece's velocity is left out, as its lag behind the pad is without a chamber.
    fn respond(&self, _deformation: Deformation, _elastic: Response, states: &[f64]) -> Response {
        Response { force_n: states[0], ..Response::default() }
    }

    fn states(&self) -> usize {
        1
    }

    fn state_rates(&self, deformation: Deformation, states: &[f64], rates: &mut [f64]) {
        let rate = deformation.rate_m_per_s;
        // What the robot has left has no rate of its own without a mass: it stands where springs and pressure are in balance, and the cell feels neither.
        if rate == 0.0 {
            rates[0] = 0.0;
            return;
        }
        let part = if rate < 0.0 { self.back_share } else { 1.0 };
        rates[0] = (part * self.drag_ns2_per_m2 * rate * rate.abs() - states[0]) / self.fill_s;
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// m·v·dv/dx = −k·x − c·v²: v² = v₀²·e^(−2cx/m) − (k/c)·x + (k·m/2c²)(1 − e^(−2cx/m)), zero at the top; the
    /// same on the way back with −c, up to where k·x = c·v².
    #[test]
    fn the_stroke_is_that_of_the_closed_form() {
        let (k, mass, speed, drag) = (25e3_f64, 6.0, 0.5, 60.0);
        let contact = strike(Rig::impact(k), speed, mass, &["air-damping:drag_Ns2_per_m2=60"]).truth().contacts[0];
        let square = |x: f64, from: f64, start: f64, drag: f64| {
            let fade = (-2.0 * drag * (x - from) / mass).exp();
            let particular = |x: f64| -k / drag * x + k * mass / (2.0 * drag * drag);
            (start * start - particular(from)) * fade + particular(x)
        };
        let top = contact.stroke_m;
        near("at the top", square(top, 0.0, speed, drag), 0.0, 1e-6);
        // The contact ends before the springs are at rest, where their force is that of the air.
        let end = contact.end_s.unwrap();
        let impact = strike(Rig::impact(k), speed, mass, &["air-damping:drag_Ns2_per_m2=60"]);
        let left = impact.value(crate::rig::Quantity::Position, end);
        let after = contact.speed_after_m_per_s;
        near("on the way back", square(left, top, 0.0, -drag), after * after, 1e-6);
        near("at the end", k * left, drag * after * after, 1e-3);
        near("step", impact.force_n(0.0), drag * speed * speed, 1e-9);
    }

    /// At once it is as without a chamber; the first pressure comes as 1 − e^(−t/τ).
    #[test]
    fn the_chamber_fills() {
        let drag = "air-damping:drag_Ns2_per_m2=60";
        for rig in [Rig::impact(25e3), Rig::impact(25e3).with_pad(80e3)] {
            let at_once = strike(rig, 0.5, 6.0, &[drag]).truth().contacts[0];
            let filled = strike(rig, 0.5, 6.0, &[&format!("{drag},fill_s=1e-5,fills=1")]).truth().contacts[0];
            near("peak", filled.peak_n, at_once.peak_n, 2e-3 * at_once.peak_n);
            near("speed after", filled.speed_after_m_per_s, at_once.speed_after_m_per_s, 2e-3);
        }
        let begins = strike(Rig::impact(25e3), 0.5, 6.0, &[&format!("{drag},fill_s=0.001,fills=1")]);
        let without = strike(Rig::impact(25e3), 0.5, 6.0, &[]);
        let expected = 60.0 * 0.25 * (1.0 - (-0.5_f64).exp());
        near("begins", begins.force_n(5e-4) - without.force_n(5e-4), expected, 0.01 * expected);
    }

    /// A valve that opens on the way back: pressed in as without it, and back as by springs alone.
    #[test]
    fn a_valve_lets_the_springs_back_freely() {
        let valve = ["air-damping:drag_Ns2_per_m2=60,back_share=0"];
        let (free, both) = (
            strike(Rig::impact(25e3), 0.5, 6.0, &valve),
            strike(Rig::impact(25e3), 0.5, 6.0, &["air-damping:drag_Ns2_per_m2=60"]),
        );
        let (free, both) = (free.truth().contacts[0], both.truth().contacts[0]);
        near("stroke", free.stroke_m, both.stroke_m, 1e-8);
        let energy = 0.5 * 25e3 * free.stroke_m * free.stroke_m;
        near("on the way back", 3.0 * free.speed_after_m_per_s.powi(2), energy, 1e-5);
        assert!(both.speed_after_m_per_s.abs() < 0.99 * free.speed_after_m_per_s.abs());
    }

    /// Beside the cell the air is felt by what it does to the motion alone: the cell bears the springs.
    #[test]
    fn a_cell_beside_the_housing_bears_the_springs_alone() {
        for rig in [Rig::impact(25e3), Rig::impact(25e3).with_pad(80e3)] {
            let impact = strike(rig, 0.5, 6.0, &["air-damping:drag_Ns2_per_m2=60,cell_share=0"]);
            for time_s in [0.0, 0.003, 0.01, 0.03] {
                let spring_n = 25e3 * impact.value(crate::rig::Quantity::Stroke, time_s);
                near("springs", impact.force_n(time_s), spring_n, 1e-6 * (1.0 + spring_n.abs()));
            }
        }
    }

    /// k·x = c·ẋ² after the robot has left: the square root of the stroke falls steadily, by t/2·√(k/c). A cell beside the housing bears k·x meanwhile.
    #[test]
    fn air_holds_springs_up_after_the_robot_has_left() {
        let (springs, drag) = (25e3_f64, 60.0);
        for rig in [Rig::impact(springs), Rig::impact(springs).with_pad(80e3)] {
            let impact = strike(rig, 0.5, 6.0, &["air-damping:drag_Ns2_per_m2=60,cell_share=0"]);
            let separates_s = impact.truth().contacts[0].end_s.unwrap();
            let stroke_m = |after_s: f64| impact.value(crate::rig::Quantity::Stroke, separates_s + after_s);
            let left_m = stroke_m(-1e-9);
            assert!(left_m > 2e-4);
            for after_s in [1e-6, 0.0003, 0.0006, 0.0009] {
                let expected_m = (left_m.sqrt() - 0.5 * after_s * (springs / drag).sqrt()).powi(2);
                near("stroke", stroke_m(after_s), expected_m, 2e-3 * left_m);
                near("cell", impact.force_n(separates_s + after_s), springs * expected_m, 2e-3 * springs * left_m);
            }
            near("back", stroke_m(0.05), 0.0, 1e-12);
        }
    }

    /// Behind a pad, on a body of its own, and with friction: what the robot loses is what the contact's work says.
    #[test]
    fn the_robot_loses_what_the_contact_takes() {
        let rig = Rig::impact(25e3).with_pad(80e3);
        let drag = "air-damping:drag_Ns2_per_m2=16";
        for others in [&[][..], &["guide-friction"], &["moving-piece-inertia"], &["hunt-crossley-damping"]] {
            let with: Vec<&str> = others.iter().copied().chain([drag]).collect();
            let truth = strike(rig, 0.4, 6.0, &with).truth();
            let without = strike(rig, 0.4, 6.0, others).truth();
            let loss: f64 = truth.contacts.iter().map(|contact| contact.loss_j).sum();
            let after = truth.contacts.last().unwrap().speed_after_m_per_s;
            near("loss", loss, 0.5 * 6.0 * (0.16 - after * after), 2e-5);
            let less: f64 = without.contacts.iter().map(|contact| contact.loss_j).sum();
            assert!(loss > less + 1e-3, "{others:?}: {loss} {less}");
        }
    }
}
