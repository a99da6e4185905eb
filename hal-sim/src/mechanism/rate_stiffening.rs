//! The pad is stiffer against a faster hit.
//!
//! k(v) = k·(1 + a·ln(v/v_ref)), v the speed at first contact, to which the mean strain rate of the hit is
//! proportional, and v_ref the speed at which the rig's own stiffness holds: that of the press or the hit that told it.
//! (With a stiffness that nobody has stated, v_ref would be one number too many.)
//!
//! Some pads are better described by the rate at each instant (law 1), softest where the robot turns. To first order in a the rate is that
//! of the impact without this effect, v² = v_0²·(1 − (δ/δ_max)²), so that the law is one of depth and equally stiff on the way out. A
//! logarithm has no bottom, and a force that falls faster with depth than it grows cannot be balanced behind a spring: with v² + 2a·v_0² for
//! v² it never does.
//!
//! What stiffens with the logarithm of the rate softens with that of time: a rubber that is a stiffer for e times the speed is
//! a softer again once it has forgotten a factor e of it, after τ. F = k(v)·δ − a·k·z, ż = (δ − z)/τ; an impact that lasts t_c, short
//! beside τ, loses a·t_c/τ of its energy. On a rig without a pad it is the springs' stiffness that grows, and with one that of both where
//! they are one rubber, which one stiffness stands for (`whole`).
//!
//! Source: logarithmic rate law of rubber and foam in drop tests; a 0.02 to 0.1 per factor e. Equivalence of rate and time in
//! relaxation: J. D. Ferry, Viscoelastic Properties of Polymers (1980), ch. 3.

use super::pad_relaxation::Branch;
use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Deformation, ForceLaw, Response};

/// No pad softens below this part of its stiffness: a logarithm has no bottom.
const SOFTEST: f64 = 0.1;

/// Nor below this by the rate at each instant, which takes up to half of the stiffness from the force's slope where the robot turns: a force that
/// falls with depth has no balance behind a spring.
const SOFTEST_AT_ONCE: f64 = SOFTEST + 0.5;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "rate-stiffening",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("memory_s", "law", &[0.0])],
    sized: &[],
    equation: "law 0: F = k·(1 + a·ln(v/v_ref))·δ − a·k·z, dz/dt = (δ − z)/τ, v the speed at first contact; law 1: the rate at each instant for v, and no z",
    source: "logarithmic rate law of rubber; a 0.02 to 0.1",
    parameters: &[
        Parameter {
            name: "per_e_fold",
            unit: "1",
            meaning: "relative gain in stiffness for e times the speed",
            null: Some(0.0),
            range: (0.0, 0.6),
            plausible: (0.002, 0.15),
            typical: 0.05,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "memory_s",
            unit: "s",
            meaning: "time in which the pad forgets a factor e of the speed",
            null: None,
            range: (1e-2, 1e3),
            plausible: (0.03, 30.0),
            typical: 1.0,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "reference_m_per_s",
            unit: "m/s",
            meaning: "speed v_ref at which the stated stiffness holds",
            null: None,
            range: (1e-3, 20.0),
            plausible: (0.05, 0.8),
            typical: 0.2,
            scale: Scale::Logarithmic,
            search: Search::Typical,
        },
        Parameter {
            name: "law",
            meaning: "0: the speed at first contact counts, 1: the rate at each instant; others are rounded",
            ..Parameter::EITHER
        },
        Parameter::WHOLE,
    ],
    signature: "the fitted stiffness grows with the logarithm of the speed; each pulse loses little",
    confused_with: &["hardening", "joint-elasticity", "mullins-softening"],
    separated_by: "another mass at the same speed changes the peak and with it hardening, but not this; the pad alone in a press",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    let approach = assembly.approach;
    let speed = approach.hits_m_per_s();
    let (per_e_fold, memory_s) = (effect.value(0), effect.value(1));
    let e_folds = (speed / effect.value(2)).ln();
    let whole = effect.form(4) == 1;
    if effect.form(3) == 1 {
        let mass_kg = approach.effective_mass_kg;
        assembly.obey(&Instantaneous { per_e_fold, e_folds, speed_m_per_s: speed, mass_kg }, whole);
        return;
    }
    assembly.stiffen((1.0 + per_e_fold * e_folds).max(SOFTEST), whole);
    // No part of it has been forgotten at first, a factor e of the speed in the end.
    assembly.obey(&Branch { ratio: per_e_fold, time_constant_s: memory_s, at_once: 0.0 }, whole);
}

/// Stiffer by the rate at each instant.
#[derive(Clone, Debug)]
struct Instantaneous {
    per_e_fold: f64,
    /// Of the speed at first contact over the reference.
    e_folds: f64,
    speed_m_per_s: f64,
    mass_kg: f64,
}

impl ForceLaw for Instantaneous {
    /// It takes from what there is: with play in the springs, less than of the linear stiffness.
    fn respond(&self, deformation: Deformation, elastic: Response, _states: &[f64]) -> Response {
        let stiffness = deformation.linear_n_per_m;
        // How deep the element is pressed in by an impact without this effect.
        let deepest_m = self.speed_m_per_s * (self.mass_kg * deformation.share / stiffness).sqrt();
        let part = (deformation.depth_m / deepest_m).clamp(-1.0, 1.0);
        // The square of the rate over that at first contact, with what keeps a logarithm from having no bottom.
        let square = 1.0 - part * part + 2.0 * self.per_e_fold.abs();
        let factor = self.per_e_fold * (self.e_folds + 0.5 * square.ln());
        if factor < SOFTEST_AT_ONCE - 1.0 {
            return elastic.times(SOFTEST_AT_ONCE - 1.0, 0.0);
        }
        let falling_per_m = if part.abs() < 1.0 { self.per_e_fold * part / (square * deepest_m) } else { 0.0 };
        elastic.times(factor, -falling_per_m)
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike, strike_as};
    use crate::rig::{Approach, Rig};

    /// Every impact is an ideal one whose stiffness is that of its speed.
    #[test]
    fn the_stiffness_grows_by_the_same_part_for_every_doubling_of_the_speed() {
        let stiffness = |speed: f64| {
            let peak = strike(Rig::impact(40e3), speed, 6.0, &["rate-stiffening:per_e_fold=0.06,memory_s=1000"])
                .truth()
                .peak_n;
            (peak / speed).powi(2) / 6.0
        };
        for speed in [0.05, 0.2, 0.6] {
            near("stiffness", stiffness(speed), 40e3 * (1.0 + 0.06 * (speed / 0.2_f64).ln()), 0.1);
        }
        near("doubling", stiffness(0.4) - stiffness(0.2), stiffness(0.2) - stiffness(0.1), 0.2);
        // With a pad it is the pad's.
        let padded =
            strike(Rig::impact(25e3).with_pad(80e3), 0.6, 6.0, &["rate-stiffening:per_e_fold=0.06,memory_s=1000"]);
        let pad = 80e3 * (1.0 + 0.06 * 3.0_f64.ln());
        let ideal = 0.6 * (6.0 * Rig::impact(25e3).with_pad(pad).effective_stiffness_n_per_m()).sqrt();
        near("padded", padded.truth().peak_n, ideal, 1e-6 * ideal);
        let slow = strike_as(Rig::impact(40e3), Approach::new(1e-4, 6.0), &["rate-stiffening:per_e_fold=0.25"]);
        assert!(slow.truth().peak_n > 0.0);
    }

    /// Where the robot is fast the pad is as stiff as at first contact; where it turns, a·ln √(2a) less. It gives back what it took.
    #[test]
    fn by_the_rate_at_each_instant_it_is_softest_where_the_robot_turns() {
        for (stiffness, rig) in [(40e3, Rig::impact(40e3)), (20e3, Rig::impact(40e3).with_pad(40e3))] {
            let impact = strike(rig, 0.3, 6.0, &["rate-stiffening:per_e_fold=0.02,reference_m_per_s=0.3,law=1"]);
            let contact = impact.truth().contacts[0];
            near("gives back", contact.speed_after_m_per_s, -0.3, 1e-6);
            let top = 1.0 + 0.5 * 0.02 * 0.04_f64.ln();
            let share = stiffness / 40e3;
            // The top is reached a little deeper than without the effect, where nothing changes further.
            let soft = contact.peak_n / contact.stroke_m / 40e3;
            if share == 1.0 {
                near("top", soft, top, 2e-3);
            } else {
                near("the springs stay", soft, 1.0, 1e-6);
            }
            let early = impact.force_n(0.002) / (stiffness * 0.3 * 0.002);
            near("early", early, 1.0, 0.01);
        }
    }

    /// To first order: of the energy a·t_c/τ is lost, half of that of the speed.
    #[test]
    fn what_the_pad_forgets_is_lost() {
        for (stiffness, rig) in [(40e3, Rig::impact(40e3)), (20e3, Rig::impact(40e3).with_pad(40e3))] {
            let effect = "rate-stiffening:per_e_fold=0.05,memory_s=0.5,reference_m_per_s=0.3";
            let contact = strike(rig, 0.3, 6.0, &[effect]).truth().contacts[0];
            let lasts_s = std::f64::consts::PI * (6.0_f64 / stiffness).sqrt();
            // Half of what bends is the pad where there are springs behind it.
            let share = stiffness / 40e3;
            near("speed after", contact.speed_after_m_per_s, -0.3 * (1.0 - share * 0.05 * lasts_s / 0.5 / 2.0), 2e-5);
        }
    }
}
