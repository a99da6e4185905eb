//! Where samples are missing from an evenly sampled recording.

use super::Recording;

/// A stretch of time without samples where the rest of the recording has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Index of the last sample before it.
    pub after: usize,
    /// Instant of that sample, s.
    pub from_s: f64,
    /// Instant of the next sample, s.
    pub to_s: f64,
}

/// A step in time this many times the median interval is a gap.
///
/// Uneven sampling is allowed: a step of 1.5 intervals is jitter, one of two intervals is one lost sample.
const GAP_INTERVALS: f64 = 1.75;

/// A recording is taken for evenly sampled when at least this share of its steps are close to the median.
const EVEN_SHARE: f64 = 0.9;
/// How close: relative to the median. Rounded time columns of real loggers stay within it.
const EVEN_WITHIN: f64 = 0.25;

impl Recording {
    /// The gaps, if the recording is evenly sampled otherwise.
    ///
    /// Where the sampling itself is uneven, no step can be told from a loss, and there is none.
    #[must_use]
    pub fn gaps(&self) -> Vec<Gap> {
        let interval = self.median_interval_s();
        let times = self.times_s();
        let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let even = steps.clone().filter(|step| (step / interval - 1.0).abs() <= EVEN_WITHIN).count();
        if (even as f64) < EVEN_SHARE * (times.len() - 1) as f64 {
            return Vec::new();
        }
        steps
            .enumerate()
            .filter(|(_, step)| *step > GAP_INTERVALS * interval)
            .map(|(after, _)| Gap { after, from_s: times[after], to_s: times[after + 1] })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Channel, FORCE};
    use super::*;

    fn recording(times: Vec<f64>) -> Recording {
        let values = vec![0.0; times.len()];
        Recording::new(times, vec![Channel { name: FORCE.to_owned(), values }]).unwrap()
    }

    #[test]
    fn lost_samples_are_a_gap() {
        let times = (0..100).filter(|index| !(50..53).contains(index)).map(|index| f64::from(index) * 0.001).collect();
        let gaps = recording(times).gaps();
        assert_eq!(gaps.len(), 1);
        assert_eq!(gaps[0].after, 49);
        assert!((gaps[0].from_s - 0.049).abs() < 1e-12 && (gaps[0].to_s - 0.053).abs() < 1e-12);
    }

    #[test]
    fn uneven_sampling_is_not_a_loss() {
        let mut time = 0.0;
        let times = (0..100)
            .map(|index| {
                time += if index % 3 == 0 { 0.004 } else { 0.001 };
                time
            })
            .collect();
        assert_eq!(recording(times).gaps(), []);
    }
}
