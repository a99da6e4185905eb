//! The campaign as the fit takes it: samples that matter, thinned to the rate that the pulse needs, with their noise.
//!
//! ```text
//!   quiet        contact                     after
//! ──────────┬──╱────────╲──┬──────────────────────
//!  noise,   │  thinned to some hundred   │ as long as
//!  offset   │  samples for a contact     │ it tells anything
//! ```

use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use statrs::statistics::Statistics as _;
use thud_sim::rig::Quantity;

use super::convention::{Convention, convention, released};
use super::noise::{Noise, scatters};
use super::sampling::bends;
use super::spectrum::without_mains;
use super::work::Work;
use super::{DiagnosisError, Note};
use crate::campaign::{Campaign, Estimate, Loaded, Observed, Rig, RigKind};
use crate::decimal::significant;

/// Samples that one contact is thinned to, at least.
const SAMPLES_PER_CONTACT: f64 = 110.0;
/// A thinned recording keeps what rings below half of this, Hz: moving pieces do so at 170 to 600 Hz (table of mechanisms).
const KEPT_RATE_HZ: f64 = 5_000.0;
/// The same of a fall, which has no contact to be resolved: a line of the mains' third harmonic, a gap of a millisecond.
const FALL_RATE_HZ: f64 = 1_000.0;
/// What the usual load cell can read, N (500 lbf), and of what falls a camera or a laser, m.
const CELL_N: f64 = 2224.0;
const FRAME_M: f64 = 1.0;
/// Quiet kept before contact, s: enough for the offset and for a period of the mains.
const QUIET_S: f64 = 0.05;
/// Fewer samples in a contact do not show its form.
const FEWEST_PER_CONTACT: f64 = 8.0;
/// Coefficients of the smooth course of a fall: gravity and a drag that grows with the speed bend it little over its length.
const COURSE: usize = 8;
/// Samples for each of them, at least; what a course can follow is no noise.
const MEANS_PER_COEFFICIENT: usize = 12;
/// Instants of a release or a gap that are tried at a time.
const INSTANTS: usize = 12;
/// Fewer positions have no parabola beside their noise.
const WAY: usize = 8;
/// Parts of the way before contact that are looked at, and from how many standard deviations on a variance is larger than another.
const COMING: [f64; 3] = [1.0, 0.7, 0.5];
const SURELY_MORE: f64 = 6.0;
/// Part of the ideal contact's depth that is little: what turns so near to the farthest turns as far in, what is so far out has left.
const LITTLE: f64 = 0.3;
/// It stood where that leaves less than this part of the squares.
const STOOD: f64 = 0.8;
/// Samples are missing where a gap leaves less than this part of the squares: of 400 times 96 means of noise that goes together (0.7 from one
/// to the next) chance left 0.44 at least, a gap of eight frames under 2 mm of noise leaves a tenth.
const WHOLE: f64 = 0.4;
/// Fewer quiet samples of a recording do not show how strong its noise is.
pub(super) const FEWEST_QUIET: usize = 12;
/// From when, before contact, to when further channels are asked, in contact times: how fast the robot comes and leaves is seen by then. Before, whatever
/// a simulator has let it do (wait at the rig, come along a parabola that it had not begun yet); after, a motion that the rig does not feel any more:
/// along a free flight the smallest error of a speed becomes hundreds of a gauge's deviations, and a baseline that follows them is of another rig.
const ASKED: [f64; 2] = [0.5, 1.6];
/// Quiet time left out before the guessed contact, in contact times.
const GUARD: f64 = 0.05;
/// A beginning whose values scatter by more than this times the noise is not at rest.
const LIVELIEST: f64 = 3.0;
/// Samples whose times between them differ by no more than this part of them are of one rate.
const RATE_TOLERANCE: f64 = 0.1;
/// Samples are spaced alike where what a tenth, half and nine tenths of the steps are shorter than differs by this factor at most
const STEADY: f64 = 1.3;
/// from what this part of the steps more or less are shorter than: of samples of which a tenth is missing nine tenths of the steps may be one or two.
const STEPS_MORE: f64 = 0.09;
/// The median size of a Gaussian, in its deviation.
const GAUSSIAN_MEDIAN: f64 = 0.6745;
/// The most samples of a recording that are fitted.
const MOST_SAMPLES: usize = 4_000;

/// Everything that is fitted.
#[derive(Clone, Debug)]
pub struct Problem {
    /// What is believed of the rig.
    pub rig: Rig,
    /// What of the rig's motion each series shows.
    pub channels: Vec<ChannelModel>,
    /// The recordings, in the order in which they were made.
    pub recordings: Vec<Prepared>,
    /// Names of the configurations; each shares one error of the mass.
    pub configurations: Vec<String>,
    /// Relative uncertainty of each configuration's mass.
    pub mass_sd: Vec<f64>,
    /// [`Campaign::is_of_places`].
    pub is_of_places: bool,
    /// What has been done about it; of all that is made from it, too.
    pub work: Arc<Work>,
}

/// What a channel shows.
#[derive(Clone, Debug)]
pub struct ChannelModel {
    /// Name of its column.
    pub column: String,
    /// What of the motion it shows.
    pub quantity: Quantity,
    /// 1, or −1 where the channel counts the other way round.
    pub sign: f64,
    /// What 1 of its unit stands for in the measuring chain, N; none: it does not come by way of that.
    pub newtons: Option<f64>,
    /// What holds a dropped mass up before contact, m/s²: gravity where its position comes at a constant speed, else 0.
    pub lift_m_per_s2: f64,
}

/// A recording, ready to be fitted.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Its file without folder and extension, as the contract names recordings.
    pub name: String,
    /// Its file, as the campaign names it.
    pub file: String,
    /// Instants in the recording's own time, s.
    pub times_s: Vec<f64>,
    /// Weights of the slopes on either side in the second differences of a series, from the second instant on.
    pub bends: Vec<[f64; 2]>,
    /// One series for each channel: values at the instants.
    pub series: Vec<Vec<f64>>,
    /// What each channel shows before contact, means over as many samples as the series'; of a fall what it shows beside a smooth course.
    pub quiet: Vec<Vec<f64>>,
    /// The noise of each channel, in means over as many samples as the series'.
    pub noise: Vec<Noise>,
    /// How many of the converter's samples each value is the mean of.
    pub averaged: usize,
    /// Time between two samples of the converter, s.
    pub sample_s: f64,
    /// Speed at contact, as believed.
    pub speed: Estimate,
    /// Effective mass, as believed.
    pub mass: Estimate,
    /// Number of its configuration.
    pub configuration: usize,
    /// Place in the campaign.
    pub order: u32,
    /// A first guess of the instant of contact, s.
    pub contact_guess_s: f64,
    /// A first guess of each channel's offset.
    pub offset_guess: Vec<f64>,
    /// Duration of the ideal contact, s.
    pub contact_time_s: f64,
    /// From when to when, s after the guessed contact, further channels are asked.
    pub asked_s: Range<f64>,
    /// Every sample of the observed channel, as recorded.
    pub raw: Samples,
}

/// Every sample of a channel.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Instants in the recording's own time, s.
    pub times_s: Vec<f64>,
    /// Values.
    pub values: Vec<f64>,
    /// Standard deviation in the quiet before contact; none where there is none.
    pub quiet_rms: Option<f64>,
}

impl Prepared {
    /// Its first sample, s in its own time: what is long before contact may have been left out.
    #[must_use]
    pub fn begins_s(&self) -> f64 {
        self.raw.times_s.first().map_or(self.times_s[0], |first_s| first_s.min(self.times_s[0]))
    }

    /// How long it goes on after the first touch or the release, s.
    #[must_use]
    pub fn lasts_s(&self) -> f64 {
        self.times_s.last().map_or(0.0, |end| end - self.contact_guess_s)
    }

    /// Whether it still shows an instant, s after the first touch or the release; if not, what happens then never comes.
    #[must_use]
    pub fn shows(&self, instant_s: f64) -> bool {
        instant_s <= self.lasts_s()
    }

    /// An instant after the first touch or the release that never comes, s: twice as late as anything it shows.
    #[must_use]
    pub fn never_s(&self) -> f64 {
        2.0 * self.lasts_s()
    }

    /// What its speed is counted in, m/s: the stated one, or its uncertainty where it is dropped from rest.
    #[must_use]
    pub fn speed_scale(&self) -> f64 {
        match self.speed.value.abs() {
            0.0 if self.speed.sd > 0.0 => self.speed.sd,
            0.0 => 1.0,
            stated => stated,
        }
    }

    /// Number of values, over all series.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.series.len() * self.times_s.len()
    }

    /// Which samples of a further channel are asked.
    fn asked(&self) -> Range<usize> {
        let until = |since_s: f64| self.times_s.partition_point(|time| *time < self.contact_guess_s + since_s);
        until(self.asked_s.start)..until(self.asked_s.end)
    }

    /// Number of values that are asked, over all series.
    fn asked_rows(&self) -> usize {
        self.times_s.len() + (self.series.len() - 1) * self.asked().len()
    }

    /// What a model leaves of it, whitened.
    #[must_use]
    pub fn left_by(&self, model: &[f64]) -> Vec<f64> {
        let observed = self.series.iter().flatten();
        let mut residual: Vec<f64> = observed.zip(model).map(|(observed, model)| observed - model).collect();
        self.whiten(&mut residual);
        residual
    }

    /// Whitens, in place, a column that holds a value for each of the fitted ones; where a further channel is not asked it is nothing.
    pub fn whiten(&self, column: &mut [f64]) {
        let asked = self.asked();
        for (channel, (noise, series)) in
            self.noise.iter().zip(column.chunks_mut(self.times_s.len().max(1))).enumerate()
        {
            noise.whiten(series);
            if channel > 0 {
                series[..asked.start].fill(0.0);
                series[asked.end..].fill(0.0);
            }
        }
    }
}

impl Problem {
    /// The same with what is observed, and no further channels.
    #[must_use]
    pub fn without_further_channels(&self) -> Self {
        let mut alone = self.clone();
        alone.channels.truncate(1);
        for recording in &mut alone.recordings {
            recording.series.truncate(1);
            recording.quiet.truncate(1);
            recording.noise.truncate(1);
            recording.offset_guess.truncate(1);
        }
        alone
    }

    /// The same up to so many times the duration of the ideal contact: what comes later depends on how the robot has left, and a small
    /// error there is a large one at the next contact.
    #[must_use]
    pub fn until(&self, contacts: f64) -> Self {
        let mut shorter = self.clone();
        for recording in &mut shorter.recordings {
            let end_s = recording.contact_guess_s + contacts * recording.contact_time_s;
            let samples = recording.times_s.partition_point(|time| *time <= end_s).max(2).min(recording.times_s.len());
            recording.times_s.truncate(samples);
            recording.series.iter_mut().for_each(|series| series.truncate(samples));
        }
        shorter
    }

    /// Number of fitted values.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.recordings.iter().map(Prepared::asked_rows).sum()
    }

    /// How exactly the quiet before contact shows a recording's zero: one standard deviation. A fall has its first sample alone; what comes
    /// is at its zero when it meets the rig, which its way shows no better than that instant is known: `None`.
    #[must_use]
    pub fn zero_deviation(&self, recording: usize, channel: usize) -> Option<f64> {
        if comes(self.channels[channel].quantity, self.rig.kind) {
            return None;
        }
        let recording = &self.recordings[recording];
        let quiet = match self.rig.kind {
            RigKind::Fall => 1,
            _ => recording.times_s.partition_point(|time| *time < recording.contact_guess_s).max(1),
        };
        let mut constant = vec![1.0; quiet];
        recording.noise[channel].whiten(&mut constant);
        Some(1.0 / constant.iter().map(|value| value * value).sum::<f64>().sqrt())
    }

    /// Noise of the observed channel at its own sample rate: what the recordings show before contact, or what is stated.
    #[must_use]
    pub fn noise_rms(&self) -> f64 {
        let seen: Vec<f64> = self.recordings.iter().filter_map(|recording| recording.raw.quiet_rms).collect();
        // A quantiser that swallows the noise shows none.
        if seen.iter().all(|rms| *rms == 0.0) {
            return self.recordings[0].noise[0].rms();
        }
        (seen.iter().map(|rms| rms * rms).sum::<f64>() / seen.len() as f64).sqrt()
    }

    /// Peak force of a recording, N: as recorded, or as the stated rig would have it where no channel is a force.
    #[must_use]
    pub fn peak_n(&self, recording: usize) -> f64 {
        let number = self.channels.iter().position(|channel| channel.column == crate::recording::FORCE);
        let recording = &self.recordings[recording];
        match number {
            Some(number) => {
                recording.series[number].iter().copied().fold(0.0, f64::max) - recording.offset_guess[number]
            }
            None => {
                let stiffness = crate::model::simulated(&self.rig).effective_stiffness_n_per_m();
                recording.speed.value.abs() * (stiffness * recording.mass.value).sqrt()
            }
        }
    }

    /// Whether there is a rig with springs.
    #[must_use]
    pub fn has_springs(&self) -> bool {
        self.rig.kind != RigKind::Fall
    }

    /// Over how long after the first touch an instant is sought that a recording has for itself, s: over the contact, or all of a fall.
    #[must_use]
    pub fn eventful_s(&self, recording: usize) -> f64 {
        let recording = &self.recordings[recording];
        if self.has_springs() { recording.contact_time_s } else { recording.lasts_s() }
    }

    /// Prepares a campaign.
    ///
    /// # Errors
    /// What makes it unusable, with the remedy.
    pub fn new(loaded: &Loaded, notes: &mut Vec<Note>) -> Result<Self, DiagnosisError> {
        let campaign = &loaded.campaign;
        let mut configurations: Vec<String> = Vec::new();
        let mut mass_sd: Vec<(f64, usize)> = Vec::new();
        let observed = campaign.chain.observed;
        let mut columns = vec![observed.column().to_owned()];
        for other in [Observed::Force, Observed::Displacement].map(Observed::column) {
            let everywhere = loaded.recordings.iter().all(|recording| recording.channel(other).is_some());
            if other != observed.column() && everywhere && campaign.rig.kind != RigKind::Fall {
                columns.push(other.to_owned());
            }
        }
        let conventions: Vec<Convention> = columns.iter().map(|column| convention(loaded, column)).collect();
        if conventions.iter().any(|convention| convention.lift_m_per_s2 != 0.0) {
            notes.push(Note::general(
                "the position comes at a constant speed before contact, as nothing that falls does; gravity counts from contact on",
            ));
        }
        let comes: Vec<bool> =
            conventions.iter().map(|convention| comes(convention.quantity, campaign.rig.kind)).collect();
        let released = released(loaded, &columns[0], conventions[0]);
        if released.is_some() {
            notes.push(Note::general(
                "the speeds that are stated are those at the end of each fall; what it has been let go with follows from its way",
            ));
        }
        let mut prepared = Vec::new();
        let mut rests = Vec::new();
        let mut rebounds = 0;
        let mut all_steady = true;
        for (order, (entry, recording)) in campaign.recordings.iter().zip(&loaded.recordings).enumerate() {
            // Without a name, recordings of one believed mass are of one pose.
            let configuration = entry
                .configuration
                .clone()
                .unwrap_or_else(|| format!("{} kg", significant(entry.effective_mass_kg.value, 4)));
            let number = configurations.iter().position(|known| *known == configuration).unwrap_or_else(|| {
                configurations.push(configuration);
                mass_sd.push((0.0, 0));
                configurations.len() - 1
            });
            mass_sd[number].0 += entry.effective_mass_kg.sd / entry.effective_mass_kg.value;
            mass_sd[number].1 += 1;
            let raw = Raw {
                kind: campaign.rig.kind,
                times_s: recording.times_s(),
                channels: columns.iter().filter_map(|column| recording.channel(column)).collect(),
                interval_s: recording.median_interval_s(),
                contact_time_s: contact_time_s(&campaign.rig, entry.effective_mass_kg.value),
                speed_m_per_s: entry.impact_speed_m_per_s.value,
                gravity_m_per_s2: campaign.rig.gravity_along_impact_m_per_s2,
                stated_noise: campaign.chain.noise_rms,
                comes: comes.clone(),
                sign: conventions[0].sign,
                jumps: conventions[0].quantity == Quantity::Acceleration,
            };
            let file = entry.file.clone();
            let name = std::path::Path::new(&file).file_stem().map_or(file.clone(), |s| s.to_string_lossy().into());
            let Some(thinned) = raw.thin() else {
                notes.push(Note::about(&name, "nothing in it rises above its noise; it is left out"));
                continue;
            };
            if let Some(per_contact) = thinned.too_slow {
                notes.push(Note::about(
                    &name,
                    &format!(
                        "only {per_contact:.0} samples in a contact of {:.1} ms: its form is hardly seen; sample at {:.0} Hz or more",
                        1e3 * raw.contact_time_s,
                        SAMPLES_PER_CONTACT / 2.0 / raw.contact_time_s
                    ),
                ));
            }
            all_steady &= thinned.steady;
            rebounds += usize::from(thinned.kept < recording.times_s().len());
            prepared.push(Prepared {
                name,
                file,
                bends: bends(&thinned.times_s),
                times_s: thinned.times_s,
                series: thinned.series,
                quiet: (0..columns.len()).map(|channel| thinned.rest.means(channel, thinned.rest.averaged)).collect(),
                noise: Vec::new(),
                averaged: thinned.rest.averaged,
                sample_s: raw.interval_s,
                speed: released.as_ref().map_or(entry.impact_speed_m_per_s, |released| released[order]),
                mass: entry.effective_mass_kg,
                configuration: number,
                order: order as u32,
                contact_guess_s: thinned.contact_guess_s,
                offset_guess: thinned.offset_guess,
                contact_time_s: raw.contact_time_s,
                asked_s: raw.asked_s(),
                raw: Samples {
                    times_s: recording.times_s()[..thinned.kept].to_vec(),
                    values: raw.channels[0][..thinned.kept].to_vec(),
                    quiet_rms: None,
                },
            });
            rests.push(thinned.rest);
        }
        if prepared.is_empty() {
            return Err(DiagnosisError::Nothing);
        }
        let quiet = |rest: &Rest| rest.channels[0].len() >= FEWEST_QUIET;
        let shown: Vec<&[f64]> = rests.iter().filter(|rest| quiet(rest)).map(|rest| &rest.channels[0][..]).collect();
        let showing = prepared.iter_mut().zip(&rests).filter(|(_, rest)| quiet(rest));
        for ((recording, _), rms) in showing.zip(scatters(&shown)) {
            recording.raw.quiet_rms = Some(rms);
        }
        if rebounds > 0 {
            notes.push(Note::general(&format!(
                "{rebounds} recordings show the mass fall again after its first rebound; they are compared up to there, since when it comes \
                 back magnifies every small loss"
            )));
        }
        let thinned_by = prepared.iter().map(|recording| recording.series[0].len()).max().unwrap_or(0);
        if thinned_by < 20 {
            return Err(DiagnosisError::TooFewSamples { most: thinned_by });
        }
        for (number, column) in columns.iter().enumerate() {
            let noises = noises(&rests, number, all_steady).unwrap_or_else(|| {
                let stated = if number == 0 { campaign.chain.noise_rms } else { 0.0 };
                let seen = scatter(&prepared, number);
                // What is stated and does not scatter from sample to sample is slow; what scatters is less in means over several.
                let quick = third_differences(prepared.iter().map(|recording| {
                    let Samples { times_s, values, .. } = &recording.raw;
                    (times_s.as_slice(), values.as_slice())
                }));
                let slow = (stated.powi(2) - quick.powi(2)).max(0.0).sqrt();
                let seen = seen.max(quantum(&prepared, number) / 12.0_f64.sqrt());
                let taken = seen.hypot(slow);
                let (taken, seen) = if taken > 0.0 { (taken, seen) } else { [spread(&prepared, number) * 1e-3; 2].into() };
                let noise = Noise::unseen(taken, seen);
                notes.push(Note::general(&format!(
                    "{column}: too little quiet before contact to see the noise; taken as {}, {} rms ({}scatter from sample to sample {}). Begin recordings 50 ms before contact",
                    if noise.is_white() { "white" } else { "alike in neighbouring samples" },
                    significant(taken, 3),
                    if number == 0 { format!("stated {stated}, ") } else { String::new() },
                    significant(seen, 3),
                )));
                vec![noise; prepared.len()]
            });
            prepared.iter_mut().zip(noises).for_each(|(recording, noise)| recording.noise.push(noise));
        }
        // The chain is that of the force; where none was recorded, of what was observed.
        let is_force = |convention: &Convention| convention.quantity == Quantity::CellForce;
        let chained = conventions.iter().position(is_force).unwrap_or(0);
        let channels = columns
            .iter()
            .zip(&conventions)
            .enumerate()
            .map(|(number, (column, Convention { quantity, sign, lift_m_per_s2 }))| ChannelModel {
                column: column.clone(),
                quantity: *quantity,
                sign: *sign,
                newtons: (number == chained).then(|| newtons(campaign, *quantity)),
                lift_m_per_s2: *lift_m_per_s2,
            })
            .collect();
        let mass_sd = mass_sd.into_iter().map(|(sum, count)| sum / count.max(1) as f64).collect();
        Ok(Self {
            rig: campaign.rig.clone(),
            channels,
            recordings: prepared,
            configurations,
            mass_sd,
            is_of_places: campaign.is_of_places(),
            work: Arc::default(),
        })
    }
}

/// The force, N, on the stated rig or robot at which a quantity is 1 of its unit: N/m of a displacement, kg of an acceleration. The place
/// of what falls has no such rig: what disturbs its instrument disturbs it by the same part of what it can read.
fn newtons(campaign: &Campaign, quantity: Quantity) -> f64 {
    let has_springs = campaign.rig.kind != RigKind::Fall;
    let rig = crate::model::simulated(&campaign.rig);
    match quantity {
        Quantity::Acceleration => {
            let masses = campaign.recordings.iter().map(|recording| recording.effective_mass_kg.value);
            median(masses.collect()).unwrap_or(1.0)
        }
        Quantity::Stroke if has_springs => rig.body_stiffness_n_per_m,
        Quantity::Position | Quantity::Depth if has_springs => rig.effective_stiffness_n_per_m(),
        Quantity::Position => CELL_N / FRAME_M,
        _ => 1.0,
    }
}

/// What a recording shows before contact, as the converter gave it.
struct Rest {
    /// One series for each channel; empty in a short fall.
    channels: Vec<Vec<f64>>,
    /// Time between two samples, s.
    interval_s: f64,
    /// How many samples are averaged into a fitted one.
    averaged: usize,
}

impl Rest {
    /// Means of a channel over so many samples.
    fn means(&self, channel: usize, over: usize) -> Vec<f64> {
        self.channels[channel].chunks_exact(over).map(mean).collect()
    }

    fn is_as_quick_as(&self, other: &Self) -> bool {
        (self.interval_s / other.interval_s - 1.0).abs() < RATE_TOLERANCE
    }
}

/// A channel's noise in each recording. Means over more samples are less noisy and otherwise coloured, so that those of one length have
/// their model, from the rest of all recordings of that rate; where these are too few, what all show together stands for it. `None`
/// where all are too few.
fn noises(rests: &[Rest], channel: usize, coloured: bool) -> Option<Vec<Noise>> {
    let of = |stretches: Vec<Vec<f64>>| Noise::of_quiet(&stretches, coloured);
    let together = of(rests.iter().map(|rest| rest.means(channel, rest.averaged)).collect())?;
    let mut noises: Vec<Noise> = Vec::new();
    for (number, rest) in rests.iter().enumerate() {
        let alike = |other: &&Rest| rest.is_as_quick_as(other);
        let known = rests[..number].iter().position(|other| alike(&other) && other.averaged == rest.averaged);
        noises.push(known.map(|known| noises[known].clone()).unwrap_or_else(|| {
            let stretches = rests.iter().filter(alike).map(|other| other.means(channel, rest.averaged));
            of(stretches.collect()).unwrap_or_else(|| together.clone())
        }));
    }
    Some(noises)
}

/// Noise as the scatter of neighbouring samples shows it, over all recordings.
fn scatter(prepared: &[Prepared], channel: usize) -> f64 {
    third_differences(prepared.iter().map(|recording| (&recording.times_s[..], &recording.series[channel][..])))
}

/// Least difference of two neighbouring values that is not zero: the step of a quantiser, where there is one.
fn quantum(prepared: &[Prepared], channel: usize) -> f64 {
    let differences =
        prepared.iter().flat_map(|recording| recording.series[channel].windows(2)).map(|two| (two[1] - two[0]).abs());
    let least = differences.filter(|difference| *difference > 0.0).fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// The scatter of one stretch.
fn steps(times_s: &[f64], values: &[f64]) -> f64 {
    third_differences(std::iter::once((times_s, values)))
}

/// The third difference of white noise has the variance 1 + 9 + 9 + 1, and of anything that is nearly a parabola over four samples
/// nothing. Divided by the distances where these are not even: a falling body is millimetres on in the milliseconds by which a camera's instants
/// stray. The median, so that corners do not count.
fn third_differences<'a>(stretches: impl Iterator<Item = (&'a [f64], &'a [f64])>) -> f64 {
    let difference = |(times, values): (&[f64], &[f64])| {
        let weight = |place: usize| {
            let others = times.iter().enumerate().filter(|(other, _)| *other != place);
            others.map(|(_, other)| times[place] - other).product::<f64>().recip()
        };
        let weights = [0, 1, 2, 3].map(weight);
        let sum: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
        sum.abs() / weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
    };
    let differences = stretches.flat_map(|(times, values)| times.windows(4).zip(values.windows(4)).map(difference));
    median(differences.collect()).map_or(0.0, |median| median / GAUSSIAN_MEDIAN)
}

/// Middle and standard deviation of a stretch, as its medians tell them.
fn rest(values: &[f64]) -> Option<(f64, f64)> {
    let zero = median(values.to_vec())?;
    let deviation = median(values.iter().map(|value| (value - zero).abs()).collect())?;
    Some((zero, deviation / GAUSSIAN_MEDIAN))
}

/// The middle one; `None` of none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn spread(prepared: &[Prepared], channel: usize) -> f64 {
    prepared
        .iter()
        .flat_map(|recording| &recording.series[channel])
        .fold(0.0, |most: f64, value| most.max(value.abs()))
        .max(1e-12)
}

/// Half a period of the mass on the springs, s; in a fall there are none, and a tenth of a second stands for it.
pub(super) fn contact_time_s(rig: &Rig, mass_kg: f64) -> f64 {
    match rig.kind {
        RigKind::Fall => 0.1,
        _ => std::f64::consts::PI * (mass_kg / crate::model::simulated(rig).effective_stiffness_n_per_m()).sqrt(),
    }
}

/// What a fall shows beside standing still until it is let go and a smooth course from then on, a polynomial of some coefficients that may
/// have one gap: noise, where means over so many samples are enough to tell them from it; else nothing. And when it is let go: the first sample, where nothing
/// shows that it stood.
fn beside_course(times_s: &[f64], values: &[f64], averaged: usize) -> (Vec<f64>, usize) {
    let means = values.len() / averaged;
    if means < COURSE * MEANS_PER_COEFFICIENT {
        return (Vec::new(), 0);
    }
    let begun = beside_standing(times_s, values, 0);
    let (release, standing) = least(0..=values.len() / 2, |release| beside_standing(times_s, values, release));
    let (release, beside) =
        if standing.norm_squared() > STOOD * begun.norm_squared() { (0, begun) } else { (release, standing) };
    let courses = courses(&times_s[release..]);
    let gaps = release + COURSE..=values.len() - COURSE;
    let (_, apart) = least(gaps, |gap| beside_gap(times_s, &beside, &courses, gap));
    // What the course, the place and the choice of each instant have taken of it.
    let (beside, taken) = if apart.norm_squared() > WHOLE * beside.norm_squared() {
        (beside, COURSE + 2)
    } else {
        (apart, COURSE + 2 + 3)
    };
    let times = (means as f64 / (means - taken) as f64).sqrt();
    (beside.iter().map(|value| value * times).collect(), release)
}

/// When what falls is let go, seen by gravity alone: the first sample, where nothing shows that it stood. Then its way is bent, or what it feels jumps.
pub(super) fn let_go(times_s: &[f64], values: &[f64], jumps: bool) -> usize {
    let seen = DVector::from_column_slice(values);
    let left = |release: usize| {
        let course = |place: usize, order: i32| match times_s[place] - times_s[release] {
            _ if order == 0 => 1.0,
            falling_s if falling_s <= 0.0 => 0.0,
            falling_s => falling_s.powi(if jumps { order - 1 } else { order }),
        };
        let courses = DMatrix::from_fn(times_s.len(), 3, |place, order| course(place, order as i32)).qr().q();
        &seen - &courses * courses.tr_mul(&seen)
    };
    let (release, standing) = least(0..=values.len() / 2, left);
    if standing.norm_squared() < STOOD * left(0).norm_squared() { release } else { 0 }
}

/// What has the least squares, of what is left where something happens in one of these places: sought ever more closely.
fn least(places: RangeInclusive<usize>, left: impl Fn(usize) -> DVector<f64>) -> (usize, DVector<f64>) {
    let at = |place: usize| (place, left(place));
    let (first, last) = places.into_inner();
    let (mut from, mut to, mut step) = (first, last, last - first);
    let mut best = at(first);
    while step > 1 {
        step = (to - from).div_ceil(INSTANTS);
        let tried = (from..=to).step_by(step).map(at);
        best =
            tried.fold(best, |best, other| if other.1.norm_squared() < best.1.norm_squared() { other } else { best });
        (from, to) = (best.0.saturating_sub(step).max(first), (best.0 + step).min(last));
    }
    best
}

/// Values without the mean of those before the release and the course of the others.
fn beside_standing(times_s: &[f64], values: &[f64], release: usize) -> DVector<f64> {
    let (standing, falling) = values.split_at(release);
    let courses = courses(&times_s[release..]);
    let falling = DVector::from_column_slice(falling);
    let beside = &falling - &courses * courses.tr_mul(&falling);
    let level = if standing.is_empty() { 0.0 } else { mean(standing) };
    DVector::from_iterator(values.len(), standing.iter().map(|value| value - level).chain(beside.iter().copied()))
}

/// Orthonormal courses over some instants, polynomials: Chebyshev's, from -1 to 1, T_k(cos φ) = cos kφ.
fn courses(times_s: &[f64]) -> DMatrix<f64> {
    let (first_s, lasts_s) = (times_s[0], times_s[times_s.len() - 1] - times_s[0]);
    let angle = |place: usize| (2.0 * (times_s[place] - first_s) / lasts_s - 1.0).clamp(-1.0, 1.0).acos();
    DMatrix::from_fn(times_s.len(), COURSE, |place, order| (order as f64 * angle(place)).cos()).qr().q()
}

/// What is left beside the courses where, from one place on, values come so much later that they have jumped and go on at another speed.
fn beside_gap(times_s: &[f64], beside: &DVector<f64>, courses: &DMatrix<f64>, gap: usize) -> DVector<f64> {
    let (all, falling) = (beside.len(), courses.nrows());
    let kinds = DMatrix::from_fn(falling, 2, |place, order| match (place + all - falling, order) {
        (place, _) if place < gap => 0.0,
        (_, 0) => 1.0,
        (place, _) => times_s[place] - times_s[gap - 1],
    });
    let kinds = (&kinds - courses * courses.tr_mul(&kinds)).qr().q();
    let tail = beside.rows(all - falling, falling).clone_owned();
    let tail = &tail - &kinds * kinds.tr_mul(&tail);
    DVector::from_iterator(all, beside.iter().take(all - falling).chain(tail.iter()).copied())
}

struct Raw<'a> {
    kind: RigKind,
    times_s: &'a [f64],
    channels: Vec<&'a [f64]>,
    interval_s: f64,
    contact_time_s: f64,
    speed_m_per_s: f64,
    gravity_m_per_s2: f64,
    /// Noise of the observed channel as stated, in its unit.
    stated_noise: f64,
    /// Which channels move before contact: they show the position of what comes.
    comes: Vec<bool>,
    /// −1 where the observed channel counts against the motion, as a height does; else 1.
    sign: f64,
    /// Whether it is an acceleration: it jumps where what falls is let go.
    jumps: bool,
}

struct Thinned {
    /// How many samples of the recording are compared, from its first.
    kept: usize,
    times_s: Vec<f64>,
    series: Vec<Vec<f64>>,
    rest: Rest,
    offset_guess: Vec<f64>,
    contact_guess_s: f64,
    /// Whether what goes together from sample to sample in the quiet does so later.
    steady: bool,
    too_slow: Option<f64>,
}

impl Raw<'_> {
    /// From when to when, s after contact, further channels are asked: in a fall always.
    fn asked_s(&self) -> Range<f64> {
        if self.kind == RigKind::Fall {
            return f64::NEG_INFINITY..f64::INFINITY;
        }
        let [before, after] = ASKED.map(|contacts| contacts * self.contact_time_s);
        -before..after
    }

    fn thin(&self) -> Option<Thinned> {
        let contact = if self.kind == RigKind::Fall { Some(0) } else { self.contact() };
        let contact = contact?;
        let contact_guess_s = self.times_s[contact];
        let per_contact = self.contact_time_s / self.interval_s;
        let fall = self.kind == RigKind::Fall;
        let rate = if fall { FALL_RATE_HZ } else { KEPT_RATE_HZ.max(SAMPLES_PER_CONTACT / self.contact_time_s) };
        let even = self.is_even();
        let from_s = if fall { f64::NEG_INFINITY } else { contact_guess_s - QUIET_S.max(self.contact_time_s) };
        let first = self.times_s.partition_point(|time| *time < from_s);
        // All that follows, since a robot that goes on pushing comes back late; but not what a dropped mass does after its rebound.
        let last = if self.kind == RigKind::Drop { self.second_fall(contact) } else { self.times_s.len() };
        let mut n = if even { (1.0 / (rate * self.interval_s)).floor().max(1.0) as usize } else { 1 };
        while (last - first) / n > MOST_SAMPLES {
            n += 1;
        }
        // Blocks are counted from the contact, so that quiet blocks hold no contact.
        let guard = (GUARD * per_contact).ceil() as usize + 1;
        let quiet_end = contact.saturating_sub(guard);
        let mut release = 0;
        // What comes is at zero when it meets the rig; before, its noise is what is left of its way.
        let rests: Vec<Vec<f64>> = self
            .channels
            .iter()
            .zip(&self.comes)
            .map(|(channel, comes)| {
                let quiet = &channel[..quiet_end.max(1)];
                if fall {
                    // What falls is never quiet, but smooth.
                    let (noise, let_go) = beside_course(self.times_s, channel, n);
                    release = let_go;
                    if even { without_mains(&noise, self.interval_s.recip()) } else { noise }
                } else if *comes {
                    let released_s = (self.kind == RigKind::Drop && self.gravity_m_per_s2 > 0.0)
                        .then(|| contact_guess_s - self.speed_m_per_s / self.gravity_m_per_s2);
                    let coming = still_coming(&self.times_s[..quiet.len()], quiet);
                    without_way(&self.times_s[..coming], &quiet[..coming], contact_guess_s, released_s)
                } else {
                    quiet.to_vec()
                }
            })
            .collect();
        let blocks: Vec<usize> = (first..last).step_by(n).filter(|start| start + n <= last).collect();
        let whole = |start: &usize| {
            let lasts = self.times_s[start + n - 1] - self.times_s[*start];
            n == 1 || lasts < self.interval_s * (n as f64 - 0.5)
        };
        let blocks: Vec<usize> = blocks.into_iter().filter(whole).collect();
        Some(Thinned {
            kept: last,
            times_s: blocks.iter().map(|start| mean(&self.times_s[*start..start + n])).collect(),
            series: self
                .channels
                .iter()
                .map(|channel| blocks.iter().map(|start| mean(&channel[*start..start + n])).collect())
                .collect(),
            contact_guess_s: match release {
                0 if fall => self.times_s[let_go(self.times_s, self.channels[0], self.jumps)],
                release if fall => self.times_s[release],
                _ => contact_guess_s,
            },
            offset_guess: if fall {
                self.channels.iter().map(|channel| channel[0]).collect()
            } else {
                rests.iter().map(|rest| mean(rest)).collect()
            },
            // Noise is taken from all of the quiet time.
            rest: Rest { channels: rests, interval_s: self.interval_s, averaged: n },
            // The noise of a fall is taken from all of it.
            steady: even || self.is_steady(if fall { self.times_s.len() / 2 } else { quiet_end }),
            too_slow: (!fall && per_contact < FEWEST_PER_CONTACT).then_some(per_contact),
        })
    }

    fn is_even(&self) -> bool {
        let steps = self.times_s.windows(2).map(|pair| pair[1] - pair[0]);
        let even = steps.filter(|step| (step / self.interval_s - 1.0).abs() < RATE_TOLERANCE).count();
        even as f64 >= 0.98 * (self.times_s.len() - 1) as f64
    }

    /// Whether samples are spaced after the quiet as they are in it: as evenly or as unevenly. A steady noise that is read at steps of
    /// one distribution is steady from sample to sample, too.
    fn is_steady(&self, quiet_end: usize) -> bool {
        let steps = |times_s: &[f64]| {
            let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
            steps.sort_by(f64::total_cmp);
            steps
        };
        let (before, after) = self.times_s.split_at(quiet_end);
        let (before, after) = (steps(before), steps(after));
        let at = |steps: &[f64], part: f64| steps[((steps.len() - 1) as f64 * part.clamp(0.0, 1.0)) as usize];
        let alike = |part: f64| {
            let [shortest, longest] = [-STEPS_MORE, STEPS_MORE].map(|more| at(&after, part + more));
            (shortest / STEADY..longest * STEADY).contains(&at(&before, part))
        };
        before.len().min(after.len()) >= FEWEST_QUIET && [0.1, 0.5, 0.9].into_iter().all(alike)
    }

    /// Index of the last sample before contact: the observed channel passes a level at a twentieth of its peak, or five times the
    /// noise of the first samples, and a half sine tells how long before the contact was.
    fn contact(&self) -> Option<usize> {
        if self.comes[0] {
            return self.turning_point();
        }
        let passed = self.passed()?;
        let contact_s = self.times_s[passed.first] - passed.before_s;
        Some(self.times_s.partition_point(|time| *time <= contact_s).saturating_sub(1))
    }

    /// What comes turns half a contact after it has met the springs. A mass that bounces may turn again as far in.
    fn turning_point(&self) -> Option<usize> {
        let farthest = (0..self.times_s.len()).map(|place| self.way(place)).max_by(f64::total_cmp)?;
        let is_far = |place: &usize| self.way(*place) > farthest - self.little_m();
        let first = (0..self.times_s.len()).find(is_far)?;
        let turns = (first..self.times_s.len()).take_while(is_far);
        let turned = turns.max_by(|a, b| self.way(*a).total_cmp(&self.way(*b)))?;
        let contact_s = self.times_s[turned] - self.contact_time_s / 2.0;
        Some(self.times_s.partition_point(|time| *time <= contact_s).saturating_sub(1))
    }

    /// A way that noise does not make: a part of the ideal contact's depth, m.
    fn little_m(&self) -> f64 {
        LITTLE * self.speed_m_per_s.abs() * self.contact_time_s / std::f64::consts::PI
    }

    /// Where what comes is, towards the rig.
    fn way(&self, place: usize) -> f64 {
        self.sign * self.channels[0][place]
    }

    /// The same of a way: a mass that has left the rig is back where it met it first.
    fn comes_back(&self, contact: usize) -> usize {
        let all = self.times_s.len();
        let met = self.way(contact);
        let after_s = self.times_s[contact] + self.contact_time_s / 2.0;
        let turned = self.times_s.partition_point(|time| *time < after_s);
        let left = (turned..all).find(|place| self.way(*place) < met - self.little_m());
        let Some(back) = left.and_then(|left| (left..all).find(|place| self.way(*place) > met)) else { return all };
        let end_s = self.times_s[back] - GUARD * self.contact_time_s;
        self.times_s.partition_point(|time| *time < end_s)
    }

    /// Number of samples before a dropped mass meets the rig a second time: all, where it does not. Of a force: between two contacts the channel
    /// is at rest for half a contact at least; a piece that rings on after the separation is not.
    fn second_fall(&self, contact: usize) -> usize {
        let all = self.times_s.len();
        if self.comes[0] {
            return self.comes_back(contact);
        }
        let Some(passed) = self.passed() else { return all };
        let beyond = |place: usize| {
            let near = &self.channels[0][place..place + 3];
            near.iter().filter(|value| (*value - passed.zero).abs() > passed.level).count() >= 2
        };
        let mut left_s = None;
        for place in contact.max(passed.first)..all.saturating_sub(2) {
            match (beyond(place), left_s) {
                (true, Some(left_s)) if self.times_s[place] - left_s > self.contact_time_s / 2.0 => {
                    let end_s = self.times_s[place] - 2.0 * passed.before_s - GUARD * self.contact_time_s;
                    return self.times_s.partition_point(|time| *time < end_s);
                }
                (true, _) => left_s = None,
                (false, None) => left_s = Some(self.times_s[place]),
                (false, Some(_)) => {}
            }
        }
        all
    }

    /// Where the observed channel leaves its rest.
    fn passed(&self) -> Option<Passed> {
        let values = self.channels[0];
        // A recording may begin just before contact: then fewer samples are at rest.
        let mut head = (values.len() / 20).clamp(4, values.len().max(4)).min(values.len());
        let (mut zero, mut noise) = rest(values.get(..head)?)?;
        let highest = |zero: f64| values.iter().map(|value| (value - zero).abs()).fold(0.0, f64::max);
        if 5.0 * noise > 0.5 * highest(zero) {
            while noise > LIVELIEST * self.stated_noise.max(steps(&self.times_s[..head], &values[..head])) && head > 4 {
                head = (head / 2).max(4);
                (zero, noise) = rest(&values[..head])?;
            }
        }
        let deviation = |value: f64| (value - zero).abs();
        let peak = highest(zero);
        let level = (0.05 * peak).max(5.0 * noise);
        if level >= peak || self.speed_m_per_s == 0.0 {
            return None;
        }
        // Two of three beyond the level: a spike is no contact.
        let first = (0..values.len().saturating_sub(2))
            .find(|place| values[*place..place + 3].iter().filter(|v| deviation(**v) > level).count() >= 2)?;
        let before_s = (level / peak).asin() * self.contact_time_s / std::f64::consts::PI;
        Some(Passed { first, zero, level, before_s })
    }
}

/// Whether a channel moves before contact.
fn comes(quantity: Quantity, kind: RigKind) -> bool {
    quantity == Quantity::Position && kind != RigKind::Fall
}

/// How many positions are of the way before the rig is met, which is not where stated masses and springs have it: those whose last part is no less like a
/// parabola than what comes before.
fn still_coming(times_s: &[f64], positions: &[f64]) -> usize {
    let counts =
        COMING.map(|part| (part * positions.len() as f64) as usize).into_iter().filter(|count| *count > 2 * WAY);
    let parts: Vec<(usize, f64, f64)> = counts
        .map(|count| {
            let rest = without_parabola(&times_s[..count], &positions[..count], times_s[0]);
            (count, rest.iter().variance(), togetherness(&rest))
        })
        .collect();
    let Some((count, least, together)) = parts.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return positions.len();
    };
    let by_chance = 1.0 + SURELY_MORE * (2.0 * together / *count as f64).sqrt();
    let alike = parts.iter().find(|(_, variance, _)| *variance <= by_chance * least);
    alike.map_or(positions.len(), |(count, ..)| *count)
}

/// Freed of the parabola of a steady or falling approach, up to its value at this instant; where what falls was let go within, and it shows, of where it
/// hung before, too.
fn without_way(times_s: &[f64], positions: &[f64], at_s: f64, released_s: Option<f64>) -> Vec<f64> {
    let begun = without_parabola(times_s, positions, at_s);
    let release = released_s.map_or(0, |released_s| times_s.partition_point(|time| *time < released_s));
    let (hung, fell) = positions.split_at(release);
    let Some(level) = median(hung.to_vec()).filter(|_| fell.len() >= WAY) else { return begun };
    let fell = without_parabola(&times_s[release..], fell, at_s);
    let zero = mean(&fell);
    let apart: Vec<f64> = hung.iter().map(|value| value - level + zero).chain(fell).collect();
    if apart.iter().variance() < STOOD * begun.iter().variance() { apart } else { begun }
}

/// Freed of their parabola, up to its value at this instant, and as much as they were before that took its part of them.
fn without_parabola(times_s: &[f64], positions: &[f64], at_s: f64) -> Vec<f64> {
    if positions.len() < WAY {
        return positions.to_vec();
    }
    let powers = DMatrix::from_fn(times_s.len(), 3, |row, power| (times_s[row] - at_s).powi(power as i32));
    let values = DVector::from_column_slice(positions);
    let Ok(way) = powers.clone().svd(true, true).solve(&values, 1e-12) else { return positions.to_vec() };
    let rest = values - powers * &way;
    let all = rest.len() as f64;
    let taken = (3.0 * togetherness(rest.as_slice())).min(all / 2.0);
    let times = (all / (all - taken)).sqrt();
    rest.iter().map(|rest| rest * times + way[0]).collect()
}

/// Of how many values noise of a first order, that is alike in neighbouring ones, makes one of its own: (1 + φ)/(1 − φ); 1 at least.
fn togetherness(rest: &[f64]) -> f64 {
    let middle = mean(rest);
    let product = |lag: usize| -> f64 {
        rest.iter().zip(&rest[lag..]).map(|(one, other)| (one - middle) * (other - middle)).sum()
    };
    let alike = product(1) / product(0);
    if alike > 0.0 { ((1.0 + alike) / (1.0 - alike).max(0.1)).max(1.0) } else { 1.0 }
}

/// The observed channel has left its rest.
struct Passed {
    /// Index of the first sample beyond the level.
    first: usize,
    /// Its rest, in its unit.
    zero: f64,
    /// The level, from the rest on.
    level: f64,
    /// How long a half sine takes from contact to the level, s.
    before_s: f64,
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::diagnosis::noise::tests::coloured;

    /// A half sine of 40 ms and 100 N at 10 kHz, and another one 0.2 s later, after this much rest; noise of ± 0.3 N.
    fn two_pulses(rest_s: f64, count: usize) -> (Vec<f64>, Vec<f64>) {
        let times: Vec<f64> = (0..count).map(|sample| sample as f64 * 1e-4).collect();
        let pulse = |since: f64| {
            if (0.0..0.04).contains(&since) { 100.0 * (since / 0.04 * std::f64::consts::PI).sin() } else { 0.0 }
        };
        let values = times
            .iter()
            .enumerate()
            .map(|(sample, time)| pulse(time - rest_s) + pulse(time - rest_s - 0.2) + 0.3 * (sample as f64 * 2.4).sin())
            .collect();
        (times, values)
    }

    fn raw<'a>(kind: RigKind, times_s: &'a [f64], values: &'a [f64]) -> Raw<'a> {
        Raw {
            kind,
            times_s,
            channels: vec![values],
            interval_s: 1e-4,
            contact_time_s: 0.04,
            speed_m_per_s: 0.5,
            gravity_m_per_s2: 9.81,
            stated_noise: 0.2,
            comes: vec![false],
            sign: 1.0,
            jumps: false,
        }
    }

    /// Half a millisecond or a tenth of a second before contact.
    #[test]
    fn contact_is_found_however_short_the_rest_before_it() {
        for rest_s in [0.0005, 0.002, 0.1] {
            let (times, values) = two_pulses(rest_s, 1_500);
            let found = times[raw(RigKind::Impact, &times, &values).contact().expect("a contact")];
            assert!((found - rest_s).abs() < 1e-3, "{rest_s}: {found}");
        }
    }

    #[test]
    fn a_recording_of_a_few_samples_shows_no_contact() {
        for count in 0..4 {
            let (times, values) = two_pulses(0.0, count);
            assert_eq!(raw(RigKind::Impact, &times, &values).contact(), None, "{count}");
        }
    }

    /// A robot may come back and mean it; a dropped mass only falls again.
    #[test]
    fn a_drop_ends_before_its_second_fall() {
        let (times, values) = two_pulses(0.1, 4_000);
        let dropped = raw(RigKind::Drop, &times, &values).thin().expect("a contact");
        let end_s = times[dropped.kept - 1];
        assert!((0.28..0.3).contains(&end_s), "{end_s}");
        assert!(dropped.times_s.iter().all(|time| *time <= end_s));
        assert_eq!(raw(RigKind::Impact, &times, &values).thin().expect("a contact").kept, times.len());
    }

    /// 800 samples at 1 kHz, means of five.
    #[test]
    fn what_a_fall_shows_beside_its_course_is_its_noise() {
        let noise: Vec<f64> = coloured(800, 3).iter().map(|value| 1e-3 * value).collect();
        let times_s: Vec<f64> = (0..800).map(|place| place as f64 * 1e-3).collect();
        let fallen = |place: usize| 1.2 - 4.9 * (place as f64 * 1e-3).powi(2) + 0.3 * (place as f64 * 1e-3).powi(4);
        let seen: Vec<f64> = noise.iter().enumerate().map(|(place, noise)| fallen(place) + noise).collect();
        let (told, release) = beside_course(&times_s, &seen, 5);
        assert_eq!(release, 0);
        let of = |values: &[f64]| values.chunks_exact(5).map(mean).collect::<Vec<_>>().iter().std_dev();
        assert!((of(&told) / of(&noise) - 1.0).abs() < 0.05, "{} {}", of(&told), of(&noise));
        assert!(beside_course(&times_s[..400], &seen[..400], 5).0.is_empty());
        // Held for 120 ms, then thrown down at 0.5 m/s.
        let thrown = |place: usize| if place < 120 { 1.2 } else { fallen(place - 120) - 0.5e-3 * (place - 120) as f64 };
        let seen: Vec<f64> = noise.iter().enumerate().map(|(place, noise)| thrown(place) + noise).collect();
        let (told, release) = beside_course(&times_s, &seen, 5);
        assert!((118..=122).contains(&release), "{release}");
        assert!((of(&told) / of(&noise) - 1.0).abs() < 0.06, "{} {}", of(&told), of(&noise));
        // The same without 16 samples on the way: what came later is 60 mm lower at once.
        let lacks = |place: usize| thrown(place + if place < 430 { 0 } else { 16 });
        let seen: Vec<f64> = noise.iter().enumerate().map(|(place, noise)| lacks(place) + noise).collect();
        let (told, release) = beside_course(&times_s, &seen, 5);
        assert!((118..=122).contains(&release), "{release}");
        assert!((of(&told) / of(&noise) - 1.0).abs() < 0.06, "{} {}", of(&told), of(&noise));
    }

    /// Held for 52 ms, then let go at 0.18 m/s, or from rest: a course of eight coefficients follows that as well.
    #[test]
    fn what_is_let_go_late_is_seen_by_gravity() {
        let noise = coloured(800, 4);
        let times_s: Vec<f64> = (0..800).map(|place| place as f64 * 5e-4).collect();
        for thrown_m_per_s in [0.18, 0.0] {
            for let_go_s in [0.052, 0.0] {
                let falling = times_s.iter().map(|time| (time - let_go_s).max(0.0));
                let height =
                    falling.zip(&noise).map(|(s, noise)| 1.0 - thrown_m_per_s * s - 4.9 * s * s + 1e-3 * noise);
                let found_s = times_s[let_go(&times_s, &height.collect::<Vec<_>>(), false)];
                assert!((found_s - let_go_s).abs() < 8e-3, "{thrown_m_per_s} m/s, {let_go_s} s: {found_s}");
                let felt = times_s.iter().zip(&noise).map(|(time, noise)| {
                    if *time < let_go_s { 0.0 } else { 9.81 - 0.3 * (time - let_go_s) + 0.1 * noise }
                });
                let found_s = times_s[let_go(&times_s, &felt.collect::<Vec<_>>(), true)];
                assert!((found_s - let_go_s).abs() < 2e-3, "felt, {let_go_s} s: {found_s}");
            }
        }
    }

    /// A camera's instants stray by a third of their distance: what falls at 3 m/s is 8 mm on, which is no noise.
    #[test]
    fn instants_that_stray_make_no_noise() {
        let strays = coloured(120, 5);
        let times_s: Vec<f64> = strays
            .iter()
            .enumerate()
            .map(|(place, stray)| (place as f64 + 0.1 * stray.clamp(-3.0, 3.0)) / 120.0)
            .collect();
        let values: Vec<f64> =
            times_s.iter().zip(coloured(120, 6)).map(|(t, noise)| 2.0 - 4.9 * t * t + 1e-3 * noise).collect();
        let of = |values: &[f64]| values.iter().std_dev();
        let noise = 1e-3 * of(&coloured(120, 6));
        assert!(steps(&times_s, &values) < 1.2 * noise, "{}", steps(&times_s, &values));
        let (told, release) = beside_course(&times_s, &values, 1);
        assert_eq!(release, 0);
        assert!((of(&told) / noise - 1.0).abs() < 0.15, "{} {noise}", of(&told));
    }

    /// Hung for 60 ms, let go, 30 ms of fall; or 90 ms of a way of which the last third is in contact already.
    #[test]
    fn what_hangs_before_it_falls_and_what_has_met_the_rig_is_no_noise() {
        let times_s: Vec<f64> = (0..900).map(|place| f64::from(place) * 1e-4).collect();
        let noise: Vec<f64> = coloured(900, 7).iter().map(|noise| 1e-5 * noise).collect();
        let with_noise = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            times_s.iter().zip(&noise).map(|(t, noise)| of(*t) + noise).collect()
        };
        let strength = noise.iter().std_dev();
        let near = |values: &[f64]| {
            let told = values.iter().std_dev() / strength;
            assert!((told - 1.0).abs() < 0.15, "{told}");
        };
        let dropped = with_noise(&|t| -4.5e-3 + 4.905 * (t - 0.06).max(0.0).powi(2));
        near(&without_way(&times_s, &dropped, 0.09, Some(0.06)));
        near(&without_way(&times_s, &with_noise(&|t| 0.5 * t), 0.09, Some(0.04)));
        let met = with_noise(&|t| 0.5 * t - 2.0 * (t - 0.06).max(0.0).powi(2));
        let coming = still_coming(&times_s, &met);
        assert_eq!(coming, 630);
        near(&without_way(&times_s[..coming], &met[..coming], 0.09, None));
        assert_eq!(still_coming(&times_s, &with_noise(&|t| 0.5 * t)), 900);
    }

    /// The longest recording is averaged more coarsely: what it shows is whitened by noise of that colour.
    #[test]
    fn means_of_each_length_have_their_noise() {
        let rests = [(1, 1), (1, 2), (4, 3)].map(|(averaged, seed)| Rest {
            channels: vec![crate::diagnosis::noise::tests::coloured(6_000, seed)],
            interval_s: 1e-4,
            averaged,
        });
        for (rest, noise) in rests.iter().zip(noises(&rests, 0, true).expect("enough rest")) {
            let mut means = rest.means(0, rest.averaged);
            noise.whiten(&mut means);
            let squares = means.iter().map(|value| value * value).sum::<f64>() / means.len() as f64;
            assert!((squares - 1.0).abs() < 0.1, "{}: {squares}", rest.averaged);
        }
    }

    /// A tenth of the samples is missing, whichever: nine tenths of the steps are one or two. Twice the rate from contact on is another thing.
    #[test]
    fn missing_samples_leave_the_spacing_as_it_is() {
        let (times, _) = two_pulses(1.0, 2_000);
        let spaced = |times_s: &[f64]| {
            let quiet_end = times_s.partition_point(|time| *time < 0.1);
            raw(RigKind::Impact, times_s, &vec![0.0; times_s.len()]).is_steady(quiet_end)
        };
        for seed in 0..40 {
            let mut chance = ChaCha8Rng::seed_from_u64(seed);
            let kept: Vec<f64> = times.iter().copied().filter(|_| chance.random_bool(0.9)).collect();
            assert!(spaced(&kept), "{seed}");
        }
        let quicker = times
            .windows(2)
            .flat_map(|two| if two[0] < 0.1 { vec![two[0]] } else { vec![two[0], 0.5 * (two[0] + two[1])] });
        assert!(!spaced(&quicker.collect::<Vec<_>>()));
    }

    /// What comes at 0.5 m/s, turns and goes: its way before contact is neither noise nor offset.
    #[test]
    fn the_way_of_what_comes_is_no_noise() {
        let (times, noise) = two_pulses(1.0, 2_000);
        let position: Vec<f64> = times
            .iter()
            .zip(&noise)
            .map(|(time, noise)| {
                let since = (time - 0.1).min(0.04);
                let depth = 0.04 / std::f64::consts::PI * 0.5 * (since.max(0.0) / 0.04 * std::f64::consts::PI).sin();
                0.03 + if since < 0.0 { 0.5 * since } else { depth - 0.5 * (time - 0.14).max(0.0) } + 1e-5 * noise
            })
            .collect();
        let height: Vec<f64> = position.iter().map(|position| -position).collect();
        for (sign, values) in [(1.0, &position), (-1.0, &height)] {
            let coming = Raw { comes: vec![true], sign, ..raw(RigKind::Impact, &times, values) };
            let thinned = coming.thin().expect("a contact");
            assert!((thinned.contact_guess_s - 0.1).abs() < 1e-3, "{}", thinned.contact_guess_s);
            assert!((thinned.offset_guess[0] - sign * 0.03).abs() < 1e-3, "{:?}", thinned.offset_guess);
            let rms = scatters(&[&thinned.rest.channels[0]])[0];
            assert!((1e-6..4e-6).contains(&rms), "{rms}");
        }
    }
}
