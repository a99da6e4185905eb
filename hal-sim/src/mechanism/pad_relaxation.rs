//! The pad yields slowly: a part of its force relaxes (standard linear solid).
//!
//! F = k·δ + κ·k·(δ − z), ż = (δ − z)/τ; z is the strain of the dashpot in the second branch. The instantaneous
//! stiffness is k·(1 + κ), the long-term stiffness k. After release the pad is still deep by κ·z/(1 + κ) and recovers with
//! the same branch, so that a second hit comes a little later.
//!
//! Source: Zener's standard linear solid.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "pad-relaxation",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "F = k·δ + ratio·k·(δ − z), dz/dt = (δ − z)/τ",
    source: "standard linear solid; k1/k 0.05 to 0.5, τ 5 ms to 1 s",
    parameters: &[
        Parameter {
            name: "ratio",
            unit: "1",
            meaning: "stiffness of the relaxing branch over the lasting one",
            null: Some(0.0),
            range: (0.0, 10.0),
            plausible: (0.01, 1.0),
            typical: 0.2,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "time_constant_s",
            unit: "s",
            meaning: "relaxation time",
            null: None,
            range: (1e-4, 100.0),
            plausible: (0.002, 2.0),
            typical: 0.03,
            scale: Scale::Logarithmic,
            search: Search::OfContactTime,
        },
    ],
    signature: "decay while held, to a plateau; a lower unloading; the loss is greatest where the pulse lasts about τ",
    confused_with: &["hunt-crossley-damping", "viscous-damping", "piezo-discharge", "joint-elasticity", "robot-push"],
    separated_by: "a held contact: relaxation ends at a plateau, discharge at nothing",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let branch = Branch { ratio: effect.value(0), time_constant_s: effect.value(1), at_once: 1.0 };
    assembly.contact_laws.push(Box::new(branch));
}

/// A spring and a dashpot in series.
#[derive(Clone, Debug)]
pub(super) struct Branch {
    /// Stiffness over that of the element.
    pub(super) ratio: f64,
    /// Relaxation time, s.
    pub(super) time_constant_s: f64,
    /// How much of its stiffness a sudden compression meets here: 1 where it stands beside the element's own, 0 where that holds it already.
    pub(super) at_once: f64,
}

impl ForceLaw for Branch {
    fn respond(&self, deformation: Deformation, _elastic: Response, states: &[f64]) -> Response {
        let stiffness_n_per_m = self.ratio * deformation.linear_n_per_m;
        Response {
            force_n: stiffness_n_per_m * (self.at_once * deformation.depth_m - states[0]),
            stiffness_n_per_m: self.at_once * stiffness_n_per_m,
            drift_n_per_s: -stiffness_n_per_m * (deformation.depth_m - states[0]) / self.time_constant_s,
            ..Response::default()
        }
    }

    fn is_linear(&self, _beyond_knot: bool) -> bool {
        true
    }

    fn states(&self) -> usize {
        1
    }

    fn state_rates(&self, deformation: Deformation, states: &[f64], rates: &mut [f64]) {
        rates[0] = (deformation.depth_m - states[0]) / self.time_constant_s;
    }
}
