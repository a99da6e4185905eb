//! A channel onto the ADC's even grid, without inventing force.
//!
//! Between samples runs a piecewise cubic Hermite polynomial whose slopes are limited so that it is monotone wherever
//! the samples are (F. N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300: the slope at a sample is the
//! weighted harmonic mean of the slopes on both sides, and zero at a turning point). An ordinary spline would swing
//! below zero before a contact and above a peak; this one does neither, at the price that a peak between two samples
//! stays at the higher of them.

use std::ops::Range;

use crate::recording::Gap;

/// A stretch of the grid without loss: `values[i]` belongs to the grid's point `first + i`.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Number of its first point on the grid.
    pub first: u64,
    /// Values at its points.
    pub values: Vec<f64>,
}

/// Resamples onto the points `times[0] + i / rate_hz`, s; inside gaps there are none.
///
/// `times` (s) rises strictly, `values` has its length, and the gaps are those of the same recording.
#[must_use]
pub fn resample(times: &[f64], values: &[f64], gaps: &[Gap], rate_hz: f64) -> Vec<Stretch> {
    let mut pieces: Vec<Range<usize>> = Vec::with_capacity(gaps.len() + 1);
    let mut start = 0;
    for gap in gaps {
        pieces.push(start..gap.after + 1);
        start = gap.after + 1;
    }
    pieces.push(start..times.len());
    let origin = times[0];
    pieces
        .into_iter()
        .filter_map(|piece| {
            let (times, values) = (&times[piece.clone()], &values[piece]);
            // A time column is rounded: a point that misses a sample by a thousandth of a step is at it.
            let first = ((times[0] - origin) * rate_hz - 1e-3).ceil().max(0.0) as u64;
            let last = ((times[times.len() - 1] - origin) * rate_hz + 1e-3).floor() as u64;
            let curve = Curve::new(times, values);
            let mut at = 0;
            let values: Vec<f64> =
                (first..=last).map(|point| curve.value(origin + point as f64 / rate_hz, &mut at)).collect();
            (!values.is_empty()).then_some(Stretch { first, values })
        })
        .collect()
}

/// The interpolating polynomial of one stretch.
struct Curve<'a> {
    times: &'a [f64],
    values: &'a [f64],
    slopes: Vec<f64>,
}

impl<'a> Curve<'a> {
    fn new(times: &'a [f64], values: &'a [f64]) -> Self {
        let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let secants: Vec<f64> = values.windows(2).zip(&steps).map(|(pair, step)| (pair[1] - pair[0]) / step).collect();
        // At the ends the secant itself: monotone too, as it is at most three times the secant.
        let mut slopes = vec![secants.first().copied().unwrap_or(0.0)];
        for index in 1..secants.len() {
            let (before, after) = (secants[index - 1], secants[index]);
            slopes.push(if before * after <= 0.0 {
                0.0
            } else {
                let (weight_before, weight_after) =
                    (2.0 * steps[index] + steps[index - 1], steps[index] + 2.0 * steps[index - 1]);
                (weight_before + weight_after) / (weight_before / before + weight_after / after)
            });
        }
        if let Some(last) = secants.last() {
            slopes.push(*last);
        }
        Self { times, values, slopes }
    }

    /// The value at `time`; `at` remembers the interval, as the points come in order.
    fn value(&self, time: f64, at: &mut usize) -> f64 {
        if self.times.len() == 1 {
            return self.values[0];
        }
        while *at + 2 < self.times.len() && self.times[*at + 1] <= time {
            *at += 1;
        }
        let step = self.times[*at + 1] - self.times[*at];
        let u = ((time - self.times[*at]) / step).clamp(0.0, 1.0);
        let (value, next) = (self.values[*at], self.values[*at + 1]);
        let (slope, next_slope) = (self.slopes[*at] * step, self.slopes[*at + 1] * step);
        // Hermite's cubic, written so that it is exact at both ends.
        let v = 1.0 - u;
        value * v * v * (1.0 + 2.0 * u) + next * u * u * (3.0 - 2.0 * u) + slope * u * v * v - next_slope * u * u * v
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn samples_on_the_grid_stay_what_they_are() {
        // 25.6 kHz with the time rounded to 10 ns, as a logger writes it.
        let times: Vec<f64> = (0..1000).map(|index| (f64::from(index) / 25_600.0 * 1e8).round() / 1e8).collect();
        let values: Vec<f64> = (0..1000).map(|index| f64::from(index % 17) - 3.0).collect();
        let rate = 999.0 / times[999];
        let stretches = resample(&times, &values, &[], rate);
        assert_eq!(stretches.len(), 1);
        assert_eq!(stretches[0].values.len(), 1000);
        for (resampled, value) in stretches[0].values.iter().zip(&values) {
            assert!((resampled - value).abs() < 0.01, "{resampled} {value}");
        }
    }

    #[test]
    fn a_pulse_is_neither_announced_nor_exceeded() {
        let times: Vec<f64> = (0..40).map(|index| f64::from(index) * 0.8e-3).collect();
        let mut values = vec![0.0; 40];
        values[20..24].copy_from_slice(&[50.0, 400.0, 390.0, 20.0]);
        let stretches = resample(&times, &values, &[], 20_000.0);
        let fine = &stretches[0].values;
        let peak = fine.iter().copied().fold(0.0, f64::max);
        assert!(peak <= 400.0 + 1e-9 && peak > 399.9, "{peak}");
        assert!(fine[..19 * 16].iter().all(|value| value.abs() < 1e-12));
    }

    #[test]
    fn inside_a_gap_there_are_no_points() {
        let times: Vec<f64> = (0..100).filter(|index| !(40..60).contains(index)).map(|i| f64::from(i) * 1e-3).collect();
        let values = vec![1.0; times.len()];
        let gap = Gap { after: 39, from_s: 0.039, to_s: 0.060 };
        let stretches = resample(&times, &values, &[gap], 10_000.0);
        assert_eq!(stretches.len(), 2);
        assert_eq!((stretches[0].first, stretches[0].values.len()), (0, 391));
        assert_eq!(stretches[1].first, 600);
    }

    proptest! {
        #[test]
        fn it_never_leaves_the_range_of_its_neighbours(
            samples in prop::collection::vec((1e-4..2e-3f64, -100.0..100.0f64), 2..60),
            rate in 500.0..30_000.0f64,
        ) {
            let mut time = 0.0;
            let times: Vec<f64> = samples.iter().map(|(step, _)| { time += step; time }).collect();
            let values: Vec<f64> = samples.iter().map(|(_, value)| *value).collect();
            let stretches = resample(&times, &values, &[], rate);
            for (index, value) in stretches[0].values.iter().enumerate() {
                let at = times[0] + index as f64 / rate;
                let right = times.partition_point(|time| *time <= at).clamp(1, times.len() - 1);
                let (a, b) = (values[right - 1], values[right]);
                prop_assert!(*value >= a.min(b) - 1e-9 && *value <= a.max(b) + 1e-9, "{value} not in {a}..{b}");
            }
        }
    }
}
