//! Campaigns into impacts: of each recording what was known before, what it did, and how it began.

use std::path::{Path, PathBuf};

use thud_firmware::configuration::FilterProfile;
use thud_firmware::filter::LowPass;
use thud_firmware::forecast::{DUE, INSTANTS, Known, Rise};
use thud_firmware::limits::Region;
use thud_firmware::units::{Hertz, Kilogram, NewtonPerMetre};

use super::plan::POSTURES_FILE;
use crate::campaign::{self, Loaded, RigKind};
use crate::input::{InputError, read_text};
use crate::recording::{FORCE, Recording};

/// Instants of the force over time that are learned and tested, from contact to `PROFILE_ENDS` ideal durations.
pub const PROFILE_INSTANTS: usize = 16;
/// How far the profile goes, in durations π·√(m_R/K) of the ideal impact, which are known before.
const PROFILE_ENDS: f64 = 1.4;
/// A contact is noticed at this multiple of the noise, as the sensor does by default, and at this force at least, N.
const ONSET: (f64, f64) = (6.0, 1.0);
/// The force at an instant is the mean of this long before it, s: a block of the sensor at 20 kS/s.
const MEAN_S: f64 = 4e-4;

/// An instant of an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Since contact, s.
    pub time_s: f64,
    /// Stroke of the body springs, m, where it was recorded.
    pub stroke_m: Option<f64>,
    /// Force, N.
    pub force_n: f64,
}

/// One impact.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// Its file.
    pub file: PathBuf,
    /// Number of its campaign in the data set.
    pub campaign: usize,
    /// As stated, m/s.
    pub speed_m_per_s: f64,
    /// As stated, kg.
    pub mass_kg: f64,
    /// Of the body springs, as stated, N/m.
    pub body_stiffness_n_per_m: f64,
    /// Of springs and pad in series, as stated, N/m.
    pub stiffness_n_per_m: f64,
    /// m_H of the region that the campaign is named after, kg.
    pub body_mass_kg: Option<f64>,
    /// Joints 1, 2 and 4, degrees.
    pub joints_deg: Option<[f64; 3]>,
    /// Largest force through the filter of the verdict, N.
    pub peak_n: f64,
    /// Largest stroke, m, where it was recorded.
    pub stroke_m: Option<f64>,
    /// The force over time through that filter.
    pub profile: Vec<Sample>,
    /// How it began, as the sensor sees it.
    pub rise: Rise,
    /// From the last force of the rise to the peak, s; negative: the peak was before.
    pub ahead_s: f64,
}

impl Impact {
    /// What the sensor knows beforehand.
    #[must_use]
    pub fn known(&self) -> Known {
        Known { mass: Kilogram(self.mass_kg as f32), stiffness: NewtonPerMetre(self.body_stiffness_n_per_m as f32) }
    }

    /// v·√(K·m_R), N: equation 4, corrected, for a rigid mount.
    #[must_use]
    pub fn ideal_peak_n(&self) -> f64 {
        self.speed_m_per_s * (self.stiffness_n_per_m * self.mass_kg).sqrt()
    }

    /// √(K/m_R), rad/s.
    #[must_use]
    pub fn pulsation(&self) -> f64 {
        (self.stiffness_n_per_m / self.mass_kg).sqrt()
    }
}

/// All impacts, and what could not be taken.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// The impacts, in the order of their folders and recordings.
    pub impacts: Vec<Impact>,
    /// How many campaigns they are from.
    pub campaigns: usize,
    /// What was left out or is missing, one sentence each.
    pub notes: Vec<String>,
}

/// The campaign folders that a path means: itself, or those in it.
///
/// # Errors
/// There is none.
pub fn folders(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    if path.is_file() || path.join(campaign::FILE_NAME).is_file() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).map_err(|error| InputError::unreadable(path, &error))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|inside| inside.join(campaign::FILE_NAME).is_file())
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(InputError::whole(
            &path.display().to_string(),
            format!("there is no {} in it, nor in a folder in it", campaign::FILE_NAME),
            "name a campaign, or a folder of campaigns such as `thud predict data` makes",
        ));
    }
    Ok(found)
}

impl Dataset {
    /// Adds a campaign.
    ///
    /// # Errors
    /// A campaign that is no robot's impact on springs, or a posture file that cannot be read.
    pub fn add(&mut self, loaded: &Loaded) -> Result<(), InputError> {
        let place = loaded.folder.display().to_string();
        let rig = &loaded.campaign.rig;
        let Some(body) = rig.body_stiffness_n_per_m.filter(|_| rig.kind == RigKind::Impact) else {
            return Err(InputError::whole(
                &place,
                format!(
                    "a campaign of the kind `{}` has no impacts of a robot on springs to learn from",
                    rig.kind.name()
                ),
                "give campaigns of the kind `impact`",
            ));
        };
        let stiffness = rig.pad_stiffness_n_per_m.map_or(body.value, |pad| 1.0 / (1.0 / body.value + 1.0 / pad.value));
        let postures = postures(&loaded.folder)?;
        let region = loaded
            .campaign
            .name
            .split([',', ' '])
            .next()
            .and_then(Region::from_name)
            .map(|region| f64::from(region.body().effective_mass.0));
        for (entry, recording) in loaded.campaign.recordings.iter().zip(&loaded.recordings) {
            let file = loaded.folder.join(&entry.file);
            let joints = entry
                .configuration
                .as_ref()
                .and_then(|name| postures.iter().find(|(known, _)| known == name).map(|(_, joints)| *joints));
            let known = Impact {
                file: file.clone(),
                campaign: self.campaigns,
                speed_m_per_s: entry.impact_speed_m_per_s.value,
                mass_kg: entry.effective_mass_kg.value,
                body_stiffness_n_per_m: body.value,
                stiffness_n_per_m: stiffness,
                body_mass_kg: region,
                joints_deg: joints,
                peak_n: 0.0,
                stroke_m: None,
                profile: Vec::new(),
                rise: Rise::default(),
                ahead_s: 0.0,
            };
            match impact(known, recording, loaded.campaign.chain.noise_rms) {
                Ok(impact) => self.impacts.push(impact),
                Err(why) => self.notes.push(format!("{} is left out: {why}", file.display())),
            }
        }
        self.campaigns += 1;
        Ok(())
    }
}

/// Joints 1, 2 and 4 of each configuration, from the file beside the campaigns; empty where there is none.
fn postures(folder: &Path) -> Result<Vec<(String, [f64; 3])>, InputError> {
    let beside = [folder.join(POSTURES_FILE), folder.join("..").join(POSTURES_FILE)];
    let Some(path) = beside.into_iter().find(|path| path.is_file()) else { return Ok(Vec::new()) };
    let text = read_text(&path)?;
    let file = path.display().to_string();
    let mut known = Vec::new();
    let mut start = 0;
    for (number, line) in text.split('\n').enumerate() {
        let bytes = start..start + line.len();
        start += line.len() + 1;
        if number == 0 || line.trim().is_empty() {
            continue;
        }
        let mut cells = line.trim().split(',');
        let name = cells.next().unwrap_or_default().to_owned();
        let angles: Option<Vec<f64>> = cells.map(|cell| cell.trim().parse().ok()).collect();
        match angles.as_deref() {
            Some([one, two, _, four, ..]) if [one, two, four].iter().all(|angle| angle.is_finite()) => {
                known.push((name, [*one, *two, *four]));
            }
            _ => {
                return Err(InputError::at(
                    &file,
                    &text,
                    bytes,
                    "this is no posture",
                    "write the configuration's name and at least four joint angles in degrees: 1,-56.6,87.6,-90,109.2",
                ));
            }
        }
    }
    Ok(known)
}

/// Values over time with the same interval.
struct Even {
    start_s: f64,
    interval_s: f64,
    values: Vec<f64>,
}

impl Even {
    fn new(times_s: &[f64], values: &[f64], interval_s: f64) -> Self {
        let span = times_s[times_s.len() - 1] - times_s[0];
        let count = (span / interval_s).floor() as usize + 1;
        let mut at = 0;
        let values = (0..count)
            .map(|index| {
                let time = times_s[0] + index as f64 * interval_s;
                while at + 2 < times_s.len() && times_s[at + 1] < time {
                    at += 1;
                }
                let share = (time - times_s[at]) / (times_s[at + 1] - times_s[at]);
                values[at] + share.clamp(0.0, 1.0) * (values[at + 1] - values[at])
            })
            .collect();
        Self { start_s: times_s[0], interval_s, values }
    }

    fn time_s(&self, index: usize) -> f64 {
        self.start_s + index as f64 * self.interval_s
    }

    fn at(&self, time_s: f64) -> f64 {
        let place = ((time_s - self.start_s) / self.interval_s).clamp(0.0, (self.values.len() - 1) as f64);
        let before = (place.floor() as usize).min(self.values.len().saturating_sub(2));
        let share = place - before as f64;
        self.values[before] * (1.0 - share) + self.values[before + 1] * share
    }

    /// Mean of the values within [`MEAN_S`] before an instant, and the middle of their times.
    fn mean_before(&self, time_s: f64) -> (f64, f64) {
        let end = (((time_s - self.start_s) / self.interval_s) + 1e-9).floor() as usize;
        let count = ((MEAN_S / self.interval_s).round() as usize).max(1);
        let from = (end + 1).saturating_sub(count).min(self.values.len() - 1);
        let inside = &self.values[from..=end.min(self.values.len() - 1)];
        let mean = inside.iter().sum::<f64>() / inside.len() as f64;
        (mean, self.time_s(from) + 0.5 * (inside.len() - 1) as f64 * self.interval_s)
    }

    fn judged(&self) -> Self {
        let rate = Hertz((1.0 / self.interval_s) as f32);
        let mut values: Vec<f32> = self.values.iter().map(|value| *value as f32).collect();
        let corner = FilterProfile::IsoPas5672.corner().unwrap_or(Hertz(100.0));
        LowPass::of_two_passes(corner, rate).forth_and_back(&mut values);
        Self { values: values.into_iter().map(f64::from).collect(), ..*self }
    }
}

/// Completes what is known by what the recording shows.
fn impact(known: Impact, recording: &Recording, noise: f64) -> Result<Impact, String> {
    let force = recording.channel(FORCE).ok_or("it has no force")?;
    let interval_s = recording.median_interval_s();
    let mut even = Even::new(recording.times_s(), force, interval_s);
    // The zero: before anything rises, judged by the first instants.
    let first = even.values.len().min((0.02 / interval_s) as usize).max(4).min(even.values.len());
    let threshold = (ONSET.0 * noise).max(ONSET.1);
    let early = even.values[..first].iter().sum::<f64>() / first as f64;
    // Two in a row, so that a spike is no contact.
    let noticed = even.values.windows(2).position(|pair| pair.iter().all(|value| value - early > threshold));
    let noticed = noticed.ok_or_else(|| format!("no force above {threshold:.1} N"))?;
    let quiet = noticed.saturating_sub((0.003 / interval_s) as usize);
    if quiet < 4 {
        return Err("it begins within the contact".to_owned());
    }
    let zero = even.values[..quiet].iter().sum::<f64>() / quiet as f64;
    even.values.iter_mut().for_each(|value| *value -= zero);
    let noticed_s = even.time_s(noticed);
    let mut rise = Rise::default();
    for (index, due) in DUE.iter().enumerate() {
        let (mean, middle) = even.mean_before(noticed_s + f64::from(due.0));
        rise.at[index] = (middle - noticed_s) as f32;
        rise.force[index] = mean as f32;
    }
    let slope = f64::from(rise.force[1] - rise.force[0]) / f64::from(rise.at[1] - rise.at[0]);
    let at_noticed = even.values[noticed];
    let contact_s = noticed_s - if slope > 0.0 { (at_noticed / slope).clamp(0.0, 0.005) } else { 0.0 };

    let judged = even.judged();
    // The first blow: what comes after its end does not belong to a forecast.
    let duration_s = std::f64::consts::PI / known.pulsation();
    let until = judged.values.len().min(noticed + (1.5 * duration_s / interval_s).ceil() as usize + 1);
    let (place, peak_n) = judged.values[..until]
        .iter()
        .copied()
        .enumerate()
        .skip(noticed)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or("it ends at the contact")?;
    if place + 2 >= judged.values.len() {
        return Err("it ends before the force falls".to_owned());
    }
    let stroke =
        recording.channel("displacement_m").map(|values| Even::new(recording.times_s(), values, interval_s).judged());
    let profile = (1..=PROFILE_INSTANTS)
        .map(|index| {
            let time_s = PROFILE_ENDS * duration_s * index as f64 / PROFILE_INSTANTS as f64;
            Sample {
                time_s,
                stroke_m: stroke.as_ref().map(|stroke| stroke.at(contact_s + time_s)),
                force_n: judged.at(contact_s + time_s),
            }
        })
        .collect();
    let stroke_m =
        stroke.map(|stroke| stroke.values[noticed..until.min(stroke.values.len())].iter().copied().fold(0.0, f64::max));
    let ahead_s = judged.time_s(place) - (noticed_s + f64::from(DUE[INSTANTS - 1].0));
    Ok(Impact { peak_n, stroke_m, profile, rise, ahead_s, ..known })
}
