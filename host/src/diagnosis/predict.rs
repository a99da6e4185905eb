//! What the simulation says a recording should show, for given coordinates.

use std::borrow::Cow;

use thud_sim::mechanism::Effect;
use thud_sim::rig::{Accuracy, Approach, Impact, Rig, RigError};

use super::layout::{Coordinate, Layout, Point, Role};
use super::problem::{ChannelModel, Prepared, Problem};
use super::sampling::{Averages, Grid, bends};
use crate::model;

/// As exact as the thinnest noise needs: a finite difference of 10⁻³ sees errors of 10⁻⁴ of the effect.
pub const ACCURACY: Accuracy = Accuracy { relative: 1e-7, force_n: 1e-5 };

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
    let averages = Averages::of(prepared, converter_s2(layout, point, prepared));
    let mut values = Vec::with_capacity(problem.channels.len() * shown_s.len());
    let mut channels = Vec::with_capacity(problem.channels.len());
    for (number, channel) in problem.channels.iter().enumerate() {
        let later_s = later_s(layout, point, prepared, number);
        let read_s = read_s(&shown_s, later_s);
        let grid = Grid::new(&read_s, &bends, impact, channel.quantity, averages);
        let zero = layout.local(point, recording, Role::Offset(number)).unwrap_or(0.0);
        values.extend(sampled(channel, impact, &grid, prepared.begins_s() - contact_s - later_s, zero));
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
    let averages = Averages { samples: 1, ..Averages::of(prepared, converter_s2(layout, point, prepared)) };
    let bends = bends(&shown_s);
    let grid = Grid::new(&shown_s, &bends, &impact, channel.quantity, averages);
    let zero = layout.local(point, recording, Role::Offset(0)).unwrap_or(0.0);
    let mut values = sampled(channel, &impact, &grid, shown_s[0], zero);
    logged(channel, &impact, &shown_s, &mut values);
    values.truncate(since_s.len());
    values.iter_mut().for_each(|value| *value += zero);
    Some(values)
}

/// The samples of a channel before the log: the motion through the filter before the converter and the chain, which is at rest where the recording begins.
fn sampled(channel: &ChannelModel, impact: &Impact, grid: &Grid<'_>, begins_s: f64, zero: f64) -> Vec<f64> {
    let mut series = impact.sample(channel.quantity, grid.times_s());
    lifted(&mut series, channel, impact, grid.times_s());
    grid.convert(&mut series);
    felt(channel, impact, begins_s, grid.times_s(), zero, &mut series);
    grid.mean(series)
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
