//! A captured curve as force: calibrated, zero and hum removed, raw and through the verdict filter.

use thud_firmware::board::AdcCode;
use thud_firmware::calibration::Calibration;
use thud_firmware::configuration::{Chain, FilterProfile};
use thud_firmware::filter::LowPass;
use thud_firmware::idle::Baseline;
use thud_firmware::units::{Hertz, Second};

/// Force over sample numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceCurve {
    /// Number of the first sample.
    pub first_index: u64,
    /// Samples per second.
    pub sample_rate: Hertz,
    /// By how much the front end delayed it; taken off every time.
    pub delay: Second,
    /// Unfiltered, N.
    pub raw: Vec<f32>,
    /// As judged, N.
    pub judged: Vec<f32>,
}

impl ForceCurve {
    /// The curve from forces whose zero has been removed.
    #[must_use]
    pub fn new(first_index: u64, chain: &Chain, raw: Vec<f32>, filter: FilterProfile) -> Self {
        let judged = judged(&raw, filter, chain.sample_rate);
        Self { first_index, sample_rate: chain.sample_rate, delay: chain.delay, raw, judged }
    }

    /// The curve from codes, with the idle signal that the sensor knew removed.
    #[must_use]
    pub fn from_codes(
        first_index: u64,
        codes: &[AdcCode],
        chain: &Chain,
        idle: &Baseline,
        filter: FilterProfile,
    ) -> Self {
        let calibration = Calibration::new(chain);
        let raw = codes
            .iter()
            .zip(first_index..)
            .map(|(code, index)| calibration.force(*code) - idle.at(index.wrapping_sub(idle.origin) as i64 as f32))
            .collect();
        Self::new(first_index, chain, raw, filter)
    }

    /// Seconds from `origin` to the instant at which the force of the curve's first sample acted.
    #[must_use]
    pub fn start_s(&self, origin: thud_firmware::units::SampleInstant) -> f64 {
        let whole = self.first_index.wrapping_sub(origin.index) as i64 as f64;
        (whole - f64::from(origin.fraction)) / f64::from(self.sample_rate.0) - f64::from(self.delay.0)
    }
}

/// The force through the filter of the verdict.
pub(super) fn judged(raw: &[f32], filter: FilterProfile, sample_rate: Hertz) -> Vec<f32> {
    let mut values = raw.to_vec();
    if let Some(corner) = filter.corner() {
        LowPass::of_two_passes(corner, sample_rate).forth_and_back(&mut values);
    }
    values
}

/// Thins a line to about `points` points without losing its highest and lowest: from each stretch both are kept.
pub(crate) fn thinned(line: &[(f64, f64)], points: usize) -> Vec<(f64, f64)> {
    let stretch = (2 * line.len()).div_ceil(points.max(2)).max(1);
    if stretch <= 2 {
        return line.to_vec();
    }
    let mut kept = Vec::with_capacity(points + 2);
    for piece in line.chunks(stretch) {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let low = piece.iter().min_by(by_height);
        let high = piece.iter().max_by(by_height);
        let mut both: Vec<(f64, f64)> = low.into_iter().chain(high).copied().collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        both.dedup();
        kept.extend(both);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_extremes() {
        let line: Vec<(f64, f64)> =
            (0..10_000).map(|index| (f64::from(index), f64::from((index * 37) % 1001))).collect();
        let thin = thinned(&line, 300);
        assert!(thin.len() <= 320, "{}", thin.len());
        assert!(thin.windows(2).all(|pair| pair[0].0 < pair[1].0));
        let top = |line: &[(f64, f64)]| line.iter().map(|point| point.1).fold(f64::MIN, f64::max);
        assert_eq!(top(&thin), top(&line));
    }

    #[test]
    fn the_judged_curve_has_no_delay() {
        let rate = Hertz(20_000.0);
        let raw: Vec<f32> = (0..4_000)
            .map(|index| {
                let time = (index - 1_000) as f32 / 20_000.0;
                if (0.0..0.05).contains(&time) { 100.0 * (std::f32::consts::PI * time / 0.05).sin() } else { 0.0 }
            })
            .collect();
        let judged = judged(&raw, FilterProfile::IsoPas5672, rate);
        let top = judged.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!(top.0.abs_diff(1_500) <= 2, "{}", top.0);
        assert!((top.1 - 100.0).abs() < 1.0, "{}", top.1);
        assert_eq!(super::judged(&raw, FilterProfile::None, rate), raw);
    }
}
