//! A recording cut to its first contact: zero removed, noise known, and reasons why it may not be used.
//!
//! ```text
//!      quiet        |  rise      peak            |  after
//!  ~~~~~~~~~~~~~~~~~|/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾\__|~~~~~
//!      zero, noise  contact                separation
//! ```

use crate::campaign::{Entry, Estimate};
use crate::recording::{FORCE, Recording};

/// The contact is looked for from this share of the peak backwards and forwards.
const FOOT: f64 = 0.03;
/// At least this many times the noise is a force.
const NOISES: f64 = 5.0;
/// A blow is this many times the noise, or there is none.
const LEAST_PEAK: f64 = 20.0;
/// Quiet samples that are needed before contact.
const LEAST_QUIET: usize = 10;
/// Samples of a contact that are needed.
const LEAST_SAMPLES: usize = 12;
/// More samples than this in a window are averaged in groups for the fit.
const MOST_FITTED: usize = 420;
/// How much quiet on either side belongs to the window, as a part of the contact.
const MARGIN: f64 = 0.12;
/// So many equal highest samples in a row are a clipped top.
const CLIPPED: usize = 4;
/// A momentum taken away of more than this times m·v₀ cannot be a rebound's; doubt in speed and mass comes on top.
const MOST_IMPULSE: f64 = 2.0;

/// Samples of a blow.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Instants of the recording, s.
    pub(super) times_s: Vec<f64>,
    /// Force without zero, N.
    pub(super) force_n: Vec<f64>,
    /// Depth and its rate, where measured: m and m/s.
    pub(super) depth: Vec<(f64, f64)>,
    /// How many samples each one is the mean of.
    pub(super) group: f64,
}

/// The first contact of a recording.
#[derive(Clone, Debug)]
pub(super) struct Blow {
    pub(super) file: String,
    /// Number of the robot's configuration.
    pub(super) configuration: usize,
    pub(super) speed: Estimate,
    pub(super) mass: Estimate,
    /// About when it begins and ends, s.
    pub(super) contact_s: f64,
    pub(super) separation_s: f64,
    pub(super) peak_n: f64,
    /// Noise of one sample, N rms.
    pub(super) noise_n: f64,
    /// Standard error of the zero that was removed, N.
    pub(super) zero_n: f64,
    /// Every sample of the window.
    pub(super) full: Series,
    /// What is fitted: the same, or means of a few samples each.
    pub(super) fitted: Series,
    /// Force without its mean and displacement without its line, before contact, where there is a displacement.
    pub(super) quiet: Vec<(f64, f64)>,
    /// Displacement of the full window, where there is one, m.
    pub(super) stroke_m: Vec<f64>,
}

impl Blow {
    /// Cuts a recording. The error is why it cannot be used, with the remedy, as a sentence without its end.
    pub(super) fn cut(
        entry: &Entry,
        recording: &Recording,
        full_scale_n: f64,
        configuration: usize,
        measured: bool,
    ) -> Result<Self, String> {
        let times = recording.times_s();
        let Some(raw) = recording.channel(FORCE) else { return Err("it has no force".to_owned()) };
        let top = raw.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let first = zero_of(&raw[..(raw.len() / 20).max(2)]);
        let restless = restless_n(raw);
        if top - first < LEAST_PEAK * restless {
            return Err(format!(
                "it has no blow: its highest force of {:.2} N is less than {LEAST_PEAK} times the noise of {restless:.2} N; leave it out, or check \
                 the trigger",
                top - first
            ));
        }
        let half = raw.iter().position(|force| force - first > 0.5 * (top - first)).unwrap_or(0);
        let crossing = (0..half).rev().find(|&place| raw[place] - first < 0.05 * (top - first)).unwrap_or(0);
        // As far before the foot again as the rise from there lasts, nothing is quiet for sure.
        let quiet = crossing.saturating_sub(half - crossing + 1);
        if quiet < LEAST_QUIET {
            return Err(format!(
                "there are {quiet} quiet samples before the contact at {:.4} s, so neither zero nor noise is known; let the recording begin \
                 earlier",
                times[crossing]
            ));
        }
        let zero = zero_of(&raw[..quiet]);
        let noise_n =
            (raw[..quiet].iter().map(|force| (force - zero).powi(2)).sum::<f64>() / (quiet - 1) as f64).sqrt();
        let force: Vec<f64> = raw.iter().map(|force| force - zero).collect();
        let foot_of = |peak: f64, noise: f64| (NOISES * noise).max(FOOT * peak);
        // The first contact, which need not be the highest of a row of bounces.
        let rough = foot_of(top - zero, noise_n);
        let after = (half..force.len()).find(|&place| force[place] < rough).unwrap_or(force.len());
        let peak = (half..after).max_by(|a, b| force[*a].total_cmp(&force[*b])).unwrap_or(half);
        let peak_n = force[peak];
        // A noiseless recording has its own resolution as noise.
        let noise_n = noise_n.max(1e-6 * peak_n);
        let foot = foot_of(peak_n, noise_n);
        let begins = (0..half).rev().find(|&place| force[place] < foot).unwrap_or(0);
        let Some(ends) = (peak..force.len()).find(|&place| force[place] < foot) else {
            return Err(format!(
                "the contact that begins at {:.4} s has not ended when the recording does: a robot that pushes on, or a clamp; record the \
                 rebound, or stop the robot at contact",
                times[begins]
            ));
        };
        if ends - begins < LEAST_SAMPLES {
            return Err(format!(
                "the contact at {:.4} s is {} samples long, and {LEAST_SAMPLES} are needed; sample faster",
                times[begins],
                ends - begins
            ));
        }
        if let Some(gap) = recording.gaps().iter().find(|gap| gap.after >= begins && gap.after < ends) {
            return Err(format!(
                "samples are missing from {:.4} to {:.4} s, inside the contact, so its momentum is not known; record it again",
                gap.from_s, gap.to_s
            ));
        }
        if let Some((from, count)) = clipped(&raw[begins..ends], &raw[..quiet], full_scale_n) {
            return Err(format!(
                "it is clipped at {:.2} N: {count} equal samples in a row from {:.4} s on; measure with a larger full scale (stated: {} N)",
                raw[begins + from],
                times[begins + from],
                full_scale_n
            ));
        }
        // Back-extrapolated along the rise from the foot to twice it; the fit finds the rest.
        let twice = (begins..peak).find(|&place| force[place] > 2.0 * foot).unwrap_or(begins + 1);
        let contact_s = (2.0 * times[begins] - times[twice]).max(times[begins] - 0.2 * (times[ends] - times[begins]));
        let separation_s = times[ends];
        let margin = MARGIN * (separation_s - contact_s);
        let start = times.partition_point(|time| *time < contact_s - margin);
        let mut stop = times.partition_point(|time| *time < separation_s + margin);
        // A second contact is not this one's.
        if let Some(again) = (ends + 1..stop).find(|&place| force[place] > 2.0 * foot) {
            stop = again;
        }
        let stroke = if measured { recording.channel("displacement_m") } else { None };
        let blow = Self {
            file: entry.file.clone(),
            configuration,
            speed: entry.impact_speed_m_per_s,
            mass: entry.effective_mass_kg,
            contact_s,
            separation_s,
            peak_n,
            noise_n,
            zero_n: noise_n / (quiet as f64).sqrt(),
            full: Series {
                times_s: times[start..stop].to_vec(),
                force_n: force[start..stop].to_vec(),
                depth: Vec::new(),
                group: 1.0,
            },
            fitted: Series::default(),
            quiet: stroke.map_or(Vec::new(), |stroke| {
                // A robot that comes is a straight line before contact.
                let rest = without_line(&times[..quiet], &stroke[..quiet]);
                force[..quiet].iter().copied().zip(rest).collect()
            }),
            stroke_m: stroke.map_or(Vec::new(), |stroke| stroke[start..stop].to_vec()),
        };
        Ok(blow)
    }

    /// How long it lasts, s.
    pub(super) fn duration_s(&self) -> f64 {
        self.separation_s - self.contact_s
    }

    /// Momentum that the force took, N·s, over the window.
    pub(super) fn impulse_ns(&self) -> f64 {
        let pairs = self.full.times_s.windows(2).zip(self.full.force_n.windows(2));
        pairs.map(|(time, force)| 0.5 * (force[0] + force[1]) * (time[1] - time[0])).sum()
    }

    /// Restitution by the momentum: e = J/(m·v₀) − 1 − g·T/v₀, with its standard deviation from what is stated.
    pub(super) fn restitution(&self, mass_kg: f64, speed_m_per_s: f64, gravity_m_per_s2: f64) -> (f64, f64) {
        let share = self.impulse_ns() / (mass_kg * speed_m_per_s);
        let doubt = (self.mass.sd / self.mass.value).hypot(self.speed.sd / self.speed.value);
        (share - 1.0 - gravity_m_per_s2 * self.duration_s() / speed_m_per_s, share * doubt)
    }

    /// Why mass, speed and force of this blow contradict each other, if they do.
    pub(super) fn contradiction(&self, gravity_m_per_s2: f64) -> Option<String> {
        let (restitution, sd) = self.restitution(self.mass.value, self.speed.value, gravity_m_per_s2);
        let doubt = 4.0 * sd + 0.02;
        let share = restitution + 1.0;
        if share > MOST_IMPULSE + doubt {
            return Some(format!(
                "its force takes {share:.2} times the momentum that is stated ({} kg at {} m/s), and a rebound takes 2 at most: the robot pushes \
                 on during the contact, or mass or speed is stated too small",
                self.mass.value, self.speed.value
            ));
        }
        (share < 1.0 - doubt).then(|| {
            format!(
                "its force takes {share:.2} times the momentum that is stated ({} kg at {} m/s), and to stop it takes 1 at least: mass or speed is \
                 stated too large, or part of the force misses the cell",
                self.mass.value, self.speed.value
            )
        })
    }

    /// Averages the window in groups for the fit.
    pub(super) fn group(&mut self) {
        let size = self.full.times_s.len().div_ceil(MOST_FITTED).max(1);
        let mean = |values: &[f64]| values.chunks_exact(size).map(zero_of).collect::<Vec<f64>>();
        self.fitted = Series {
            times_s: mean(&self.full.times_s),
            force_n: mean(&self.full.force_n),
            depth: self
                .full
                .depth
                .chunks_exact(size)
                .map(|chunk| {
                    let sum = chunk.iter().fold((0.0, 0.0), |sum, (x, v)| (sum.0 + x, sum.1 + v));
                    (sum.0 / size as f64, sum.1 / size as f64)
                })
                .collect(),
            group: size as f64,
        };
    }
}

fn zero_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Noise by what most samples differ from the one before, N rms: a blow is but a few of them.
fn restless_n(values: &[f64]) -> f64 {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    // 1.4826: a Gaussian's median; two samples have twice the variance of one.
    1.4826 * *median / 2.0_f64.sqrt()
}

/// What a straight line leaves.
fn without_line(times_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mean = (zero_of(times_s), zero_of(values));
    let product: f64 = times_s.iter().zip(values).map(|(time, value)| (time - mean.0) * (value - mean.1)).sum();
    let square: f64 = times_s.iter().map(|time| (time - mean.0).powi(2)).sum();
    let slope = product / square;
    times_s.iter().zip(values).map(|(time, value)| value - mean.1 - slope * (time - mean.0)).collect()
}

/// Where a clipped top begins, and how long it is.
///
/// Equal top samples in a row are one at full scale; below it they are one where the codes are finer than the noise, so that
/// chance does not repeat them.
fn clipped(force: &[f64], quiet: &[f64], full_scale_n: f64) -> Option<(usize, usize)> {
    let top = force.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let steps = quiet.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let code = steps.clone().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let noise_n = (steps.map(|step| step * step).sum::<f64>() / (2 * quiet.len()) as f64).sqrt();
    let from = force.iter().position(|force| *force == top)?;
    let count = force[from..].iter().take_while(|force| **force == top).count();
    let at_full_scale = top >= 0.98 * full_scale_n;
    (count >= CLIPPED && (at_full_scale || code < 0.5 * noise_n)).then_some((from, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_top_is_clipped_and_a_coarse_one_is_not() {
        let sine = |height: f64, code: f64| -> Vec<f64> {
            let value =
                |index: i32| (height * (f64::from(index) / 100.0 * std::f64::consts::PI).sin() / code).round() * code;
            (0..100).map(value).collect()
        };
        let quiet = |code: f64| -> Vec<f64> {
            (0..200).map(|index| (0.3 * (f64::from(index) * 12.99).sin() / code).round() * code).collect()
        };
        let cut: Vec<f64> = sine(100.0, 0.001).iter().map(|force| force.min(80.0)).collect();
        assert!(clipped(&cut, &quiet(0.001), 2224.0).is_some(), "below full scale");
        assert!(clipped(&sine(100.0, 0.001), &quiet(0.001), 2224.0).is_none());
        assert!(
            clipped(&sine(100.0, 2.0), &quiet(2.0), 2224.0).is_none(),
            "coarse codes repeat at the top of any pulse"
        );
        assert!(clipped(&sine(100.0, 2.0), &quiet(2.0), 100.0).is_some(), "at full scale it is believed");
    }
}
