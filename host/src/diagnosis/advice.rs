//! What to record next: computed from the models, not a canned sentence.
//!
//! Two models that these recordings cannot tell apart are both run at conditions that have not been recorded. What the one shows and
//! the other cannot imitate (by contact instant, offset, speed, spring and its own values for that recording, and by whatever else the
//! recordings at hand leave it free to move) is how far that recording would separate them. It is asked for where a few of it tell
//! clearly more than what is at hand does.

use std::f64::consts::TAU;
use std::sync::Arc;

use thud_sim::mechanism::Search;

use super::fit::{Effort, Fit, Tangent};
use super::layout::{Layout, Point, Role};
use super::problem::{Prepared, Problem, Samples};
use super::sampling::bends;
use super::select::{Selection, Trial};
use super::verdict::{IMPOSSIBLE, Verdict, twins};
use super::words::listed;
use super::{DiagnosisError, Options, RigKind};
use crate::campaign::Loaded;

/// Speeds that are tried, over the largest that was recorded.
const SPEEDS: [f64; 4] = [0.25, 0.6, 1.0, 1.3];
/// A further recording is worth its while if it separates two models so many times better,
pub const RAISED: f64 = 1.5;
/// less than one standard deviation being chance.
pub const CHANCE: f64 = 1.0;
/// It is foretold to separate them so much better: what a rig has that no model knows takes up to half of what is foretold
/// (docs/proof.md, the advice followed).
const AIMED: f64 = 2.25;
/// So many times it is asked for at least, since one impact may go wrong,
const LEAST_TIMES: usize = 3;
/// and at most.
const MOST_TIMES: usize = 10;
/// From how many values of its own for the new recording an imitation begins.
const OWN_STARTS: usize = 4;
/// What one recording explains so much of is seen in it alone.
const ALONE: f64 = 0.9;
/// How long a recording goes on after the contact that a free impact would have, in contact times,
const FREE: f64 = 3.0;
/// and where contact is held. The models have to be right for longest there, so it is asked for only where a free impact tells too little.
const HELD: f64 = 25.0;

/// A recording that has not been made, and how far it separates two models.
#[derive(Clone, Debug, PartialEq)]
pub struct Separation {
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Effective mass, kg.
    pub mass_kg: f64,
    /// Name of the configuration.
    pub configuration: String,
    /// Seconds after contact to be recorded.
    pub after_s: f64,
    /// Whether contact is held.
    pub is_held: bool,
    /// Norm of the whitened difference that cannot be imitated.
    pub separation: f64,
}

/// A recording that an answer asks for, read from its sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// The mechanism that is named, and the one that it is to be told from.
    pub twins: (String, String),
    /// Speed, m/s.
    pub speed_m_per_s: f64,
    /// Name of the configuration.
    pub configuration: String,
    /// Seconds after contact to be recorded.
    pub after_s: f64,
    /// How many such recordings.
    pub times: usize,
}

impl Asked {
    /// `None`: the sentence asks for no recording.
    #[must_use]
    pub fn read(sentence: &str) -> Option<Self> {
        let (twins, rest) = sentence.strip_prefix("To tell ")?.split_once(": record ")?;
        let (one, other) = twins.split_once(" from ")?;
        let (speed, rest) = rest.split_once(" m/s with ")?;
        let (configuration, rest) = rest.split_once(" kg (configuration ")?.1.split_once("), until ")?;
        let (after, rest) = rest.split_once(" s after contact, ")?;
        let (times, _) = rest.split_once(" times.")?;
        Some(Self {
            twins: (one.to_owned(), other.to_owned()),
            speed_m_per_s: speed.parse().ok()?,
            configuration: configuration.to_owned(),
            after_s: after.parse().ok()?,
            times: times.parse().ok()?,
        })
    }
}

impl Separation {
    /// How far so many such recordings separate two models that the ones at hand separate so far.
    fn beside(&self, here: f64, times: usize) -> f64 {
        here.hypot(self.separation * (times as f64).sqrt())
    }

    /// How many of it separate them as far as is aimed at; `None`: more than anybody makes.
    fn times(&self, here: f64) -> Option<usize> {
        (LEAST_TIMES..=MOST_TIMES).find(|times| self.beside(here, *times) > AIMED * here.max(CHANCE))
    }
}

/// The recording to make, and how many times: the one that separates most, without a held contact where that will do.
fn next(separations: &[Separation], here: f64) -> Option<(&Separation, usize)> {
    [false, true].into_iter().find_map(|held| {
        let most = separations.iter().find(|separation| separation.is_held == held)?;
        Some((most, most.times(here)?))
    })
}

fn sentence((id, twin): (&str, &str), (next, times): (&Separation, usize), here: f64) -> String {
    format!(
        "To tell {id} from {twin}: record {:.2} m/s with {:.1} kg (configuration {}), until {:.2} s after contact, {times} times. They are then {:.1} standard deviations apart; with the recordings at hand {here:.1}.",
        next.speed_m_per_s,
        next.mass_kg,
        next.configuration,
        next.after_s,
        next.beside(here, times)
    )
}

/// How far the recordings tell two mechanisms apart: the root of what the second leaves of χ² beyond the first, each alone beside the
/// re-tuned baseline.
///
/// # Errors
/// As [`diagnose`](super::diagnose) has them.
pub fn told_apart(loaded: &Loaded, one: &str, other: &str) -> Result<f64, DiagnosisError> {
    let alone = |id: &str| {
        let options = Options { only: vec![id.to_owned()], ..Options::default() };
        super::diagnose(loaded, &options, &mut |_| {}).map(|diagnosis| diagnosis.selection.best.fit.cost)
    };
    Ok((alone(other)? - alone(one)?).max(0.0).sqrt())
}

/// Sentences for a selection.
#[must_use]
pub fn advice(problem: &Problem, selection: &Selection) -> Vec<String> {
    let best = &selection.best;
    let mut sentences = impossible_speeds(problem, &best.fit);
    for place in 0..best.fit.layout.entrants.len() {
        let id = best.fit.layout.entrants[place].effect.mechanism().id;
        for (twin, _) in twins(selection, place) {
            let rival = selection.rivals.iter().find(|(of, trial)| *of == place && last_id(trial) == Some(twin));
            let Some((_, rival)) = rival else { continue };
            let here = (best.fit.cost - rival.fit.cost).abs().sqrt();
            sentences.push(match next(&separations(problem, &best.fit, &rival.fit), here) {
                Some(next) => sentence((id, twin), next, here),
                None => format!(
                    "No speed, mass or longer recording on this rig tells {id} from {twin} much better: change the rig ({}).",
                    best.fit.layout.entrants[place].effect.mechanism().separated_by
                ),
            });
        }
    }
    if sentences.is_empty() && Verdict::of(selection) == Verdict::Unexplained {
        sentences.extend(where_to_look(problem));
    }
    if sentences.is_empty() {
        sentences.extend(once_more(problem, selection));
    }
    sentences
}

/// What a single recording shows no other one foretells: the same impact again tells whether it was that of the rig.
fn once_more(problem: &Problem, selection: &Selection) -> Option<String> {
    let explained =
        |number: usize| selection.baseline.own_cost(problem, number) - selection.best.fit.own_cost(problem, number);
    let explained: Vec<f64> = (0..problem.recordings.len()).map(explained).collect();
    let number = alone(&explained)?;
    let Prepared { name, speed, mass, configuration, .. } = &problem.recordings[number];
    let again = match problem.rig.kind {
        RigKind::Fall => "let it fall like that".to_owned(),
        _ => format!(
            "record {:.2} m/s with {:.1} kg (configuration {})",
            speed.value, mass.value, problem.configurations[*configuration]
        ),
    };
    Some(format!(
        "Only {name} shows what is named: {again} {LEAST_TIMES} times more. Until then nothing else foretells it."
    ))
}

/// Which of several holds nearly all that is explained; `None`: they share it, or nothing is.
fn alone(explained: &[f64]) -> Option<usize> {
    let (most, of_one) = explained.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let all: f64 = explained.iter().map(|part| part.max(0.0)).sum();
    (explained.len() > 1 && *of_one > 0.0 && *of_one >= ALONE * all).then_some(most)
}

/// What to take away or to change, one at a time, where nothing has a name for what is left.
fn where_to_look(problem: &Problem) -> Option<String> {
    if problem.rig.kind == RigKind::Fall {
        return Some(
            "Let it fall three times more from the greatest height, and once each from half of it, with ballast in it and seen by another instrument: what ballast changes is the air's, what another instrument does not show is the first one's.".to_owned(),
        );
    }
    let heaviest = problem.recordings.iter().max_by(|a, b| energy(a).total_cmp(&energy(b)))?;
    let (exchanged, whose) = match problem.rig.kind {
        RigKind::Drop => ("with other ballast", "with the carriage"),
        _ => ("with another pose", "with the robot"),
    };
    let (mut changes, mut places) = (vec!["at half that speed", exchanged], vec!["with the rig", whose]);
    if problem.rig.pad_stiffness_n_per_m.is_some() {
        changes.insert(1, "with the pad taken out");
        places.insert(1, "with the pad");
    }
    Some(format!(
        "Repeat {:.2} m/s with {:.1} kg three times, and once each {}: what stays {} says where to look.",
        heaviest.speed.value,
        heaviest.mass.value,
        listed(&changes, "and"),
        listed(&places, "or")
    ))
}

/// Speeds that the force contradicts beyond all that masses, springs and the mechanisms that were found can explain.
fn impossible_speeds(problem: &Problem, fit: &Fit) -> Vec<String> {
    let Some(place) = fit.layout.locals.iter().position(|coordinate| coordinate.role == Role::Speed) else {
        return Vec::new();
    };
    let recordings = problem.recordings.iter().enumerate();
    let sentences = recordings.filter_map(|(number, recording)| {
        let (mean, sd) = fit.layout.local_prior(problem, number, place)?;
        let off = (fit.point.locals[number][place] - mean) / sd;
        let stated = recording.speed;
        let asked = stated.value + fit.point.locals[number][place] * recording.speed_scale();
        (off.abs() > IMPOSSIBLE).then(|| {
            format!(
                "Check the speed of {}: {:.3} ± {:.3} m/s is stated, and what was recorded goes with {asked:.3} m/s; no mass and no stiffness within what is stated explains that.",
                recording.name, stated.value, stated.sd
            )
        })
    });
    sentences.collect()
}

fn last_id(trial: &Trial) -> Option<&'static str> {
    trial.fit.layout.entrants.last().map(|entrant| entrant.effect.mechanism().id)
}

fn energy(recording: &Prepared) -> f64 {
    recording.mass.value * recording.speed.value.powi(2)
}

/// Recordings that could be made, the one that separates most first.
#[must_use]
pub fn separations(problem: &Problem, one: &Fit, other: &Fit) -> Vec<Separation> {
    let fastest = problem.recordings.iter().map(|recording| recording.speed.value.abs()).fold(0.0, f64::max);
    let at_hand: Vec<usize> = (0..problem.recordings.len()).collect();
    let Some(tangent) = other.tangent(problem, &at_hand) else { return Vec::new() };
    let mut all = Vec::new();
    for configuration in 0..problem.configurations.len() {
        let Some(model) = problem.recordings.iter().position(|recording| recording.configuration == configuration)
        else {
            continue;
        };
        for part in SPEEDS {
            for is_held in [false, true] {
                all.extend(separation(problem, one, (other, &tangent), model, part * fastest, is_held));
            }
        }
    }
    all.sort_by(|a, b| b.separation.total_cmp(&a.separation));
    all
}

/// Simulates `one` as a recording and lets `other`, whose tangent at the recordings at hand is given, imitate it.
fn separation(
    problem: &Problem,
    one: &Fit,
    (other, at_hand): (&Fit, &Tangent),
    like: usize,
    speed: f64,
    is_held: bool,
) -> Option<Separation> {
    let pattern = &problem.recordings[like];
    let step_s = (pattern.times_s[pattern.times_s.len() - 1] - pattern.times_s[0]) / (pattern.times_s.len() - 1) as f64;
    let contact_s = 0.02;
    let after_s = if is_held { HELD } else { FREE } * pattern.contact_time_s;
    // A long hold is thinned: what it shows is slow.
    let step_s = step_s.max((contact_s + after_s) / 3000.0);
    let times_s: Vec<f64> = (0..((contact_s + after_s) / step_s) as usize).map(|place| place as f64 * step_s).collect();
    // A recorder that takes no second sample within the hit shows nothing of it.
    if times_s.len() < 2 {
        return None;
    }
    let blank = |series: Vec<Vec<f64>>| Problem {
        rig: problem.rig.clone(),
        channels: problem.channels.clone(),
        configurations: problem.configurations.clone(),
        mass_sd: problem.mass_sd.clone(),
        is_of_places: problem.is_of_places,
        work: Arc::clone(&problem.work),
        recordings: vec![Prepared {
            name: String::new(),
            file: String::new(),
            bends: bends(&times_s),
            times_s: times_s.clone(),
            series,
            quiet: Vec::new(),
            noise: pattern.noise.clone(),
            averaged: pattern.averaged,
            sample_s: pattern.sample_s,
            speed: crate::campaign::Estimate::new(
                speed,
                pattern.speed.sd / pattern.speed.value.abs().max(1e-9) * speed,
            ),
            mass: pattern.mass,
            configuration: pattern.configuration,
            order: problem.recordings.len() as u32,
            contact_guess_s: contact_s,
            offset_guess: vec![0.0; problem.channels.len()],
            contact_time_s: pattern.contact_time_s,
            asked_s: pattern.asked_s.clone(),
            raw: Samples { times_s: Vec::new(), values: Vec::new(), quiet_rms: None },
        }],
    };
    let quiet = blank(vec![vec![0.0; times_s.len()]; problem.channels.len()]);
    let start = |fit: &Fit, problem: &Problem| {
        let mut point = fit.layout.start(problem);
        point.globals.clone_from(&fit.point.globals);
        point
    };
    let shown = Fit::at(&quiet, one.layout.clone(), start(one, &quiet), &[0])?;
    let series: Vec<Vec<f64>> = shown.model[0].chunks(times_s.len()).map(<[f64]>::to_vec).collect();
    let hypothetical = blank(series);
    let starts = own_starts(&hypothetical, &other.layout, start(other, &hypothetical));
    let fits = starts.into_iter().filter_map(|start| {
        let fit = Fit::run(&hypothetical, other.layout.clone(), start, &[0], Effort::LOCAL)?;
        Some((fit.own_cost(&hypothetical, 0), fit))
    });
    let (left, imitated) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let yielded = yielded(at_hand, &hypothetical, &imitated)?;
    Some(Separation {
        speed_m_per_s: speed,
        mass_kg: pattern.mass.value,
        configuration: problem.configurations[pattern.configuration].clone(),
        after_s,
        is_held,
        separation: (left - yielded).max(0.0).sqrt(),
    })
}

/// The starts of an imitation: what a mechanism has of its own for each impact, a phase or an instant, may be anything.
fn own_starts(problem: &Problem, layout: &Layout, start: Point) -> Vec<Point> {
    let mut starts = vec![start];
    for (place, coordinate) in layout.locals.iter().enumerate() {
        let Role::Mechanism { entrant, place: number } = coordinate.role else { continue };
        let parameter = &layout.entrants[entrant].effect.mechanism().parameters[number];
        if !parameter.is_of_each_impact() || parameter.search == Search::Again {
            continue;
        }
        let instant = parameter.search == Search::EachInstant;
        let whole = if instant { problem.eventful_s(0) } else { TAU };
        let values = (0..OWN_STARTS).map(|part| whole * (part as f64 + 0.5) / OWN_STARTS as f64);
        starts = values
            .flat_map(|value| {
                let mut starts = starts.clone();
                starts.iter_mut().for_each(|start| start.locals[0][place] = value);
                starts
            })
            .collect();
    }
    starts
}

/// By how much the cost of a problem's only recording falls, to first order, when the shared coordinates move as well, as far as the
/// recordings at hand leave them free.
fn yielded(at_hand: &Tangent, problem: &Problem, fit: &Fit) -> Option<f64> {
    let mut residuals = vec![Vec::new(); at_hand.recordings()];
    residuals.push(fit.residuals[0].clone());
    let all = at_hand.clone().and(fit.tangent(problem, &[0])?);
    let (globals, mut locals) = all.transposed(&residuals);
    // The recording's own coordinates are where they want to be.
    locals.iter_mut().for_each(|local| local.fill(0.0));
    Some(all.normal(0.0)?.solve(&globals, &locals).globals.dot(&globals))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apart(separation: f64, is_held: bool) -> Separation {
        let (speed_m_per_s, mass_kg, after_s) = (0.62, 10.2, 0.31);
        Separation { speed_m_per_s, mass_kg, configuration: "elbow up".into(), after_s, is_held, separation }
    }

    /// √(4² + n·s²) has to pass 9.
    #[test]
    fn as_many_are_asked_for_as_surely_tell() {
        let times = |separation| apart(separation, false).times(4.0);
        assert_eq!([5.0, 3.0, 2.0].map(times), [Some(3), Some(8), None]);
        // What is less than chance counts as chance.
        assert_eq!(apart(0.8, false).times(0.1), Some(8));
    }

    #[test]
    fn contact_is_held_only_where_a_free_impact_tells_too_little() {
        let chosen = |free, held| {
            let mut separations = [apart(free, false), apart(held, true)];
            separations.sort_by(|a, b| b.separation.total_cmp(&a.separation));
            next(&separations, 4.0).map(|(next, times)| (next.is_held, times))
        };
        assert_eq!(chosen(3.0, 50.0), Some((false, 8)));
        assert_eq!(chosen(2.0, 50.0), Some((true, 3)));
        assert_eq!(chosen(2.0, 1.0), None);
    }

    #[test]
    fn what_one_recording_shows_alone_is_asked_for_again() {
        assert_eq!(alone(&[-2.0, 400.0, 3.0, 10.0]), Some(1));
        assert_eq!(alone(&[50.0, 400.0, 3.0, 10.0]), None);
        assert_eq!(alone(&[-2.0, -1.0]), None);
        assert_eq!(alone(&[400.0]), None);
    }

    #[test]
    fn what_is_asked_for_can_be_read_back() {
        let next = apart(7.4, false);
        let asked =
            Asked::read(&sentence(("stiction", "guide-friction"), (&next, 4), 1.2)).expect("it asks for a recording");
        assert_eq!(asked.twins, ("stiction".into(), "guide-friction".into()));
        assert_eq!((asked.speed_m_per_s, asked.after_s, asked.times), (0.62, 0.31, 4));
        assert_eq!(asked.configuration, "elbow up");
        assert_eq!(Asked::read("No speed, mass or longer recording on this rig tells a from b: change the rig."), None);
    }
}
