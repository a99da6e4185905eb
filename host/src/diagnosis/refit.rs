//! Refits one more mechanism in full: where a fit begins decides where it ends.
//!
//! ```text
//! scores ─▶ the best starts of each mechanism ─▶ simulate each once, a little weaker or stronger ─▶ 9 mechanisms, 2 starts each
//!        ─▶ 4 iterations ─▶ who leads, and who was promised to, until they converge ─▶ best by BIC
//! ```
//!
//! A score is a promise of a tangent, what the simulation makes of it is another opinion: half of the starts are chosen by the one,
//! half by the other. Where the fit so far strains what was stated it imitates what is missing; then every start is tried once
//! more beside what was stated. Where very much is left, mechanisms that promise nothing are tried at likely strengths.

use std::collections::HashSet;

use rayon::prelude::*;
use thud_sim::mechanism::{Mechanism, Scale, Search};

use super::fit::{Effort, Fit, Part};
use super::layout::{Entrant, Layout, Scope};
use super::omnibus::Omnibus;
use super::problem::Problem;
use super::screen::{Screened, scale_strength};
use super::select::Trial;

/// How far a search goes.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Mechanisms that are begun with.
    tried: usize,
    /// From how many starts each.
    begun: usize,
    /// Mechanisms that are refitted.
    refitted: usize,
    /// From how many starts each.
    starts: usize,
}

impl Breadth {
    /// For one more mechanism.
    pub const MORE: Self = Self { tried: 14, begun: 4, refitted: 9, starts: 2 };
    /// For another in the place of one that stands.
    pub const INSTEAD: Self = Self { tried: 8, begun: 2, refitted: 6, starts: 1 };
}

/// Of those, how many until they converge.
const FINISHED: usize = 4;
/// And who was promised this part of what the best has gained by then.
const PROMISING: f64 = 0.4;
/// A belief about the rig or a mass is strained beyond this many of its deviations.
const STRAINED: f64 = 3.5;
/// A signature of which more than this is imitated by re-tuning is mere re-tuning.
const MERE_TUNING: f64 = 0.995;
/// How often a start that makes everything worse is taken back, and to which part of it, or one that helps is lengthened.
const OTHER_STRENGTHS: usize = 4;
const SHORTER: f64 = 0.3;
const LONGER: f64 = 1.7;
/// A rest of so many standard deviations is very much.
const MUCH: f64 = 100.0;
/// Mechanisms that are fitted then though they promise nothing, and from how many strengths each: the last is beyond what is likely.
const SILENT: usize = 3;
const SILENT_STRENGTHS: u32 = 6;
/// A score below this is not refitted.
const LEAST_SCORE: f64 = 3.5;

/// Refits what scores best, best first.
#[must_use]
pub fn refit(
    problem: &Problem,
    base: &Fit,
    scores: &[Screened],
    rest: Omnibus,
    breadth: Breadth,
    part: Part<'_>,
) -> Vec<Trial> {
    // A score is a promise of a tangent; what the simulation makes of it is another opinion. Both have their say in turn.
    let promised: Vec<(Fit, f64)> = promising(base, scores, breadth)
        .par_iter()
        .filter_map(|score| begin(problem, base, score, part).map(|fit| (fit, score.z * score.z)))
        .collect();
    let mut by_cost: Vec<usize> = (0..promised.len()).collect();
    by_cost.sort_by(|a, b| promised[*a].0.cost.total_cmp(&promised[*b].0.cost));
    let id = |number: usize| {
        let last = promised[number].0.layout.entrants.last();
        last.map_or(("", false), |last| (last.effect.mechanism().id, last.scope == Scope::Everywhere))
    };
    let mut taken: Vec<usize> = Vec::new();
    let mut mechanisms: HashSet<&str> = HashSet::new();
    for (by_score, by_cost) in (0..promised.len()).zip(by_cost) {
        for number in [by_score, by_cost] {
            let of_same = taken.iter().filter(|other| id(**other) == id(number)).count();
            let most = if id(number).1 { breadth.starts } else { 1 };
            let room = mechanisms.len() < breadth.refitted || mechanisms.contains(id(number).0);
            if !taken.contains(&number) && of_same < most && room {
                mechanisms.insert(id(number).0);
                taken.push(number);
            }
        }
    }
    let mut begun: Vec<(Fit, f64, Effort)> =
        taken.iter().map(|number| (promised[*number].0.clone(), promised[*number].1, Effort::BRIEF)).collect();
    // Where a belief is strained, the fit so far imitates what is missing and may be far from where it would be beside it.
    if base.strain() > STRAINED {
        let mut once: HashSet<(&str, bool)> = HashSet::new();
        let anew = taken.iter().filter(|number| once.insert(id(**number))).filter_map(|number| {
            let layout = promised[*number].0.layout.clone();
            let stated = layout.as_stated(&promised[*number].0.point);
            Fit::at(problem, layout, stated, part).map(|fit| (fit, promised[*number].1, Effort::ANEW))
        });
        begun.extend(anew);
    }
    begun.extend(unpromised(problem, base, scores, rest, part).into_iter().map(|fit| (fit, 0.0, Effort::ANEW)));
    let mut brief: Vec<(Trial, f64)> = begun
        .into_par_iter()
        .filter_map(|(begun, promised, effort)| {
            let fit = Fit::run(problem, begun.layout, begun.point, part, effort)?;
            Some((Trial::new(problem, fit), promised))
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

/// Where very much is left, mechanisms that promise nothing: a step at contact that the fit has imitated by an earlier contact looks, to
/// first order, like too much of itself. Each begins with likely strengths beside what was stated, the best few are fitted.
fn unpromised(problem: &Problem, base: &Fit, scores: &[Screened], rest: Omnibus, part: Part<'_>) -> Vec<Fit> {
    if rest.z() < MUCH {
        return Vec::new();
    }
    let mut silent: Vec<&'static Mechanism> = Vec::new();
    for score in scores {
        let mechanism = score.entrant.effect.mechanism();
        let of_same = || scores.iter().filter(|other| other.entrant.effect.mechanism().id == mechanism.id);
        if silent.iter().all(|other| other.id != mechanism.id)
            && mechanism.parameters[0].search == Search::Strength
            && of_same().all(|other| other.entrant.scope != Scope::Everywhere || other.z < LEAST_SCORE)
        {
            silent.push(mechanism);
        }
    }
    let mut fits: Vec<Fit> = silent
        .par_iter()
        .filter_map(|mechanism| {
            let (low, high) = mechanism.parameters[0].plausible;
            let strengths =
                (0..SILENT_STRENGTHS).map(|n| low * (high / low).powf(f64::from(n) / f64::from(SILENT_STRENGTHS - 2)));
            let fits = strengths.filter_map(|strength| {
                let mut effect = mechanism.typical();
                effect.set_value(0, strength).ok()?;
                let mut entrants = base.layout.entrants.clone();
                entrants.push(Entrant::everywhere(effect));
                let layout = Layout::new(problem, entrants);
                let mut start = layout.as_stated(&layout.start_from(problem, &base.layout, &base.point));
                layout.touch_as_guessed(problem, &mut start);
                Fit::at(problem, layout, start, part)
            });
            fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
        })
        .collect();
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    fits.truncate(SILENT);
    fits
}

/// The best starts of each mechanism by score, and what relieves a strained belief whatever its score.
fn promising<'a>(base: &Fit, scores: &'a [Screened], breadth: Breadth) -> Vec<&'a Screened> {
    // A strain of many deviations is not linear.
    let strained = base.strain() > STRAINED;
    let relieves = |score: &&Screened| {
        strained
            && score.absorbed > MERE_TUNING
            && score.entrant.effect.mechanism().parameters[0].scale == Scale::Linear
    };
    let mut order: Vec<&Screened> = scores.iter().filter(|score| score.z >= LEAST_SCORE || relieves(score)).collect();
    order.sort_by(|a, b| b.z.total_cmp(&a.z));
    let id = |score: &Screened| score.entrant.effect.mechanism().id;
    let everywhere = |score: &Screened| score.entrant.scope == Scope::Everywhere;
    let mut chosen: Vec<&Screened> = Vec::new();
    for score in &order {
        let of_same = || chosen.iter().filter(|other| id(other) == id(score));
        let take = if everywhere(score) {
            of_same().filter(|other| everywhere(other)).count() < breadth.begun
        } else {
            // Only where it says clearly more than the same everywhere would.
            let same = order.iter().filter(|other| id(other) == id(score) && everywhere(other));
            let most = same.map(|other| other.z).fold(0.0, f64::max);
            of_same().all(|other| everywhere(other)) && score.z * score.z > most * most + 30.0
        };
        if !take {
            continue;
        }
        if of_same().next().is_none()
            && chosen.iter().map(|other| id(other)).collect::<HashSet<_>>().len() == breadth.tried
        {
            continue;
        }
        chosen.push(score);
    }
    chosen
}

/// Where a fit with one more mechanism begins: with the strength that its score tells, as much less of it as does not make
/// everything worse at once, or as much more as helps more, and with the other coordinates as they were or as they need no longer imitate it. A score is a
/// tangent; far along it the simulation may be elsewhere.
fn begin(problem: &Problem, base: &Fit, score: &Screened, part: Part<'_>) -> Option<Fit> {
    let begun = |entrant: &Entrant| -> Option<Fit> {
        let mut entrants = base.layout.entrants.clone();
        entrants.push(entrant.clone());
        let layout = Layout::new(problem, entrants);
        let starts = [&score.beside, &base.point].map(|point| layout.start_from(problem, &base.layout, point));
        let fits = starts.into_iter().filter_map(|start| Fit::at(problem, layout.clone(), start, part));
        fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    };
    let mut entrant = score.entrant.clone();
    let mut best = begun(&entrant);
    let helps = |best: &Option<Fit>| best.as_ref().is_some_and(|best| best.cost < base.cost);
    let times = if helps(&best) { LONGER } else { SHORTER };
    for _ in 0..OTHER_STRENGTHS {
        let before = entrant.effect.clone();
        if scale_strength(&mut entrant.effect, times).is_none() || entrant.effect == before {
            break;
        }
        let other = begun(&entrant);
        let better = other.as_ref().is_some_and(|other| best.as_ref().is_none_or(|best| other.cost < best.cost));
        if better {
            best = other;
        }
        if if times > 1.0 { !better } else { helps(&best) } {
            break;
        }
    }
    best
}
