//! A recording's force on the ADC's grid, with the quiet that the firmware needs around it.

use super::ReplayError;
use super::padding::{Quiet, idle_at_end_only, idle_samples};
use super::resample::{Stretch, resample};
use crate::recording::{FORCE, Recording};

/// From this rate on a recording is replayed at its own: an ADC of that rate would have sampled just that. Interpolated samples
/// have coloured noise and rounded toes, which cost the contact instant a sample or two. Every verdict filter can work at
/// this rate (ten samples for a period of 300 Hz, the fastest corner), and a blow of 1 ms still has the three samples
/// that confirm an onset.
pub const OWN_RATE_FROM_HZ: f64 = 3_000.0;
/// Rate that slower recordings are brought to unless another is asked for: that of the reference ADC.
pub const REFERENCE_RATE_HZ: f64 = 20_000.0;
/// Fastest: what the ADC reaches. A faster recording loses samples here, and that is said.
pub const LAST_RATE_HZ: f64 = 250_000.0;

/// Quiet that the firmware gets before the contact, s: it settles in 0.5 s and learns for another 0.5 s.
const QUIET_BEFORE_S: f64 = 1.0;
/// Quiet after the end, s: an impact is over when the force has been gone for the rest of the transient window, 0.5 s.
pub(super) const QUIET_AFTER_S: f64 = 1.0;
/// The same where the force does not go, because the zero has drifted away: the longest impact that is followed, 10 s, and one.
const LONGEST_AFTER_S: f64 = 11.0;
/// The most samples that are replayed: 17 minutes at 20 kS/s.
const MOST_SAMPLES: f64 = 2e7;
/// A force this far above the idle level at the end of the recording is a contact that was cut, N.
const CUT_N: f64 = 2.0;

/// Quiet at the end of a recording that begins under load is taken from at least so much, s.
const LEAST_END_S: f64 = 0.05;

/// So many equal samples at the highest force may be a clipped top.
const PLATEAU_SAMPLES: usize = 4;
/// A round top of n equal samples is a parabola within one step of the resolution: half as many samples beyond either edge it is
/// (n/2 + n/2)²/(n/2)² = 4 steps down at most. A clipped top falls off by more steps than this.
const PLATEAU_EDGE_STEPS: f64 = 6.0;
/// A step between two values larger than this part of their range is no resolution, but a steep flank without noise.
const COARSEST: f64 = 1.0 / 50.0;

/// Force as the sensor's cell would see it, sampled evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// Samples per second.
    pub rate_hz: f64,
    /// Instant of sample 0, s, in the recording's own time; the quiet made before it lies before the recording.
    pub origin_s: f64,
    /// Stretches of force, N, without loss in them; what lies between two of them was lost.
    pub stretches: Vec<Stretch>,
    /// Samples of the recording itself that are missing in its gaps.
    pub lost: u64,
    /// Number of the first sample of the recording itself.
    pub begin: u64,
    /// Whether something touched already when the recording began.
    pub begins_cut: bool,
    /// Number of the first sample after the end of the recording.
    pub end: u64,
    /// Whether something still touched when the recording ended.
    pub cut: bool,
    /// The force at which the recording's own chain was clipped, N, if it looks so.
    pub plateau_n: Option<f64>,
    /// What was done to the recording, one sentence each.
    pub notes: Vec<String>,
    /// What its idle samples go on with.
    quiet: Quiet,
}

impl Prepared {
    /// The instant of a sample in the recording's own time, s; the sample may be fractional.
    #[must_use]
    pub fn time_s(&self, sample: f64) -> f64 {
        self.origin_s + sample / self.rate_hz
    }

    /// Quiet after the end, N: what an impact needs to close, as long as the firmware may need it.
    pub fn after_end(&self) -> impl Iterator<Item = f64> + '_ {
        let in_recording = |sample: u64| sample as i64 - self.begin as i64;
        let longest = (LONGEST_AFTER_S * self.rate_hz).ceil() as u64;
        (0..longest).map(move |sample| self.quiet.after(in_recording(self.end), in_recording(self.end + sample)))
    }
}

/// Prepares the force of a recording; `file` is the name that errors give it.
///
/// The ADC runs at the recording's own rate, from [`OWN_RATE_FROM_HZ`] up to its fastest; a slower recording is resampled to
/// [`REFERENCE_RATE_HZ`]. `rate_hz` overrides both. `resolution_n` is the chain's step.
///
/// # Errors
/// There is no force, too little of it, or too much.
pub fn prepare(
    file: &str,
    recording: &Recording,
    rate_hz: Option<f64>,
    resolution_n: f64,
) -> Result<Prepared, ReplayError> {
    let Some(force) = recording.channel(FORCE) else {
        let has: Vec<&str> = recording.channels().iter().map(|channel| channel.name.as_str()).collect();
        return Err(ReplayError::NoForce { file: file.to_owned(), has: has.join(", ") });
    };
    let times = recording.times_s();
    let gaps = recording.gaps();
    let own_rate = own_rate_hz(recording);
    let rate = rate_hz
        .unwrap_or_else(|| if own_rate < OWN_RATE_FROM_HZ { REFERENCE_RATE_HZ } else { own_rate.min(LAST_RATE_HZ) });
    let duration_s = times[times.len() - 1] - times[0];
    let samples = duration_s * rate;
    if samples > MOST_SAMPLES {
        return Err(ReplayError::TooLong { file: file.to_owned(), duration_s, rate_hz: rate, samples });
    }

    let mut notes = Vec::new();
    if own_rate < rate * 0.999 {
        notes.push(format!(
            "recorded at {own_rate:.0} samples a second, brought to {rate:.0} by a monotone cubic: \
             a peak between two recorded samples is not restored"
        ));
    } else if own_rate > rate * 1.001 {
        notes.push(format!(
            "recorded at {own_rate:.0} samples a second, of which {rate:.0} are used: faster content is lost"
        ));
    }
    let mut stretches = resample(times, force, &gaps, rate);
    let interval = recording.median_interval_s();
    let lost: u64 = gaps.iter().map(|gap| ((gap.to_s - gap.from_s) / interval).round() as u64 - 1).sum();
    for gap in &gaps {
        notes.push(format!("samples are missing between {} s and {} s", gap.from_s, gap.to_s));
    }

    let plateau_n = plateau(force);
    if let Some((level, count)) = plateau_n {
        notes.push(format!(
            "{count} samples in a row stand at {level} N, the highest force: its chain was clipped there; that is taken \
             as the full scale unless `--full-scale` is given"
        ));
    }

    let (Some(idle), Some(end_of_last)) = (
        stretches.first().and_then(|stretch| idle_samples(&stretch.values, resolution_n)),
        stretches.last().map(|stretch| stretch.first + stretch.values.len() as u64),
    ) else {
        return Err(ReplayError::NotIdle { file: file.to_owned(), samples: times.len() });
    };
    let least = (LEAST_END_S * rate).ceil() as usize;
    let (first, last) = (&stretches[0].values, &stretches[stretches.len() - 1].values);
    let at_end = idle_at_end_only(first, last, least, resolution_n);
    let (idle, quiet) = match at_end {
        Some(count) => (0, Quiet::new(&last[last.len() - count..], end_of_last as i64 - count as i64, rate)),
        None => (idle, Quiet::new(&first[..idle], 0, rate)),
    };
    let begins_cut = at_end.is_some() && (first[0] - quiet.level()).abs() > CUT_N.max(6.0 * resolution_n);
    let lead = (QUIET_BEFORE_S * rate).ceil() as usize;
    let lead = lead.saturating_sub(idle);
    let how = if quiet.mirrored() { "mirrored" } else { "repeated" };
    if lead > 0 && at_end.is_some() {
        notes.push(format!(
            "it begins within a contact: {:.3} s of quiet were put before it, made of the idle samples at its end, {how}",
            lead as f64 / rate
        ));
    } else if lead > 0 {
        notes.push(format!(
            "it begins {:.4} s before the first departure from idle, too late for the firmware to settle: {:.3} s of quiet \
             were put before it, made of its own idle samples, {how}",
            idle as f64 / rate,
            lead as f64 / rate
        ));
    }
    if begins_cut {
        notes.push(format!(
            "{:.1} N act when it begins, at {} s: what came before is not known, the contact is marked truncated",
            stretches[0].values[0] - quiet.level(),
            times[0]
        ));
    }
    if lead > 0 {
        for stretch in &mut stretches {
            stretch.first += lead as u64;
        }
        stretches[0].first = 0;
        stretches[0].values.splice(0..0, (0..lead).map(|sample| quiet.at(sample as i64 - lead as i64)));
    }

    let last = stretches.last().expect("a recording has samples");
    let end = last.first + last.values.len() as u64;
    let cut = last.values.last().is_some_and(|force| (force - quiet.level()).abs() > CUT_N.max(6.0 * resolution_n));
    if cut {
        notes.push(format!(
            "it ends at {} s while {:.1} N act: a contact that lasts until then is cut, and marked truncated",
            times[times.len() - 1],
            last.values[last.values.len() - 1] - quiet.level()
        ));
    }
    Ok(Prepared {
        rate_hz: rate,
        origin_s: times[0] - lead as f64 / rate,
        stretches,
        lost,
        begin: lead as u64,
        begins_cut,
        end,
        cut,
        plateau_n: plateau_n.map(|(level, _)| level),
        notes,
        quiet,
    })
}

/// The level of a clipped top, N, and its longest run of samples.
fn plateau(force: &[f64]) -> Option<(f64, usize)> {
    let mut levels = force.to_vec();
    levels.sort_by(f64::total_cmp);
    let (lowest, highest) = (levels[0], levels[levels.len() - 1]);
    let step = levels.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let edge = PLATEAU_EDGE_STEPS * step.min(COARSEST * (highest - lowest));
    let falls_off = |value: Option<&f64>| value.is_some_and(|value| highest - value > edge);
    let mut longest = 0;
    let mut from = 0;
    while let Some(start) = force[from..].iter().position(|value| *value == highest).map(|place| from + place) {
        let end = force[start..].iter().position(|value| *value != highest).map_or(force.len(), |place| start + place);
        let beyond = (end - start).div_ceil(2);
        let before = start.checked_sub(beyond).and_then(|place| force.get(place));
        if falls_off(before) && falls_off(force.get(end - 1 + beyond)) {
            longest = longest.max(end - start);
        }
        from = end;
    }
    (highest > CUT_N && longest >= PLATEAU_SAMPLES).then_some((highest, longest))
}

/// Samples per second, from the mean of all steps that are no gaps: time columns are rounded, their median with them.
fn own_rate_hz(recording: &Recording) -> f64 {
    let times = recording.times_s();
    let gaps = recording.gaps();
    let missing: f64 = gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
    let steps = times.len() - 1 - gaps.len();
    let rate = steps as f64 / (times[times.len() - 1] - times[0] - missing);
    // Ten parts in a million are the rounding of the time column, not the clock.
    let whole = rate.round();
    if (rate / whole - 1.0).abs() < 1e-5 { whole } else { rate }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Channel;

    fn recording(times: Vec<f64>, force: impl Fn(f64) -> f64) -> Recording {
        let values = times.iter().map(|time| force(*time)).collect();
        Recording::new(times, vec![Channel { name: FORCE.to_owned(), values }]).unwrap()
    }

    fn pulse(time: f64) -> f64 {
        if (0.0..0.02).contains(&time) { 100.0 * (std::f64::consts::PI * time / 0.02).sin() } else { 0.0 }
    }

    fn times(from: f64, to: f64, rate: f64) -> Vec<f64> {
        (0..).map(|index| from + f64::from(index) / rate).take_while(|time| *time < to).collect()
    }

    #[test]
    fn a_slow_recording_comes_to_the_adc_s_rate_and_keeps_its_time() {
        let prepared = prepare("a.csv", &recording(times(-0.2, 0.5, 1_250.0), pulse), None, 0.07).unwrap();
        assert_eq!(prepared.rate_hz, 20_000.0);
        assert_eq!(prepared.stretches.len(), 1);
        let values = &prepared.stretches[0].values;
        let peak = values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!((prepared.time_s(peak.0 as f64) - 0.01).abs() < 0.8e-3);
        assert!(prepared.origin_s < -1.0);
        assert!(prepared.notes.iter().any(|note| note.contains("1250")), "{:?}", prepared.notes);
        assert!(prepared.notes.iter().any(|note| note.contains("repeated")), "{:?}", prepared.notes);
    }

    #[test]
    fn a_fast_recording_keeps_its_rate() {
        let prepared = prepare("a.csv", &recording(times(-0.001, 0.1, 25_600.0), pulse), None, 0.07).unwrap();
        assert_eq!(prepared.rate_hz, 25_600.0);
        assert!(prepared.notes.iter().any(|note| note.contains("mirrored")), "{:?}", prepared.notes);
        let beyond = prepare("a.csv", &recording(times(-0.001, 0.1, 500_000.0), pulse), None, 0.07).unwrap();
        assert_eq!(beyond.rate_hz, 250_000.0);
        assert!(beyond.notes.iter().any(|note| note.contains("faster content is lost")), "{:?}", beyond.notes);
    }

    #[test]
    fn a_recording_with_enough_quiet_gets_none_before_it() {
        let prepared = prepare("a.csv", &recording(times(-2.0, 0.5, 20_000.0), pulse), None, 0.07).unwrap();
        assert_eq!(prepared.notes, [] as [String; 0]);
        assert_eq!(prepared.origin_s, -2.0);
    }

    #[test]
    fn gaps_stay_gaps() {
        let times = times(-2.0, 0.5, 20_000.0).into_iter().filter(|time| !(0.0049..0.0061).contains(time)).collect();
        let prepared = prepare("a.csv", &recording(times, pulse), None, 0.07).unwrap();
        assert_eq!(prepared.stretches.len(), 2);
        let end = prepared.stretches[0].first + prepared.stretches[0].values.len() as u64;
        assert_eq!(prepared.stretches[1].first - end, prepared.lost);
        assert!((22..=26).contains(&prepared.lost), "{}", prepared.lost);
    }

    #[test]
    fn a_contact_that_the_end_cuts_is_said() {
        let prepared = prepare("a.csv", &recording(times(-2.0, 0.01, 20_000.0), pulse), None, 0.07).unwrap();
        assert!(prepared.cut);
        assert_eq!(prepared.lost, 0);
        assert_eq!(prepared.time_s(prepared.end as f64), -2.0 + (prepared.end as f64) / 20_000.0);
        assert!(prepared.notes.iter().any(|note| note.contains("it ends at")), "{:?}", prepared.notes);
    }

    #[test]
    fn a_recording_that_begins_within_the_pulse_gets_its_quiet_from_its_end() {
        let prepared = prepare("a.csv", &recording(times(0.006, 0.5, 10_000.0), pulse), None, 0.07).unwrap();
        assert!(prepared.begins_cut);
        let whole = prepared.stretches[0].values.iter().filter(|force| **force > 99.0).count();
        assert!(whole < 60, "the pulse is there once: {whole}");
        assert!(prepared.notes.iter().any(|note| note.contains("when it begins, at 0.006 s")), "{:?}", prepared.notes);
        let whole = prepare("a.csv", &recording(times(0.0, 0.5, 10_000.0), pulse), None, 0.07).unwrap();
        assert!(!whole.begins_cut);
    }

    #[test]
    fn a_clipped_top_is_told_from_a_round_one() {
        let clipped = recording(times(-0.2, 0.5, 10_000.0), |time| pulse(time).min(80.0));
        let prepared = prepare("a.csv", &clipped, None, 0.07).unwrap();
        assert_eq!(prepared.plateau_n, Some(80.0));
        // Written coarsely, the round top is flat, too.
        for step in [0.1, 0.5, 1.0, 2.0] {
            let coarse = recording(times(-0.2, 0.5, 10_000.0), |time| (pulse(time) / step).round() * step);
            assert_eq!(prepare("a.csv", &coarse, None, 0.07).unwrap().plateau_n, None, "{step}");
        }
        assert_eq!(
            prepare("a.csv", &recording(times(-0.2, 0.5, 10_000.0), pulse), None, 0.07).unwrap().plateau_n,
            None
        );
    }

    #[test]
    fn what_cannot_be_replayed_is_said() {
        let height = Channel { name: "height_m".to_owned(), values: vec![0.0; 10] };
        let fall = Recording::new(times(0.0, 9.5, 1.0), vec![height]).unwrap();
        let error = prepare("ball.csv", &fall, None, 0.07).unwrap_err();
        assert_eq!(error.to_string(), "ball.csv: there is no column `force_N`; it has height_m");
        let short = recording(vec![0.0, 1e-4], pulse);
        assert!(matches!(prepare("a.csv", &short, None, 0.07), Err(ReplayError::NotIdle { .. })));
        let long = recording((0..100).map(|index| f64::from(index) * 1e6).collect(), pulse);
        assert!(matches!(prepare("a.csv", &long, None, 0.07), Err(ReplayError::TooLong { .. })));
    }
}
