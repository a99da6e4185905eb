//! What the simulation says a recording should show, for given coordinates.

use std::borrow::Cow;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;

use statrs::function::erf::erfc;
use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Kink, Quantity, Rig, RigError};

use super::layout::{Coordinate, Layout, Point, Role};
use super::problem::{ChannelModel, Prepared, Problem};
use crate::model;

/// As exact as the thinnest noise needs: a finite difference of 10⁻³ sees errors of 10⁻⁴ of the effect.
pub const ACCURACY: Accuracy = Accuracy { relative: 1e-7, force_n: 1e-5 };

/// From where, in deviations of the converter's filter, a jump and a bend are extrapolated.
const KINK_REACH: f64 = 0.05;
/// Beyond so many deviations a Gaussian leaves nothing: 10⁻⁹ of a jump.
const FARTHEST_SD: f64 = 6.0;

/// Simulates one recording.
///
/// # Errors
/// A combination of values that cannot be simulated.
pub fn strike(problem: &Problem, layout: &Layout, point: &Point, recording: usize) -> Result<Impact, RigError> {
    let prepared = &problem.recordings[recording];
    let contact_s = layout.contact_s(problem, point, recording);
    // A shifted instant of contact is read from the same motion: it must be long enough. So must it be for a channel that is read sooner.
    let sooner_s = (0..problem.channels.len()).map(|channel| -later_s(layout, point, prepared, channel));
    let until_s = prepared.times_s[prepared.times_s.len() - 1] - contact_s + 1e-3 + sooner_s.fold(0.0, f64::max);
    strike_until(problem, layout, point, recording, until_s)
}

/// The same motion, with the mechanisms of the measuring chain as they are at another point.
///
/// # Errors
/// A combination of values that cannot be simulated.
pub fn through(
    problem: &Problem,
    layout: &Layout,
    point: &Point,
    recording: usize,
    impact: &Impact,
) -> Result<Impact, RigError> {
    let (rig, approach, effects) = assembled(problem, layout, point, recording);
    impact.through(&rig, &approach, &effects)
}

fn strike_until(
    problem: &Problem,
    layout: &Layout,
    point: &Point,
    recording: usize,
    until_s: f64,
) -> Result<Impact, RigError> {
    let (rig, approach, effects) = assembled(problem, layout, point, recording);
    let motion = rig.strike(&approach, &effects, until_s.max(1e-3), ACCURACY);
    problem.work.follow(motion.as_ref().ok());
    motion
}

fn assembled(problem: &Problem, layout: &Layout, point: &Point, recording: usize) -> (Rig, Approach, Vec<Effect>) {
    let prepared = &problem.recordings[recording];
    let mut rig: Rig = model::simulated(&problem.rig);
    let mut pad_ratio = 1.0;
    let mut speed = prepared.speed.value;
    let mut mass = prepared.mass.value;
    let mut apply = |coordinates: &[Coordinate], values: &[f64]| {
        for (coordinate, value) in coordinates.iter().zip(values) {
            match coordinate.role {
                Role::Body => rig.body_stiffness_n_per_m *= value.exp(),
                Role::Pad => pad_ratio *= value.exp(),
                Role::Repeat => {
                    rig.body_stiffness_n_per_m *= value.exp();
                    pad_ratio *= value.exp();
                }
                Role::Mass(configuration) if configuration == prepared.configuration => mass *= value.exp(),
                Role::Speed => speed += value * prepared.speed_scale(),
                _ => {}
            }
        }
    };
    apply(&layout.globals, &point.globals);
    apply(&layout.locals, &point.locals[recording]);
    rig.pad_stiffness_n_per_m = rig.pad_stiffness_n_per_m.map(|pad| pad * pad_ratio);
    let effects: Vec<Effect> = (0..layout.entrants.len())
        .filter(|entrant| layout.entrants[*entrant].scope.includes(recording, prepared.configuration))
        .map(|entrant| layout.effect_at(problem, entrant, point, recording))
        .collect();
    let approach = Approach {
        speed_m_per_s: speed,
        effective_mass_kg: mass,
        configuration: prepared.configuration as u32,
        order: prepared.order,
    };
    (rig, approach, effects)
}

/// Reads from the simulated motion what the channels show at the recording's instants, all series one after the other.
pub fn read(
    problem: &Problem,
    layout: &Layout,
    point: &Point,
    recording: usize,
    impact: &Impact,
    shift_s: f64,
) -> Vec<f64> {
    unlogged(problem, layout, point, recording, impact, shift_s).logged(problem, impact)
}

/// What the channels show before the log, which may lose some of it.
#[derive(Clone, Debug)]
pub struct Unlogged {
    /// All series one after the other.
    values: Vec<f64>,
    /// Their instants, s after contact: more than the recording has, where its log may show later ones in their place.
    shown_s: Vec<f64>,
    /// How many the recording has.
    rows: usize,
    /// Of each series its zero, and how much later it is read, s.
    channels: Vec<(f64, f64)>,
}

/// The same as [`read`], but for the log.
pub fn unlogged(
    problem: &Problem,
    layout: &Layout,
    point: &Point,
    recording: usize,
    impact: &Impact,
    shift_s: f64,
) -> Unlogged {
    let prepared = &problem.recordings[recording];
    let contact_s = layout.contact_s(problem, point, recording) + shift_s;
    let since_s: Vec<f64> = prepared.times_s.iter().map(|time| time - contact_s).collect();
    let rows = since_s.len();
    problem.work.read(rows * problem.channels.len());
    let more = match impact.shown_s(&since_s) {
        Cow::Owned(more) => Some(more),
        Cow::Borrowed(_) => None,
    };
    let bends = more.as_ref().map_or_else(|| Cow::Borrowed(&prepared.bends[..]), |more| Cow::Owned(bends(more)));
    let shown_s = more.unwrap_or(since_s);
    let mut values = Vec::with_capacity(problem.channels.len() * shown_s.len());
    let mut channels = Vec::with_capacity(problem.channels.len());
    for (number, channel) in problem.channels.iter().enumerate() {
        let later_s = later_s(layout, point, prepared, number);
        let read_s = read_s(&shown_s, later_s);
        let from = values.len();
        values.resize(from + read_s.len(), 0.0);
        let series = &mut values[from..];
        impact.sample_into(channel.quantity, &read_s, series);
        lifted(series, channel, impact, &read_s);
        bent(series, channel.quantity, impact, &read_s, &bends, prepared);
        let zero = layout.local(point, recording, Role::Offset(number)).unwrap_or(0.0);
        converted(series, &read_s, &bends, converter_s2(layout, point, prepared), channel.quantity, impact);
        felt(channel, impact, prepared.begins_s() - contact_s - later_s, &read_s, zero, series);
        averaged(series, &bends, prepared.mean_of_s2());
        channels.push((zero, later_s));
    }
    Unlogged { values, shown_s, rows, channels }
}

impl Unlogged {
    /// What the log of an impact makes of it.
    pub fn logged(mut self, problem: &Problem, impact: &Impact) -> Vec<f64> {
        let length = self.shown_s.len();
        for (number, (channel, (zero, later_s))) in problem.channels.iter().zip(&self.channels).enumerate() {
            let series = &mut self.values[number * length..][..length];
            logged(channel, impact, &read_s(&self.shown_s, *later_s), series);
            series.iter_mut().for_each(|value| *value += zero);
            // Later instants than the recording has were for the log only.
            if length > self.rows {
                self.values.copy_within(number * length..number * length + self.rows, number * self.rows);
            }
        }
        self.values.truncate(self.channels.len() * self.rows);
        self.values
    }
}

/// When a channel is read that comes later than these instants.
fn read_s(shown_s: &[f64], later_s: f64) -> Cow<'_, [f64]> {
    match later_s {
        0.0 => shown_s.into(),
        later_s => shown_s.iter().map(|since_s| since_s - later_s).collect(),
    }
}

/// What the observed channel shows at every sample of a recording, not thinned. `None`: it cannot be simulated.
#[must_use]
pub fn raw(problem: &Problem, layout: &Layout, point: &Point, recording: usize) -> Option<Vec<f64>> {
    let prepared = &problem.recordings[recording];
    let contact_s = layout.contact_s(problem, point, recording);
    let since_s: Vec<f64> = prepared.raw.times_s.iter().map(|time| time - contact_s).collect();
    let impact = strike_until(problem, layout, point, recording, since_s[since_s.len() - 1]).ok()?;
    let channel = &problem.channels[0];
    let shown_s = impact.shown_s(&since_s);
    let mut values = impact.sample(channel.quantity, &shown_s);
    lifted(&mut values, channel, &impact, &shown_s);
    let zero = layout.local(point, recording, Role::Offset(0)).unwrap_or(0.0);
    let converter_s2 = converter_s2(layout, point, prepared);
    converted(&mut values, &shown_s, &bends(&shown_s), converter_s2, channel.quantity, &impact);
    felt(channel, &impact, shown_s[0], &shown_s, zero, &mut values);
    logged(channel, &impact, &shown_s, &mut values);
    values.truncate(since_s.len());
    values.iter_mut().for_each(|value| *value += zero);
    Some(values)
}

/// Before contact a carriage may come at a constant speed and not as it falls from rest.
fn lifted(series: &mut [f64], channel: &ChannelModel, impact: &Impact, since_s: &[f64]) {
    if channel.lift_m_per_s2 != 0.0 {
        let released_s = impact.released_s();
        let before = series.iter_mut().zip(since_s).take_while(|(_, since_s)| **since_s < 0.0);
        before.for_each(|(value, since_s)| {
            let falling_s = since_s.max(released_s);
            // Before it would have been let go it comes at the speed of the contact, too: −g times that instant.
            *value -= channel.lift_m_per_s2 * (0.5 * falling_s * falling_s + released_s * (since_s - falling_s));
        });
    }
}

/// Where robot and rig touch or part, or what falls is let go, a curve is bent in one place: of the blocks there the second difference says
/// too little or too much of the mean. What is missing is added.
fn bent(
    series: &mut [f64],
    quantity: Quantity,
    impact: &Impact,
    since_s: &[f64],
    bends: &[[f64; 2]],
    prepared: &Prepared,
) {
    let n = prepared.averaged;
    if n == 1 {
        return;
    }
    let ends = impact.contact_intervals().iter().flat_map(|(from, to)| [Some(*from), *to]).flatten().chain([0.0]);
    let mut blocks: Vec<usize> = Vec::new();
    for end_s in ends {
        let next = since_s.partition_point(|time| *time < end_s);
        blocks.extend(next.saturating_sub(2).max(1)..(next + 2).min(since_s.len().saturating_sub(1)));
    }
    blocks.sort_unstable();
    blocks.dedup();
    let from_middle_s = |place: usize| (place as f64 - 0.5 * (n - 1) as f64) * prepared.sample_s;
    let means = blocks.iter().map(|block| {
        let times_s: Vec<f64> = (0..n).map(|place| since_s[*block] + from_middle_s(place)).collect();
        let mut samples = vec![0.0; n];
        impact.sample_into(quantity, &times_s, &mut samples);
        (*block, samples.iter().sum::<f64>() / n as f64)
    });
    let means: Vec<(usize, f64)> = means.collect();
    // What is added bends the curve itself, a twelfth as much.
    for _ in 0..2 {
        let lacks = |(block, mean): &(usize, f64)| {
            let around = [series[block - 1], series[*block], series[block + 1]];
            (*block, mean - meant(around, bends[block - 1], prepared.mean_of_s2()))
        };
        let missing: Vec<(usize, f64)> = means.iter().map(lacks).collect();
        missing.into_iter().for_each(|(block, missing)| series[block] += missing);
    }
}

/// What a channel's readout makes of the motion, which may clip what the converter's filter has rounded; its zero comes later. The chain is at rest where the
/// recording begins, be it before these instants.
fn felt(channel: &ChannelModel, impact: &Impact, begins_s: f64, since_s: &[f64], zero: f64, series: &mut [f64]) {
    series.iter_mut().for_each(|value| *value *= channel.sign);
    in_newtons(channel, series, |series, newtons| {
        let zero_n = zero * newtons;
        if begins_s >= since_s[0] || !impact.has_chain() {
            return impact.apply_chain(since_s, zero_n, series);
        }
        let times_s: Vec<f64> = std::iter::once(begins_s).chain(since_s.iter().copied()).collect();
        let mut values: Vec<f64> = std::iter::once(series[0]).chain(series.iter().copied()).collect();
        impact.apply_chain(&times_s, zero_n, &mut values);
        series.copy_from_slice(&values[1..]);
    });
}

/// What the log makes of the samples of a channel.
fn logged(channel: &ChannelModel, impact: &Impact, since_s: &[f64], series: &mut [f64]) {
    in_newtons(channel, series, |series, _| impact.apply_log(since_s, series));
}

/// What is behind the measuring chain, in newtons on the way.
fn in_newtons(channel: &ChannelModel, series: &mut [f64], apply: impl FnOnce(&mut [f64], f64)) {
    let Some(newtons) = channel.newtons else { return };
    if newtons == 1.0 {
        return apply(series, newtons);
    }
    series.iter_mut().for_each(|value| *value *= newtons);
    apply(series, newtons);
    series.iter_mut().for_each(|value| *value /= newtons);
}

/// Half the variance of what the filter before the converter averages over, s².
fn converter_s2(layout: &Layout, point: &Point, prepared: &Prepared) -> f64 {
    layout.global(point, Role::Converter).unwrap_or(0.0) * prepared.sample_s.powi(2)
}

/// How much later than the observed channel another one is read, s.
fn later_s(layout: &Layout, point: &Point, prepared: &Prepared, channel: usize) -> f64 {
    layout.global(point, Role::Delay(channel)).unwrap_or(0.0) * prepared.sample_s
}

/// Weights of the slopes before and after each instant in the second difference there.
#[must_use]
pub fn bends(times_s: &[f64]) -> Vec<[f64; 2]> {
    let weights = |at: &[f64]| {
        let (left, right, both) = (at[1] - at[0], at[2] - at[1], at[2] - at[0]);
        [2.0 / (left * both), 2.0 / (right * both)]
    };
    times_s.windows(3).map(weights).collect()
}

/// What a mean reads where the curve is bent, over a block of samples or by a filter: its second difference says how much.
fn averaged(series: &mut [f64], bends: &[[f64; 2]], mean_of_s2: f64) {
    if mean_of_s2 == 0.0 {
        return;
    }
    // Before it touches anything and long after, a force is bent nowhere.
    let Range { start, end } = changing(series);
    let past = series[start..end].to_vec();
    let inner = series[start..end].iter_mut().skip(1).zip(past.windows(3)).zip(&bends[start.min(bends.len())..]);
    for ((value, around), bends) in inner {
        *value = meant([around[0], around[1], around[2]], *bends, mean_of_s2);
    }
}

/// What the filter before a converter makes of a series. A second difference would round a jump alike wherever between two samples it is, and a bend by a
/// length of theirs, so these go through a Gaussian of the filter's variance, and the second difference tells only of the rest.
fn converted(
    series: &mut [f64],
    times_s: &[f64],
    bends: &[[f64; 2]],
    mean_of_s2: f64,
    quantity: Quantity,
    impact: &Impact,
) {
    if mean_of_s2 == 0.0 || bends.is_empty() {
        return;
    }
    averaged(series, bends, mean_of_s2);
    let sd_s = (2.0 * mean_of_s2).sqrt();
    for kink in impact.kinks(quantity, KINK_REACH * sd_s) {
        let next = times_s.partition_point(|time_s| *time_s < kink.at_s);
        for here in next.saturating_sub(1).max(1)..(next + 1).min(series.len().saturating_sub(1)) {
            let around = [here - 1, here, here + 1].map(|place| sharp(&kink, times_s[place]));
            series[here] += around[1] - meant(around, bends[here - 1], mean_of_s2);
        }
        let from = times_s[..next].partition_point(|time_s| *time_s < kink.at_s - FARTHEST_SD * sd_s);
        for (value, time_s) in series[from..].iter_mut().zip(&times_s[from..]) {
            if *time_s > kink.at_s + FARTHEST_SD * sd_s {
                break;
            }
            *value += rounding(&kink, *time_s, sd_s);
        }
    }
}

/// What a jump and a bend have added to a curve by an instant.
fn sharp(kink: &Kink, time_s: f64) -> f64 {
    if time_s < kink.at_s { 0.0 } else { kink.jump + kink.slope * (time_s - kink.at_s) }
}

/// What a Gaussian of this deviation, s, makes of that more than it is: the integrals of its tail, once for a jump and twice for a bend.
fn rounding(kink: &Kink, time_s: f64, sd_s: f64) -> f64 {
    let away = (time_s - kink.at_s) / sd_s;
    let tail = 0.5 * erfc(away.abs() * FRAC_1_SQRT_2);
    let density = (-0.5 * away * away).exp() / TAU.sqrt();
    let step = if away < 0.0 { tail } else { -tail };
    kink.jump * step + kink.slope * sd_s * (density - away.abs() * tail)
}

/// Where a series changes, from the last value that is as the first one to the first that is as the last one.
fn changing(series: &[f64]) -> Range<usize> {
    let [first, .., last] = series else { return 0..series.len() };
    let start = series.iter().position(|value| value != first).unwrap_or(series.len()).saturating_sub(1);
    let end = series.iter().rposition(|value| value != last).map_or(start, |place| (place + 2).min(series.len()));
    // One before and one after, which the mean there reads.
    start.saturating_sub(1)..(end + 1).min(series.len())
}

/// What a mean reads in the middle of three values.
fn meant([before, here, after]: [f64; 3], [left, right]: [f64; 2], mean_of_s2: f64) -> f64 {
    here + ((after - here) * right - (here - before) * left) * mean_of_s2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What does not change before and after is skipped, not lost.
    #[test]
    fn a_pulse_is_averaged_alike_wherever_it_is() {
        let times_s: Vec<f64> = (0..40).map(|place: i32| 1e-3 * f64::from(place).powf(1.1)).collect();
        let bends = bends(&times_s);
        for (from, until) in [(0, 40), (1, 39), (2, 38), (10, 20), (10, 40), (0, 20), (15, 16), (0, 0)] {
            let pulse = |place: usize| if (from..until).contains(&place) { (place as f64).sin() + 2.0 } else { 1.0 };
            let series: Vec<f64> = (0..40).map(pulse).collect();
            let mut short = series.clone();
            averaged(&mut short, &bends, 3e-8);
            for place in 1..39 {
                let around = [series[place - 1], series[place], series[place + 1]];
                let expected = meant(around, bends[place - 1], 3e-8);
                assert!((short[place] - expected).abs() < 1e-12, "{from} to {until}, {place}");
            }
        }
    }

    /// Against the integral of the curve under a Gaussian, wherever between two samples contact is.
    #[test]
    fn a_jump_and_a_bend_go_through_the_filter_where_they_are() {
        let (sample_s, sd_s) = (5e-4, 0.35 * 5e-4);
        let dashpot = "viscous-damping:damping_Ns_per_m=12".parse().unwrap();
        let rub = "guide-friction:force_N=3,cell_share=1".parse().unwrap();
        let impact = Rig::impact(50e3).strike(&Approach::new(0.4, 8.0), &[dashpot, rub], 0.1, ACCURACY).unwrap();
        let filtered = |time_s: f64| {
            let weight = |place: i32| (-0.5 * (f64::from(place) / 100.0).powi(2)).exp();
            let part = |place: i32| weight(place) * impact.force_n(time_s + sd_s * f64::from(place) / 100.0);
            (-600..=600).map(part).sum::<f64>() / (-600..=600).map(weight).sum::<f64>()
        };
        for part in 0..10 {
            let times_s: Vec<f64> =
                (-5..150).map(|place| (f64::from(place) + 0.1 * f64::from(part)) * sample_s).collect();
            let mut series = impact.sample(Quantity::CellForce, &times_s);
            converted(&mut series, &times_s, &bends(&times_s), 0.5 * sd_s * sd_s, Quantity::CellForce, &impact);
            for (value, time_s) in series.iter().zip(&times_s).skip(1) {
                let expected = filtered(*time_s);
                assert!((value - expected).abs() < 0.03, "{part}, {time_s} s: {value} N, not {expected} N");
            }
        }
    }

    #[test]
    fn what_is_too_short_to_bend_is_its_own_mean() {
        for length in 0..3 {
            let mut series = vec![1.0; length];
            averaged(&mut series, &[], 1e-8);
            assert_eq!(series, vec![1.0; length]);
        }
    }
}
