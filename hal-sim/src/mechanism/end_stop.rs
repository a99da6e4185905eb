//! The springs go solid: beyond a stroke the coils, or the ends of the guide, bear a second, stiffer spring.
//!
//! F = k·x + κ·k·⟨x − x_b⟩, ⟨·⟩ the positive part, x the stroke of the body springs.
//!
//! Source: common practice for coil bind (DIN EN 13906-1 keeps a reserve before the solid length).

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
    used_in: &[],
    sized: &["stiffness_ratio"],
    equation: "F = k·x + ratio·k·max(x − x_b, 0), x the stroke of the body springs",
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
    ],
    signature: "a kink at one stroke, in the recordings of highest energy only; a steep, short top",
    confused_with: &["hardening", "clipping"],
    separated_by: "the kink stays at the same stroke with other springs and speeds",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.spring.laws.push(Box::new(Stop { stiffness_ratio: effect.value(0), stroke_m: effect.value(1) }));
}

#[derive(Debug)]
struct Stop {
    stiffness_ratio: f64,
    stroke_m: f64,
}

impl ForceLaw for Stop {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        if !deformation.beyond_knot {
            return Response::default();
        }
        let stiffness_n_per_m = self.stiffness_ratio * deformation.linear_n_per_m;
        Response {
            force_n: stiffness_n_per_m * (deformation.depth_m - self.stroke_m),
            stiffness_n_per_m,
            ..Response::default()
        }
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn knot_m(&self) -> Option<f64> {
        Some(self.stroke_m)
    }
}
