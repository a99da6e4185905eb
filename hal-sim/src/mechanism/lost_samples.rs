//! The log has lost a run of samples and closed the gap: what came later stands too early.
//!
//! y(t) = F(t) before t_j, F(t + T) from there on, t counted from the first contact; the logger's time is the number
//! of the sample over the rate, so that T is the lost samples over the rate. Where it happens is each impact's own. (Lost samples whose places stayed empty are uneven
//! sampling, and those that were filled with the last value are equal to the bit: both are seen without a model.)
//!
//! Source: dropped blocks of streaming loggers; after the last sample its value is held.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "lost-samples",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: false,
    equation: "y(t) = F(t) for t < t_j, F(t + T) for t ≥ t_j",
    source: "dropped blocks of a streaming logger, whose time is a count of samples",
    parameters: &[
        Parameter {
            name: "lost_s",
            unit: "s",
            meaning: "length T of what was lost: number of samples over the rate",
            null: Some(0.0),
            range: (0.0, 0.2),
            plausible: (1e-4, 0.01),
            typical: 0.001,
            scale: Scale::Logarithmic,
            search: Search::Strength,
        },
        Parameter {
            name: "at_s",
            unit: "s",
            meaning: "where, after the first contact",
            null: None,
            range: (-1.0, 10.0),
            plausible: (0.0, 0.1),
            typical: 0.015,
            scale: Scale::Linear,
            search: Search::EachInstant,
        },
    ],
    signature: "a jump between two samples in proportion to the slope there; nothing before, a shift afterwards",
    confused_with: &["stiction", "collision-reaction"],
    separated_by: "the logger's own counters; the jump is one sample long, and the impulse falls short",
    enter,
};

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.chain.push(Box::new(Loss { lost_s: effect.value(0), at_s: effect.value(1) }));
}

#[derive(Debug)]
struct Loss {
    lost_s: f64,
    at_s: f64,
}

impl Stage for Loss {
    /// Straight between samples where T is no whole number of them.
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let first = times_s.partition_point(|time_s| *time_s < self.at_s);
        let mut later = first;
        for place in first..times_s.len() {
            let wanted_s = times_s[place] + self.lost_s;
            while later + 1 < times_s.len() && times_s[later + 1] <= wanted_s {
                later += 1;
            }
            // `later` is never before `place`, so that what is read has not been written yet.
            signal_n[place] = match times_s.get(later + 1) {
                Some(next_s) => {
                    let part = (wanted_s - times_s[later]) / (next_s - times_s[later]);
                    signal_n[later] + part * (signal_n[later + 1] - signal_n[later])
                }
                None => signal_n[later],
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_later_stands_early_and_what_came_before_stays() {
        let times: Vec<f64> = (0..200).map(|index| f64::from(index) * 1e-3).collect();
        let mut signal: Vec<f64> = times.iter().map(|time| 5.0 * time).collect();
        Loss { lost_s: 0.0125, at_s: 0.05 }.apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            let shifted = if *time < 0.05 { *time } else { (time + 0.0125).min(0.199) };
            assert!((value - 5.0 * shifted).abs() < 1e-12, "{time} s: {value}");
        }
    }
}
