//! Refits one more mechanism in full: where a fit begins decides where it ends.
//!
//! ```text
//! scores ─▶ the best starts of each mechanism ─▶ simulate each once, a little weaker or stronger ─▶ 14 mechanisms, 2 starts each
//!        ─▶ 2 looks ─▶ who leads, is about to, or was promised to, until they converge ─▶ best by BIC
//! ```
//!
//! A score is a promise of a tangent, what the simulation makes of it is another opinion: half of the starts are chosen by the one,
//! half by the other. Where the fit so far strains what was stated it imitates what is missing; then the best start of each mechanism
//! is tried once more beside what was stated. Where nothing stands out every mechanism is refitted; where very much is left, mechanisms that
//! promise little are tried at likely strengths. What was promised all the same may leave a rest: then every mechanism is begun [anew], whatever
//! its score, and [together] with what it is confused with.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;
use thud_sim::mechanism::{Effect, Mechanism, Parameter, Scale, Search};

use super::candidate::Reach;
use super::fit::{Effort, Fit, Part};
use super::instants::each_its_own;
use super::layout::{Entrant, Layout, Point, Role, Scope};
use super::omnibus::Omnibus;
use super::problem::Problem;
use super::screen::{Screened, scale_strength};
use super::select::Trial;
use super::subset::Subset;
use super::verdict::SIGNIFICANT;
use super::work::Purse;

/// How far a search goes.
#[derive(Clone, Copy, Debug)]
pub struct Breadth {
    /// Mechanisms that are begun with.
    tried: usize,
    /// From how many starts each, in each of its forms.
    begun: usize,
    /// Mechanisms that are refitted.
    refitted: usize,
    /// From how many starts each, in each of its forms.
    starts: usize,
    /// What scores less is not refitted.
    least_score: f64,
}

impl Breadth {
    /// For one more mechanism.
    pub const MORE: Self = Self { tried: 20, begun: 4, refitted: 14, starts: 2, least_score: 3.5 };
    /// For the first one where nothing stands out: of what is faint a tangent at the start of a grid promises little.
    pub const FAINT: Self = Self { tried: usize::MAX, refitted: usize::MAX, least_score: 2.5, ..Self::MORE };
    /// For another in the place of one that stands.
    pub const INSTEAD: Self = Self { tried: 12, begun: 2, refitted: 9, starts: 1, ..Self::MORE };
    /// For either where so much is left that no tangent says anything.
    const EVERY: Self = Self { tried: usize::MAX, begun: 2, refitted: usize::MAX, starts: 1, ..Self::MORE };
}

/// About so many times the motions of a fit are followed to begin with one more mechanism.
const BEGINNING: u64 = 4;
/// How often a start is looked at, and one from far away.
const LOOKS: usize = 2;
const LOOKS_ANEW: usize = 4;
/// Of the refitted ones, how many until they converge.
const FINISHED: usize = 4;
/// And who was promised this part of what the best gains.
const PROMISING: f64 = 0.4;
/// A belief about the rig or a mass is strained beyond this many of its deviations.
const STRAINED: f64 = 3.5;
/// A fit may still gain so many times what its last step did; further from the best than this it is no rival even then.
const STILL: f64 = 20.0;
const SPARE: f64 = 50.0;
/// What was promised to come near the best and would not by so many such steps once it has been looked at stands still. (Of 700 s of refits of 30
/// campaigns 90 went into those, none of which came near; at 20 steps two would have.)
const STANDS_STILL: f64 = 100.0;
/// One that would be the best after so many steps like its last is followed until it converges, whoever leads.
const SOON: f64 = 4.0;
/// A fit is followed in so many stretches, as long as it may come near the best, or soon overtake another form of its mechanism.
const STRETCHES: usize = 6;
/// A start that leaves so many times what there is without it is none, whatever it promises.
const ASTRAY: f64 = 2.0;
/// A signature of which more than this is imitated by re-tuning is mere re-tuning.
const MERE_TUNING: f64 = 0.995;
/// How often a start that makes everything worse is taken back, and to which part of it, or one that helps is lengthened.
const OTHER_STRENGTHS: usize = 4;
const SHORTER: f64 = 0.3;
const LONGER: f64 = 1.7;
/// A rest of so many standard deviations is very much.
const MUCH: f64 = 100.0;
/// And of so many enormous.
pub(super) const ENORMOUS: f64 = 2000.0;
/// Mechanisms that are fitted where very much is left though they promise little, and from how many strengths each: the last is
/// beyond what is likely.
const SILENT: usize = 3;
pub(super) const SILENT_STRENGTHS: u32 = 6;
/// Of a ratio this many strengths of each sign are tried beside what was stated, by factors of √2 from the end of its range.
const RATIOS: u32 = 8;
/// The most starts of a mechanism beside one that it is confused with.
const TOGETHER: usize = 12;
/// A mechanism in some recordings takes this much more off χ² than the same everywhere.
const CLEARLY_MORE: f64 = 30.0;

/// Where a refit begins.
#[derive(Clone)]
struct Start {
    fit: Fit,
    /// What its score promises to take off χ².
    promised: f64,
    /// How often it is looked at before it is judged.
    looks: usize,
}

/// Which mechanism, and where: what is in some recordings only is tried beside what is in all.
type Kind = (&'static str, Acts);

/// Where a mechanism acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Acts {
    Everywhere,
    InSome,
    /// In some, in each with a value of its own.
    InEach,
}

impl Start {
    fn kind(&self) -> Kind {
        kind(added(&self.fit))
    }
}

/// The mechanism that was added last.
pub(super) fn added(fit: &Fit) -> &Entrant {
    fit.layout.entrants.last().expect("a mechanism was added")
}

fn kind(entrant: &Entrant) -> Kind {
    let acts = match entrant.scope {
        Scope::Everywhere => Acts::Everywhere,
        Scope::EachRecording(_) => Acts::InEach,
        Scope::EachConfiguration | Scope::Configuration(_) | Scope::Recordings(_) => Acts::InSome,
    };
    (entrant.effect.mechanism().id, acts)
}

/// Refits what scores best, best first. Above the cost `wanted` nothing matters.
#[must_use]
pub fn refit(
    problem: &Problem,
    base: &Fit,
    scores: &[Screened],
    rest: Omnibus,
    breadth: Breadth,
    part: Part<'_>,
    wanted: f64,
) -> Vec<Trial> {
    let breadth = if rest.z() > ENORMOUS { Breadth::EVERY } else { breadth };
    let mut promised = promising(base, scores, breadth);
    let begun_ns = promised.iter().map(|_| BEGINNING * base.motions_ns);
    promised.truncate(problem.work.purse().pays_for(begun_ns));
    let begun = promised
        .par_iter()
        .filter_map(|score| {
            let fit = begin(problem, base, score, part)?;
            Some(Start { fit, promised: score.z * score.z, looks: LOOKS })
        })
        .collect();
    let mut starts = in_turn(begun, base.cost, breadth);
    // Where a belief is strained, the fit so far imitates what is missing and may be far from where it would be beside it.
    if base.strain() > STRAINED {
        let mut once: HashSet<Kind> = HashSet::new();
        let best_of_each = starts.iter().filter(|start| once.insert(start.kind()));
        let anew = best_of_each.filter_map(|Start { fit, promised, .. }| {
            Some(Start { fit: beside_stated(problem, fit, part)?, promised: *promised, looks: LOOKS_ANEW })
        });
        let anew: Vec<Start> = anew.collect();
        starts.extend(anew);
    }
    if rest.z() > MUCH {
        let silent = unpromised(problem, base, scores, &starts, part);
        // The first is followed as if much were promised: where a step has to pass one sample after the other every iteration gains little.
        let promised = |rank: usize| if rank == 0 { PROMISING * base.cost } else { 0.0 };
        let starting = |(rank, fit): (usize, Fit)| Start { fit, promised: promised(rank), looks: LOOKS_ANEW };
        starts.extend(silent.into_iter().enumerate().map(starting));
    }
    finished(problem, base, starts, part, wanted)
}

/// Every mechanism with what is typical of it, beside what was stated and beside the fit, everywhere and in those recordings that the others
/// do not foretell, if any: where all that was promised leaves a rest, a fit may have gone astray. Best first; above the cost `wanted` nothing
/// matters.
#[must_use]
pub fn anew(
    problem: &Problem,
    base: &Fit,
    scores: &[Screened],
    strangers: Option<Scope>,
    part: Part<'_>,
    wanted: f64,
) -> Vec<Trial> {
    let mut best_of_each: Vec<&Screened> = Vec::new();
    for score in scores {
        let same = |other: &&mut &Screened| kind(&other.entrant).0 == kind(&score.entrant).0;
        match best_of_each.iter_mut().find(same) {
            Some(other) if other.z < score.z => *other = score,
            Some(_) => (),
            None => best_of_each.push(score),
        }
    }
    let entrants = best_of_each.into_iter().flat_map(|score| {
        let mechanism = score.entrant.effect.mechanism();
        let typical = Entrant { own: score.entrant.own.clone(), ..Entrant::everywhere(mechanism.typical()) };
        let mut scopes = vec![Scope::Everywhere];
        scopes.extend(strangers);
        if !scopes.contains(&score.entrant.scope) {
            scopes.push(score.entrant.scope);
        }
        scopes.into_iter().map(move |scope| Entrant { scope, ..typical.clone() })
    });
    let starts = entrants.collect::<Vec<_>>().into_par_iter().flat_map_iter(|entrant| {
        let everywhere = entrant.scope == Scope::Everywhere;
        let layout = base.layout.with(problem, entrant);
        let beside = layout.start_from(problem, &base.layout, &base.point);
        let stated = layout.as_stated(&beside);
        // Everywhere and beside the fit is where the search has begun already.
        let points = std::iter::once(stated).chain((!everywhere).then_some(beside));
        let fits: Vec<Fit> = points.filter_map(|start| Fit::touching(problem, layout.clone(), start, part)).collect();
        fits.into_iter().map(|fit| Start { fit, promised: 0.0, looks: LOOKS_ANEW })
    });
    finished(problem, base, starts.collect(), part, wanted)
}

/// Pairs of a mechanism, in each of its forms, with each that it is confused with, from every likely strength, all else as stated, in
/// stretches, as long as each may still come near the best. Two that take from each other meet in no other way: beside the one that came
/// first, which has taken the other's part, that promises nothing, or has the wrong sign. Above the cost `wanted` nothing matters.
#[must_use]
pub fn together(
    problem: &Problem,
    base: &Fit,
    first: &Entrant,
    mechanisms: &[&'static Mechanism],
    part: Part<'_>,
    wanted: f64,
) -> Vec<Trial> {
    let reach = Reach::of(problem, Vec::new());
    // In another form than it has taken by itself it may be another one's partner: some of each, what begins with the least need not end there.
    let forms = reach.forms(first.effect.clone());
    let most = TOGETHER.div_ceil(forms.len());
    let begun = |mechanism: &'static Mechanism, form: &Effect| {
        let alone = base.layout.with(problem, Entrant { effect: form.clone(), ..first.clone() });
        let fits = reach.starts(mechanism).into_par_iter().filter_map(|effect| {
            let layout = alone.with(problem, Entrant::everywhere(effect));
            let start = layout.as_stated(&layout.start_from(problem, &base.layout, &base.point));
            Fit::touching(problem, layout, start, part)
        });
        let mut fits: Vec<Fit> = fits.collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        fits.truncate(most);
        fits
    };
    let confused = mechanisms.iter().filter(|mechanism| mechanism.is_confused_with(first.effect.mechanism()));
    let pairs = confused.flat_map(|mechanism| forms.iter().flat_map(|form| begun(mechanism, form)));
    let candidate = |fit: Fit| Candidate { fit, promised: 0.0, to_beat: f64::INFINITY };
    followed(problem, base, pairs.map(candidate).collect(), part, wanted, &problem.work.purse())
}

/// Chooses among starts, given in the order of what they promise: the most promising and what the simulation makes most of, in turn.
/// Who promises more than there is, or begins far from there, comes after all who do not.
fn in_turn(mut begun: Vec<Start>, all: f64, breadth: Breadth) -> Vec<Start> {
    begun.sort_by_key(|start| start.promised >= all || start.fit.cost > ASTRAY * all);
    let mut by_cost: Vec<usize> = (0..begun.len()).collect();
    by_cost.sort_by(|a, b| begun[*a].fit.cost.total_cmp(&begun[*b].fit.cost));
    let mut taken: Vec<usize> = Vec::new();
    let mut mechanisms: HashSet<&str> = HashSet::new();
    for number in by_cost.into_iter().enumerate().flat_map(|(by_promise, by_cost)| [by_promise, by_cost]) {
        let kind = begun[number].kind();
        let entrant = added(&begun[number].fit);
        let same = |other: &Start| other.kind() == kind && added(&other.fit).effect.has_form_of(&entrant.effect);
        let of_same = taken.iter().filter(|other| same(&begun[**other])).count();
        // What a form does not use makes no difference.
        let is_new =
            taken.iter().all(|other| !(same(&begun[*other]) && begun[*other].fit.cost == begun[number].fit.cost));
        let most = if kind.1 == Acts::Everywhere { breadth.starts } else { 1 };
        let room = mechanisms.len() < breadth.refitted || mechanisms.contains(kind.0);
        if is_new && of_same < most && room {
            mechanisms.insert(kind.0);
            taken.push(number);
        }
    }
    taken.into_iter().map(|number| begun[number].clone()).collect()
}

/// Everything as stated beside the mechanism that was added last. A ratio (a gain, a speed) that re-tuning has imitated may be far larger
/// there than a tangent tells: it begins where it fits best.
fn beside_stated(problem: &Problem, fit: &Fit, part: Part<'_>) -> Option<Fit> {
    let stated = fit.layout.as_stated(&fit.point);
    let at = |point| Fit::at(problem, fit.layout.clone(), point, part);
    let strength = Role::Mechanism { entrant: fit.layout.entrants.len() - 1, place: 0 };
    let is_ratio = |mechanism: &Mechanism| {
        let strength = &mechanism.parameters[0];
        strength.scale == Scale::Linear && strength.search == Search::Strength
    };
    let ratio = fit.layout.globals.iter().position(|coordinate| coordinate.role == strength);
    let Some(place) = ratio.filter(|_| is_ratio(added(fit).effect.mechanism())) else { return at(stated) };
    let (low, high) = fit.layout.globals[place].range;
    let strengths = (0..RATIOS).flat_map(|number| [low, high].map(|end| end * 0.5_f64.powf(f64::from(number) / 2.0)));
    let fits = strengths.chain([stated.globals[place]]).filter_map(|strength| {
        let mut point = stated.clone();
        point.globals[place] = strength;
        at(point)
    });
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// The better one of a start and of the same with everything as stated, each contact where it fits best.
pub(super) fn beside_or_as_stated(problem: &Problem, layout: Layout, beside: Point, part: Part<'_>) -> Option<Fit> {
    let stated = layout.as_stated(&beside);
    let fits = [beside, stated].map(|start| Fit::touching(problem, layout.clone(), start, part));
    fits.into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// What is followed until it converges.
struct Candidate {
    fit: Fit,
    /// What its score promises to take off χ².
    promised: f64,
    /// A cost that it has to be about to fall below.
    to_beat: f64,
}

/// A few iterations each, as long as there is hope; then who leads, who is about to, and who was promised to come near the best and has
/// not yet, in stretches, as long as each may still come near the best.
fn finished(problem: &Problem, base: &Fit, mut starts: Vec<Start>, part: Part<'_>, wanted: f64) -> Vec<Trial> {
    let purse = problem.work.purse();
    let mut best = wanted;
    for look in 0..starts.iter().map(|start| start.looks).max().unwrap_or(0) {
        let more = |start: &Start| look < start.looks && may_still(base, &start.fit, start.promised, best);
        let (looked, rest): (Vec<Start>, Vec<Start>) = starts.into_iter().partition(more);
        let (looked, unpaid) = paid_for(looked, |start| &start.fit, Effort::LOOK, &purse);
        let look = |start: Start| Start { fit: start.fit.further(problem, part, Effort::LOOK), ..start };
        let unmoved = rest.into_iter().chain(unpaid);
        starts = looked.into_par_iter().map(look).collect::<Vec<_>>().into_iter().chain(unmoved).collect();
        best = starts.iter().map(|start| start.fit.cost).fold(best, f64::min);
    }
    let mut looked: Vec<(Trial, f64)> =
        starts.into_iter().map(|start| (Trial::new(problem, start.fit), start.promised)).collect();
    looked.sort_by(|a, b| a.0.bic.total_cmp(&b.0.bic));
    // Of a mechanism's forms the one that leads early need not end best: the others are followed while they may.
    let mut once: Vec<Entrant> = Vec::new();
    looked.retain(|(trial, _)| {
        let added = added(&trial.fit);
        let is_new = once.iter().all(|other| !(other.is_same_as(added) && other.effect.has_form_of(&added.effect)));
        if is_new {
            once.push(added.clone());
        }
        is_new
    });
    // What another form of the mechanism has come to, where that leads.
    let other_form = |rank: usize, fit: &Fit| {
        let ahead = looked[..rank].iter().find(|(other, _)| added(&other.fit).is_same_as(added(fit)));
        ahead.map_or(f64::INFINITY, |(other, _)| other.fit.cost)
    };
    let candidate = |(rank, (trial, promised)): (usize, &(Trial, f64))| {
        let leads = rank < FINISHED || would_be(&trial.fit) < best || is_promised(base, *promised, best);
        let to_beat = if leads { other_form(rank, &trial.fit) } else { f64::NEG_INFINITY };
        Candidate { fit: trial.fit.clone(), promised: *promised, to_beat }
    };
    let candidates = looked.iter().enumerate().map(candidate).collect();
    let trials = followed(problem, base, candidates, part, best, &purse);
    let mut trials: Vec<Trial> = trials.into_iter().map(|trial| each_its_own(problem, trial, part)).collect();
    trials.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    let mut once: HashSet<(&str, Scope)> = HashSet::new();
    trials.retain(|trial| {
        let added = added(&trial.fit);
        once.insert((added.effect.mechanism().id, added.scope))
    });
    trials
}

/// What candidates come to in stretches, as long as each may still come near the best and is paid for.
fn followed(
    problem: &Problem,
    base: &Fit,
    mut candidates: Vec<Candidate>,
    part: Part<'_>,
    mut best: f64,
    purse: &Purse<'_>,
) -> Vec<Trial> {
    for _ in 0..STRETCHES {
        let goes_on = |Candidate { fit, promised, to_beat }: &Candidate| {
            would_be(fit) < *to_beat && may_still(base, fit, *promised, best) && comes_near(fit, STANDS_STILL, best)
        };
        let (going, rest): (Vec<Candidate>, Vec<Candidate>) = candidates.into_iter().partition(goes_on);
        let (going, unpaid) = paid_for(going, |candidate| &candidate.fit, Effort::AGAIN, purse);
        let follow =
            |candidate: Candidate| Candidate { fit: candidate.fit.further(problem, part, Effort::AGAIN), ..candidate };
        let unmoved = rest.into_iter().chain(unpaid);
        candidates = going.into_par_iter().map(follow).collect::<Vec<_>>().into_iter().chain(unmoved).collect();
        best = candidates.iter().map(|candidate| candidate.fit.cost).fold(best, f64::min);
    }
    candidates.into_iter().map(|candidate| Trial::new(problem, candidate.fit)).collect()
}

/// Those for which a search can pay, the leading ones first, and the others.
fn paid_for<T>(
    mut candidates: Vec<T>,
    fit: impl Fn(&T) -> &Fit,
    effort: Effort,
    purse: &Purse<'_>,
) -> (Vec<T>, Vec<T>) {
    candidates.sort_by(|a, b| fit(a).cost.total_cmp(&fit(b).cost));
    let paid = purse.pays_for(candidates.iter().map(|candidate| fit(candidate).cost_ns(effort)));
    let unpaid = candidates.split_off(paid);
    (candidates, unpaid)
}

/// Where a fit would be after so many steps like its last.
fn would_be(fit: &Fit) -> f64 {
    fit.cost - SOON * fit.gaining
}

/// Whether a fit may still come near the best: it gains enough, or was promised to.
fn may_still(base: &Fit, fit: &Fit, promised: f64, best: f64) -> bool {
    !fit.is_settled() && (comes_near(fit, STILL, best) || is_promised(base, promised, best))
}

/// Whether a fit would come near the best by so many steps like its last.
fn comes_near(fit: &Fit, steps: f64, best: f64) -> bool {
    fit.cost - steps * fit.gaining < best + SPARE
}

/// Whether much of what the best gains was promised, and no more than there is.
fn is_promised(base: &Fit, promised: f64, best: f64) -> bool {
    promised >= PROMISING * (base.cost - best) && promised < base.cost
}

/// Where very much is left, mechanisms that promise little or nothing: a step at contact that the fit has imitated by an earlier contact
/// looks, to first order, like too much of itself. Each begins with likely strengths beside what was stated, the best few are fitted.
fn unpromised(problem: &Problem, base: &Fit, scores: &[Screened], begun: &[Start], part: Part<'_>) -> Vec<Fit> {
    let scope = where_left(problem, base);
    // What was begun in some recordings only is silent about all.
    let is_begun = |id: &str| {
        let mut kinds = begun.iter().map(Start::kind);
        kinds.any(|(begun, acts)| begun == id && (acts == Acts::Everywhere || scope != Scope::Everywhere))
    };
    let mut silent: Vec<&'static Mechanism> = Vec::new();
    for score in scores {
        let mechanism = score.entrant.effect.mechanism();
        if silent.iter().all(|other| other.id != mechanism.id)
            && mechanism.parameters[0].search == Search::Strength
            && !is_begun(mechanism.id)
        {
            silent.push(mechanism);
        }
    }
    let mut fits: Vec<Fit> = silent
        .par_iter()
        .filter_map(|mechanism| {
            let effects = at_likely_strengths(&mechanism.typical(), SILENT_STRENGTHS - 2);
            let fits = effects.into_iter().filter_map(|effect| {
                let layout = base.layout.with(problem, Entrant { scope, ..Entrant::everywhere(effect) });
                let beside = layout.start_from(problem, &base.layout, &base.point);
                beside_or_as_stated(problem, layout, beside, part)
            });
            fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
        })
        .collect();
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    fits.truncate(SILENT);
    fits
}

/// A mechanism, with the shape that it has, at so many strengths at equal ratios, which reach the strongest likely one after `steps`; of a ratio, which may have either
/// sign, at the ends of what is likely.
pub(super) fn at_likely_strengths(effect: &Effect, steps: u32) -> Vec<Effect> {
    let Parameter { plausible: (low, high), scale, .. } = effect.mechanism().parameters[0];
    let strengths = match scale {
        Scale::Linear => vec![low, high],
        Scale::Logarithmic => {
            (0..SILENT_STRENGTHS).map(|n| low * (high / low).powf(f64::from(n) / f64::from(steps))).collect()
        }
    };
    let at = |strength: f64| {
        let mut effect = effect.clone();
        effect.set_value(0, strength).ok().map(|()| effect)
    };
    strengths.into_iter().filter_map(at).collect()
}

/// Mechanisms at every start of their grids and at likely strengths, each simulated once in the recordings where it acts; the best few of each are followed. Far from
/// where a fit will be a tangent tells neither a strength nor a place on the way. Best first; above the cost `wanted` nothing matters.
#[must_use]
pub fn begun_at_likely_strengths(
    problem: &Problem,
    base: &Fit,
    scores: &[Screened],
    part: Part<'_>,
    wanted: f64,
) -> Vec<Trial> {
    let begun = |score: &Screened, effect: Effect| -> Option<Fit> {
        let entrant = Entrant { effect, ..score.entrant.clone() };
        let acts = |number: &&usize| entrant.scope.includes(**number, problem.recordings[**number].configuration);
        let acts_in: Vec<usize> = part.iter().filter(acts).copied().collect();
        let layout = base.layout.with(problem, entrant);
        let start = layout.start_from(problem, &base.layout, &base.point);
        Fit::at(problem, layout, start, &acts_in)
    };
    let has_strength = |score: &&Screened| score.entrant.effect.mechanism().parameters[0].null == Some(0.0);
    let begun_ns = scores.iter().map(|_| u64::from(SILENT_STRENGTHS) * base.motions_ns);
    let paid = problem.work.purse().pays_for(begun_ns);
    let mut fits: Vec<Fit> = scores
        .par_iter()
        .take(paid)
        .filter(has_strength)
        .flat_map_iter(|score| {
            let effects = at_likely_strengths(&score.entrant.effect, SILENT_STRENGTHS - 1);
            effects.into_iter().filter_map(|effect| begun(score, effect)).collect::<Vec<_>>()
        })
        .collect();
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut of_each: HashMap<&str, usize> = HashMap::new();
    fits.retain(|fit| {
        let taken = of_each.entry(added(fit).effect.mechanism().id).or_default();
        *taken += 1;
        *taken <= Breadth::MORE.starts
    });
    let starts = fits.into_par_iter().filter_map(|fit| {
        let fit = Fit::touching(problem, fit.layout, fit.point, part)?;
        Some(Start { fit, promised: 0.0, looks: LOOKS_ANEW })
    });
    finished(problem, base, starts.collect(), part, wanted)
}

/// The recordings in which more than noise is left; everywhere where these are none or more than half.
fn where_left(problem: &Problem, fit: &Fit) -> Scope {
    let is_left = |residual: &Vec<f64>| {
        let squares: f64 = residual.iter().map(|r| r * r).sum();
        squares - residual.len() as f64 > SIGNIFICANT * (2.0 * residual.len() as f64).sqrt()
    };
    let some: Subset = (0..fit.residuals.len()).filter(|number| is_left(&fit.residuals[*number])).collect();
    if some.is_empty() || 2 * some.len() > fit.residuals.len() { Scope::Everywhere } else { Scope::of(problem, some) }
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
    let mut order: Vec<&Screened> =
        scores.iter().filter(|score| score.z >= breadth.least_score || relieves(score)).collect();
    // Who promises more than there is comes after all who do not.
    let too_much = |score: &Screened| score.z.powi(2) >= base.cost;
    order.sort_by(|a, b| too_much(a).cmp(&too_much(b)).then(b.z.total_cmp(&a.z)));
    let id = |score: &Screened| kind(&score.entrant).0;
    let acts = |score: &Screened| kind(&score.entrant).1;
    let everywhere = |score: &Screened| acts(score) == Acts::Everywhere;
    let mut chosen: Vec<&Screened> = Vec::new();
    let mut mechanisms: HashSet<&str> = HashSet::new();
    for score in &order {
        let same =
            |other: &&&Screened| id(other) == id(score) && other.entrant.effect.has_form_of(&score.entrant.effect);
        let of_same = || chosen.iter().filter(same);
        let take = if everywhere(score) {
            of_same().filter(|other| everywhere(other)).count() < breadth.begun
        } else {
            // Only where it says clearly more than the same everywhere would.
            let same = order.iter().filter(|other| id(other) == id(score) && everywhere(other));
            let most = same.map(|other| other.z).fold(0.0, f64::max);
            of_same().all(|other| acts(other) != acts(score)) && score.z * score.z > most * most + CLEARLY_MORE
        };
        let room = mechanisms.len() < breadth.tried || mechanisms.contains(id(score));
        if take && room {
            mechanisms.insert(id(score));
            chosen.push(score);
        }
    }
    chosen
}

/// Where a fit with one more mechanism begins: with the strength that its score tells, as much less of it as does not make
/// everything worse at once, or as much more as helps more, and with the other coordinates as they were or as they need no longer
/// imitate it. A score is a tangent; far along it the simulation may be elsewhere.
fn begin(problem: &Problem, base: &Fit, score: &Screened, part: Part<'_>) -> Option<Fit> {
    let begun = |entrant: &Entrant| -> Option<Fit> {
        let layout = base.layout.with(problem, entrant.clone());
        let starts = [&score.beside, &base.point].map(|point| layout.start_from(problem, &base.layout, point));
        let fits = starts.into_iter().filter_map(|start| Fit::at(problem, layout.clone(), start, part));
        fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
    };
    let mut entrant = score.entrant.clone();
    let mut best = begun(&entrant);
    // What makes everything worse may do so because a step at contact has passed the samples that it should begin between.
    if let Some(worse) = best.as_ref().filter(|best| best.cost >= base.cost) {
        let touching = Fit::touching(problem, worse.layout.clone(), worse.point.clone(), part);
        best = touching.filter(|touching| touching.cost < worse.cost).or(best);
    }
    let helps = |best: &Option<Fit>| best.as_ref().is_some_and(|best| best.cost < base.cost);
    let lengthened = helps(&best);
    for _ in 0..OTHER_STRENGTHS {
        let before = entrant.effect.clone();
        let times = if lengthened { LONGER } else { SHORTER };
        if scale_strength(&mut entrant.effect, times).is_none() || entrant.effect == before {
            break;
        }
        let other = begun(&entrant);
        let better = other.as_ref().is_some_and(|other| best.as_ref().is_none_or(|best| other.cost < best.cost));
        if better {
            best = other;
        }
        let enough = if lengthened { !better } else { helps(&best) };
        if enough {
            break;
        }
    }
    best
}
