//! A part of the springs has play: it bears only when a gap has been closed.
//!
//! F = (1 − s)·k·x + s·k·⟨x − g⟩, ⟨·⟩ the positive part, x the stroke, s the part of the stiffness behind the gap. Springs
//! of a set whose lengths differ bear one after the other: of K = 3a + b it is 3a/K or b/K. With s near 1 all of the rig
//! is behind the gap, and there is next to no force and then a knee; such a gap is only a delay in force over time, which
//! the unknown instant of contact hides, and is seen in force over displacement.
//!
//! Source: springs in parallel with unequal play; 0.05 to 0.5 mm.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "clearance",
    group: Group::Contact,
    site: Site::Spring,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &["gap_m"],
    equation: "F = (1 − share)·k·x + share·k·max(x − g, 0), x the stroke of the body springs",
    source: "springs in parallel with unequal play; 0.05 to 0.5 mm",
    parameters: &[
        Parameter {
            name: "gap_m",
            unit: "m",
            meaning: "the play g",
            null: Some(0.0),
            range: (0.0, 0.02),
            plausible: (2e-5, 1e-3),
            typical: 2e-4,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "share",
            unit: "1",
            meaning: "part of the springs' stiffness that has play",
            null: None,
            range: (0.0, 0.98),
            plausible: (0.1, 0.98),
            typical: 0.75,
            scale: Scale::Linear,
            search: Search::Plausible,
        },
    ],
    signature: "a soft foot of the force that ends with a knee at one stroke, at the begin and at the end of every pulse",
    confused_with: &["hardening", "filter-lag", "stiction"],
    separated_by: "a preload removes it; the knee is at the same stroke whatever the speed",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let spring = &mut assembly.spring;
    let share = effect.value(1) * spring.without_play;
    spring.without_play -= share;
    spring.laws.push(Box::new(Play { gap_m: effect.value(0), share }));
}

#[derive(Debug)]
struct Play {
    gap_m: f64,
    share: f64,
}

impl ForceLaw for Play {
    /// What the part with play does not bear: nothing of it below the gap, in tension (a ringing piece) neither.
    fn respond(&self, deformation: Deformation, _elastic: Response, _states: &[f64]) -> Response {
        let missing_n_per_m = self.share * deformation.linear_n_per_m;
        if deformation.beyond_knot {
            return Response { force_n: -missing_n_per_m * self.gap_m, ..Response::default() };
        }
        Response {
            force_n: -missing_n_per_m * deformation.depth_m,
            stiffness_n_per_m: -missing_n_per_m,
            ..Response::default()
        }
    }

    fn is_linear(&self, _beyond_knot: bool) -> bool {
        true
    }

    fn knot_m(&self, _share: f64) -> Option<f64> {
        Some(self.gap_m)
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike};
    use crate::rig::Rig;

    /// ½mv² = ½k·x² − s·k·g·(x − g) − ½s·k·g²; the way through the gap is a sine of the softer spring.
    #[test]
    fn the_knee_is_where_the_gap_closes_and_no_energy_is_lost() {
        let (k, mass, speed, gap, share) = (25e3_f64, 6.0, 0.25, 1e-3, 0.6);
        let effect = "clearance:gap_m=0.001,share=0.6";
        let contact = strike(Rig::impact(k), speed, mass, &[effect]).truth().contacts[0];
        let top = contact.stroke_m;
        let stored = 0.5 * k * top * top - share * k * gap * (top - gap) - 0.5 * share * k * gap * gap;
        near("energy", stored, 0.5 * mass * speed * speed, 1e-8);
        near("peak", contact.peak_n, k * top - share * k * gap, 1e-5);
        near("speed after", contact.speed_after_m_per_s, -speed, 1e-7);
        let soft = (k * (1.0 - share) / mass).sqrt();
        let closes_s = (gap * soft / speed).asin() / soft;
        let impact = strike(Rig::impact(k), speed, mass, &[effect]);
        near(
            "before the knee",
            impact.force_n(0.9 * closes_s),
            k * 0.4 * speed / soft * (soft * 0.9 * closes_s).sin(),
            1e-6,
        );
        let slope = |from: f64| (impact.force_n(from + 1e-6) - impact.force_n(from)) / 1e-6;
        near("knee", slope(closes_s + 1e-6) / slope(closes_s - 2e-6), 1.0 / (1.0 - share), 0.01);
    }

    /// All of the rig behind the gap is a rig that is hit later, by gap over speed.
    #[test]
    fn a_gap_before_everything_is_a_delay() {
        let rig = Rig::impact(25e3);
        let late = strike(rig, 0.25, 6.0, &["clearance:gap_m=0.0005,share=0.98"]);
        let ideal = strike(rig, 0.25, 6.0, &[]);
        near("peak", late.truth().peak_n, ideal.truth().peak_n, 0.5);
        near("instant", late.truth().peak_s, ideal.truth().peak_s + 0.0005 / 0.25, 1e-4);
    }
}
