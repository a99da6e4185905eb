//! The pad is stiffer against a faster hit.
//!
//! k(v) = k·(1 + a·ln(v/v_ref)), v the speed at first contact, to which the mean strain rate of the hit is
//! proportional, and v_ref the speed at which the rig's own stiffness holds: that of the press or the hit that told it.
//! (With a stiffness that nobody has stated, v_ref would be one number too many.)
//!
//! Some pads are better described by the rate at each instant (law 1): stiffest at first contact, softest somewhat after the robot has turned. Rubber
//! follows the rate v with a delay τ_r, dr/dt = (|v| − r)/τ_r, and a logarithm has no bottom: k·(1 + a·ln((r + r_0)/(v_ref + r_0))). To first order in
//! a the rate is that of the impact without this effect, v² = v_0²·(1 − (δ/δ_max)²). (By its own rate a pad before springs would run away on the way out: what
//! recovers faster is stiffer and recovers faster still, where τ_r < a·δ/(r + r_0).)
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
use crate::rig::{Assembly, Deformation, ForceLaw, Response, Which};

/// No pad softens below this part of its stiffness: a logarithm has no bottom.
const SOFTEST: f64 = 0.1;

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "rate-stiffening",
    group: Group::Contact,
    site: Site::Pad,
    lasting: true,
    exact: false,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[("memory_s", "law", &[0.0]), ("delay_s", "law", &[1.0]), ("slowest_m_per_s", "law", &[1.0])],
    sized: &[],
    equation: "law 0: F = k·(1 + a·ln(v/v_ref))·δ − a·k·z, dz/dt = (δ − z)/τ, v the speed at first contact; law 1: F = k·(1 + a·ln((r + r_0)/(v_ref + r_0)))·δ, dr/dt = (|v| − r)/τ_r, v that of the impact without this effect",
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
            name: "delay_s",
            unit: "s",
            meaning: "time τ_r in which the stiffness follows the rate",
            null: None,
            range: (1e-4, 0.1),
            plausible: (2e-4, 0.1),
            typical: 1e-3,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[1e-3, 1e-2]),
        },
        Parameter {
            name: "slowest_m_per_s",
            unit: "m/s",
            meaning: "rate r_0 below which it no longer counts",
            null: None,
            range: (1e-4, 1.0),
            plausible: (1e-3, 0.1),
            typical: 0.01,
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
    let which = Which::of(effect.form(6));
    if effect.form(5) == 1 {
        let law = Following {
            per_e_fold,
            reference_m_per_s: effect.value(2),
            delay_s: effect.value(3),
            slowest_m_per_s: effect.value(4),
            speed_m_per_s: speed,
            mass_kg: approach.effective_mass_kg,
        };
        assembly.obey(&law, which);
        return;
    }
    assembly.stiffen((1.0 + per_e_fold * e_folds).max(SOFTEST), which);
    // No part of it has been forgotten at first, a factor e of the speed in the end.
    assembly.obey(&Branch { ratio: per_e_fold, time_constant_s: memory_s, at_once: 0.0 }, which);
}

/// Stiffer by the rate, which it follows.
#[derive(Clone, Debug)]
struct Following {
    per_e_fold: f64,
    reference_m_per_s: f64,
    delay_s: f64,
    slowest_m_per_s: f64,
    speed_m_per_s: f64,
    mass_kg: f64,
}

impl Following {
    /// The rate that it has come to, m/s, and how fast that changes, m/s².
    fn rate(&self, deformation: Deformation, states: &[f64]) -> (f64, f64) {
        // How deep the element is pressed in by an impact without this effect.
        let deepest_m = self.speed_m_per_s * (self.mass_kg * deformation.share / deformation.linear_n_per_m).sqrt();
        let part = (deformation.depth_m / deepest_m).clamp(-1.0, 1.0);
        let followed_m_per_s = self.speed_m_per_s + states[0];
        let now_m_per_s = self.speed_m_per_s * (1.0 - part * part).sqrt();
        (followed_m_per_s, (now_m_per_s - followed_m_per_s) / self.delay_s)
    }
}

impl ForceLaw for Following {
    fn respond(&self, deformation: Deformation, elastic: Response, states: &[f64]) -> Response {
        let (rate_m_per_s, changes_m_per_s2) = self.rate(deformation, states);
        let counted = rate_m_per_s.max(0.0) + self.slowest_m_per_s;
        let factor = self.per_e_fold * (counted / (self.reference_m_per_s + self.slowest_m_per_s)).ln();
        if factor < SOFTEST - 1.0 {
            return elastic.times(SOFTEST - 1.0, 0.0);
        }
        let added = elastic.times(factor, 0.0);
        let drift_n_per_s = elastic.force_n * self.per_e_fold * changes_m_per_s2 / counted;
        Response { drift_n_per_s: added.drift_n_per_s + drift_n_per_s, ..added }
    }

    fn states(&self) -> usize {
        1
    }

    fn state_rates(&self, deformation: Deformation, states: &[f64], rates: &mut [f64]) {
        rates[0] = self.rate(deformation, states).1;
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::tests::{near, strike, strike_as};
    use crate::rig::{Approach, Quantity, Rig};

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

    /// Followed at once it is that of the robot, as it would be without the effect; followed slowly, that of first contact.
    #[test]
    fn by_the_rate_that_it_follows_it_is_softest_after_the_robot_has_turned() {
        let grown = |delay_s: f64, time_s: f64| {
            let effect = format!(
                "rate-stiffening:per_e_fold=0.05,reference_m_per_s=0.3,delay_s={delay_s},slowest_m_per_s=0.01,law=1"
            );
            let impact = strike(Rig::impact(40e3), 0.3, 6.0, &[&effect]);
            let [way_m, rate_m_per_s] =
                [Quantity::Position, Quantity::Velocity].map(|quantity| impact.sample(quantity, &[time_s])[0]);
            (impact.force_n(time_s) / (40e3 * way_m) - 1.0, 0.05 * ((rate_m_per_s.abs() + 0.01) / 0.31).ln())
        };
        for time_s in [0.003, 0.01, 0.025] {
            let (grown, by_rate) = grown(1e-4, time_s);
            near("at once", grown, by_rate, 5e-3);
        }
        near("slowly", grown(0.1, 0.003).0, 0.0, 2e-3);
        let turns_s = std::f64::consts::FRAC_PI_2 * (6.0_f64 / 40e3).sqrt();
        assert!(grown(3e-3, turns_s + 3e-3).0 < grown(3e-3, turns_s).0);
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
