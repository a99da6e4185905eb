//! From a curve to samples: what the filter before a converter and means over samples make of it, and where it has to be read for that.
//!
//! Where a curve is smooth its second difference says how much a mean over a short while differs from the value in its middle. Where it jumps or
//! bends (at contact, at separation, where a guide turns round) that would round it alike wherever between two samples it is. There the filter is a
//! Gaussian of its variance, means are taken sample by sample, and a chain with a memory, which takes a signal to run straight from instant to
//! instant, is told of it in between.

use std::borrow::Cow;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;

use statrs::function::erf::erfc;
use thud_sim::rig::{Impact, Kink, Quantity};

use super::problem::Prepared;

/// From where, in deviations of the converter's filter, a jump and a bend are extrapolated.
const KINK_REACH: f64 = 0.05;
/// Beyond so many deviations a Gaussian leaves nothing: 10⁻⁹ of a jump.
const FARTHEST_SD: f64 = 6.0;
/// A chain with a memory is told of a rounded jump at so many deviations on each side,
const TOLD_SD: i32 = 2;
/// and of one that no filter rounds within this part of a sample.
const SHARPEST: f64 = 0.02;
/// Instants that are closer, in samples, are one.
const CLOSEST: f64 = 1e-3;
/// So many means on each side of a jump or a bend are taken sample by sample.
const SINGLY: usize = 2;

/// What a sample is a mean over.
#[derive(Clone, Copy, Debug)]
pub struct Averages {
    /// Half the variance of what the filter before the converter averages over, s².
    pub converter_s2: f64,
    /// How many of the recording's samples are averaged into one.
    pub samples: usize,
    /// Their interval, s.
    pub sample_s: f64,
}

/// The instants at which a curve is read for a recording's samples.
#[derive(Debug)]
pub struct Grid<'a> {
    times_s: Cow<'a, [f64]>,
    bends: Cow<'a, [[f64; 2]]>,
    kinks: Vec<Kink>,
    averages: Averages,
    /// None: they are the samples' own.
    between: Option<Between<'a>>,
}

/// Where the samples are among instants that lie between them.
#[derive(Debug)]
struct Between<'a> {
    /// Of each sample.
    places: Vec<usize>,
    bends: &'a [[f64; 2]],
    /// Means that are taken sample by sample, and where the samples of each are, one mean after the other.
    singly: Vec<usize>,
    of_singly: Vec<usize>,
}

impl Averages {
    /// Of a recording, behind such a filter.
    #[must_use]
    pub fn of(prepared: &Prepared, converter_s2: f64) -> Self {
        Self { converter_s2, samples: prepared.averaged, sample_s: prepared.sample_s }
    }

    /// (n² − 1)·Δt²/24 for means over n samples: a mean is the value in the middle plus this times the curvature, s².
    fn mean_of_s2(self) -> f64 {
        (self.samples.pow(2) - 1) as f64 * self.sample_s.powi(2) / 24.0
    }

    /// Deviation of the converter's filter, s.
    fn converter_sd_s(self) -> f64 {
        (2.0 * self.converter_s2).sqrt()
    }
}

impl<'a> Grid<'a> {
    /// For samples at these instants (s after contact), whose [`bends`] are known.
    #[must_use]
    pub fn new(
        samples_s: &'a [f64],
        bends_of: &'a [[f64; 2]],
        impact: &Impact,
        quantity: Quantity,
        averages: Averages,
    ) -> Self {
        let Averages { samples, sample_s, converter_s2 } = averages;
        let told_s = averages.converter_sd_s().max(SHARPEST * sample_s);
        let asks = converter_s2 > 0.0 || samples > 1 || impact.is_late();
        let kinks = if asks { impact.kinks(quantity, KINK_REACH * told_s) } else { Vec::new() };
        let plain = |kinks| Self { times_s: samples_s.into(), bends: bends_of.into(), kinks, averages, between: None };
        let [first_s, .., last_s] = samples_s else { return plain(kinks) };
        let within = kinks.iter().filter(|kink| (*first_s..*last_s).contains(&kink.at_s));
        let mut more_s: Vec<f64> = Vec::new();
        let mut blocks: Vec<usize> = Vec::new();
        if samples > 1 {
            for kink in within {
                let next = samples_s.partition_point(|time_s| *time_s < kink.at_s);
                blocks.extend(next.saturating_sub(SINGLY)..(next + SINGLY).min(samples_s.len()));
            }
            blocks.sort_unstable();
            blocks.dedup();
            let from_middle_s = |place: usize| (place as f64 - 0.5 * (samples - 1) as f64) * sample_s;
            more_s.extend(
                blocks.iter().flat_map(|block| (0..samples).map(|place| samples_s[*block] + from_middle_s(place))),
            );
        } else if impact.is_late() {
            let told = within.flat_map(|kink| (-TOLD_SD..=TOLD_SD).map(|side| kink.at_s + f64::from(side) * told_s));
            more_s.extend(told.filter(|time_s| (*first_s..*last_s).contains(time_s)));
        }
        if more_s.is_empty() {
            return plain(kinks);
        }
        let mut all: Vec<(f64, usize)> = samples_s.iter().chain(&more_s).copied().zip(0..).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut times_s: Vec<f64> = Vec::with_capacity(all.len());
        let mut places = vec![0; all.len()];
        for (time_s, number) in all {
            if times_s.last().is_none_or(|last_s| time_s - last_s > CLOSEST * sample_s) {
                times_s.push(time_s);
            }
            places[number] = times_s.len() - 1;
        }
        let of_singly = places.split_off(samples_s.len());
        let between = Some(Between { places, bends: bends_of, singly: blocks, of_singly });
        let bends = bends(&times_s).into();
        Self { times_s: times_s.into(), bends, kinks, averages, between }
    }

    /// The instants, s after contact.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// What the filter before the converter makes of the curve at these instants.
    pub fn convert(&self, series: &mut [f64]) {
        let mean_of_s2 = self.averages.converter_s2;
        if mean_of_s2 == 0.0 || self.bends.is_empty() {
            return;
        }
        averaged(series, &self.bends, mean_of_s2);
        let sd_s = self.averages.converter_sd_s();
        for kink in &self.kinks {
            let next = self.times_s.partition_point(|time_s| *time_s < kink.at_s);
            for here in next.saturating_sub(1).max(1)..(next + 1).min(series.len().saturating_sub(1)) {
                let around = [here - 1, here, here + 1].map(|place| sharp(kink, self.times_s[place]));
                series[here] += around[1] - meant(around, self.bends[here - 1], mean_of_s2);
            }
            let reach_s = FARTHEST_SD * sd_s;
            let from = self.times_s[..next].partition_point(|time_s| *time_s < kink.at_s - reach_s);
            let near = series[from..].iter_mut().zip(&self.times_s[from..]);
            for (value, time_s) in near.take_while(|(_, time_s)| **time_s <= kink.at_s + reach_s) {
                *value += rounding(kink, *time_s, sd_s);
            }
        }
    }

    /// The samples: of what is read at these instants the means.
    #[must_use]
    pub fn mean(&self, mut series: Vec<f64>) -> Vec<f64> {
        let mean_of_s2 = self.averages.mean_of_s2();
        let Some(between) = &self.between else {
            averaged(&mut series, &self.bends, mean_of_s2);
            return series;
        };
        let mut samples: Vec<f64> = between.places.iter().map(|place| series[*place]).collect();
        averaged(&mut samples, between.bends, mean_of_s2);
        for (block, places) in between.singly.iter().zip(between.of_singly.chunks(self.averages.samples)) {
            samples[*block] = places.iter().map(|place| series[*place]).sum::<f64>() / places.len() as f64;
        }
        samples
    }
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
    use thud_sim::rig::{Approach, Rig};

    use super::super::predict::ACCURACY;
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
        let averages = Averages { converter_s2: 0.5 * sd_s * sd_s, samples: 1, sample_s };
        for part in 0..10 {
            let times_s: Vec<f64> =
                (-5..150).map(|place| (f64::from(place) + 0.1 * f64::from(part)) * sample_s).collect();
            let bends = bends(&times_s);
            let grid = Grid::new(&times_s, &bends, &impact, Quantity::CellForce, averages);
            let mut series = impact.sample(Quantity::CellForce, grid.times_s());
            grid.convert(&mut series);
            for (value, time_s) in grid.mean(series).iter().zip(&times_s).skip(1) {
                let expected = filtered(*time_s);
                assert!((value - expected).abs() < 0.03, "{part}, {time_s} s: {value} N, not {expected} N");
            }
        }
    }

    /// Against the chain and the means at every sample of a recording taken a hundred times as fast.
    #[test]
    fn a_chain_with_a_memory_is_told_of_a_jump_between_samples() {
        let dashpot = "viscous-damping:damping_Ns_per_m=12".parse().unwrap();
        let lag = "filter-lag:corner_Hz=400,poles=2".parse().unwrap();
        let impact = Rig::impact(50e3).strike(&Approach::new(0.4, 8.0), &[dashpot, lag], 0.1, ACCURACY).unwrap();
        for (samples, step_s, tolerance_n) in [(1_usize, 5e-4, 0.25), (10, 2e-4, 0.05)] {
            let sample_s = step_s / samples as f64;
            for part in 0..10 {
                let at_s = |place: f64| (place + 0.1 * f64::from(part)) * step_s;
                let times_s: Vec<f64> = (-5..150).map(|place| at_s(f64::from(place))).collect();
                let averages = Averages { converter_s2: 0.0, samples, sample_s };
                let bends = bends(&times_s);
                let grid = Grid::new(&times_s, &bends, &impact, Quantity::CellForce, averages);
                let mut series = impact.sample(Quantity::CellForce, grid.times_s());
                impact.apply_chain(grid.times_s(), 0.0, &mut series);
                let fine_s: Vec<f64> = (-550..15_000).map(|place| at_s(0.01 * f64::from(place))).collect();
                let fine = impact.measured_n(&fine_s);
                for (place, value) in grid.mean(series).iter().enumerate().skip(1) {
                    let middle = 50 + 100 * place;
                    let of = |sample: usize| fine[middle + 100 * sample / samples - 50 * (samples - 1) / samples];
                    let expected = (0..samples).map(of).sum::<f64>() / samples as f64;
                    let off = value - expected;
                    assert!(off.abs() < tolerance_n, "{samples}, {part}, {place}: {value} N, not {expected} N");
                }
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
