//! The pad stiffens as it is pressed together: the closer to solid rubber, the steeper.
//!
//! F = k·δ/(1 − δ/δ_l)^p (law 0); beyond 95 % of the locking depth δ_l the force goes on along its tangent, so that it is
//! finite for any depth. On a rig without a pad it is the springs that harden, and with one both alike where they are one rubber, which one
//! stiffness stands for (`whole`): then δ is what both together are pressed in.
//!
//! A pad that is pressed far less than to its locking depth shows p/δ_l alone, F = k·δ·(1 + δ·p/δ_l + …): that is the strength, g. How
//! steep the lock is, and with it how deep, δ_l = p/g, shows only near that depth. (What is likely is p, a number of the law: a pad is as thick as it is.)
//!
//! A foam hardens from the first touch on; what is alike in push and pull only with the square of the depth, F = k·δ·(1 + (g·δ)²), as Duffing's spring
//! does (law 1). Round bodies harden with a power of it, F = k·δ·(δ/δ_r)^(g·δ_r), half of one between balls, the most (law 2): δ_r is where the stated stiffness
//! holds, and nothing locks.
//!
//! Source: locking-material law as used for foams and soft pads; δ_l 0.4 to 0.7 of the thickness. G. Duffing, Erzwungene Schwingungen bei
//! veränderlicher Eigenfrequenz (1918). Power law: K. L. Johnson, Contact Mechanics (1985), ch. 4.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response, Which};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "hardening",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("exponent", "law", &[0.0]), ("reference_m", "law", &[2.0])],
    sized: &[],
    equation: "F = k·δ/(1 − δ·growth/exponent)^exponent, k·δ·(1 + (growth·δ)²) or k·δ·(δ/reference)^(growth·reference)",
    source: "locking law, δ_l 0.4 to 0.7 of a pad of 7 to 21 mm; Duffing (1918); Johnson, Contact Mechanics (1985), ch. 4",
    parameters: &[
        Parameter {
            name: "growth_per_m",
            unit: "1/m",
            meaning: "relative growth of the stiffness with depth, where it begins: the law's exponent over its locking depth; of law 1, one over the depth at which it is twice as stiff",
            null: Some(0.0),
            range: (0.0, 2000.0),
            plausible: (5.0, 500.0),
            typical: 125.0,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "exponent",
            unit: "1",
            meaning: "how steeply it locks; exponent/growth is the depth at which the pad would be solid",
            null: None,
            range: (0.02, 10.0),
            plausible: (0.7, 3.0),
            typical: 1.0,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[1.0, 2.0]),
        },
        Parameter {
            name: "reference_m",
            unit: "m",
            meaning: "depth at which the stated stiffness holds",
            null: None,
            range: (5e-4, 0.1),
            plausible: (0.0028, 0.015),
            typical: 0.008,
            scale: Scale::Logarithmic,
            search: Search::OfDepth,
        },
        Parameter {
            name: "law",
            meaning: "0: it locks, 1: it stiffens with the square of the depth, 2: with a power of the depth; others are rounded",
            ..Parameter::ONE_OF_THREE
        },
        Parameter::WHOLE,
    ],
    signature: "a soft toe and a steep top; the fitted stiffness grows with the peak",
    confused_with: &["end-stop", "rate-stiffening", "clearance"],
    separated_by: "with and without the pad; no kink, unlike a stop",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let [growth_per_m, exponent, reference_m] = [0, 1, 2].map(|place| effect.value(place));
    let which = Which::of(effect.form(4));
    match effect.form(3) {
        0 => assembly.obey(&Locking { exponent, lock_m: exponent / growth_per_m, which }, which),
        1 => assembly.obey(&Duffing { growth_per_m, which }, which),
        _ => {
            let exponent = (growth_per_m * reference_m).min(BALLS);
            assembly.obey(&Power { exponent, reference_m, which }, which);
        }
    }
}

/// Where the tangent takes over, as a part of the locking depth.
const TANGENT_FROM: f64 = 0.95;

#[derive(Clone, Debug)]
struct Locking {
    exponent: f64,
    lock_m: f64,
    /// Whether that is a depth of pad and springs together.
    which: Which,
}

impl ForceLaw for Locking {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        if deformation.depth_m <= 0.0 {
            return Response::default();
        }
        let lock_m = self.lock_m / deformation.scale(self.which);
        let locked_m = deformation.depth_m.min(TANGENT_FROM * lock_m);
        let part = locked_m / lock_m;
        let steeper = (1.0 - part).powf(-self.exponent);
        let slope = steeper - 1.0 + part * self.exponent * steeper / (1.0 - part);
        let beyond_m = deformation.depth_m - locked_m;
        Response {
            force_n: deformation.linear_n_per_m * (locked_m * (steeper - 1.0) + slope * beyond_m),
            stiffness_n_per_m: deformation.linear_n_per_m * slope,
            ..Response::default()
        }
    }
}

#[derive(Clone, Debug)]
struct Duffing {
    growth_per_m: f64,
    which: Which,
}

impl ForceLaw for Duffing {
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        let stiffer = (self.growth_per_m * deformation.scale(self.which) * deformation.depth_m).powi(2);
        Response {
            force_n: deformation.linear_n_per_m * stiffer * deformation.depth_m,
            stiffness_n_per_m: 3.0 * deformation.linear_n_per_m * stiffer,
            ..Response::default()
        }
    }
}

/// No round body hardens more than a ball does.
const BALLS: f64 = 0.5;

/// Depths far below this, a rubber's roughness, are alike to a power law: at the first touch it would have no stiffness at all, m.
const SMOOTH_M: f64 = 1e-5;

#[derive(Clone, Debug)]
struct Power {
    exponent: f64,
    reference_m: f64,
    which: Which,
}

impl ForceLaw for Power {
    /// It takes from what there is: with play in the springs, less than of the linear stiffness.
    fn respond(&self, deformation: Deformation, elastic: Response, _states: &[f64]) -> Response {
        if deformation.depth_m <= 0.0 {
            return Response::default();
        }
        let scale = deformation.scale(self.which);
        let depth_m = deformation.depth_m * scale;
        let square_m2 = depth_m * depth_m + SMOOTH_M * SMOOTH_M;
        let stiffer = (square_m2.sqrt() / self.reference_m).powf(self.exponent);
        let growing_per_m = stiffer * self.exponent * depth_m / square_m2 * scale;
        elastic.times(stiffer - 1.0, growing_per_m)
    }
}
