//! The chain has an end: above it every sample has the same value.
//!
//! |y| = |F| − κ·L·ln(1 + e^((|F| − L)/(κ·L))): a converter cuts, y = max(−L, min(F, L)), as κ is next to nothing; an amplifier bends before
//! it, over some hundredths of L at most: what bends far below it is no rail but a curve of the cell. What is cut is the reading, F + b with
//! the chain's zero b, unless that has been adjusted before the rails.
//!
//! Source: rails of converter and amplifier; the smooth minimum of F and L.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "clipping",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: true,
    exact: true,
    by_configuration: &[],
    by_recording: &[],
    used_in: &[],
    sized: &[],
    equation: "|y| = |F| − κ·L·ln(1 + exp((|F| − L)/(κ·L))), which for a small κ is min(|F|, L)",
    source: "rails of amplifier and converter; a range that was set too small",
    parameters: &[
        Parameter {
            name: "limit_N",
            unit: "N",
            meaning: "largest force that passes, of either sign",
            null: Some(f64::INFINITY),
            range: (1.0, 1e5),
            plausible: (50.0, 2500.0),
            typical: 200.0,
            scale: Scale::Logarithmic,
            search: Search::OfPeak,
        },
        Parameter {
            name: "knee",
            unit: "1",
            meaning: "part of L over which it bends there: next to nothing for a converter, more for an amplifier",
            null: None,
            range: (1e-5, 0.3),
            plausible: (1e-4, 0.02),
            typical: 1e-3,
            scale: Scale::Logarithmic,
            search: Search::OneOf(&[1e-3, 0.03]),
        },
        Parameter {
            name: "zero",
            meaning: "what reaches the rails: 0 the force alone, 1 the force and the chain's zero",
            ..Parameter::EITHER
        },
    ],
    signature: "a flat top at one force, in the strongest recordings only",
    confused_with: &["force-ceiling", "end-stop"],
    separated_by: "equal samples to the last code; a force ceiling of the robot rings and depends on the pose",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Rails {
        limit_n: effect.value(0),
        knee_n: effect.value(0) * effect.value(1),
        reads_zero: effect.value(2) > 0.5,
    }));
}

/// e⁻³⁷ is less than half of the last digit of 1.
const ROUNDED: f64 = 37.0;

#[derive(Debug)]
struct Rails {
    limit_n: f64,
    knee_n: f64,
    reads_zero: bool,
}

impl Stage for Rails {
    fn reads_zero(&self) -> bool {
        self.reads_zero
    }

    fn apply(&self, _times_s: &[f64], signal_n: &mut [f64]) {
        if !self.limit_n.is_finite() {
            return;
        }
        for signal in signal_n {
            let over = (signal.abs() - self.limit_n) / self.knee_n;
            // ln(1 + e^x) without an overflow; where its second part is lost in rounding, underflow takes long.
            let soft = if over.abs() < ROUNDED { (-over.abs()).exp().ln_1p() } else { 0.0 };
            let cut_n = self.knee_n * (over.max(0.0) + soft);
            *signal = signal.signum() * (signal.abs() - cut_n).max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converter_cuts_and_an_amplifier_bends() {
        let passed = |knee: f64| {
            let mut signal = vec![-500.0, 0.0, 50.0, 99.0, 100.0, 101.0, 300.0];
            Rails { limit_n: 100.0, knee_n: 100.0 * knee, reads_zero: false }.apply(&[], &mut signal);
            signal
        };
        let near = |a: &[f64], b: &[f64], free: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < free);
        assert!(near(&passed(1e-5), &[-100.0, 0.0, 50.0, 99.0, 100.0, 100.0, 100.0], 1e-3));
        let bent = passed(0.03);
        assert!(near(&bent[..3], &[-100.0, 0.0, 50.0], 1e-4) && (bent[4] - (100.0 - 3.0 * 2.0_f64.ln())).abs() < 1e-9);
    }

    #[test]
    fn a_zero_reaches_the_rails_where_it_has_not_been_adjusted_before() {
        let cut = |zero: &str| {
            let impact = crate::mechanism::tests::strike(
                crate::rig::Rig::impact(25e3),
                0.2,
                6.0,
                &[&format!("clipping:limit_N=50,knee=1e-5,zero={zero}")],
            );
            let mut signal = vec![-80.0, 0.0, 46.0, 80.0];
            impact.apply_chain(&[0.0, 0.001, 0.002, 0.003], 5.0, &mut signal);
            signal
        };
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-2);
        assert!(near(&cut("0"), &[-50.0, 0.0, 46.0, 50.0]), "{:?}", cut("0"));
        assert!(near(&cut("1"), &[-55.0, 0.0, 45.0, 45.0]), "{:?}", cut("1"));
    }
}
