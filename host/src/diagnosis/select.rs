//! Which mechanisms: one after the other, each refitted in full beside its rivals, and dropped again where it is not needed.
//!
//! ```text
//! baseline ─▶ screen ─▶ refit the promising ─▶ best by BIC ─▶ is there a rest? ─▶ again … ─▶ drop what is not missed
//! ```
//!
//! BIC = χ² + p·ln N, N whitened samples, p parameters of the mechanisms (G. Schwarz, Ann. Stat. 6 (1978) 461); a mechanism
//! that acts in some recordings only pays for the choice as well.

use rayon::prelude::*;
use statrs::function::factorial::ln_binomial;
use thud_sim::mechanism::{Mechanism, Scale};

use super::candidate::Reach;
use super::fit::{Effort, Fit, Part, Tangent};
use super::layout::{Entrant, Layout, Role, Scope};
use super::locate::{Alone, alone};
use super::omnibus::{Omnibus, omnibus};
use super::problem::{Prepared, Problem};
use super::screen::{Screened, scale_strength, screen};
use super::verdict::{SIGNIFICANT, UNLIKELY};

/// Fall of BIC that the first mechanism must bring: with its parameter's ln N a fall of χ² of about 5.5².
const ENOUGH: f64 = 20.0;
/// A further one that no smooth rest asks for (it rings, hums or jumps) must bring this.
const UNASKED: f64 = 150.0;
/// And a further one this part of what the model has gained so far.
const FURTHER: f64 = 0.025;
/// Rivals within this of the best in BIC cannot be told apart.
pub const WITHIN_REACH: f64 = 10.0;
/// The most mechanisms in one model.
const MOST_MECHANISMS: usize = 3;
/// Mechanisms that are refitted.
const REFITTED: usize = 7;
/// Of those, how many until they converge.
const FINISHED: usize = 4;
/// And who was promised this part of what the best has gained by then.
const PROMISING: f64 = 0.4;
/// A belief about the rig or a mass is strained beyond this many of its deviations.
const STRAINED: f64 = 3.5;
/// A signature of which more than this is imitated by re-tuning is mere re-tuning.
const MERE_TUNING: f64 = 0.995;
/// How often a start that makes everything worse is taken back, and to which part of it.
const SHORTER_STARTS: usize = 5;
const SHORTER: f64 = 0.3;
/// A score below this is not refitted.
const LEAST_SCORE: f64 = 3.5;

/// A model that was fitted, with what it costs.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The fit.
    pub fit: Fit,
    /// Its BIC.
    pub bic: f64,
}

/// What the selection came to.
#[derive(Debug)]
pub struct Selection {
    /// The baseline, re-tuned.
    pub baseline: Fit,
    /// Derivatives there.
    pub baseline_tangent: Tangent,
    /// Whether the baseline leaves a rest.
    pub baseline_rest: Omnibus,
    /// Scores against the baseline.
    pub screened: Vec<Screened>,
    /// The chosen model; the baseline itself where nothing is needed.
    pub best: Trial,
    /// Derivatives there.
    pub tangent: Tangent,
    /// Whether it leaves a rest.
    pub rest: Omnibus,
    /// What one recording alone says against it.
    pub alone: Alone,
    /// Every other model that was refitted: which mechanism of the best it stands in for, and the model.
    pub rivals: Vec<(usize, Trial)>,
}

impl Trial {
    fn new(problem: &Problem, fit: Fit) -> Self {
        let bic = fit.cost + penalty(problem, &fit.layout);
        Self { fit, bic }
    }
}

/// What a model's mechanisms cost in BIC.
#[must_use]
pub fn penalty(problem: &Problem, layout: &Layout) -> f64 {
    let rows = problem.rows() as f64;
    let recordings = problem.recordings.len() as f64;
    let of_mechanism = |role: Role| matches!(role, Role::Mechanism { .. });
    let globals = layout.globals.iter().filter(|coordinate| of_mechanism(coordinate.role)).count() as f64;
    let acts_in = |entrant: usize| {
        let scope = layout.entrants[entrant].scope;
        let acts = |(number, recording): &(usize, &Prepared)| scope.includes(*number, recording.configuration);
        problem.recordings.iter().enumerate().filter(acts).count() as f64
    };
    let locals: f64 = layout
        .locals
        .iter()
        .map(|coordinate| match coordinate.role {
            Role::Mechanism { entrant, .. } => acts_in(entrant),
            _ => 0.0,
        })
        .sum();
    let choices: f64 = layout
        .entrants
        .iter()
        .map(|entrant| match entrant.scope {
            Scope::Everywhere => 0.0,
            Scope::Configuration(_) => 2.0 * recordings.ln(),
            // How many of them, and which.
            Scope::Recordings(some) => {
                let (n, k) = (problem.recordings.len() as u64, some.len() as u64);
                2.0 * (recordings.ln() + ln_binomial(n, k.min(n)))
            }
        })
        .sum();
    globals * rows.ln() + locals * (rows / recordings).ln() + choices
}

/// Selects among the given mechanisms.
#[must_use]
pub fn select(
    problem: &Problem,
    baseline: Fit,
    mechanisms: &[&'static Mechanism],
    lines_hz: &dyn Fn(&Fit) -> Vec<f64>,
    progress: &mut dyn FnMut(&str),
) -> Option<Selection> {
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let baseline_tangent = baseline.tangent(problem, &all)?;
    let baseline_rest = omnibus(problem, &baseline, &baseline_tangent);
    let mut best = Trial::new(problem, baseline.clone());
    let mut rest = baseline_rest;
    let mut tangent = baseline_tangent.clone();
    let mut screened = Vec::new();
    let mut rivals: Vec<(usize, Trial)> = Vec::new();
    while best.fit.layout.entrants.len() < MOST_MECHANISMS {
        let number = best.fit.layout.entrants.len();
        progress(if number == 0 { "which mechanism" } else { "is there another" });
        let reach = Reach::of(problem, lines_hz(&best.fit));
        let scores = screen(problem, &best.fit, &tangent, &reach, &remaining(mechanisms, &best.fit));
        if number == 0 {
            screened.clone_from(&scores);
        }
        let trials = refit(problem, &best.fit, &scores, &all);
        let Some(next) = trials.first() else { break };
        let fewer = (best.clone(), rivals.clone());
        // A further one has to be worth something beside what is explained already: no rig is quite like its equations.
        let worth = FURTHER * (baseline.cost - best.fit.cost).max(0.0);
        let enough = if number == 0 || asked_for(rest, &alone(problem, &best.fit)) { ENOUGH } else { UNASKED };
        if best.bic - next.bic < enough + worth {
            if number == 0 {
                rivals.extend(trials.into_iter().map(|trial| (0, trial)));
            }
            break;
        }
        best = next.clone();
        rivals.extend(trials.into_iter().skip(1).map(|trial| (number, trial)));
        tangent = best.fit.tangent(problem, &all)?;
        rest = omnibus(problem, &best.fit, &tangent);
        if number > 0 {
            let gained = (baseline.cost - best.fit.cost).max(0.0);
            drop_unneeded(problem, &mut best, gained, &all);
            if best.fit.layout.entrants.len() <= number {
                rivals.clear();
            }
            tangent = best.fit.tangent(problem, &all)?;
            rest = omnibus(problem, &best.fit, &tangent);
            if best.fit.layout.entrants.len() <= number {
                break;
            }
        }
        // Three that still leave a rest are no explanation: with enough of them anything bends to anything.
        if best.fit.layout.entrants.len() > 2 && asked_for(rest, &alone(problem, &best.fit)) {
            (best, rivals) = fewer;
            tangent = best.fit.tangent(problem, &all)?;
            rest = omnibus(problem, &best.fit, &tangent);
            break;
        }
    }
    if best.fit.layout.entrants.len() > 1 {
        progress("is each of them needed");
        rivals.clear();
        for place in 0..best.fit.layout.entrants.len() {
            for (_, trial) in stand_ins(problem, &best, place, mechanisms, lines_hz, &all) {
                rivals.push((place, trial));
            }
        }
        if let Some(better) = rivals
            .iter()
            .filter(|(_, trial)| trial.bic < best.bic - 1.0)
            .min_by(|a, b| a.1.bic.total_cmp(&b.1.bic))
            .cloned()
        {
            let (place, trial) = better;
            let beaten = std::mem::replace(&mut best, trial);
            rivals.retain(|(of, trial)| *of == place && trial.bic > best.bic);
            rivals.push((place, beaten));
            tangent = best.fit.tangent(problem, &all)?;
            rest = omnibus(problem, &best.fit, &tangent);
        }
    }
    let alone = alone(problem, &best.fit);
    Some(Selection { alone, baseline, baseline_tangent, baseline_rest, screened, best, tangent, rest, rivals })
}

/// Whether what a model leaves is more than noise and traces of the usual imperfections.
fn asked_for(rest: Omnibus, alone: &Alone) -> bool {
    rest.z() > SIGNIFICANT || alone.p_value < UNLIKELY
}

fn remaining(mechanisms: &[&'static Mechanism], fit: &Fit) -> Vec<&'static Mechanism> {
    let taken =
        |mechanism: &Mechanism| fit.layout.entrants.iter().any(|entrant| entrant.effect.mechanism().id == mechanism.id);
    mechanisms.iter().copied().filter(|mechanism| !taken(mechanism)).collect()
}

/// Refits what scores best, best first.
fn refit(problem: &Problem, base: &Fit, scores: &[Screened], part: Part<'_>) -> Vec<Trial> {
    // Where a belief is strained, what could relieve it is refitted whatever its score: a strain of many deviations is not linear.
    let strained = base.strain() > STRAINED;
    let relieves = |score: &&Screened| {
        strained
            && score.absorbed > MERE_TUNING
            && score.entrant.effect.mechanism().parameters[0].scale == Scale::Linear
    };
    let mut order: Vec<&Screened> = scores.iter().filter(|score| score.z >= LEAST_SCORE || relieves(score)).collect();
    order.sort_by(|a, b| b.z.total_cmp(&a.z));
    let mut chosen: Vec<&Screened> = Vec::new();
    let mut mechanisms: Vec<&str> = Vec::new();
    for score in &order {
        let id = score.entrant.effect.mechanism().id;
        let of_same: Vec<&&Screened> =
            chosen.iter().filter(|other| other.entrant.effect.mechanism().id == id).collect();
        let everywhere = of_same.iter().find(|other| other.entrant.scope == Scope::Everywhere);
        let take = match score.entrant.scope {
            Scope::Everywhere => {
                let starts = of_same.iter().filter(|other| other.entrant.scope == Scope::Everywhere).count();
                starts == 0 || (starts < 2 && everywhere.is_some_and(|other| score.z > 0.6 * other.z))
            }
            // Only where it says clearly more than the same everywhere would.
            _ => {
                let here = order
                    .iter()
                    .filter(|o| o.entrant.effect.mechanism().id == id && o.entrant.scope == Scope::Everywhere);
                let most = here.map(|other| other.z).fold(0.0, f64::max);
                let scoped = of_same.iter().filter(|other| other.entrant.scope != Scope::Everywhere).count();
                scoped == 0 && score.z * score.z > most * most + 30.0
            }
        };
        if !take {
            continue;
        }
        if !mechanisms.contains(&id) {
            if mechanisms.len() == REFITTED {
                continue;
            }
            mechanisms.push(id);
        }
        chosen.push(score);
    }
    let mut brief: Vec<(Trial, f64)> = chosen
        .par_iter()
        .filter_map(|score| {
            let begun = begin(problem, base, score, part)?;
            let fit = Fit::run(problem, begun.layout, begun.point, part, Effort::BRIEF)?;
            Some((Trial::new(problem, fit), score.z * score.z))
        })
        .collect();
    brief.sort_by(|a, b| a.0.bic.total_cmp(&b.0.bic));
    let mut seen: Vec<(String, Scope)> = Vec::new();
    brief.retain(|(trial, _)| {
        let Some(last) = trial.fit.layout.entrants.last() else { return false };
        let key = (last.effect.mechanism().id.to_owned(), last.scope);
        let new = !seen.contains(&key);
        seen.push(key);
        new
    });
    // Who leads after a few iterations goes on, and so does who was promised to come near the best and has not yet.
    let gained = |trial: &Trial| base.cost - trial.fit.cost;
    let most = brief.first().map_or(0.0, |(trial, _)| gained(trial));
    let mut trials: Vec<Trial> = brief
        .into_par_iter()
        .enumerate()
        .filter_map(|(rank, (trial, promised))| {
            if rank >= FINISHED && promised < PROMISING * most {
                return Some(trial);
            }
            let fit = Fit::run(problem, trial.fit.layout.clone(), trial.fit.point.clone(), part, Effort::FULL)?;
            Some(Trial::new(problem, fit))
        })
        .collect();
    trials.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    trials
}

/// Where a fit with one more mechanism begins: with the strength that its score tells, or as much less of it as does not make
/// everything worse at once, and with the other coordinates as they were or as they need no longer imitate it. A score is a
/// tangent; far along it the simulation may be elsewhere.
fn begin(problem: &Problem, base: &Fit, score: &Screened, part: Part<'_>) -> Option<Fit> {
    let mut entrant = score.entrant.clone();
    let mut best: Option<Fit> = None;
    for _ in 0..SHORTER_STARTS {
        let mut entrants = base.layout.entrants.clone();
        entrants.push(entrant.clone());
        let layout = Layout::new(problem, entrants);
        for point in [&score.beside, &base.point] {
            let start = layout.start_from(problem, &base.layout, point);
            if let Some(fit) = Fit::at(problem, layout.clone(), start, part)
                && best.as_ref().is_none_or(|best| fit.cost < best.cost)
            {
                best = Some(fit);
            }
        }
        let before = entrant.effect.clone();
        let shortened = scale_strength(&mut entrant.effect, SHORTER).is_some() && entrant.effect != before;
        if !shortened || best.as_ref().is_some_and(|best| best.cost < base.cost) {
            break;
        }
    }
    best
}

/// The model without the mechanism in one place.
#[must_use]
pub fn without(problem: &Problem, trial: &Trial, place: usize, part: Part<'_>) -> Option<Trial> {
    let mut entrants = trial.fit.layout.entrants.clone();
    entrants.remove(place);
    let layout = Layout::new(problem, entrants);
    let start = layout.start_from(problem, &trial.fit.layout, &trial.fit.point);
    Fit::run(problem, layout, start, part, Effort::FULL).map(|fit| Trial::new(problem, fit))
}

fn drop_unneeded(problem: &Problem, best: &mut Trial, gained: f64, part: Part<'_>) {
    while best.fit.layout.entrants.len() > 1 {
        let smaller: Vec<Trial> =
            (0..best.fit.layout.entrants.len()).filter_map(|place| without(problem, best, place, part)).collect();
        match smaller.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic)) {
            Some(trial) if trial.bic < best.bic + ENOUGH + FURTHER * gained => *best = trial,
            _ => break,
        }
    }
}

/// Other mechanisms in one place of the model.
fn stand_ins(
    problem: &Problem,
    best: &Trial,
    place: usize,
    mechanisms: &[&'static Mechanism],
    lines_hz: &dyn Fn(&Fit) -> Vec<f64>,
    part: Part<'_>,
) -> Vec<(Entrant, Trial)> {
    let Some(base) = without(problem, best, place, part) else { return Vec::new() };
    let Some(tangent) = base.fit.tangent(problem, part) else { return Vec::new() };
    let reach = Reach::of(problem, lines_hz(&base.fit));
    let others: Vec<&'static Mechanism> = remaining(mechanisms, &best.fit);
    let scores = screen(problem, &base.fit, &tangent, &reach, &others);
    refit(problem, &base.fit, &scores, part)
        .into_iter()
        .filter_map(|trial| trial.fit.layout.entrants.last().cloned().map(|entrant| (entrant, trial)))
        .collect()
}
