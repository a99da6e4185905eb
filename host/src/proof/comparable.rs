//! Which parameters of the concealing simulator mean the same as the tool's, and how the one is reckoned from the other.
//!
//! The two simulators share no equations, so that most shapes have no common number: a spectrum of relaxation has not one time
//! constant. Where both have the quantity, its error and the coverage of its interval are scored; where not, [`NOT`] says why.

use super::hidden::Hidden;

/// The tool's parameter that has a true value.
pub struct Comparable {
    /// Mechanism.
    pub mechanism: &'static str,
    /// Its parameter as the tool names it.
    pub parameter: &'static str,
    /// How the true value comes from the concealing parameters, in words.
    pub from: &'static str,
    truth: Truth,
}

/// The true value from the concealing parameters, which are asked by name.
type Truth = fn(&dyn Fn(&str) -> Option<f64>) -> Option<f64>;

const fn same(mechanism: &'static str, parameter: &'static str, from: &'static str, truth: Truth) -> Comparable {
    Comparable { mechanism, parameter, from, truth }
}

/// Everything that can be compared.
pub const ALL: &[Comparable] = &[
    same("hunt-crossley-damping", "alpha_s_per_m", "alpha, the same law", |of| of("alpha")),
    same("viscous-damping", "damping_Ns_per_m", "damping, the same dashpot", |of| of("damping")),
    same("rate-stiffening", "per_e_fold", "growth, the same law about its own reference", |of| of("growth")),
    same("mullins-softening", "excess", "softening, the same law", |of| of("softening")),
    same("mullins-softening", "hits", "hits, the same law", |of| of("hits")),
    same("hardening", "growth_per_m", "exponent over lock_stroke, the first power of the same law", |of| {
        Some(of("exponent")? / of("lock_stroke")?)
    }),
    same("end-stop", "stroke_m", "stroke + half of soft_range, where the stop's straight part meets the axis", |of| {
        Some(of("stroke")? + 0.5 * of("soft_range")?)
    }),
    same("clearance", "gap_m", "gap, the same law", |of| of("gap")),
    same("clearance", "share", "loose_share, the same law", |of| of("loose_share")),
    same("adhesion", "pull_off_N", "pull_off", |of| of("pull_off")),
    same("air-damping", "drag_Ns2_per_m2", "quadratic_damping, the same law", |of| of("quadratic_damping")),
    same("guide-friction", "force_N", "force, reached some micrometres after the reversal", |of| of("force")),
    same("load-dependent-friction", "coefficient", "share of the contact force", |of| of("share")),
    same("stiction", "force_N", "sliding_force", |of| of("sliding_force")),
    same("moving-piece-inertia", "mass_kg", "mass", |of| of("mass")),
    same("frame-compliance", "compliance_m_per_N", "1/stiffness", |of| Some(1.0 / of("stiffness")?)),
    same("joint-elasticity", "link_fraction", "share", |of| of("share")),
    same("joint-elasticity", "frequency_Hz", "frequency of the two masses against each other", |of| of("frequency")),
    same("link-oscillation", "amplitude_m_per_s", "2π·frequency·amplitude", |of| {
        Some(std::f64::consts::TAU * of("frequency")? * of("amplitude")?)
    }),
    same("link-oscillation", "frequency_Hz", "frequency", |of| of("frequency")),
    same("collision-reaction", "force_N", "force, reached with the same law", |of| of("force")),
    same("collision-reaction", "threshold_N", "threshold", |of| of("threshold")),
    same("pose-dependent-mass", "relative", "mass_ratio − 1", |of| Some(of("mass_ratio")? - 1.0)),
    same("speed-error", "relative", "relative_error", |of| of("relative_error")),
    same("piezo-discharge", "time_constant_s", "time_constant", |of| of("time_constant")),
    same("charge-drift", "rate_N_per_s", "slope", |of| of("slope")),
    same("filter-lag", "corner_Hz", "corner of the two-pole Butterworth filter", |of| of("corner")),
    same("mains-hum", "amplitude_N", "amplitude of the first harmonic", |of| of("amplitude")),
    same("mains-hum", "frequency_Hz", "frequency", |of| of("frequency")),
    same("gain-error", "relative", "gain − 1", |of| Some(of("gain")? - 1.0)),
];

/// What cannot be compared, and why.
pub const NOT: &[(&str, &str)] = &[
    (
        "pad-relaxation",
        "three branches there, one here: neither ratio nor time constant of a spectrum is a single number",
    ),
    (
        "robot-push",
        "a position servo that saturates there, a rise of first order here: the plateau need not be reached",
    ),
    ("force-ceiling", "the force on the pad is held there, the force in the arm here; the tip's inertia lies between"),
    (
        "collision-reaction: delay and rise",
        "the same law, but what comes later and at once looks like what comes sooner and grows",
    ),
    ("clipping", "the level counts from the converter's zero there, from the zero of the force here, up to 1 N apart"),
    ("lost-samples", "gaps of different sizes in some recordings there, one size here"),
    ("air-drag", "each ball has a drag of its own there"),
    ("end-stop: stiffness, stiction: ratio", "the soft stop and the Stribeck curve smooth just what they describe"),
    ("damping ratios and frame masses", "weakly determined; the rigs' dampers do not sit at the same places"),
];

impl Comparable {
    /// The true value in a case, where its effect is hidden there.
    #[must_use]
    pub fn truth(&self, hidden: &Hidden) -> Option<f64> {
        let effect = hidden.effects.iter().find(|effect| effect.id == self.mechanism)?;
        (self.truth)(&|name| effect.value(name)).filter(|value| value.is_finite() && *value != 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every mechanism and parameter of the table is one of the tool's, and every mechanism is in the table or in the reasons.
    #[test]
    fn the_table_speaks_of_what_there_is() {
        for one in ALL {
            let mechanism = thud_sim::mechanism::Mechanism::find(one.mechanism).unwrap();
            assert!(
                mechanism.parameters.iter().any(|p| p.name == one.parameter),
                "{} {}",
                one.mechanism,
                one.parameter
            );
        }
        for mechanism in thud_sim::mechanism::LIST {
            let said =
                ALL.iter().any(|one| one.mechanism == mechanism.id) || NOT.iter().any(|(id, _)| *id == mechanism.id);
            assert!(said, "{}", mechanism.id);
        }
    }
}
