//! From a campaign to its contact law: what can be fitted is fitted, each law is judged on recordings left out, and the simplest
//! one that is not worse than the best is named.
//!
//! Intervals are the wider of two: the Jacobian's, with model error as noise and stated uncertainties as they are stated, and the
//! jackknife's over recordings (M. H. Quenouille, Biometrika 43 (1956) 353; Student's t with as many degrees as recordings less one),
//! which knows of whatever differs from recording to recording.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::blow::Blow;
use super::depth::{self, Source};
use super::fit::{Fit, Setting};
use super::hysteresis::restitution_of_loss;
use super::identifiable::{adds_nothing, identifiable, too_few};
use super::law::{Damping, Law, Values};
use super::refusal::NotIdentified;
use super::{LAWS, motion};
use crate::campaign::{Loaded, RigKind};
use crate::recording::FORCE;

/// Column of a measured depth.
const STROKE: &str = "displacement_m";
/// Most folds; with fewer recordings each is its own.
const MOST_FOLDS: usize = 24;
/// A law is not worse than another one when the mean of ln(rest²) is less than this above it, whatever its scatter.
const IMMATERIAL: f64 = 1e-3;
/// A simpler law is taken when it is at most this many standard errors worse than the best.
const SIMPLER: f64 = 1.0;
/// Laws this many standard errors apart are told apart.
const ALIKE: f64 = 2.0;
/// Points of a curve of restitution over speed.
const CURVE: usize = 25;
/// A measured stroke that is this much shorter than the robot's way is that of a part.
const PART_OF_THE_WAY: f64 = 0.93;
/// Held-out rest over noise above which something besides the law acts.
const BEYOND_NOISE: f64 = 1.5;

/// What is asked for.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Only these laws; empty: all.
    pub laws: Vec<String>,
    /// Where the depth comes from; `None`: measured where it was measured.
    pub depth: Option<Source>,
    /// An exponent that is known.
    pub exponent: Option<f64>,
}

/// A parameter with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its unit; `N/m^n` depends on the exponent.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// Lower end; that of the value where it was held.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A law that was fitted.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The law.
    pub law: &'static Law,
    /// Its values.
    pub values: Values,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// What is left of the recordings that it was fitted to, N rms.
    pub rmse_n: f64,
    /// What is left of each recording when it took no part, N rms.
    pub held_out_n: Vec<f64>,
    /// The restitution that the law really gives, over the speeds that were recorded: m/s and 1.
    pub restitution: Vec<(f64, f64)>,
    /// What it claims at the middle speed, beside what it gives there.
    pub claimed_restitution: Option<f64>,
    /// What it gives at the middle speed.
    pub true_restitution: f64,
    pub(super) fit: Fit,
}

impl Identified {
    /// What is left of recordings that took no part, N rms over all.
    #[must_use]
    pub fn held_out_rmse_n(&self) -> f64 {
        (self.held_out_n.iter().map(|rest| rest * rest).sum::<f64>() / self.held_out_n.len() as f64).sqrt()
    }
}

/// What became of a recording.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Its file.
    pub file: String,
    /// Speed as stated, m/s.
    pub speed_m_per_s: f64,
    /// Mass as stated, kg.
    pub mass_kg: f64,
    /// Highest force, N.
    pub peak_n: f64,
    /// Restitution by its momentum with mass and speed as stated, and its standard deviation.
    pub restitution: (f64, f64),
}

/// What was identified.
#[derive(Clone, Debug)]
pub struct Identification {
    /// The law that is named.
    pub chosen: usize,
    /// Laws that cannot be told from it, by place in `laws`.
    pub alike: Vec<usize>,
    /// Every law that was fitted, the best on recordings left out first.
    pub laws: Vec<Identified>,
    /// Laws that were not fitted, with the reason.
    pub unfitted: Vec<(&'static Law, String)>,
    /// What cannot be identified, a sentence each.
    pub cannot: Vec<String>,
    /// Recordings that could not be used, with the reason.
    pub left_out: Vec<(String, String)>,
    /// What is to be noted, a sentence each.
    pub notes: Vec<String>,
    /// Where the depth came from.
    pub source: Source,
    /// Noise before contact, N rms over all recordings.
    pub noise_n: f64,
    /// Depth, force and speed in the middle of the recordings: m, N, m/s.
    pub middle: (f64, f64, f64),
    /// Mean mass, kg.
    pub mass_kg: f64,
    /// The recordings that were used.
    pub recordings: Vec<Recorded>,
    /// Gravity along the impact, m/s².
    pub gravity_m_per_s2: f64,
    /// Relative repeatability of the springs.
    pub(super) spring_repeatability: f64,
    pub(super) configurations: usize,
    pub(super) held_exponent: Option<f64>,
    pub(super) blows: Vec<Blow>,
}

impl Identification {
    /// The law that is named.
    #[must_use]
    pub fn law(&self) -> &Identified {
        &self.laws[self.chosen]
    }

    /// Whether the law is the only one, or one of several that differ in nothing but what they claim.
    #[must_use]
    pub fn is_ambiguous(&self) -> bool {
        self.alike.iter().any(|&place| !self.laws[place].law.same_force(self.law().law))
    }

    pub(super) fn setting(&self) -> Setting<'_> {
        Setting {
            blows: &self.blows,
            source: self.source,
            gravity_m_per_s2: self.gravity_m_per_s2,
            spring_repeatability: self.spring_repeatability,
            configurations: self.configurations,
            reference_m: self.middle.0,
            reference_n: self.middle.1,
            reference_m_per_s: self.middle.2,
            held_exponent: self.held_exponent,
        }
    }
}

/// Identifies the contact law of a campaign; `progress` is told what comes next.
///
/// # Errors
/// [`NotIdentified`]: the campaign cannot tell a contact law at all.
pub fn identify(
    loaded: &Loaded,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Identification, NotIdentified> {
    let campaign = &loaded.campaign;
    let asked = asked_for(options)?;
    if campaign.rig.kind == RigKind::Fall {
        return Err(NotIdentified::NoContact);
    }
    for (entry, recording) in campaign.recordings.iter().zip(&loaded.recordings) {
        if recording.channel(FORCE).is_none() {
            return Err(NotIdentified::NoForce { file: entry.file.clone() });
        }
    }
    let mut notes = loaded.warnings.clone();
    let source = source(loaded, options, &mut notes)?;
    let gravity = campaign.rig.gravity_along_impact_m_per_s2;

    progress("the first contact of each recording");
    let names = configurations(loaded);
    let mut left_out = Vec::new();
    let mut blows = Vec::new();
    for (number, (entry, recording)) in campaign.recordings.iter().zip(&loaded.recordings).enumerate() {
        let measured = source == Source::Measured;
        let cut =
            Blow::cut(entry, recording, campaign.chain.full_scale.unwrap_or(f64::INFINITY), names[number], measured)
                .and_then(|blow| {
                    match blow.contradiction(gravity) {
                        // The momentum says nothing of a depth that was measured.
                        Some(sentence) if !measured => Err(sentence),
                        Some(sentence) => {
                            notes.push(format!("{}: {sentence}", entry.file));
                            Ok(blow)
                        }
                        None => Ok(blow),
                    }
                });
        match cut {
            Ok(blow) => blows.push(blow),
            Err(because) => left_out.push((entry.file.clone(), because)),
        }
    }
    let usable = blows.len();
    if usable < 2 {
        let because = left_out.iter().map(|(file, because)| format!("{file}: {because}")).collect();
        return Err(NotIdentified::TooFew { usable, all: loaded.recordings.len(), needed: 2, because });
    }
    // Before a measured depth cuts the ends off.
    let recordings = blows.iter().map(|blow| recorded(blow, gravity)).collect();
    if source == Source::Measured {
        progress("whether depth and force belong together");
        depth::not_computed(&blows)?;
        depth::aligned(&blows, gravity, campaign.rig.pad_stiffness_n_per_m.is_some())?;
        notes.extend(part_of_the_way(&blows, gravity));
        blows.iter_mut().for_each(depth::measured);
    }
    blows.iter_mut().for_each(Blow::group);

    let found = identifiable(&blows, options.exponent.is_some());
    let held_exponent = options.exponent.or((!found.exponent).then_some(1.0));
    let mut unfitted = Vec::new();
    let mut to_fit: Vec<&'static Law> = Vec::new();
    for law in asked {
        match adds_nothing(law, held_exponent)
            .map(str::to_owned)
            .or_else(|| too_few(law, held_exponent.is_some(), usable))
        {
            Some(because) => unfitted.push((law, because)),
            None => to_fit.push(law),
        }
    }
    let middle = middle(&blows, source, gravity);
    let mut identification = Identification {
        chosen: 0,
        alike: Vec::new(),
        laws: Vec::new(),
        unfitted,
        cannot: found.sentences,
        left_out,
        notes,
        source,
        noise_n: (blows.iter().map(|blow| blow.noise_n * blow.noise_n).sum::<f64>() / usable as f64).sqrt(),
        middle,
        mass_kg: blows.iter().map(|blow| blow.mass.value).sum::<f64>() / usable as f64,
        recordings,
        gravity_m_per_s2: gravity,
        spring_repeatability: campaign.rig.spring_repeatability,
        configurations: names.iter().max().map_or(1, |most| most + 1),
        held_exponent,
        blows,
    };
    progress("every law, on all recordings and with each left out");
    fit_all(&mut identification, &to_fit);
    if identification.laws.is_empty() {
        let because: Vec<String> =
            identification.unfitted.iter().map(|(law, because)| format!("{}: {because}", law.name)).collect();
        return Err(NotIdentified::NoLaw(because.join("; ")));
    }
    choose(&mut identification, found.speeds);
    Ok(identification)
}

fn asked_for(options: &Options) -> Result<Vec<&'static Law>, NotIdentified> {
    if let Some(exponent) = options.exponent
        && !(0.4..=5.0).contains(&exponent)
    {
        return Err(NotIdentified::Exponent(exponent));
    }
    for id in &options.laws {
        if Law::named(id).is_none() {
            return Err(NotIdentified::NoSuchLaw(id.clone()));
        }
    }
    Ok(LAWS
        .iter()
        .copied()
        .filter(|law| options.laws.is_empty() || options.laws.iter().any(|id| id == law.id))
        .collect())
}

/// Where the depth comes from.
fn source(loaded: &Loaded, options: &Options, notes: &mut Vec<String>) -> Result<Source, NotIdentified> {
    let files = loaded.campaign.recordings.iter().map(|entry| &entry.file);
    let without = files.zip(&loaded.recordings).find(|(_, recording)| recording.channel(STROKE).is_none());
    match (options.depth, without) {
        (Some(Source::Reconstructed), _) => Ok(Source::Reconstructed),
        (_, None) => Ok(Source::Measured),
        (Some(Source::Measured), Some((file, _))) => Err(NotIdentified::NoDepth { file: file.clone() }),
        (None, Some((file, _))) => {
            if loaded.recordings.iter().any(|recording| recording.channel(STROKE).is_some()) {
                notes.push(format!(
                    "{file} has no `{STROKE}`, others have: all depths are computed from force, mass and speed"
                ));
            }
            Ok(Source::Reconstructed)
        }
    }
}

/// The number of each recording's configuration; recordings that name none are one.
fn configurations(loaded: &Loaded) -> Vec<usize> {
    let mut names: Vec<Option<&String>> = Vec::new();
    let entries = &loaded.campaign.recordings;
    entries
        .iter()
        .map(|entry| {
            let name = entry.configuration.as_ref();
            names.iter().position(|other| *other == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            })
        })
        .collect()
}

/// Says where a measured stroke is not the whole way of the robot.
fn part_of_the_way(blows: &[Blow], gravity: f64) -> Option<String> {
    let mut shares: Vec<f64> = blows
        .iter()
        .map(|blow| {
            let way = depth::reconstructed(blow, blow.contact_s, blow.mass.value, blow.speed.value, gravity);
            let deepest = way.iter().map(|(depth, _)| *depth).fold(0.0, f64::max);
            let first = blow.full.times_s.iter().position(|time| *time >= blow.contact_s).unwrap_or(0);
            let stroke = blow.stroke_m.iter().copied().fold(f64::NEG_INFINITY, f64::max) - blow.stroke_m[first];
            stroke / deepest
        })
        .collect();
    shares.sort_by(f64::total_cmp);
    let share = shares[shares.len() / 2];
    (share < PART_OF_THE_WAY).then(|| {
        format!(
            "the stroke in `{STROKE}` is {share:.2} of the robot's way (the force integrated twice): it is that of a part, such as the springs \
             without the pad, and so is the law; for the whole contact say --depth reconstructed"
        )
    })
}

/// Depth, force and speed in the middle of the recordings.
fn middle(blows: &[Blow], source: Source, gravity: f64) -> (f64, f64, f64) {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let deepest = |blow: &Blow| {
        let depths = match source {
            Source::Measured => blow.full.depth.clone(),
            Source::Reconstructed => {
                depth::reconstructed(blow, blow.contact_s, blow.mass.value, blow.speed.value, gravity)
            }
        };
        depths.iter().map(|(depth, _)| *depth).fold(1e-9, f64::max)
    };
    (
        median(blows.iter().map(deepest).collect()),
        median(blows.iter().map(|blow| blow.peak_n).collect()),
        median(blows.iter().map(|blow| blow.speed.value).collect()),
    )
}

fn recorded(blow: &Blow, gravity: f64) -> Recorded {
    Recorded {
        file: blow.file.clone(),
        speed_m_per_s: blow.speed.value,
        mass_kg: blow.mass.value,
        peak_n: blow.peak_n,
        restitution: blow.restitution(blow.mass.value, blow.speed.value, gravity),
    }
}

/// Fits every law, with its intervals and what it leaves of recordings that took no part; laws of one force are fitted once.
fn fit_all(identification: &mut Identification, laws: &[&'static Law]) {
    let setting = identification.setting();
    let mut distinct: Vec<&'static Law> = Vec::new();
    for law in laws {
        if distinct.iter().all(|other| !other.same_force(law)) {
            distinct.push(law);
        }
    }
    let fitted: Vec<Option<Fitted>> = distinct.par_iter().map(|law| fit_one(&setting, law)).collect();
    let mut found = Vec::new();
    let mut unfitted = Vec::new();
    for law in laws {
        let like = distinct.iter().position(|other| other.same_force(law)).and_then(|place| fitted[place].as_ref());
        match like {
            Some(like) => found.push(identified(identification, &setting, law, like)),
            None => unfitted.push((*law, "no values of its parameters can be fitted to these recordings".to_owned())),
        }
    }
    identification.laws = found;
    identification.unfitted.extend(unfitted);
}

struct Fitted {
    fit: Fit,
    jackknife: DMatrix<f64>,
    folds: usize,
    /// Mean square of what is left of each blow that took no part, N².
    held_out: Vec<f64>,
}

fn fit_one(setting: &Setting<'_>, law: &'static Law) -> Option<Fitted> {
    let count = setting.blows.len();
    let all: Vec<usize> = (0..count).collect();
    let fit = setting.fit(law, &all, None)?;
    let folds = count.min(MOST_FOLDS);
    // Coordinates without a fold, and what they leave of each blow in it.
    type Without = (Vec<f64>, Vec<(usize, f64)>);
    let without: Option<Vec<Without>> = (0..folds)
        .into_par_iter()
        .map(|fold| {
            let part: Vec<usize> = all.iter().copied().filter(|number| number % folds != fold).collect();
            let again = setting.fit(law, &part, Some(&fit))?;
            let rests: Option<Vec<(usize, f64)>> = all
                .iter()
                .filter(|number| *number % folds == fold)
                .map(|&number| Some((number, setting.left_out(&again, number)?)))
                .collect();
            Some((again.point.law.clone(), rests?))
        })
        .collect();
    let without = without?;
    let size = fit.point.law.len();
    let mut mean = DVector::zeros(size);
    for (coordinates, _) in &without {
        mean += DVector::from_column_slice(coordinates) / folds as f64;
    }
    let mut jackknife = DMatrix::zeros(size, size);
    for (coordinates, _) in &without {
        let away = DVector::from_column_slice(coordinates) - &mean;
        jackknife += &away * away.transpose() * ((folds - 1) as f64 / folds as f64);
    }
    let mut held_out = vec![0.0; count];
    for (number, rest) in without.into_iter().flat_map(|(_, rests)| rests) {
        held_out[number] = rest;
    }
    Some(Fitted { fit, jackknife, folds, held_out })
}

fn identified(
    identification: &Identification,
    setting: &Setting<'_>,
    law: &'static Law,
    fitted: &Fitted,
) -> Identified {
    let fit = Fit { law, ..fitted.fit.clone() };
    let values = setting.values(law, &fit.point.law);
    let squares: f64 =
        (0..setting.blows.len()).filter_map(|number| setting.mean_square(law, &fit.point, number)).sum::<f64>();
    let speeds = setting.blows.iter().map(|blow| blow.speed.value);
    let (low, high) = speeds.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
    let gives = |speed: f64| match law.damping {
        Damping::None => 1.0,
        Damping::Material => restitution_of_loss(1.5 * values.damping * speed),
        Damping::OverSpeed { .. } => restitution_of_loss(values.damping),
        Damping::Dashpot => motion::restitution(law, &values, identification.mass_kg, speed),
    };
    // Scatter may have fitted a gain; nothing gains energy.
    let gives = |speed: f64| gives(speed).min(1.0);
    let steps = if high / low - 1.0 < 0.02 { 1 } else { CURVE };
    let middle = setting.reference_m_per_s;
    Identified {
        law,
        values,
        parameters: parameters(setting, law, &fit, &fitted.jackknife, fitted.folds),
        rmse_n: (squares / setting.blows.len() as f64).sqrt(),
        held_out_n: fitted.held_out.iter().map(|square| square.sqrt()).collect(),
        restitution: (0..steps)
            .map(|step| low + (high - low) * step as f64 / (steps.max(2) - 1) as f64)
            .map(|speed| (speed, gives(speed)))
            .collect(),
        claimed_restitution: law.claimed_restitution(&values, middle),
        true_restitution: gives(middle),
        fit,
    }
}

/// Parameters with their intervals.
fn parameters(setting: &Setting<'_>, law: &Law, fit: &Fit, jackknife: &DMatrix<f64>, folds: usize) -> Vec<Parameter> {
    let coordinates = &fit.point.law;
    let values = setting.values(law, coordinates);
    let quantile = StudentsT::new(0.0, 1.0, (folds - 1).max(1) as f64).map_or(2.0, |t| t.inverse_cdf(0.975));
    // Half the interval of a linear combination of the coordinates.
    let half = |weights: &[f64]| {
        let weights = DVector::from_column_slice(weights);
        let sd = |covariance: &DMatrix<f64>| (weights.transpose() * covariance * &weights)[(0, 0)].max(0.0).sqrt();
        (1.96 * sd(&fit.covariance)).max(quantile * sd(jackknife))
    };
    let unit = |place: usize| {
        let mut weights = vec![0.0; coordinates.len()];
        weights[place] = 1.0;
        weights
    };
    let free = law.exponent && setting.held_exponent.is_none();
    let mut of_stiffness = unit(0);
    if free {
        of_stiffness[1] = -setting.reference_m.ln();
    }
    let ratio = |half: f64, value: f64| (value * (-half).exp(), value * half.exp());
    let stiffness = values.stiffness();
    let (low, high) = ratio(half(&of_stiffness), stiffness);
    let is_linear = !law.exponent || setting.held_exponent == Some(1.0);
    let mut all = vec![Parameter {
        name: "stiffness",
        unit: if is_linear { "N/m" } else { "N/m^n" },
        value: stiffness,
        low,
        high,
    }];
    if law.exponent {
        let half = if free { half(&unit(1)) } else { 0.0 };
        let value = values.exponent;
        all.push(Parameter { name: "exponent", unit: "1", value, low: value - half, high: value + half });
    }
    let (low, high) = ratio(half(&unit(0)), values.reference_n);
    all.push(Parameter { name: "force_at_middle_depth", unit: "N", value: values.reference_n, low, high });
    if matches!(law.damping, Damping::None) {
        return all;
    }
    let last = coordinates.len() - 1;
    let half = half(&unit(last)) * setting.damping_unit(law);
    // Recordings may scatter beyond what a loss can be; nothing gains energy.
    let [value, low, high] = [values.damping, values.damping - half, values.damping + half].map(|loss| loss.max(0.0));
    all.push(match law.damping {
        Damping::OverSpeed { restitution, .. } => Parameter {
            name: "restitution",
            unit: "1",
            value: restitution(value),
            low: restitution(high),
            high: restitution(low),
        },
        Damping::Dashpot => Parameter { name: "damping", unit: "N·s/m", value, low, high },
        Damping::None | Damping::Material => Parameter { name: "alpha", unit: "s/m", value, low, high },
    });
    all
}

/// Names the simplest law that is not worse than the best on recordings left out, and what cannot be told from it.
fn choose(identification: &mut Identification, speeds_differ: bool) {
    let held = identification.held_exponent.is_some();
    identification.laws.sort_by(|a, b| a.held_out_rmse_n().total_cmp(&b.held_out_rmse_n()));
    let laws = &identification.laws;
    // Mean of the logarithm of the rests' ratio, and its standard error, over recordings.
    let behind = |a: &Identified, b: &Identified| {
        let ratios: Vec<f64> = a.held_out_n.iter().zip(&b.held_out_n).map(|(a, b)| 2.0 * (a / b).ln()).collect();
        let count = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / count;
        let variance = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, (variance / count).sqrt())
    };
    let score = |law: &Identified| law.held_out_n.iter().map(|rest| rest.ln()).sum::<f64>();
    let best = (0..laws.len()).min_by(|a, b| score(&laws[*a]).total_cmp(&score(&laws[*b]))).unwrap_or(0);
    let as_good = |place: usize, than: usize, errors: f64| {
        let (mean, se) = behind(&laws[place], &laws[than]);
        mean <= (errors * se).max(IMMATERIAL)
    };
    // At one speed, α of the material and a loss that is the same at every speed are one law.
    let loses = |law: &Law| matches!(law.damping, Damping::Material | Damping::OverSpeed { .. });
    let honest =
        |law: &Identified| law.claimed_restitution.map_or(0.0, |claimed| (claimed - law.true_restitution).abs());
    let chosen = (0..laws.len())
        .filter(|place| as_good(*place, best, SIMPLER))
        .min_by(|a, b| {
            let (a, b) = (&laws[*a], &laws[*b]);
            let alike = a.law.same_force(b.law);
            let simple = a.law.parameters(held).cmp(&b.law.parameters(held));
            // Of laws with one force, the one whose restitution is the one that it gives.
            let among = if alike { honest(a).total_cmp(&honest(b)) } else { score(a).total_cmp(&score(b)) };
            simple.then(among)
        })
        .unwrap_or(best);
    let alike = (0..laws.len())
        .filter(|&place| {
            let (law, named) = (laws[place].law, laws[chosen].law);
            let one_speed = !speeds_differ && law.exponent == named.exponent && loses(law) && loses(named);
            place != chosen
                && (one_speed || as_good(place, chosen, ALIKE))
                && (law.same_force(named) || !law.contains(named))
        })
        .collect();
    identification.chosen = chosen;
    identification.alike = alike;
    let ratio = identification.law().held_out_rmse_n() / identification.noise_n;
    let mut cannot = Vec::new();
    if ratio > BEYOND_NOISE {
        identification.notes.push(format!(
            "even the best law leaves {ratio:.1} times the noise of recordings left out: something besides the contact acts; `thud diagnose` looks for it"
        ));
    }
    let law = identification.law();
    if identification.laws.iter().any(|other| !matches!(other.law.damping, Damping::None))
        && matches!(law.law.damping, Damping::None)
    {
        cannot.push(no_loss(identification));
    }
    if speeds_differ && matches!(law.law.damping, Damping::OverSpeed { .. }) {
        let same: Vec<&str> = identification
            .laws
            .iter()
            .filter(|other| matches!(other.law.damping, Damping::OverSpeed { .. }))
            .map(|other| other.law.name)
            .collect();
        if same.len() > 1 {
            cannot.push(format!(
                "{} give the same force and differ only in the restitution that they read from it: no recording of force and depth tells them apart",
                same.join(", ")
            ));
        }
    }
    identification.cannot.extend(cannot);
}

/// What loss would have been seen.
fn no_loss(identification: &Identification) -> String {
    let least = identification
        .laws
        .iter()
        .filter(|law| matches!(law.law.damping, Damping::OverSpeed { .. }))
        .flat_map(|law| law.parameters.iter().filter(|parameter| parameter.name == "restitution"))
        .map(|parameter| parameter.low)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        format!(
            "No loss shows: a restitution below {least:.4} would have been seen; how it is lost cannot be identified"
        )
    } else {
        "No loss shows, so how it is lost cannot be identified".to_owned()
    }
}
