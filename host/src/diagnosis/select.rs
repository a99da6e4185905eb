//! Which mechanisms: one after the other, each refitted in full beside its rivals, and dropped again where it is not needed.
//!
//! ```text
//! beside further channels: all of this by the observed one alone ─▶ what that names, fitted to all; where it leaves something:
//! baseline ─▶ screen ─▶ refit the promising ─▶ best by BIC ─▶ is there a rest? ─▶ a second … ─▶ drop what is not missed
//!                                                  ─▶ where two leave something, be it next to nothing: the two steady ones that tangents beside each first promise most of
//!                                                  ─▶ where more than one is named: the second beside what came nearest to the first
//!                                                  ─▶ where that leaves something, or bends to each recording: each one anew; the better one
//!                                                  ─▶ where that still leaves something: each of it together with what it is confused with
//!                                                  ─▶ where that leaves something, or bends to much: any two steady ones as above
//!                                                  ─▶ where two leave something, whatever they are: a third
//!                                                  ─▶ all of it once more without what bends to each recording; the better one
//!                                                  ─▶ of several: what each is confused with in its place, all else as it is
//!                                                  ─▶ where that leaves something: forms that add to a mechanism
//!                                                  ─▶ a third that brings little is dropped
//!                                                  ─▶ one of a shape that nothing has: made likely, with another beside it
//!                                                  ─▶ of what stands for each other, first what foretells best
//!                                                  ─▶ each in its usual form, where another is no better
//! ```
//!
//! BIC = χ² + p·ln N, N whitened samples, p parameters of the mechanisms (G. Schwarz, Ann. Stat. 6 (1978) 461); a mechanism
//! that acts in some recordings only pays for the choice as well. It says which of two; whether there is any at all is another question:
//! by chance χ² falls as that of p degrees of freedom (S. S. Wilks, Ann. Math. Stat. 9 (1938) 60). A mechanism whose instants are looked
//! for everywhere is none of Wilks's; what has values of its own for each impact is judged by BIC there, too.

use std::sync::Arc;

use nalgebra::DVector;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};
use statrs::function::factorial::ln_binomial;
use thud_sim::mechanism::{Effect, Mechanism, Search};

use super::candidate::Reach;
use super::coincidence::{is_at_an_event, is_coincidence};
use super::fit::{Effort, Fit, Part, Tangent};
use super::instants::{each_its_own, placed, several};
use super::layout::{Entrant, Layout, Role, Scope};
use super::locate::{Oddity, oddity};
use super::omnibus::{Omnibus, observed_omnibus, omnibus};
use super::problem::{Prepared, Problem};
use super::refit::{
    Breadth, ENORMOUS, SILENT_STRENGTHS, added, anew, at_likely_strengths, begun_at_likely_strengths,
    beside_or_as_stated, refit, together,
};
use super::screen::{Screened, screen};
use super::spectrum::{Hum, hum};
use super::strangers::{strangers, told_by_others};
use super::unfold::{touching_again, unfolded};
use super::verdict::{
    AS_GOOD, IMPOSSIBLE, SIGNIFICANT, UNLIKELY, WORTH, is_likely, is_quite_likely, made_likely, remains, unlikely,
};

/// The first mechanism must take more off χ² than chance does in one trial of so many; thirty mechanisms are tried, from several starts
/// each. Of 515 campaigns with traces of the usual imperfections one had a fall rarer than that, of one in 50,000, and none of 80 of another simulator; of
/// sixty effects of 5 ≤ d < 10 four had one between one in 10⁶ and one in 10⁴.
pub const BY_CHANCE: f64 = 3e-5;
/// Fall of BIC that a further one must bring, or a first one with a value of its own for each impact.
pub const ENOUGH: f64 = 20.0;
/// What the observed channel shows by less than so many deviations of its noise, over all recordings, is one of the usual imperfections.
pub const TRACE: f64 = 5.0;
/// A further one that no smooth rest asks for (it rings, hums or jumps) must bring this.
const UNASKED: f64 = 150.0;
/// And of this nothing foretells so much that it is refitted.
const HOPELESS: f64 = 0.3;
/// Of a sum of squares of noise, whatever the estimate of its level, at least this is noise.
const LEAST_NOISE: f64 = 0.8;
/// And a further one this part of what the model has gained so far: a rest that is worth a word is worth a name.
const FURTHER: f64 = WORTH;
/// What is alike everywhere and leaves nothing needs to bring only this where no rest asks for it, and this part of what the model has gained.
/// Of 120 single effects of two simulators no such mechanism had brought more than 24 unasked; where a rest asked for one, a second that left
/// nothing of it had brought 4.8 % of the first's gain or more. Of 39 pairs it mended two, and gave one a wrong second name.
const ALIKE: f64 = 50.0;
const SOLVED: f64 = 0.002;
/// A third one must bring this part: with three anything bends to anything. Of 170 campaigns of two other engines, with one or two effects hidden or one that
/// is not in the list, three named a third; none was there, and none of them brought more than 4 %.
const THIRD: f64 = 0.05;
/// Nothing is left of a rest below this, in standard deviations.
const NOTHING: f64 = 3.0;
/// Rivals within this of the best in BIC cannot be told apart. A parameter more that the recordings do not show costs ln N, 9 to 11.
pub const WITHIN_REACH: f64 = 12.0;
/// A baseline that is this much worse than it could be has not converged.
const UNCONVERGED: f64 = 1.0;
/// A form that is tried later is fitted from so many starts.
const BEGUN: usize = 2;
/// How often a model grows and its mechanisms are exchanged for better ones.
const ROUNDS: usize = 2;
/// What explains all but this part of what the first does may be the right one of two.
const NEARLY: f64 = 0.05;
/// The most of these that a second one is sought beside.
const NEAREST: usize = 2;
/// Steady firsts that explain so much of what the best does are worth a second one, the lightest so many of them,
const PARTLY: f64 = 0.5;
const FIRSTS: usize = 8;
/// and of the pairs that tangents promise so many are refitted.
const CROSSED: usize = 4;
/// This part of an enormous rest is little.
const LITTLE: f64 = 0.1;
/// The most mechanisms in one model, and before every other two have been tried.
const MOST_MECHANISMS: usize = 3;
const TWO: usize = 2;

/// A model that was fitted, with what it costs.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The fit.
    pub fit: Fit,
    /// Its BIC.
    pub bic: f64,
    /// Places of mechanisms that would have to choose their recordings, or an event in each.
    pub coincidences: Vec<usize>,
}

/// A model, and what it leaves.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The model.
    pub trial: Trial,
    /// Derivatives there.
    pub tangent: Tangent,
    /// What it leaves in all recordings together.
    pub rest: Omnibus,
    /// What is oddest about it.
    pub oddity: Oddity,
    /// What it leaves of the mains in the quiet.
    pub hum: Hum,
    /// The models without each of its mechanisms, refitted; `None` where that cannot be simulated.
    pub fewer: Vec<Option<Trial>>,
}

/// What is observed by itself, beside further channels.
#[derive(Clone, Copy, Debug)]
pub struct Observed {
    /// What the chosen model leaves of it.
    pub rest: Omnibus,
    /// By how much χ² of it is lower than of a rig without mechanisms that has nothing else to be like.
    pub gained: f64,
}

/// What the selection came to.
#[derive(Debug)]
pub struct Selection {
    /// The baseline, re-tuned.
    pub baseline: Fit,
    /// Derivatives there.
    pub baseline_tangent: Tangent,
    /// Scores against the baseline.
    pub screened: Vec<Screened>,
    /// The chosen model; the baseline itself where nothing is needed.
    pub best: Trial,
    /// Derivatives there.
    pub tangent: Tangent,
    /// Standard deviations of its global coordinates; `None` where they cannot be told.
    pub deviations: Option<DVector<f64>>,
    /// The same by what the recordings say alone, without what is only likely of any rig.
    pub told_deviations: Option<DVector<f64>>,
    /// Whether it leaves a rest.
    pub rest: Omnibus,
    /// The same of what is observed by itself, where there are further channels.
    pub observed: Option<Observed>,
    /// What is oddest about it.
    pub oddity: Oddity,
    /// What it leaves of the mains in the quiet.
    pub hum: Hum,
    /// Every other model that was refitted: which mechanism of the best it stands in for, and the model.
    pub rivals: Vec<(usize, Trial)>,
    /// Those of which only a finer channel shows the mechanism, and by how much χ² of what is observed falls with it.
    pub traces: Vec<(Trial, f64)>,
    /// By how much χ² grows without each mechanism of the best.
    pub worth: Vec<f64>,
    /// Whether the others have likely shapes without it.
    pub is_likely_without: Vec<bool>,
}

impl Trial {
    /// Counts what its mechanisms cost.
    #[must_use]
    pub fn new(problem: &Problem, fit: Fit) -> Self {
        let bic = fit.cost + penalty(problem, &fit);
        let entrants = fit.layout.entrants.iter().enumerate();
        let coincidences = entrants
            .filter(|(place, entrant)| is_coincidence(problem, entrant) || is_at_an_event(problem, &fit, *place))
            .map(|(place, _)| place)
            .collect();
        Self { fit, bic, coincidences }
    }
}

/// What a parameter costs of which the recordings say nothing: it lowers χ² by nothing (Akaike's price is enough), but is one.
const SILENT: f64 = 2.0;

/// What a model's mechanisms cost in BIC; a shape that hardly moves anything costs little.
#[must_use]
pub fn penalty(problem: &Problem, fit: &Fit) -> f64 {
    let layout = &fit.layout;
    let rows = problem.rows() as f64;
    let recordings = problem.recordings.len() as f64;
    let globals = layout.globals.iter().filter(|coordinate| coordinate.role.entrant().is_some()).count();
    let telling = (globals - fit.silent) as f64;
    let acts_in = |entrant: usize| {
        let scope = layout.entrants[entrant].scope;
        let acts = |(number, recording): &(usize, &Prepared)| scope.includes(*number, recording.configuration);
        problem.recordings.iter().enumerate().filter(acts).count() as f64
    };
    let each = (rows / recordings).ln();
    let locals = layout.locals.iter().enumerate().map(|(local, coordinate)| match coordinate.role {
        Role::Mechanism { entrant, .. }
            if layout.entrants[entrant].is_repeated() && layout.instants(entrant).contains(&local) =>
        {
            let comes = |(prepared, locals): &(&Prepared, &Vec<f64>)| prepared.shows(locals[local]);
            let comes_in = problem.recordings.iter().zip(&fit.point.locals).filter(comes).count();
            comes_in as f64 * each + choice(problem, comes_in)
        }
        Role::Mechanism { entrant, .. } => acts_in(entrant) * each,
        _ => 0.0,
    });
    telling * rows.ln() + fit.silent as f64 * SILENT + locals.sum::<f64>() + choices(problem, layout)
}

/// What the choice of so many recordings costs: how many, and which.
fn choice(problem: &Problem, some: usize) -> f64 {
    let recordings = problem.recordings.len() as u64;
    2.0 * ((recordings as f64).ln() + ln_binomial(recordings, (some as u64).min(recordings)))
}

/// What the choice of the recordings that mechanisms act in costs.
fn choices(problem: &Problem, layout: &Layout) -> f64 {
    let of_scope = |scope| match scope {
        Scope::Everywhere | Scope::EachConfiguration => 0.0,
        Scope::Configuration(_) => 2.0 * (problem.recordings.len() as f64).ln(),
        Scope::Recordings(some) | Scope::EachRecording(some) => choice(problem, some.len()),
    };
    layout.entrants.iter().map(|entrant| of_scope(entrant.scope)).sum()
}

/// In which part of trials chance takes as much off χ² as the only mechanism of a model does; `None` where that is not known, since it has
/// values of its own for each impact.
#[must_use]
pub fn by_chance(problem: &Problem, baseline: &Fit, fit: &Fit) -> Option<f64> {
    let layout = &fit.layout;
    if layout.is_loose() {
        return None;
    }
    let fall = baseline.cost - fit.cost - choices(problem, layout);
    Some(chance_of(fall, layout.parameters()))
}

/// In which part of trials chance takes so much off χ² with so many parameters.
fn chance_of(fall: f64, parameters: usize) -> f64 {
    ChiSquared::new(parameters as f64).map_or(1.0, |by_chance| by_chance.sf(fall.max(0.0)))
}

/// χ² of what is observed, without further channels, and of what strains the beliefs about the rig.
fn observed(problem: &Problem, fit: &Fit, part: Part<'_>) -> f64 {
    part.iter().map(|number| fit.observed_cost(problem, *number)).sum::<f64>() + fit.tension(problem, part)
}

/// By how much a fit is better than another in that.
fn shown(problem: &Problem, one: &Fit, other: &Fit, part: Part<'_>) -> f64 {
    observed(problem, other, part) - observed(problem, one, part)
}

/// The same χ² of a rig without mechanisms that has nothing else to be like.
fn observed_by_itself(problem: &Problem, part: Part<'_>) -> Option<f64> {
    let alone = problem.without_further_channels();
    let layout = Layout::new(&alone, Vec::new());
    let start = layout.start(&alone);
    Fit::run(&alone, layout, start, part, Effort::FULL).map(|fit| fit.cost)
}

/// Whether a larger model is no trace that only a finer channel shows and no rest asks for.
fn is_no_trace(problem: &Problem, here: &Standing, larger: &Trial, part: Part<'_>) -> bool {
    here.asks() || !is_trace(problem, &here.trial.fit, &larger.fit, part)
}

/// Whether what a larger model brings is more than chance does, and hardly seen in what is observed: a finer channel shows it.
fn is_trace(problem: &Problem, smaller: &Fit, larger: &Fit, part: Part<'_>) -> bool {
    problem.channels.len() > 1
        && chance_of(smaller.cost - larger.cost, 1) < BY_CHANCE
        && shown(problem, larger, smaller, part) <= TRACE * TRACE
}

/// Whether the only mechanism of a model does more than chance, and is no such trace.
fn is_no_chance(problem: &Problem, baseline: &Standing, trial: &Trial, part: Part<'_>) -> bool {
    let begun = &baseline.trial;
    let does_more =
        by_chance(problem, &begun.fit, &trial.fit).map_or(begun.bic - trial.bic >= ENOUGH, |p| p < BY_CHANCE);
    does_more && is_no_trace(problem, baseline, trial, part)
}

impl Standing {
    fn of(problem: &Problem, trial: Trial, part: Part<'_>) -> Option<Self> {
        let trial = Trial::new(problem, placed(problem, trial.fit.touched(problem, part), part));
        let trial = several(problem, each_its_own(problem, trial, part), part);
        let fewer = (0..trial.fit.layout.entrants.len()).map(|place| without(problem, &trial, place, part)).collect();
        let tangent = trial.fit.tangent(problem, part)?;
        let rest = omnibus(problem, &trial.fit, &tangent);
        let oddity = oddity(problem, &trial.fit);
        let hum = hum(problem, &trial.fit);
        Some(Self { trial, tangent, rest, oddity, hum, fewer })
    }

    fn entrants(&self) -> &[Entrant] {
        &self.trial.fit.layout.entrants
    }

    fn mechanisms(&self) -> usize {
        self.entrants().len()
    }

    /// Whether its mechanisms are these, in this order.
    fn has(&self, others: &[Entrant]) -> bool {
        self.mechanisms() == others.len()
            && self.entrants().iter().zip(others).all(|(this, other)| this.is_same_as(other))
    }

    /// The place of its only mechanism that another model of as many has not.
    fn only_one_not_of(&self, other: &Self) -> Option<usize> {
        let is_other = |entrant: &Entrant| other.entrants().iter().all(|theirs| !theirs.is_same_as(entrant));
        let mut places = (0..self.mechanisms()).filter(|place| is_other(&self.entrants()[*place]));
        let only = places.next().filter(|_| places.next().is_none());
        only.filter(|_| self.mechanisms() == other.mechanisms())
    }

    /// Whether what it leaves is more than noise and traces of the usual imperfections.
    fn asks(&self) -> bool {
        self.rest.z() > SIGNIFICANT || self.oddity.p_value < UNLIKELY || self.hum.is_there()
    }

    /// The model without the mechanism in a place; where it has none, itself.
    fn without(&self, place: usize) -> Option<&Trial> {
        if self.mechanisms() == 0 { Some(&self.trial) } else { self.fewer[place].as_ref() }
    }

    /// The best model with one mechanism fewer.
    fn smaller(&self) -> Option<&Trial> {
        self.fewer.iter().flatten().min_by(|a, b| a.bic.total_cmp(&b.bic))
    }

    /// By how much χ² grows without each of its mechanisms.
    fn worth(&self) -> Vec<f64> {
        let cost = self.trial.fit.cost;
        self.fewer.iter().map(|fewer| fewer.as_ref().map_or(f64::INFINITY, |fewer| fewer.fit.cost - cost)).collect()
    }
}

/// Selects among the given mechanisms.
#[must_use]
pub fn select(
    problem: &Problem,
    baseline: Fit,
    mechanisms: &[&'static Mechanism],
    progress: &mut dyn FnMut(&str),
) -> Option<Selection> {
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let retuned = Standing::of(problem, Trial::new(problem, baseline), &all)?;
    let has_further = problem.channels.len() > 1;
    let mut selecting = Selecting {
        problem,
        mechanisms,
        part: &all,
        retuned,
        observed_by_itself: has_further.then(|| observed_by_itself(problem, &all)).flatten(),
        most: TWO,
        to_beat: f64::INFINITY,
        screened: Vec::new(),
        firsts: Vec::new(),
        rivals: Vec::new(),
        met: Vec::new(),
        crossed_at: None,
        unfolded: None,
    };
    let told = selecting.as_observed(progress);
    let mut here = selecting.begun(told, progress)?;
    let stages: [Stage<'_>; 8] = [
        Selecting::revised,
        Selecting::doubted,
        Selecting::begun_otherwise,
        Selecting::paired,
        Selecting::crossed,
        Selecting::joined_by_a_third,
        Selecting::steadied,
        Selecting::substituted,
    ];
    for stage in stages {
        here = selecting.paid_for(stage, here, progress)?;
    }
    let here = selecting.in_later_form(here)?;
    let here = selecting.stripped(here)?;
    let here = selecting.without_a_third(here)?;
    let here = selecting.paid_for(Selecting::divided, here, progress)?;
    let here = selecting.in_each_recording(here)?;
    selecting.meet_kin(&here);
    let here = selecting.foretelling(here)?;
    let here = selecting.in_usual_form(here)?;
    Some(selecting.selection(here))
}

/// A search for a better model than one.
type Stage<'a> = fn(&mut Selecting<'a>, Standing, &mut dyn FnMut(&str)) -> Option<Standing>;

/// A selection under way.
struct Selecting<'a> {
    problem: &'a Problem,
    mechanisms: &'a [&'static Mechanism],
    part: Part<'a>,
    retuned: Standing,
    /// [`observed_by_itself`], where there are further channels.
    observed_by_itself: Option<f64>,
    /// The most mechanisms in one model.
    most: usize,
    /// A χ² that the largest model has to come near to be of any use.
    to_beat: f64,
    /// Scores against the baseline.
    screened: Vec<Screened>,
    /// What each mechanism alone came to when the first was chosen.
    firsts: Vec<Trial>,
    rivals: Vec<(usize, Trial)>,
    /// Rivals that were found before.
    met: Vec<Met>,
    /// χ² of the model that other pairs were last sought for.
    crossed_at: Option<f64>,
    /// What moves the robot by itself, everywhere, and χ² of the baseline that it was fitted beside.
    unfolded: Option<(f64, Vec<Trial>)>,
}

/// The rivals of one mechanism of a model.
struct Met {
    /// The model's mechanisms and its χ².
    entrants: Vec<Entrant>,
    cost: f64,
    place: usize,
    rivals: Vec<Trial>,
}

impl Met {
    fn of(model: &Standing, place: usize, rivals: Vec<Trial>) -> Self {
        Self { entrants: model.entrants().to_vec(), cost: model.trial.fit.cost, place, rivals }
    }

    fn are_of(&self, model: &Standing, place: usize) -> bool {
        self.place == place && self.cost == model.trial.fit.cost && self.entrants == model.entrants()
    }
}

impl<'a> Selecting<'a> {
    /// With what it came to.
    fn selection(&self, here: Standing) -> Selection {
        let worth = here.worth();
        let is_likely_without =
            here.fewer.iter().map(|fewer| fewer.as_ref().is_none_or(|fewer| is_quite_likely(&fewer.fit))).collect();
        let (traces, rivals): (Vec<_>, Vec<_>) =
            self.rivals.iter().cloned().partition(|rival| self.is_trace_instead(&here, rival));
        let seen = |(place, trial): (usize, Trial)| {
            let fewer = here.without(place);
            let shown = fewer.map_or(0.0, |fewer| shown(self.problem, &trial.fit, &fewer.fit, self.part));
            (trial, shown.max(0.0))
        };
        let traces = traces.into_iter().map(seen).collect();
        let Standing { trial: best, tangent, rest, oddity, hum, .. } = here;
        let deviations = tangent.deviations();
        let told_deviations = tangent.deviations_without_beliefs(|global| best.fit.layout.globals[global].is_guess);
        let retuned = self.retuned.clone();
        let observed = self.observed_by_itself.map(|by_itself| Observed {
            rest: observed_omnibus(self.problem, &best.fit, &tangent),
            gained: by_itself - self.missed(&best.fit),
        });
        Selection {
            baseline: retuned.trial.fit,
            baseline_tangent: retuned.tangent,
            screened: self.screened.clone(),
            best,
            tangent,
            deviations,
            told_deviations,
            rest,
            observed,
            oddity,
            hum,
            rivals,
            traces,
            worth,
            is_likely_without,
        }
    }

    /// What a stage comes to, as long as anything further is to be begun.
    fn paid_for(&mut self, stage: Stage<'a>, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        self.problem.work.begin_stage();
        if self.problem.work.is_done() { Some(from) } else { stage(self, from, progress) }
    }

    /// Whether it would leave something, beside the rivals that are known now.
    fn leaves(&self, standing: &Standing) -> bool {
        remains(&self.selection(standing.clone()))
    }

    /// By how much a model lowers χ².
    fn gained(&self, trial: &Trial) -> f64 {
        (self.retuned.trial.fit.cost - trial.fit.cost).max(0.0)
    }

    /// What a model misses of what is observed, and strains to: its χ², where there are no further channels.
    fn missed(&self, fit: &Fit) -> f64 {
        if self.observed_by_itself.is_some() { observed(self.problem, fit, self.part) } else { fit.cost }
    }

    /// The same of the rig without mechanisms, which is like what is observed and nothing else.
    fn missed_without(&self) -> f64 {
        self.observed_by_itself.unwrap_or(self.retuned.trial.fit.cost)
    }

    /// By how much χ² is lower for mechanisms whose equations no rig is quite like: what their errors leave is in proportion to it.
    fn approximated(&self, standing: &Standing) -> f64 {
        let worth = standing.worth();
        let of =
            |(entrant, worth): (&Entrant, &f64)| if entrant.effect.mechanism().exact { worth.max(0.0) } else { 0.0 };
        (self.gained(&standing.trial) - standing.entrants().iter().zip(&worth).map(of).sum::<f64>()).max(0.0)
    }

    /// BIC, and what each mechanism with a value of its own for each impact has to be worth beside one without, or one that lasts and
    /// would have to choose its recordings: they bend to whatever differs from recording to recording, and no rig is quite like its
    /// equations. What acts on one channel alone bends to no other: a gauge's millions are not its business.
    fn burden(&self, trial: &Trial) -> f64 {
        let gained = self.gained(trial);
        let observed = || (self.missed_without() - self.missed(&trial.fit)).clamp(0.0, gained);
        let loose = trial.fit.layout.entrants.iter().filter(|entrant| entrant.is_loose());
        let bent_to =
            loose.map(|entrant| if entrant.effect.mechanism().is_of_one_channel() { observed() } else { gained });
        trial.bic + FURTHER * (bent_to.sum::<f64>() + trial.coincidences.len() as f64 * gained)
    }

    /// Whether a model's burden is less than another's by more than fits to the same end differ.
    fn is_lighter(&self, trial: &Trial, other: &Trial) -> bool {
        self.burden(trial) < self.burden(other) - 1.0
    }

    /// Whether another mechanism in one place of a model is a trace there, and the one that it has is none; of one that is added, whether no rest asks
    /// for it.
    fn is_trace_instead(&self, of: &Standing, (place, other): &(usize, Trial)) -> bool {
        let is_trace = |fewer: &Trial, trial: &Trial| is_trace(self.problem, &fewer.fit, &trial.fit, self.part);
        let may_be_one = |fewer: &Trial| if of.mechanisms() > 0 { is_trace(fewer, &of.trial) } else { of.asks() };
        of.without(*place).is_some_and(|fewer| is_trace(fewer, other) && !may_be_one(fewer))
    }

    /// The lightest of models with another mechanism in one place, if it is lighter than this one.
    fn lightest(&self, others: &[(usize, Trial)], than: &Standing) -> Option<(usize, Trial)> {
        let is_better =
            |other: &&(usize, Trial)| self.is_lighter(&other.1, &than.trial) && !self.is_trace_instead(than, other);
        let better = others.iter().filter(is_better);
        better.min_by(|a, b| self.burden(&a.1).total_cmp(&self.burden(&b.1))).cloned()
    }

    /// Whether the baseline had not converged: what falls with a model's only mechanism falls without it as well. Then that is the baseline.
    fn found_lower_baseline(&mut self, of: &Standing) -> Option<bool> {
        let [Some(again)] = of.fewer.as_slice() else { return Some(false) };
        let is_lower = again.fit.cost < self.retuned.trial.fit.cost - UNCONVERGED;
        if is_lower {
            self.retuned = Standing::of(self.problem, again.clone(), self.part)?;
        }
        Some(is_lower)
    }

    /// A search's beginning: what is told by what is observed alone, where that leaves nothing of the further channels either; else one mechanism after the
    /// other by all of them, and the better one of both.
    fn begun(&mut self, told: Option<Standing>, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let retuned = self.retuned.clone();
        let told = match told {
            Some(told) if !self.leaves(&told) => {
                self.screened = self.scores(&retuned.trial.fit, &retuned.tangent, &retuned.trial.fit);
                self.find_all_rivals(&told);
                return self.settled(told, progress);
            }
            told => told,
        };
        let here = self.settled(retuned, progress)?;
        let told = told.filter(|told| self.is_lighter(&told.trial, &here.trial));
        let Some(told) = told.filter(|_| self.leaves(&here)) else { return Some(here) };
        self.find_all_rivals(&told);
        Some(told)
    }

    /// What a search by what is observed alone names, or what that cannot tell from it, fitted to all channels: the lightest. A gauge of 10 µm shows the
    /// smallest error of a motion by hundreds of deviations. Where the force tells plainly what is missing, a baseline that follows the gauge is of
    /// another rig, and χ² beside it all valleys.
    fn as_observed(&self, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        if self.problem.channels.len() == 1 {
            return None;
        }
        let mut alone = self.problem.without_further_channels();
        alone.work = Arc::new(self.problem.work.half());
        let layout = Layout::new(&alone, Vec::new());
        let start = layout.start(&alone);
        let baseline = Fit::run(&alone, layout, start, self.part, Effort::FULL)?;
        let told = select(&alone, baseline, self.mechanisms, progress);
        self.problem.work.add(&alone.work);
        let told = told.filter(|told| !told.best.fit.layout.entrants.is_empty())?;
        let as_many = |trial: &&Trial| trial.fit.layout.entrants.len() == told.best.fit.layout.entrants.len();
        let rivals = told.rivals.iter().map(|(_, trial)| trial).filter(as_many);
        let near = rivals.filter(|trial| trial.bic - told.best.bic < WITHIN_REACH);
        let fitted = std::iter::once(&told.best).chain(near).filter_map(|Trial { fit, .. }| {
            let layout = Layout::new(self.problem, fit.layout.entrants.clone());
            let start = layout.start_from(self.problem, &fit.layout, &fit.point);
            let fit = Fit::run(self.problem, layout, start, self.part, Effort::FULL)?;
            Some(Trial::new(self.problem, fit))
        });
        let lightest = fitted.min_by(|a, b| self.burden(a).total_cmp(&self.burden(b)))?;
        Standing::of(self.problem, lightest, self.part)
    }

    /// What moves the robot, fitted from the first contact on, where the robot touches again or stays in most recordings and enormously much is left: what
    /// else explains a force that goes on costs more than the search may, and leaves much.
    fn moving(&mut self, from: &Standing) -> Vec<Trial> {
        let often = 2 * touching_again(self.problem).len() > self.problem.recordings.len();
        if from.mechanisms() > 0 || from.rest.z() < ENORMOUS || !often {
            return Vec::new();
        }
        let fit = &from.trial.fit;
        if self.unfolded_beside(fit).is_none() {
            let trials = unfolded(self.problem, fit, self.mechanisms, &[Scope::Everywhere], self.part);
            self.unfolded = Some((fit.cost, trials));
        }
        self.unfolded_beside(fit).unwrap_or_default()
    }

    /// The same as far as it has been fitted beside this baseline, of the mechanisms that are asked for.
    fn unfolded_beside(&self, baseline: &Fit) -> Option<Vec<Trial>> {
        let (_, known) = self.unfolded.as_ref().filter(|(beside, _)| *beside == baseline.cost)?;
        let is_asked = |trial: &&Trial| {
            let id = added(&trial.fit).effect.mechanism().id;
            self.mechanisms.iter().any(|mechanism| mechanism.id == id)
        };
        Some(known.iter().filter(is_asked).cloned().collect())
    }

    /// A model grown, and its mechanisms exchanged, as long as that makes it better.
    fn settled(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut here = from;
        for round in 0..ROUNDS {
            let before = here.entrants().to_vec();
            here = self.grow(here, progress)?;
            let settled = round > 0 && here.has(&before);
            if settled || here.mechanisms() < 2 {
                break;
            }
            progress("is each of them needed");
            let grown = here.entrants().to_vec();
            here = self.exchanged(here)?;
            if here.has(&grown) {
                break;
            }
            here = self.stripped(here)?;
        }
        Some(here)
    }

    /// Without what is not needed beside another that has taken a place.
    fn stripped(&mut self, from: Standing) -> Option<Standing> {
        let before = from.mechanisms();
        let needed = self.needed(from)?;
        if needed.mechanisms() < before {
            self.find_all_rivals(&needed);
        }
        Some(needed)
    }

    /// Where something is left beside two, whatever they are, with a third; unless one of them, come before the other, is another in each configuration.
    fn joined_by_a_third(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        self.most = MOST_MECHANISMS;
        if from.mechanisms() != TWO || !self.leaves(&from) {
            return Some(from);
        }
        let here = (0..TWO).try_fold(from.clone(), |here, place| self.differing_at(here, place))?;
        if here.trial.bic < from.trial.bic {
            self.find_all_rivals(&here);
        }
        if self.leaves(&here) { self.settled(here, progress) } else { Some(here) }
    }

    /// The two that a third stands beside, where that brings little: to the end it has kept others from bending to what two leave.
    fn without_a_third(&mut self, from: Standing) -> Option<Standing> {
        let enough = ENOUGH + THIRD * self.approximated(&from);
        let two = from.smaller().filter(|two| from.mechanisms() > 2 && two.bic < from.trial.bic + enough);
        let Some(two) = two else { return Some(from) };
        let here = Standing::of(self.problem, two.clone(), self.part)?;
        self.find_all_rivals(&here);
        Some(here)
    }

    /// Where more than one is named, or one that leaves a little, the second is sought beside each of those as well that came nearest to the first: of two
    /// that are hidden each may be imitated by a third, and what that leaves leads astray. And beside a plainer one of the same kind: friction that falls
    /// with the speed had taken the air's part, and left what two others were named for. Two instead of one have to leave nothing.
    fn begun_otherwise(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut leaves = self.leaves(&from);
        // One that leaves much is begun anew first (`revised`).
        let may_be_two = from.mechanisms() > 1 || from.mechanisms() == 1 && from.asks() && !leaves;
        if !may_be_two {
            return Some(from);
        }
        let lowest = self.firsts.iter().map(|first| self.missed(&first.fit)).fold(f64::INFINITY, f64::min);
        let reach = WITHIN_REACH.max(NEARLY * (self.missed_without() - lowest));
        let is_new = |first: &&Trial| {
            let added = added(&first.fit);
            self.missed(&first.fit) - lowest < reach
                && !added.is_loose()
                && from.entrants().iter().all(|entrant| entrant.effect.mechanism().id != added.effect.mechanism().id)
        };
        let mut firsts: Vec<Trial> = self.firsts.iter().filter(is_new).cloned().collect();
        firsts.sort_by(|a, b| a.bic.total_cmp(&b.bic));
        firsts.dedup_by_key(|first| added(&first.fit).effect.mechanism().id);
        firsts.truncate(NEAREST);
        let is_plainer_kin = |first: &&Trial| {
            let mechanism = added(&first.fit).effect.mechanism();
            let is_met = firsts.iter().any(|other| added(&other.fit).effect.mechanism().id == mechanism.id);
            let mut entrants = from.entrants().iter().map(|entrant| entrant.effect.mechanism());
            !is_met && !added(&first.fit).is_loose() && entrants.any(|other| is_plainer(mechanism, other))
        };
        let plainer = self.firsts.iter().filter(is_plainer_kin).min_by(|a, b| a.bic.total_cmp(&b.bic)).cloned();
        firsts.extend(plainer);
        let mut here = from;
        for first in firsts {
            progress("is it another two");
            let begun = Standing::of(self.problem, first, self.part)?;
            let rivals = std::mem::take(&mut self.rivals);
            self.to_beat = self.burden(&here.trial);
            let grown = self.grow(begun, progress);
            self.to_beat = f64::INFINITY;
            let grown = grown?;
            let is_better = self.is_lighter(&grown.trial, &here.trial)
                && (leaves || !self.leaves(&grown))
                && (here.mechanisms() > 1 || !grown.asks());
            if is_better {
                here = self.settled(grown, progress)?;
                leaves = self.leaves(&here);
            } else {
                self.rivals = rivals;
            }
        }
        Some(here)
    }

    /// Where something is left, or more is named than one steady mechanism, every one is begun anew: the fit may have gone astray, not
    /// the list.
    fn revised(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let leaves = self.leaves(&from);
        let is_plain = matches!(from.entrants(), [] | [_]) && !from.trial.fit.layout.is_loose();
        if is_plain && !leaves {
            return Some(from);
        }
        progress("is it another one after all");
        let retuned = &self.retuned.trial.fit;
        let strangers = strangers(self.problem, retuned);
        let mut trials = anew(self.problem, retuned, &self.screened, strangers, self.part, from.trial.fit.cost);
        // A push that comes too soon or too late is a step in time, in few recordings as well.
        let mut scopes: Vec<Scope> = strangers.into_iter().collect();
        let again = touching_again(self.problem);
        if !again.is_empty() {
            scopes.push(Scope::Everywhere);
            let some = Scope::of(self.problem, again);
            if again.len() < self.problem.recordings.len() && !scopes.contains(&some) {
                scopes.push(some);
            }
        }
        if let Some(known) = self.unfolded_beside(retuned) {
            scopes.retain(|scope| *scope != Scope::Everywhere);
            trials.extend(known);
        }
        trials.extend(unfolded(self.problem, retuned, self.mechanisms, &scopes, self.part));
        let apart = self.beside_other_configurations(from.trial.fit.cost);
        trials.extend(apart.iter().cloned());
        // Where nothing has been named, what is left may be no more than chance explains.
        let is_worthy =
            |trial: &&Trial| from.mechanisms() > 0 || is_no_chance(self.problem, &self.retuned, trial, self.part);
        let lightest_of = |trials: &[Trial]| {
            let worthy = trials.iter().filter(is_worthy);
            worthy.min_by(|a, b| self.burden(a).total_cmp(&self.burden(b))).cloned()
        };
        let lightest = lightest_of(&trials).filter(|trial| self.is_lighter(trial, &from.trial));
        // What acts in one configuration may be one of two, and what it is compared with bends to both.
        let Some(lightest) = lightest.or_else(|| lightest_of(&apart)) else { return Some(from) };
        let begun = Standing::of(self.problem, lightest, self.part)?;
        if self.found_lower_baseline(&begun)? {
            self.rivals.clear();
            let here = self.settled(self.retuned.clone(), progress)?;
            return self.revised(here, progress);
        }
        let others = trials.into_iter().filter(|trial| !added(&trial.fit).is_same_as(added(&begun.trial.fit)));
        let others: Vec<(usize, Trial)> = others.map(|trial| (0, trial)).collect();
        let rivals = std::mem::replace(&mut self.rivals, others);
        let here = self.settled(begun, progress)?;
        let is_better = self.is_lighter(&here.trial, &from.trial) && (leaves || !self.leaves(&here));
        if is_better {
            return Some(here);
        }
        self.rivals = rivals;
        Some(from)
    }

    /// Where something is left, each mechanism is begun together with what it is confused with. A pair that leaves something as well is no better:
    /// with two that take from each other much bends to much.
    fn paired(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        if !self.leaves(&from) {
            return Some(from);
        }
        progress("is it two that take from each other");
        let (Fit { layout, point, cost, .. }, retuned) = (&from.trial.fit, &self.retuned.trial.fit);
        let steady = from.entrants().iter().enumerate().filter(|(_, entrant)| !entrant.is_loose());
        let pairs = steady.flat_map(|(place, entrant)| {
            let first = Entrant { effect: layout.effect(self.problem, place, point), ..entrant.clone() };
            together(self.problem, retuned, &first, self.mechanisms, self.part, *cost)
        });
        let pairs = pairs.collect();
        self.pair_instead(from, pairs, progress)
    }

    /// Two that leave something, be it next to nothing, before anything is begun beside them.
    fn doubted(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        if from.mechanisms() == TWO && from.asks() { self.crossed(from, progress) } else { Some(from) }
    }

    /// Where something is left, be it next to nothing beside two, or one mechanism that bends to much (to each recording, or to a shape that nothing has) explains it all: the pairs
    /// of steady ones of which tangents beside each first promise most. Of two that are hidden neither need come near what a third bends to.
    fn crossed(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let leaves = self.leaves(&from);
        let fit = &from.trial.fit;
        let bends = from.mechanisms() == 1 && (fit.layout.is_loose() || !is_likely(fit));
        let is_doubtful = from.mechanisms() > 1 && from.asks();
        let is_new = self.crossed_at != Some(fit.cost);
        if !(leaves || bends || is_doubtful) || !is_new {
            return Some(from);
        }
        self.crossed_at = Some(fit.cost);
        progress("is it any other two");
        let (without, lowest) = (self.retuned.trial.fit.cost, from.trial.fit.cost);
        let is_part = |first: &&Trial| {
            let is_steady = added(&first.fit).is_alike_everywhere() && first.coincidences.is_empty();
            is_steady && is_likely(&first.fit) && first.fit.cost - lowest < PARTLY * (without - lowest)
        };
        let mut firsts: Vec<&Trial> = self.firsts.iter().filter(is_part).collect();
        firsts.sort_by(|a, b| a.bic.total_cmp(&b.bic));
        firsts.truncate(FIRSTS);
        let noise = LEAST_NOISE * self.problem.rows() as f64;
        let mut pairs: Vec<(f64, usize, Screened)> = Vec::new();
        let mut left = Vec::new();
        for first in firsts {
            let Some(tangent) = first.fit.tangent(self.problem, self.part) else { continue };
            let number = left.len();
            left.push((&first.fit, omnibus(self.problem, &first.fit, &tangent)));
            let scores = self.scores(&first.fit, &tangent, &first.fit).into_iter();
            let believed = scores.filter(|score| {
                score.entrant.is_alike_everywhere() && score.z > 0.0 && score.z.powi(2) < first.fit.cost - noise
            });
            pairs.extend(believed.map(|score| (first.fit.cost - score.z.powi(2), number, score)));
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut met: Vec<[&str; 2]> = Vec::new();
        pairs.retain(|(_, first, score)| {
            let mut ids = [added(left[*first].0), &score.entrant].map(|entrant| entrant.effect.mechanism().id);
            ids.sort_unstable();
            let is_new = !met.contains(&ids);
            met.push(ids);
            is_new
        });
        pairs.truncate(CROSSED);
        let refitted = pairs.into_iter().flat_map(|(_, first, score)| {
            let (base, rest) = left[first];
            refit(self.problem, base, &[score], rest, Breadth::INSTEAD, self.part, lowest)
        });
        let refitted = refitted.collect();
        self.pair_instead(from, refitted, progress)
    }

    /// The lightest of two that were begun at once, settled, in place of a model, where that is lighter and leaves nothing.
    fn pair_instead(&mut self, from: Standing, pairs: Vec<Trial>, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let lightest = pairs.into_iter().min_by(|a, b| self.burden(a).total_cmp(&self.burden(b)));
        let Some(pair) = lightest.filter(|pair| self.is_lighter(pair, &from.trial)) else { return Some(from) };
        let begun = Standing::of(self.problem, pair, self.part)?;
        let rivals = std::mem::take(&mut self.rivals);
        let mut here = self.settled(begun, progress)?;
        let mut leaves = self.leaves(&here);
        if leaves {
            // The first may have come first only beside the other's part.
            here = self.substituted(here, progress)?;
            leaves = self.leaves(&here);
        }
        if self.is_lighter(&here.trial, &from.trial) && !leaves {
            return Some(here);
        }
        self.rivals = rivals;
        Some(from)
    }

    /// What a mechanism with a value of its own for each impact explains at one go, two others may explain as well, and neither alone
    /// comes near it: once more without it, and the better one of both. (With three anything bends to anything.)
    fn steadied(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut here = from;
        for entrant in here.entrants().to_vec() {
            if !entrant.is_loose() || !here.entrants().contains(&entrant) || self.problem.work.is_done() {
                continue;
            }
            let loose = entrant.effect.mechanism();
            progress("do steadier ones do as well");
            let others: Vec<_> = self.mechanisms.iter().copied().filter(|other| other.id != loose.id).collect();
            let retuned = self.retuned.clone();
            let mut without = Selecting {
                mechanisms: &others,
                retuned,
                most: MOST_MECHANISMS.min(here.mechanisms() + 1),
                to_beat: self.burden(&here.trial),
                screened: Vec::new(),
                firsts: Vec::new(),
                rivals: Vec::new(),
                met: Vec::new(),
                unfolded: self.unfolded.clone(),
                ..*self
            };
            let mut steadier = without.settled(without.retuned.clone(), progress)?;
            if without.burden(&steadier.trial) < self.burden(&here.trial) {
                (self.retuned, self.rivals) = (without.retuned, without.rivals);
                std::mem::swap(&mut here, &mut steadier);
            }
            if let Some(place) = here.only_one_not_of(&steadier) {
                self.rivals.push((place, steadier.trial));
            }
        }
        Some(here)
    }

    /// One mechanism more, as long as one is worth it.
    fn grow(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut here = from;
        while here.mechanisms() < self.most {
            let number = here.mechanisms();
            let last = number + 1 == self.most;
            let is_bounded = last && self.to_beat.is_finite() || number + 1 == MOST_MECHANISMS;
            // Of nothing a third explains nothing.
            let is_idle = number > 1 && !here.asks();
            if is_idle || number > 0 && self.problem.work.is_done() {
                break;
            }
            progress(if number == 0 { "which mechanism" } else { "is there another" });
            let scores = self.scores(&here.trial.fit, &here.tangent, &here.trial.fit);
            if number == 0 {
                self.screened.clone_from(&scores);
            }
            // A further one has to be worth something beside what is explained already: no rig is quite like its equations.
            let asks = number == 0 || here.asks();
            let least = if asks { ENOUGH } else { UNASKED };
            let enough = least + FURTHER * self.approximated(&here);
            // Where little is left a tangent is to be believed, unless it promises more than there is.
            let left = here.trial.fit.cost - LEAST_NOISE * self.problem.rows() as f64;
            let hopeless = (HOPELESS * enough).min(ALIKE);
            let promises = |score: &Screened| score.z.powi(2) > hopeless && score.z.powi(2) < left;
            if (!asks || is_bounded) && !scores.iter().any(promises) {
                break;
            }
            let moving = self.moving(&here);
            let rows = self.problem.rows() as f64;
            let is_most = |trial: &&Trial| trial.fit.cost - rows < LITTLE * (here.trial.fit.cost - rows);
            let moved = moving.iter().filter(is_most).map(|trial| trial.fit.cost).fold(f64::INFINITY, f64::min);
            let wanted = if last { self.to_beat } else { moved };
            let breadth = if number == 0 && !here.asks() { Breadth::FAINT } else { Breadth::MORE };
            let mut trials = refit(self.problem, &here.trial.fit, &scores, here.rest, breadth, self.part, wanted);
            trials.extend(moving);
            trials.sort_by(|a, b| a.bic.total_cmp(&b.bic));
            let trials: Vec<Trial> = trials.into_iter().map(|trial| self.in_common(trial)).collect();
            if number == 0 {
                self.firsts.clone_from(&trials);
            }
            let is_enough = |trial: &&Trial| match number {
                0 => is_no_chance(self.problem, &here, trial, self.part),
                _ => {
                    let is_worth_it = here.trial.bic - trial.bic >= enough
                        || self.is_seen(&here.trial, trial, least, FURTHER)
                        || self.solves(&here, trial);
                    is_worth_it && is_no_trace(self.problem, &here, trial, self.part)
                }
            };
            let worthy = trials.iter().filter(is_enough);
            let Some(next) = worthy.min_by(|a, b| self.burden(a).total_cmp(&self.burden(b))) else {
                if number == 0 {
                    self.rivals.extend(trials.into_iter().map(|trial| (0, trial)));
                }
                break;
            };
            let larger = Standing::of(self.problem, next.clone(), self.part)?;
            if self.found_lower_baseline(&larger)? && !is_no_chance(self.problem, &self.retuned, next, self.part) {
                here = self.retuned.clone();
                continue;
            }
            let larger = self.differing(self.needed(larger)?)?;
            if larger.mechanisms() <= number {
                // What has taken the others' place has had no rivals.
                self.find_all_rivals(&larger);
                // Another may have led a mechanism to where it belongs, and is not needed there: what it leaves then is still to be explained.
                if larger.trial.bic < here.trial.bic - ENOUGH {
                    here = larger;
                    continue;
                }
                return Some(larger);
            }
            // Three that still leave a rest are no explanation: with enough of them anything bends to anything.
            if larger.mechanisms() > 2 && larger.asks() {
                break;
            }
            let next = added(&next.fit).clone();
            let others = trials.into_iter().filter(|trial| !added(&trial.fit).is_same_as(&next));
            let differs = added(&larger.trial.fit).scope == Scope::EachConfiguration;
            let others = others.map(|trial| if differs { self.differently(trial, number) } else { trial });
            let others: Vec<(usize, Trial)> = others.map(|trial| (number, trial)).collect();
            // Beside the same others they need not be refitted again in its place.
            let fewer = larger.fewer[number].as_ref();
            if !differs && fewer.is_some_and(|fewer| (fewer.fit.cost - here.trial.fit.cost).abs() < UNCONVERGED) {
                let is_another = |trial: &&Trial| added(&trial.fit).effect.mechanism().id != next.effect.mechanism().id;
                self.met.push(Met::of(
                    &larger,
                    number,
                    others.iter().map(|(_, trial)| trial).filter(is_another).cloned().collect(),
                ));
            }
            // With a value for each configuration another may lead.
            let lightest = self.lightest(&others, &larger).filter(|_| differs);
            self.rivals.extend(others);
            here = match lightest {
                Some((place, other)) => self.exchange(larger, place, other)?,
                None => larger,
            };
        }
        Some(here)
    }

    /// Refits the others in the place of each mechanism and takes the best, if it is better; it comes last.
    fn exchanged(&mut self, from: Standing) -> Option<Standing> {
        self.find_all_rivals(&from);
        let Some((place, trial)) = self.lightest(&self.rivals, &from) else { return Some(from) };
        self.exchange(from, place, trial)
    }

    /// Puts into the place of each mechanism what it is confused with, all else as it has come to beside that: without it the others and the rig have
    /// taken its part, and beside those what is right may promise nothing, or end in a valley far from there. A pad that relaxes at once is a dashpot.
    fn substituted(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut here = from;
        for _ in 0..ROUNDS {
            if here.mechanisms() == 0 || self.problem.work.is_done() {
                break;
            }
            progress("does another stand in for one of them");
            let instead = (0..here.mechanisms()).flat_map(|place| {
                let trials = self.in_place_of(&here, place).unwrap_or_default();
                trials.into_iter().map(move |trial| (place, trial))
            });
            let instead: Vec<(usize, Trial)> = instead.collect();
            let lightest = self.lightest(&instead, &here);
            self.rivals.extend(instead);
            let Some((place, trial)) = lightest else { break };
            here = self.exchange(here, place, trial)?;
        }
        Some(here)
    }

    /// One mechanism in a shape that nothing has may have another's part in it, as the damping of a piece on its springs has a dashpot's: taken back to
    /// what is likely, it leaves that part to another. Two of which each is likely stand instead where they leave nothing and cannot be told from it.
    fn divided(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let is_unlikely = from.mechanisms() == 1 && unlikely(&self.selection(from.clone()), 0).is_some();
        if !is_unlikely {
            return Some(from);
        }
        progress("has it another's part in it");
        let Fit { layout, cost, .. } = &from.trial.fit;
        let base = Fit::at(self.problem, layout.clone(), made_likely(&from.trial.fit), self.part)?;
        let tangent = base.tangent(self.problem, self.part)?;
        let rest = omnibus(self.problem, &base, &tangent);
        let scores = self.scores(&base, &tangent, &base);
        let trials = refit(self.problem, &base, &scores, rest, Breadth::MORE, self.part, *cost);
        let is_as_good = |trial: &Trial| {
            trial.bic < from.trial.bic + WITHIN_REACH && !trial.fit.layout.is_loose() && is_likely(&trial.fit)
        };
        let two = trials.into_iter().filter(is_as_good).min_by(|a, b| a.bic.total_cmp(&b.bic));
        let Some(two) = two else { return Some(from) };
        let here = Standing::of(self.problem, two, self.part)?;
        let rivals = std::mem::take(&mut self.rivals);
        self.find_all_rivals(&here);
        if self.leaves(&here) {
            self.rivals = rivals;
            return Some(from);
        }
        Some(here)
    }

    /// Where more than noise is left, or another rig than the stated one is asked for, the model with a mechanism in a form that adds to what it has, if that is better by
    /// what a further mechanism has to be. Such a form is not worth a search of its own: without it the mechanism leads as well.
    fn in_later_form(&self, from: Standing) -> Option<Standing> {
        if !(from.asks() || self.leaves(&from)) {
            return Some(from);
        }
        let Fit { layout, point, .. } = &from.trial.fit;
        let reach = Reach::of(self.problem, Vec::new());
        let forms = (0..layout.entrants.len()).flat_map(|place| {
            let later = reach.later_forms(&layout.effect(self.problem, place, point));
            later.into_iter().map(move |form| (place, form))
        });
        let lightest = self.lightest_in(&from.trial.fit, forms);
        match lightest.filter(|other| other.bic < from.trial.bic - ENOUGH) {
            Some(other) => Standing::of(self.problem, other, self.part),
            None => Some(from),
        }
    }

    /// Where more than noise is left, what the chain adds with a value that may be another in each recording has its own in each, if that is better by what a
    /// further mechanism has to be. As a rival of others it would bend to whatever differs from recording to recording; what has been chosen is as it is.
    fn in_each_recording(&self, from: Standing) -> Option<Standing> {
        let mut here = from;
        for place in 0..here.mechanisms() {
            let Trial { fit, bic, .. } = &here.trial;
            let effect = fit.layout.effect(self.problem, place, &fit.point);
            let mechanism = effect.mechanism();
            let may_differ =
                mechanism.is_of_one_channel() && mechanism.by_recording.contains(&mechanism.parameters[0].name);
            if !here.asks() || !may_differ || here.entrants()[place].scope != Scope::Everywhere {
                continue;
            }
            let own = vec![effect.value(0); self.problem.recordings.len()];
            let scope = Scope::EachRecording(self.part.iter().copied().collect());
            let freed = self.freed(fit, place, Entrant { effect, scope, own });
            if let Some(better) = freed.filter(|freed| freed.bic < bic - ENOUGH) {
                here = Standing::of(self.problem, better, self.part)?;
            }
        }
        Some(here)
    }

    /// A model with each mechanism in its usual form, where the recordings do not tell that it has another: an unusual one has other numbers.
    fn in_usual_form(&self, from: Standing) -> Option<Standing> {
        let mut here = from;
        for place in 0..here.mechanisms() {
            let Fit { layout, point, .. } = &here.trial.fit;
            let effect = layout.effect(self.problem, place, point);
            let usual = effect.in_usual_form();
            if usual.has_form_of(&effect) {
                continue;
            }
            let Trial { fit, bic, .. } = &here.trial;
            let is_as_good = |other: &Trial| {
                let is_as_likely = is_likely(&other.fit) || !is_likely(fit);
                other.fit.cost < fit.cost + AS_GOOD && other.bic < bic + WITHIN_REACH && is_as_likely
            };
            if let Some(other) = self.lightest_in(fit, std::iter::once((place, usual))).filter(is_as_good) {
                here = Standing::of(self.problem, other, self.part)?;
            }
        }
        Some(here)
    }

    /// A model whose last mechanism has no longer a value of its own for each impact, where it has such a form and that is better.
    fn in_common(&self, trial: Trial) -> Trial {
        let Fit { layout, point, .. } = &trial.fit;
        let last = layout.entrants.len() - 1;
        let here = layout.effect(self.problem, last, point);
        if !here.is_of_each_impact() {
            return trial;
        }
        let later = Reach::of(self.problem, Vec::new()).later_forms(&here).into_iter();
        let forms = later.filter(|form| !form.is_of_each_impact()).map(|form| (last, form));
        self.lightest_in(&trial.fit, forms).filter(|other| other.bic < trial.bic).unwrap_or(trial)
    }

    /// The lightest of models with a mechanism in another form: in which place, and which.
    fn lightest_in(&self, fit: &Fit, forms: impl Iterator<Item = (usize, Effect)>) -> Option<Trial> {
        forms.flat_map(|(place, form)| self.in_form(fit, place, form)).min_by(|a, b| a.bic.total_cmp(&b.bic))
    }

    /// A model with the mechanism in one place in another form, fitted from the likeliest starts.
    fn in_form(&self, fit: &Fit, place: usize, form: Effect) -> Vec<Trial> {
        let Fit { layout, point, .. } = fit;
        let fewer = layout.without(self.problem, place);
        let others = fewer.start_from(self.problem, layout, point);
        let beside = |effect: Effect| {
            let with = layout.in_place(self.problem, place, Entrant { effect, ..layout.entrants[place].clone() });
            let here = with.start_from(self.problem, &fewer, &others);
            beside_or_as_stated(self.problem, with, here, self.part)
        };
        // What it adds, the mechanism may have made up for far from where it belongs.
        let reach = Reach::of(self.problem, Vec::new());
        let likely = at_likely_strengths(&form, SILENT_STRENGTHS - 1);
        let starts: Vec<Effect> = reach.starts_of(form.clone()).into_iter().chain(likely).chain([form]).collect();
        let mut fits: Vec<Fit> = starts.into_par_iter().filter_map(beside).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        fits.truncate(BEGUN);
        let followed = |fit: Fit| Trial::new(self.problem, fit.further(self.problem, self.part, Effort::FULL));
        fits.into_iter().map(followed).collect()
    }

    /// What one mechanism of a model is confused with in its place, refitted from where the model is.
    fn in_place_of(&self, here: &Standing, place: usize) -> Option<Vec<Trial>> {
        let Fit { layout, point, cost, .. } = &here.trial.fit;
        let fewer = layout.without(self.problem, place);
        let start = fewer.start_from(self.problem, layout, point);
        let base = Fit::at(self.problem, fewer, start, self.part)?;
        let tangent = base.tangent(self.problem, self.part)?;
        let reach = Reach::of(self.problem, base.lines_hz(self.problem));
        let this = here.entrants()[place].effect.mechanism();
        let mut confused = remaining(self.mechanisms, &here.trial.fit);
        confused.retain(|other| other.is_confused_with(this));
        let scores = screen(self.problem, &base, &tangent, &reach, &confused);
        Some(refit(self.problem, &base, &scores, here.rest, Breadth::INSTEAD, self.part, *cost))
    }

    /// Of models with another mechanism in one place, the one that foretells best: a parameter more costs it 2, not ln N (H. Akaike, IEEE Trans.
    /// Autom. Control 19 (1974) 716). Beside rubbing, of which it is a kind, sticking would never come first by BIC.
    fn foretelling(&mut self, from: Standing) -> Option<Standing> {
        let misses = |trial: &Trial| {
            trial.fit.cost + choices(self.problem, &trial.fit.layout) + 2.0 * trial.fit.layout.parameters() as f64
        };
        let is_steady = |trial: &Trial| !added(&trial.fit).is_loose() && trial.coincidences.is_empty();
        let as_many = |trial: &Trial| trial.fit.layout.entrants.len() == from.mechanisms();
        let is_better = |trial: &Trial| misses(trial) < misses(&from.trial) && is_likely(&trial.fit);
        let is_exchange = |other: &&(usize, Trial)| {
            let trial = &other.1;
            as_many(trial) && is_steady(trial) && is_better(trial) && !self.is_trace_instead(&from, other)
        };
        let better = self.rivals.iter().filter(is_exchange);
        let best = better.min_by(|a, b| misses(&a.1).total_cmp(&misses(&b.1)));
        let Some((place, trial)) = best.cloned() else { return Some(from) };
        self.exchange(from, place, trial)
    }

    /// Takes another model, with another mechanism in one place, which comes last.
    fn exchange(&mut self, from: Standing, place: usize, trial: Trial) -> Option<Standing> {
        let last = from.mechanisms() - 1;
        let exchanged = added(&trial.fit).clone();
        self.rivals.retain(|(of, other)| *of == place && !added(&other.fit).is_same_as(&exchanged));
        self.rivals.push((place, from.trial));
        self.rivals.iter_mut().for_each(|(of, _)| *of = last);
        let here = Standing::of(self.problem, trial, self.part)?;
        // What was exchanged has had its rivals.
        (0..last).for_each(|place| self.find_rivals(&here, place));
        Some(here)
    }

    /// Refits the others in the place of each mechanism, and forgets all before.
    fn find_all_rivals(&mut self, here: &Standing) {
        self.rivals.clear();
        (0..here.mechanisms()).for_each(|place| self.find_rivals(here, place));
    }

    /// Refits the others in the place of one mechanism.
    fn find_rivals(&mut self, here: &Standing, place: usize) {
        let known = self.met.iter().position(|met| met.are_of(here, place)).or_else(|| {
            let rivals = self.instead_of(here, place)?;
            self.met.push(Met::of(here, place, rivals));
            Some(self.met.len() - 1)
        });
        let rivals = known.map_or(&[][..], |known| &self.met[known].rivals);
        self.rivals.extend(rivals.iter().map(|trial| (place, trial.clone())));
    }

    /// The others in the place of one mechanism, refitted.
    fn instead_of(&self, here: &Standing, place: usize) -> Option<Vec<Trial>> {
        let fewer = here.fewer[place].as_ref().map(|fewer| &fewer.fit)?;
        let tangent = fewer.tangent(self.problem, self.part)?;
        let rest = omnibus(self.problem, fewer, &tangent);
        let scores = self.scores(fewer, &tangent, &here.trial.fit);
        Some(refit(self.problem, fewer, &scores, rest, Breadth::INSTEAD, self.part, here.trial.fit.cost))
    }

    /// What a mechanism of the model is a kind of, or what is a kind of it, begins where that one has come to: it can hardly be worse.
    fn meet_kin(&mut self, here: &Standing) {
        let layout = &here.trial.fit.layout;
        for (place, entrant) in here.entrants().iter().enumerate() {
            let Some(fewer) = here.fewer[place].as_ref().map(|fewer| &fewer.fit.layout) else { continue };
            let effect = layout.effect(self.problem, place, &here.trial.fit.point);
            for other in remaining(self.mechanisms, &here.trial.fit) {
                let differs = entrant.scope == Scope::EachConfiguration;
                let is_own = matches!(entrant.scope, Scope::EachRecording(_));
                if !is_kin(effect.mechanism(), other)
                    || (differs && other.by_configuration.is_empty())
                    || (is_own && other.by_recording.is_empty())
                {
                    continue;
                }
                let begun = Entrant { effect: with_values_of(other, &effect), ..entrant.clone() };
                let layout = fewer.with(self.problem, begun);
                let start = layout.start_from(self.problem, &here.trial.fit.layout, &here.trial.fit.point);
                let fit = Fit::run(self.problem, layout, start, self.part, Effort::FULL);
                self.rivals.extend(fit.map(|fit| (place, Trial::new(self.problem, fit))));
            }
        }
    }

    /// Scores beside a fit, of all mechanisms that another one has not.
    fn scores(&self, fit: &Fit, tangent: &Tangent, other: &Fit) -> Vec<Screened> {
        let reach = Reach::of(self.problem, fit.lines_hz(self.problem));
        screen(self.problem, fit, tangent, &reach, &remaining(self.mechanisms, other))
    }

    /// What acts in one configuration only, where the baseline has a mass there that nobody stated: beside what the others tell, and that mass as stated. Above
    /// the cost `wanted` nothing matters.
    fn beside_other_configurations(&self, wanted: f64) -> Vec<Trial> {
        let retuned = &self.retuned.trial.fit;
        let is_off = |configuration: &usize| retuned.strayed_mass(*configuration) > IMPOSSIBLE;
        let beside = |configuration: usize| {
            let base = told_by_others(self.problem, retuned, configuration)?;
            let tangent = base.tangent(self.problem, self.part)?;
            let mut scores = self.scores(&base, &tangent, &base);
            scores.retain(|score| score.entrant.scope == Scope::Configuration(configuration));
            Some(begun_at_likely_strengths(self.problem, &base, &scores, self.part, wanted))
        };
        (0..self.problem.configurations.len()).filter(is_off).filter_map(beside).flatten().collect()
    }

    /// A model whose last mechanism may be another in each configuration, if it is better by as much as a further mechanism has to
    /// be; at all, where it has been another in each recording. (Balls in one campaign, of which some are light: what acts in some recordings only may
    /// act in all, differently.)
    fn differing(&self, here: Standing) -> Option<Standing> {
        let last = here.mechanisms() - 1;
        self.differing_at(here, last)
    }

    /// The same of the mechanism in a place.
    fn differing_at(&self, here: Standing, place: usize) -> Option<Standing> {
        let trial = self.differently(here.trial.clone(), place);
        let enough = match here.entrants()[place].scope {
            Scope::EachRecording(_) => 0.0,
            // On a rig that is not the stated one it is alike only by what it makes of the masses.
            _ if here.trial.fit.strayed() > IMPOSSIBLE => ENOUGH,
            _ if here.asks() => ENOUGH + FURTHER * self.gained(&here.trial),
            _ => UNASKED + FURTHER * self.gained(&here.trial),
        };
        if here.trial.bic - trial.bic <= enough { Some(here) } else { Standing::of(self.problem, trial, self.part) }
    }

    /// The same with that, if it is any better.
    fn differently(&self, trial: Trial, place: usize) -> Trial {
        let layout = &trial.fit.layout;
        let may_differ = |entrant: &&Entrant| {
            let may_differ = !entrant.effect.mechanism().by_configuration.is_empty();
            may_differ && entrant.scope != Scope::EachConfiguration && self.problem.configurations.len() > 1
        };
        let Some(entrant) = layout.entrants.get(place).filter(may_differ) else { return trial };
        let mut effect = layout.effect(self.problem, place, &trial.fit.point);
        for (place, parameter) in effect.mechanism().parameters.iter().enumerate() {
            // What is of one configuration is then of every one.
            if matches!(parameter.search, Search::Whole(_)) {
                let _ = effect.set_value(place, parameter.range.0);
            }
        }
        let entrant = Entrant { effect, scope: Scope::EachConfiguration, own: entrant.own.clone() };
        self.freed(&trial.fit, place, entrant).filter(|freed| freed.bic < trial.bic).unwrap_or(trial)
    }

    /// A model with another entrant in one place, fitted from where it is.
    fn freed(&self, fit: &Fit, place: usize, entrant: Entrant) -> Option<Trial> {
        let layout = fit.layout.in_place(self.problem, place, entrant);
        let start = layout.start_from(self.problem, &fit.layout, &fit.point);
        let fit = Fit::run(self.problem, layout, start, self.part, Effort::FULL)?;
        Some(Trial::new(self.problem, fit))
    }

    /// Whether one more mechanism, alike everywhere, leaves nothing of what a model leaves, and brings more than chance does.
    fn solves(&self, here: &Standing, larger: &Trial) -> bool {
        let enough = if here.asks() { ENOUGH } else { ALIKE } + SOLVED * self.approximated(here);
        here.trial.bic - larger.bic >= enough
            && added(&larger.fit).is_alike_everywhere()
            && larger.coincidences.is_empty()
            && larger.fit.tangent(self.problem, self.part).is_some_and(|tangent| {
                let rest = omnibus(self.problem, &larger.fit, &tangent);
                is_but_noise(rest, oddity(self.problem, &larger.fit))
            })
    }

    /// Whether what is observed alone, beside further channels, shows that a larger model is worth it: this much and this part of what the smaller one
    /// has gained there. A gauge of 10 µm beside a long free flight gains a hundred times as much as the force does, and 2 % of that is all; what is
    /// observed gains hundreds of times as much, too, since a rig without mechanisms gives it up for the gauge's sake.
    fn is_seen(&self, smaller: &Trial, larger: &Trial, least: f64, part: f64) -> bool {
        let gained = (self.missed_without() - self.missed(&smaller.fit)).max(0.0);
        self.observed_by_itself.is_some()
            && smaller.bic - larger.bic >= least
            && self.missed(&smaller.fit) - self.missed(&larger.fit) >= least + part * gained
    }

    /// The model with only those of its mechanisms that are needed beside the others.
    fn needed(&self, mut here: Standing) -> Option<Standing> {
        let is_solved =
            here.entrants().iter().all(Entrant::is_alike_everywhere) && is_but_noise(here.rest, here.oddity);
        let part = if is_solved { SOLVED } else { FURTHER };
        let enough = ENOUGH + part * self.approximated(&here);
        while here.mechanisms() > 1 {
            match here.smaller() {
                Some(trial)
                    if trial.bic < here.trial.bic + enough && !self.is_seen(trial, &here.trial, ENOUGH, part) =>
                {
                    here = Standing::of(self.problem, trial.clone(), self.part)?;
                }
                _ => break,
            }
        }
        Some(here)
    }
}

/// Whether no place and not all places together have more than noise left.
fn is_but_noise(rest: Omnibus, oddity: Oddity) -> bool {
    rest.z() < NOTHING && oddity.p_value > UNLIKELY
}

/// Whether of two mechanisms at one site one has all parameters of the other, and more: it is more general.
fn is_kin(one: &Mechanism, other: &Mechanism) -> bool {
    is_plainer(one, other) || is_plainer(other, one)
}

/// Whether a mechanism has no parameter that another one at its site has not.
fn is_plainer(this: &Mechanism, than: &Mechanism) -> bool {
    let has = |name: &str| than.parameters.iter().any(|parameter| parameter.name == name);
    this.id != than.id && this.site == than.site && this.parameters.iter().all(|parameter| has(parameter.name))
}

/// A mechanism with what another one has in common with it, and else as it typically is.
fn with_values_of(mechanism: &'static Mechanism, other: &Effect) -> Effect {
    let mut effect = mechanism.typical();
    for (place, parameter) in mechanism.parameters.iter().enumerate() {
        if let Ok(value) = other.get(parameter.name) {
            // Outside of its own range it stays typical.
            let _ = effect.set_value(place, value);
        }
    }
    effect
}

fn remaining(mechanisms: &[&'static Mechanism], fit: &Fit) -> Vec<&'static Mechanism> {
    let taken =
        |mechanism: &Mechanism| fit.layout.entrants.iter().any(|entrant| entrant.effect.mechanism().id == mechanism.id);
    mechanisms.iter().copied().filter(|mechanism| !taken(mechanism)).collect()
}

/// The model without the mechanism in one place.
fn without(problem: &Problem, trial: &Trial, place: usize, part: Part<'_>) -> Option<Trial> {
    let layout = trial.fit.layout.without(problem, place);
    let start = layout.start_from(problem, &trial.fit.layout, &trial.fit.point);
    Fit::run(problem, layout, start, part, Effort::FULL).map(|fit| Trial::new(problem, fit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticking_is_a_kind_of_rubbing_and_begins_where_that_has_come_to() {
        let [rubs, sticks, wrong_gain, wrong_speed] =
            ["guide-friction", "stiction", "gain-error", "speed-error"].map(|id| Mechanism::find(id).unwrap());
        assert!(is_kin(rubs, sticks) && is_kin(sticks, rubs));
        assert!(is_plainer(rubs, sticks) && !is_plainer(sticks, rubs));
        assert!(!is_kin(wrong_gain, wrong_speed), "a gain is no kind of speed, though both are relative");
        let rubbing =
            Effect::new("guide-friction", &[("force_N", 0.7), ("guide", 1.0), ("presliding_m", 4e-6)]).unwrap();
        let sticking = with_values_of(sticks, &rubbing);
        for name in ["force_N", "guide", "presliding_m", "cell_share"] {
            assert_eq!(sticking.get(name).unwrap(), rubbing.get(name).unwrap(), "{name}");
        }
        assert_eq!(sticking.get("static_ratio").unwrap(), sticks.typical().get("static_ratio").unwrap());
    }
}
