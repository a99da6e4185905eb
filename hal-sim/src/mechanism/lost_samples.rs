//! The log has lost a run of samples, or several: it has closed the gap, so that what came later stands too early, or filled it with the last
//! value or with nought.
//!
//! y(t) = F(t) before t_j, F(t + T) from there on, t counted from the first contact; the logger's time is the number
//! of the sample over the rate, so that T is the lost samples over the rate, and the last sample shows what happened T later. Where the gap is
//! `filled`, y(t) = F(t_j) or 0 for t_j ≤ t < t_j + T and F(t) again after that. Where it happens is each impact's own. A sample stands for the time around it, half of the way to its
//! neighbours: where an edge falls into that it is a mixture, and y a continuous function of t_j and T. A logger loses blocks, so that the second and
//! third gap of a recording are as long as its first; each closes or fills what those before it have left, F being that. (Lost samples whose places stayed
//! empty are uneven sampling, which is seen without a model.)
//!
//! Source: dropped blocks of streaming loggers, whose readers count samples or repeat the last one.

use super::{Effect, Group, Mechanism, Parameter, Scale, Search, Site};
use crate::rig::{Assembly, Stage};

pub(super) static MECHANISM: Mechanism = Mechanism {
    id: "lost-samples",
    group: Group::Measuring,
    site: Site::Chain,
    lasting: false,
    exact: false,
    by_configuration: &[],
    by_recording: &["lost_s"],
    used_in: &[],
    sized: &[],
    equation: "y(t) = F(t) for t < t_j, F(t + T) for t ≥ t_j; where the gap is filled F(t_j) or 0 for t_j ≤ t < t_j + T only; again at each further gap",
    source: "dropped blocks of a streaming logger, whose time is a count of samples, which repeats the last one or reads a cleared buffer",
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
        Parameter { name: "at_s", meaning: "where, after the first contact", ..INSTANT },
        Parameter {
            name: "filled",
            meaning: "what became of the gap: 0 closed, 1 filled with the last value, 2 with nought",
            ..Parameter::ONE_OF_THREE
        },
        Parameter { name: "second_s", meaning: "where a second time, as much; at 10 s nowhere", ..AGAIN },
        Parameter { name: "third_s", meaning: "where a third time, as much; at 10 s nowhere", ..AGAIN },
    ],
    signature: "a jump between two samples in proportion to the slope there; nothing before, a shift afterwards, or a step that ends in a jump",
    confused_with: &["stiction", "collision-reaction"],
    separated_by: "the logger's own counters; the jump is one sample long, and the impulse falls short",
    enter,
};

const INSTANT: Parameter = Parameter {
    name: "",
    unit: "s",
    meaning: "",
    null: None,
    range: (-1.0, 10.0),
    plausible: (0.0, 0.1),
    typical: 0.015,
    scale: Scale::Linear,
    search: Search::EachInstant,
};

const AGAIN: Parameter = Parameter { typical: INSTANT.range.1, search: Search::Again, ..INSTANT };

fn enter(effect: &Effect, assembly: &mut Assembly) {
    assembly.log.extend(gaps(effect));
}

fn gaps(effect: &Effect) -> Vec<Box<dyn Stage>> {
    let (lasts_s, filled) = (effect.value(0), effect.value(2));
    let there = [1, 3, 4].into_iter().filter(|place| effect.takes_part(*place));
    let mut instants_s: Vec<f64> = there.map(|place| effect.value(place)).collect();
    // Each is an instant of the log: what an earlier gap has moved is moved already.
    instants_s.sort_by(f64::total_cmp);
    let gap = |from_s| -> Box<dyn Stage> {
        let gap = Gap { from_s, lasts_s };
        if filled > 0.5 { Box::new(Filled { gap, repeats: filled < 1.5 }) } else { Box::new(Closed(gap)) }
    };
    instants_s.into_iter().map(gap).collect()
}

/// What was lost.
#[derive(Clone, Copy, Debug)]
struct Gap {
    from_s: f64,
    lasts_s: f64,
}

#[derive(Debug)]
struct Closed(Gap);

#[derive(Debug)]
struct Filled {
    gap: Gap,
    /// Whether with the last value; else with nought.
    repeats: bool,
}

impl Stage for Closed {
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let Self(Gap { from_s, lasts_s }) = *self;
        let original = signal_n.to_vec();
        let mut next = 0;
        for (place, signal) in signal_n.iter_mut().enumerate().skip(first_touched(times_s, from_s)) {
            let (low_s, high_s) = around(times_s, place);
            let after = ((high_s - from_s) / (high_s - low_s)).clamp(0.0, 1.0);
            let later_s = times_s[place] + lasts_s;
            // Times rise: what was behind stays behind.
            next += times_s[next..].iter().take_while(|time_s| **time_s <= later_s).count();
            let later = ahead_of(next, times_s, &original, later_s);
            *signal += after * (later - original[place]);
        }
    }

    fn ahead_s(&self) -> f64 {
        self.0.lasts_s
    }
}

impl Stage for Filled {
    fn apply(&self, times_s: &[f64], signal_n: &mut [f64]) {
        let Self { gap: Gap { from_s, lasts_s }, repeats } = *self;
        let until_s = from_s + lasts_s;
        let original = signal_n.to_vec();
        let filling = if repeats { between(times_s, &original, from_s) } else { 0.0 };
        for (place, signal) in signal_n.iter_mut().enumerate().skip(first_touched(times_s, from_s)) {
            let (low_s, high_s) = around(times_s, place);
            if low_s >= until_s {
                break;
            }
            let (from_s, until_s) = (low_s.max(from_s), high_s.min(until_s));
            let part = ((until_s - from_s) / (high_s - low_s)).max(0.0);
            *signal += part * (filling - between(times_s, &original, 0.5 * (from_s + until_s)));
        }
    }
}

/// The first sample whose time reaches beyond an instant.
fn first_touched(times_s: &[f64], from_s: f64) -> usize {
    times_s.partition_point(|time_s| *time_s < from_s).saturating_sub(1)
}

/// The time that a sample stands for: half of the way to its neighbours.
fn around(times_s: &[f64], place: usize) -> (f64, f64) {
    let time_s = times_s[place];
    let before_s = place.checked_sub(1).map(|place| 0.5 * (time_s - times_s[place]));
    let after_s = times_s.get(place + 1).map(|next_s| 0.5 * (next_s - time_s));
    let (before_s, after_s) = (before_s.or(after_s).unwrap_or(1.0), after_s.or(before_s).unwrap_or(1.0));
    (time_s - before_s, time_s + after_s)
}

/// The signal at any instant: straight between samples, held beyond them.
fn between(times_s: &[f64], signal_n: &[f64], at_s: f64) -> f64 {
    ahead_of(times_s.partition_point(|time_s| *time_s <= at_s), times_s, signal_n, at_s)
}

/// The same, given the number of the next sample.
fn ahead_of(next: usize, times_s: &[f64], signal_n: &[f64], at_s: f64) -> f64 {
    match (next.checked_sub(1), signal_n.get(next)) {
        (Some(last), Some(value_n)) => {
            let part = (at_s - times_s[last]) / (times_s[next] - times_s[last]);
            signal_n[last] + part * (value_n - signal_n[last])
        }
        (Some(last), None) => signal_n[last],
        (None, first) => first.copied().unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..200).map(|index| f64::from(index) * 1e-3).collect();
        let signal = times.iter().map(|time| 5.0 * time).collect();
        (times, signal)
    }

    /// The gap lies between two samples.
    #[test]
    fn what_came_later_stands_early_and_what_came_before_stays() {
        let (times, mut signal) = ramp();
        Closed(Gap { from_s: 0.0495, lasts_s: 0.0125 }).apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            let shifted = if *time < 0.0495 { *time } else { (time + 0.0125).min(0.199) };
            assert!((value - 5.0 * shifted).abs() < 1e-12, "{time} s: {value}");
        }
    }

    #[test]
    fn a_gap_that_is_filled_is_over_when_it_is_over() {
        let (times, mut signal) = ramp();
        Filled { gap: Gap { from_s: 0.05, lasts_s: 0.0125 }, repeats: true }.apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            let held = if (0.0505..0.0625).contains(time) { 0.05 } else { *time };
            // The last sample before the gap is held for half of the time that it stands for.
            let mixed = if (time - 0.05).abs() < 1e-9 { 7e-4 } else { 1e-12 };
            assert!((value - 5.0 * held).abs() < mixed, "{time} s: {value}");
        }
    }

    #[test]
    fn a_cleared_buffer_reads_nought() {
        let (times, mut signal) = ramp();
        Filled { gap: Gap { from_s: 0.0495, lasts_s: 0.0125 }, repeats: false }.apply(&times, &mut signal);
        for (time, value) in times.iter().zip(signal) {
            // Of the last one half is lost.
            let kept = if (0.0495..0.0615).contains(time) { 0.0 } else { 1.0 };
            let mixed = if (time - 0.062).abs() < 1e-9 { 0.2 } else { 1e-12 };
            assert!((value - 5.0 * time * kept).abs() < mixed, "{time} s: {value}");
        }
    }

    /// In whichever order they are given.
    #[test]
    fn what_is_lost_three_times_is_three_times_early() {
        let (times, signal) = ramp();
        for text in ["at_s=0.05,second_s=0.1,third_s=0.13", "at_s=0.13,second_s=0.05,third_s=0.1"] {
            let effect: Effect = format!("lost-samples:lost_s=0.01,{text}").parse().unwrap();
            let mut shown = signal.clone();
            gaps(&effect).iter().for_each(|stage| stage.apply(&times, &mut shown));
            for (time, value) in times.iter().zip(shown) {
                let before = [0.05, 0.1, 0.13].iter().filter(|at_s| **at_s < *time - 1e-9).count() as f64;
                let is_edge = [0.05, 0.1, 0.13].iter().any(|at_s| (at_s - time).abs() < 1.1e-3);
                let expected = 5.0 * (time + 0.01 * before).min(0.199);
                assert!(is_edge || (value - expected).abs() < 1e-9, "{time} s: {value} instead of {expected}");
            }
        }
    }

    /// Whatever becomes of the gap, a little later or longer changes it a little.
    #[test]
    fn a_gap_moves_smoothly() {
        let (times, signal) = ramp();
        let shown = |stage: &dyn Stage| {
            let mut shown = signal.clone();
            stage.apply(&times, &mut shown);
            shown
        };
        let change = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        for part in 0..50 {
            let gap = Gap { from_s: 0.05 + 1e-4 * f64::from(part), lasts_s: 0.0125 };
            for other in [Gap { from_s: gap.from_s + 1e-6, ..gap }, Gap { lasts_s: gap.lasts_s + 1e-6, ..gap }] {
                assert!(change(shown(&Closed(gap)), shown(&Closed(other))) < 2e-4);
                for repeats in [true, false] {
                    let filled = |gap| shown(&Filled { gap, repeats });
                    assert!(change(filled(gap), filled(other)) < 1e-3);
                }
            }
        }
    }
}
