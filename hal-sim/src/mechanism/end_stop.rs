//! The springs go solid: beyond a stroke the coils, or the ends of the guide, bear a second, stiffer spring. So does a pad that is pressed flat on what
//! carries it; or the robot meets what stands beside pad and springs together, which is both of them going solid at once.
//!
//! F = k·x + κ·k·⟨x − x_b⟩·⟨1 + 3/2·α·ẋ⟩, ⟨·⟩ the positive part, x the stroke of the body springs, or how deep the pad is pressed where they are pressed as far: a stop only pushes. What it loses, if anything, is
//! nothing at its first touch, so that the force does not jump.
//!
//! Source: common practice for coil bind (DIN EN 13906-1 keeps a reserve before the solid length); its loss: K. H. Hunt, F. R. E. Crossley,
//! J. Appl. Mech. 42 (1975) 440.

use super::{Effect, Group, Mechanism, Needed, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response, Which};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "end-stop",
    group: Group::Contact,
    site: Site::Spring,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("alpha_s_per_m", "loses", &[1.0])],
    sized: &["stiffness_ratio"],
    equation: "F = k·x + ratio·k·max(x − x_b, 0)·max(1 + 3/2·α·dx/dt, 0), x the stroke of the body springs, of the pad, or of both",
    source: "piecewise linear stop; 10 to 100 times the springs' stiffness at 8 to 25 mm",
    parameters: &[
        Parameter {
            name: "stiffness_ratio",
            unit: "1",
            meaning: "stiffness of the stop over the springs'",
            null: Some(0.0),
            range: (0.0, 1000.0),
            plausible: (0.1, 100.0),
            typical: 20.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "stroke_m",
            unit: "m",
            meaning: "stroke of the body springs at which the stop is reached",
            null: None,
            range: (1e-4, 0.2),
            plausible: (0.001, 0.025),
            typical: 0.012,
            scale: Scale::Logarithmic,
            search: Search::OfStroke,
        },
        Parameter {
            name: "alpha_s_per_m",
            unit: "s/m",
            meaning: "loss α of the stop: a ball bounces from it at 1 − α·v of its speed v",
            null: None,
            range: (1e-3, 5.0),
            plausible: (0.02, 2.0),
            typical: 0.1,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[0.1, 1.0]),
        },
        Parameter {
            name: "loses",
            meaning: "0: the stop gives back all energy, 1: it loses some",
            search: Search::LaterForm(&[1.0]),
            ..Parameter::EITHER
        },
        Parameter {
            name: "at",
            meaning: "0: the body springs go solid, 1: the pad does, 2: both at once, as where the robot meets what stands beside them",
            search: Search::FormWithLater(Needed::Pad, &[0.0], 1, &[1.0, 2.0]),
            ..Parameter::ONE_OF_THREE
        },
    ],
    signature: "a kink at one stroke, in the recordings of highest energy only; a steep, short top",
    confused_with: &["hardening", "clipping"],
    separated_by: "the kink stays at the same stroke with other springs and speeds",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let alpha_s_per_m = if effect.form(3) == 0 { 0.0 } else { effect.value(2) };
    let [stiffness_ratio, stroke_m] = [0, 1].map(|place| effect.value(place));
    let stop = |of_pad: bool| Stop { stiffness_ratio, stroke_m, alpha_s_per_m, of_pad };
    let at = if assembly.pad.is_some() { effect.form(4) } else { 0 };
    if at != 1 {
        assembly.spring.laws.push(Box::new(stop(false)));
    }
    if at != 0 {
        assembly.obey(&stop(true), Which::Touched);
    }
}

#[derive(Clone, Debug)]
struct Stop {
    stiffness_ratio: f64,
    /// Of the body springs, which bear as much as the pad.
    stroke_m: f64,
    alpha_s_per_m: f64,
    of_pad: bool,
}

impl Stop {
    /// How far the element is pressed where the body springs are by the stroke: what has the part s of both has s/(1 − s) of the others.
    fn depth_m(&self, share: f64) -> f64 {
        if self.of_pad { self.stroke_m * share / (1.0 - share) } else { self.stroke_m }
    }
}

impl ForceLaw for Stop {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        if !deformation.beyond_knot {
            return Response::default();
        }
        let elastic_n_per_m = self.stiffness_ratio * deformation.linear_n_per_m;
        let elastic_n = elastic_n_per_m * (deformation.depth_m - self.depth_m(deformation.share));
        let loss_s_per_m = 1.5 * self.alpha_s_per_m;
        let part = 1.0 + loss_s_per_m * deformation.rate_m_per_s;
        if part <= 0.0 {
            return Response::default();
        }
        Response {
            force_n: elastic_n * part,
            stiffness_n_per_m: elastic_n_per_m * part,
            damping_ns_per_m: elastic_n * loss_s_per_m,
            ..Response::default()
        }
    }

    fn depends_on_rate(&self) -> bool {
        self.alpha_s_per_m > 0.0
    }

    fn is_linear(&self, beyond_knot: bool) -> bool {
        !(beyond_knot && self.depends_on_rate())
    }

    fn knot_m(&self, share: f64) -> Option<f64> {
        Some(self.depth_m(share))
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::{Quantity, Rig};

    /// Where both go solid at once one spring does: ½mv² = ½K·x² + ½κ·K·(x − x_b)², K what both are together. Where the pad does, what is stored beyond is
    /// of a stiffness of (1 + κ)·k_p and k_b in series.
    #[test]
    fn the_pad_may_go_solid_or_both_at_once() {
        let (body, pad, mass, speed, ratio, stroke) = (25e3_f64, 80e3_f64, 6.0, 0.4, 10.0, 0.003);
        let (whole, at_n) = (body * pad / (body + pad), body * stroke);
        let beyond = |at: u32| match at {
            0 => 1.0 / (1.0 / pad + 1.0 / (body * (1.0 + ratio))),
            1 => 1.0 / (1.0 / body + 1.0 / (pad * (1.0 + ratio))),
            _ => whole * (1.0 + ratio),
        };
        for at in 0..3 {
            let effect = format!("end-stop:stiffness_ratio={ratio},stroke_m={stroke},at={at}");
            let impact = strike(Rig::impact(body).with_pad(pad), speed, mass, &[&effect]);
            let contact = impact.truth().contacts[0];
            // Beyond it ½(F² − F_b²)/k is stored.
            let left_j = 0.5 * mass * speed * speed - 0.5 * at_n * at_n / whole;
            near("peak", contact.peak_n, (at_n * at_n + 2.0 * left_j * beyond(at)).sqrt(), 1e-3);
            near("speed after", contact.speed_after_m_per_s, -speed, 1e-6);
            let at_m_per_s = (speed * speed - at_n * at_n / whole / mass).sqrt();
            let kinks = impact.kinks(Quantity::CellForce, 1e-6);
            near("slope", kinks[1].slope, (beyond(at) - whole) * at_m_per_s, 50.0);
        }
    }
}
