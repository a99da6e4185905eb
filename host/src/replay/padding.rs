//! Quiet before and after a recording.
//!
//! The firmware learns zero, hum and noise before it is armed, and closes an impact when the force has been gone for a
//! while. A recording that begins shortly before the contact, or ends soon after it, gives no time for either. What is
//! missing is made of its own idle samples, so that level, noise and slow tones are those of the recording.
//!
//! Where the idle stretch is long enough, whole tenths of a second of it are repeated: five periods of 50 Hz mains and
//! six of 60 Hz, so that hum goes on in phase; its drift, the line through its first and last tenth, goes on too, so that
//! nothing steps from one repetition to the next. A shorter one is walked to and fro, a mirror at either end, so that
//! there is no step:
//!
//! ```text
//!   … i₂ i₁ i₀ i₁ i₂ … i_m … i₂ i₁ | i₀ i₁ i₂ … i_m contact
//!   ─────── made ───────────────── ─── recorded ──────────
//! ```

/// Least number of samples to take noise from.
const LEAST_IDLE: usize = 8;

/// A sample this many standard deviations from the mean of the samples before it is no longer idle.
const DEPARTURE: f64 = 6.0;

/// The last part of the idle stretch is left out: the toe of the contact is in it before it stands out.
const TOE_SHARE: f64 = 0.2;

/// Whole periods of both mains frequencies, s.
const MAINS_PERIODS_S: f64 = 0.1;

/// So many samples in a row must stand out: noise does so once in a while, a contact goes on.
const CONFIRMED: usize = 3;

/// How many of the first samples are idle: nothing touches, and quiet can be made of them.
///
/// Grows from the first eight samples on until three in a row depart from the mean of those before them by more than six
/// standard deviations and `resolution`, the step of the values; then gives up a fifth for the toe. `None` when there are
/// not even eight.
#[must_use]
pub fn idle_samples(values: &[f64], resolution: f64) -> Option<usize> {
    if values.len() < LEAST_IDLE {
        return None;
    }
    let (mut count, mut mean, mut squares) = (0.0_f64, 0.0, 0.0);
    let mut departing = 0;
    for (index, value) in values.iter().enumerate() {
        let deviation = (squares / count.max(1.0)).sqrt();
        if index >= LEAST_IDLE && (value - mean).abs() > DEPARTURE * deviation + resolution {
            departing += 1;
            if departing == CONFIRMED {
                let idle = index + 1 - CONFIRMED;
                return Some(idle - (idle as f64 * TOE_SHARE).ceil() as usize);
            }
            continue;
        }
        departing = 0;
        // Welford's recurrence.
        count += 1.0;
        let difference = value - mean;
        mean += difference / count;
        squares += difference * (value - mean);
    }
    Some(values.len())
}

/// The idle samples at the end of a recording that begins under load: how many of the last samples are idle, where those
/// that begin it are not.
///
/// The first samples count as loaded when they wander four times as much as a long quiet end: a rising flank is a ramp, in
/// which no sample departs from those before it, so that [`idle_samples`] alone takes it for drift.
#[must_use]
pub fn idle_at_end_only(first: &[f64], last: &[f64], least: usize, resolution: f64) -> Option<usize> {
    let start = idle_samples(first, resolution)?;
    let reversed: Vec<f64> = last.iter().rev().copied().collect();
    let end = idle_samples(&reversed, resolution)?;
    let quietest = deviation(&reversed[..end]);
    let loaded = deviation(&first[..start]) > LOADED * quietest + resolution;
    (loaded && end >= least.max(LEAST_IDLE) && end < last.len()).then_some(end)
}

/// Beginning and end of a recording differ by this factor in their standard deviation when one of them is under load.
const LOADED: f64 = 4.0;

/// Standard deviation.
fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// The idle signal of a recording, continued to any time.
#[derive(Clone, Debug, PartialEq)]
pub struct Quiet {
    /// Sample of the recording that the first of `idle` is.
    first: i64,
    idle: Vec<f64>,
    /// Change of the zero from sample to sample, which is not in `idle`.
    drift: f64,
    mirrored: bool,
}

impl Quiet {
    /// Quiet made of these samples, of which the first is sample `first` of the recording, at `rate_hz`.
    ///
    /// # Panics
    /// When there is no sample.
    #[must_use]
    pub fn new(idle: &[f64], first: i64, rate_hz: f64) -> Self {
        assert!(!idle.is_empty(), "quiet is made of at least one sample");
        let period = (MAINS_PERIODS_S * rate_hz).round() as usize;
        let periods = idle.len().checked_div(period).unwrap_or(0);
        if periods == 0 {
            return Self { first, idle: idle.to_vec(), drift: 0.0, mirrored: true };
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let idle = &idle[..periods * period];
        let drift = if periods < 2 {
            // One period alone does not tell drift from hum that is not quite of mains frequency.
            0.0
        } else {
            (mean(&idle[idle.len() - period..]) - mean(&idle[..period])) / (idle.len() - period) as f64
        };
        let level = idle.iter().enumerate().map(|(index, value)| value - drift * index as f64).collect();
        Self { first, idle: level, drift, mirrored: false }
    }

    /// Whether the samples are walked to and fro, because they are fewer than hum would need.
    #[must_use]
    pub fn mirrored(&self) -> bool {
        self.mirrored
    }

    /// Mean of the samples.
    #[must_use]
    pub fn level(&self) -> f64 {
        let count = self.idle.len() as f64;
        self.idle.iter().sum::<f64>() / count + self.drift * (count - 1.0) / 2.0
    }

    /// The quiet signal at a sample of the recording; negative before its beginning.
    #[must_use]
    pub fn at(&self, sample: i64) -> f64 {
        self.level_at(sample) + self.drift * (sample - self.first) as f64
    }

    /// The quiet signal at a sample after `end`, from where on the zero drifts no more.
    #[must_use]
    pub fn after(&self, end: i64, sample: i64) -> f64 {
        self.level_at(sample) + self.drift * (end - self.first) as f64
    }

    fn level_at(&self, sample: i64) -> f64 {
        let (count, sample) = (self.idle.len(), sample - self.first);
        let place = if self.mirrored {
            let turn = (2 * count).saturating_sub(2).max(1);
            let step = sample.rem_euclid(turn as i64) as usize;
            step.min(turn - step)
        } else {
            sample.rem_euclid(count as i64) as usize
        };
        self.idle[place.min(count - 1)]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_short_stretch_is_mirrored_without_a_step() {
        let quiet = Quiet::new(&[1.0, 2.0, 3.0], 0, 20_000.0);
        let made: Vec<f64> = (-5..6).map(|sample| quiet.at(sample)).collect();
        assert_eq!(made, [2.0, 1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0, 1.0, 2.0]);
        assert_eq!(Quiet::new(&[4.0], 0, 20_000.0).at(-3), 4.0);
    }

    #[test]
    fn hum_goes_on_in_phase() {
        let rate = 2_000.0;
        let hum =
            |sample: i64| (TAU * 50.0 * sample as f64 / rate).cos() + 0.5 * (TAU * 60.0 * sample as f64 / rate).sin();
        let idle: Vec<f64> = (0..250).map(hum).collect();
        let quiet = Quiet::new(&idle, 0, rate);
        assert!(!quiet.mirrored());
        let later = Quiet::new(&idle[30..], 30, rate);
        assert!((later.at(-77) - hum(-77)).abs() < 1e-9);
        for sample in [-1001, -1, 0, 199, 200, 5_003] {
            assert!((quiet.at(sample) - hum(sample)).abs() < 1e-9, "{sample}");
        }
    }

    #[test]
    fn drift_goes_on_without_a_step() {
        let rate = 1_000.0;
        let drifting = |sample: i64| 3.0 + 0.002 * sample as f64;
        let idle: Vec<f64> = (0..350).map(drifting).collect();
        let quiet = Quiet::new(&idle, 0, rate);
        for sample in [-1_000, -1, 0, 250, 349, 1_500] {
            assert!((quiet.at(sample) - drifting(sample)).abs() < 1e-9, "{sample}");
        }
    }

    #[test]
    fn idle_ends_where_the_contact_begins() {
        let mut values: Vec<f64> = (0..100).map(|index| 0.01 * f64::from(index % 3)).collect();
        values.extend([0.02, 0.5, 3.0, 10.0]);
        let idle = idle_samples(&values, 0.0).unwrap();
        assert!((70..=101).contains(&idle), "{idle}");
    }

    #[test]
    fn a_single_sample_that_stands_out_is_noise() {
        let mut values: Vec<f64> = (0..100).map(|index| 0.01 * f64::from(index % 3)).collect();
        values[20] = 5.0;
        assert_eq!(idle_samples(&values, 0.0), Some(100));
    }

    #[test]
    fn a_recording_that_begins_within_the_pulse_is_idle_at_its_end() {
        let noise = |index: usize| 0.1 * (index % 7) as f64;
        let flank = |index: usize| 5.0 * index as f64 + noise(index);
        let values: Vec<f64> = (0..60).map(flank).chain((0..200).map(noise)).collect();
        let end = idle_at_end_only(&values, &values, 50, 0.07).unwrap();
        assert!((100..=200).contains(&end), "{end}");
        let idle_first: Vec<f64> = values.iter().rev().copied().collect();
        assert_eq!(idle_at_end_only(&idle_first, &idle_first, 50, 0.07), None);
        let all_idle: Vec<f64> = (0..300).map(noise).collect();
        assert_eq!(idle_at_end_only(&all_idle, &all_idle, 50, 0.07), None);
    }

    #[test]
    fn too_few_samples_are_no_idle_stretch() {
        assert_eq!(idle_samples(&[0.0; 5], 0.0), None);
    }

    #[test]
    fn a_recording_without_contact_is_all_idle() {
        assert_eq!(idle_samples(&[0.5; 50], 0.01), Some(50));
    }
}
