//! The pad stiffens as it is pressed together: the closer to solid rubber, the steeper.
//!
//! F = k·δ/(1 − δ/δ_l)^p; beyond 95 % of the locking depth δ_l the force goes on along its tangent, so that it is
//! finite for any depth. On a rig without a pad it is the springs that harden.
//!
//! A pad that is pressed far less than to its locking depth shows p/δ_l alone, F = k·δ·(1 + δ·p/δ_l + …): that is the strength. How
//! deep it would lock shows only near that depth.
//!
//! Source: locking-material law as used for foams and soft pads; δ_l 0.4 to 0.7 of the thickness.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "hardening",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    equation: "F = k·δ/(1 − δ/lock)^(growth·lock)",
    source: "locking law; δ_l 0.4 to 0.7 of a pad of 7 to 21 mm",
    parameters: &[
        Parameter {
            name: "growth_per_m",
            unit: "1/m",
            meaning: "relative growth of the stiffness with depth, where it begins: the law's exponent over its locking depth",
            null: Some(0.0),
            range: (0.0, 2000.0),
            plausible: (5.0, 500.0),
            typical: 125.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "lock_m",
            unit: "m",
            meaning: "depth at which the pad would be solid",
            null: None,
            range: (5e-4, 0.1),
            plausible: (0.0028, 0.015),
            typical: 0.008,
            scale: Scale::Logarithmic,
            search: Search::OfDepth,
        },
    ],
    signature: "a soft toe and a steep top; the fitted stiffness grows with the peak",
    confused_with: &["end-stop", "rate-stiffening", "clearance"],
    separated_by: "with and without the pad; no kink, unlike a stop",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly
        .contact_laws
        .push(Box::new(Locking { exponent: effect.value(0) * effect.value(1), lock_m: effect.value(1) }));
}

/// Where the tangent takes over, as a part of the locking depth.
const TANGENT_FROM: f64 = 0.95;

#[derive(Debug)]
struct Locking {
    exponent: f64,
    lock_m: f64,
}

impl ForceLaw for Locking {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        if deformation.depth_m <= 0.0 {
            return Response::default();
        }
        let part = (deformation.depth_m / self.lock_m).min(TANGENT_FROM);
        let steeper = (1.0 - part).powf(-self.exponent);
        let slope = steeper - 1.0 + part * self.exponent * steeper / (1.0 - part);
        let beyond_m = deformation.depth_m - part * self.lock_m;
        Response {
            force_n: deformation.linear_n_per_m * (part * self.lock_m * (steeper - 1.0) + slope * beyond_m),
            stiffness_n_per_m: deformation.linear_n_per_m * slope,
            ..Response::default()
        }
    }
}
