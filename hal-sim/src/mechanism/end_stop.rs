//! The springs go solid: beyond a stroke the coils, or the ends of the guide, bear a second, stiffer spring.
//!
//! F = k·x + κ·k·⟨x − x_b⟩·⟨1 + 3/2·α·ẋ⟩, ⟨·⟩ the positive part, x the stroke of the body springs: a stop only pushes. What it loses, if anything, is
//! nothing at its first touch, so that the force does not jump.
//!
//! Source: common practice for coil bind (DIN EN 13906-1 keeps a reserve before the solid length); its loss: K. H. Hunt, F. R. E. Crossley,
//! J. Appl. Mech. 42 (1975) 440.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

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
    equation: "F = k·x + ratio·k·max(x − x_b, 0)·max(1 + 3/2·α·dx/dt, 0), x the stroke of the body springs",
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
            meaning: "stroke at which the stop is reached",
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
    ],
    signature: "a kink at one stroke, in the recordings of highest energy only; a steep, short top",
    confused_with: &["hardening", "clipping"],
    separated_by: "the kink stays at the same stroke with other springs and speeds",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let alpha_s_per_m = if effect.form(3) == 0 { 0.0 } else { effect.value(2) };
    assembly.spring.laws.push(Box::new(Stop {
        stiffness_ratio: effect.value(0),
        stroke_m: effect.value(1),
        alpha_s_per_m,
    }));
}

#[derive(Debug)]
struct Stop {
    stiffness_ratio: f64,
    stroke_m: f64,
    alpha_s_per_m: f64,
}

impl ForceLaw for Stop {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        if !deformation.beyond_knot {
            return Response::default();
        }
        let elastic_n_per_m = self.stiffness_ratio * deformation.linear_n_per_m;
        let elastic_n = elastic_n_per_m * (deformation.depth_m - self.stroke_m);
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

    fn knot_m(&self) -> Option<f64> {
        Some(self.stroke_m)
    }
}
