//! What speaks for and against each mechanism that was tried: its score, what re-tuning could imitate of it, and how it does in the
//! place of one that was chosen.

use thud_sim::mechanism::{Mechanism, Search};

use super::Diagnosis;
use super::layout::Scope;
use super::screen::Screened;
use super::select::{Trial, by_chance};
use super::verdict::twins;

/// A score from which a mechanism that is there is hardly missed: on recordings that hide nothing, the largest of all scores stays
/// below it in 99 of 100 campaigns.
pub const SEEN: f64 = 5.5;

/// What became of a mechanism.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It is in the chosen model, in this place.
    Named(usize),
    /// These recordings cannot tell it from the one in the chosen model with this id.
    Twin(&'static str),
    /// It was tried and not taken.
    Rejected,
}

/// How a mechanism does in the place of a chosen one, or, where nothing was chosen, added to the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contest {
    /// The one it stands in for; none: it is added.
    pub instead_of: Option<&'static str>,
    /// χ² of the model with it less that of the chosen model.
    pub chi_squared: f64,
    /// The same for BIC.
    pub bic: f64,
    /// Parameters more than the chosen model.
    pub parameters: i64,
    /// Where it is added: in which part of trials chance does as much; none where that is not known.
    pub by_chance: Option<f64>,
    /// Where what is observed hardly shows it: by how much χ² of what is observed falls with it.
    pub trace: Option<f64>,
}

/// The smallest strength that would have been seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Name of the strength.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Whether larger values are less of the mechanism, as of a time constant.
    pub upwards_is_less: bool,
}

/// The evidence on one mechanism.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Which.
    pub mechanism: &'static Mechanism,
    /// What became of it.
    pub standing: Standing,
    /// Its best score against the re-tuned baseline, in standard deviations; none: it changes nothing that could be seen.
    pub score: Option<f64>,
    /// The part of its signature that re-tuning imitates.
    pub absorbed: Option<f64>,
    /// What would have been seen of it; none where its strength is no matter of degree or not possible.
    pub limit: Option<Limit>,
    /// How it does when refitted; none: it was not.
    pub contest: Option<Contest>,
}

/// The evidence on every mechanism that was tried: the chosen ones in their order, then the nearest rivals, then by score.
#[must_use]
pub fn evidence(diagnosis: &Diagnosis) -> Vec<Evidence> {
    let selection = &diagnosis.selection;
    let chosen = &selection.best.fit.layout.entrants;
    let mut all: Vec<Evidence> = diagnosis
        .tried
        .iter()
        .map(|mechanism| {
            let screened = selection.screened.iter().filter(|s| s.entrant.effect.mechanism().id == mechanism.id);
            let best = screened.max_by(|a, b| a.z.total_cmp(&b.z));
            let place = chosen.iter().position(|entrant| entrant.effect.mechanism().id == mechanism.id);
            let twin = || {
                (0..chosen.len())
                    .find(|place| twins(selection, *place).iter().any(|(id, _)| *id == mechanism.id))
                    .map(|place| Standing::Twin(chosen[place].effect.mechanism().id))
            };
            Evidence {
                mechanism,
                standing: place.map_or_else(|| twin().unwrap_or(Standing::Rejected), Standing::Named),
                score: best.map(|screened| screened.z),
                absorbed: best.map(|screened| screened.absorbed),
                limit: best.and_then(limit),
                contest: contest(diagnosis, mechanism),
            }
        })
        .collect();
    let rank = |evidence: &Evidence| match evidence.standing {
        Standing::Named(place) => (0, place as f64),
        Standing::Twin(_) => (1, evidence.contest.map_or(f64::INFINITY, |contest| contest.bic)),
        Standing::Rejected => match evidence.contest {
            Some(contest) => (2, contest.bic),
            None => (3, -evidence.score.unwrap_or(f64::NEG_INFINITY)),
        },
    };
    all.sort_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    all
}

/// The best model that has the mechanism and is not the chosen one.
fn contest(diagnosis: &Diagnosis, mechanism: &Mechanism) -> Option<Contest> {
    let best = &diagnosis.selection.best;
    let chosen = &best.fit.layout.entrants;
    let has = |trial: &Trial| {
        trial.fit.layout.entrants.iter().any(|entrant| entrant.effect.mechanism().id == mechanism.id)
            && chosen.iter().all(|entrant| entrant.effect.mechanism().id != mechanism.id)
    };
    let rivals = diagnosis.selection.rivals.iter().map(|(_, trial)| (trial, None));
    let traces = diagnosis.selection.traces.iter().map(|(trial, seen)| (trial, Some(*seen)));
    let theirs = rivals.chain(traces).filter(|(trial, _)| has(trial));
    let (trial, trace) = theirs.min_by(|(a, _), (b, _)| a.bic.total_cmp(&b.bic))?;
    let theirs = &trial.fit.layout.entrants;
    let missing = chosen.iter().find(|entrant| theirs.iter().all(|other| !other.is_same_as(entrant)));
    Some(Contest {
        instead_of: missing.map(|entrant| entrant.effect.mechanism().id),
        chi_squared: trial.fit.cost - best.fit.cost,
        bic: trial.bic - best.bic,
        parameters: trial.fit.parameters() as i64 - best.fit.parameters() as i64,
        by_chance: if missing.is_none() { by_chance(&diagnosis.problem, &best.fit, &trial.fit) } else { None },
        trace,
    })
}

/// The strength whose signature, freed of what re-tuning imitates, has the norm [`SEEN`].
fn limit(screened: &Screened) -> Option<Limit> {
    let mechanism = screened.tried.mechanism();
    let parameter = &mechanism.parameters[0];
    let null = parameter.null?;
    if parameter.search != Search::Strength || screened.visible <= 0.0 {
        return None;
    }
    let tried = screened.tried.value(0);
    let times = SEEN / screened.visible;
    let value = if null.is_infinite() { tried / times } else { null + (tried - null) * times };
    let upwards_is_less = null.is_infinite() || (null > tried);
    parameter.permits(value).then_some(Limit { name: parameter.name, unit: parameter.unit, value, upwards_is_less })
}

/// Where a chosen mechanism acts, for people; empty: everywhere.
#[must_use]
pub fn scope_words(diagnosis: &Diagnosis, scope: Scope) -> String {
    match scope {
        Scope::Everywhere => String::new(),
        Scope::EachConfiguration => "in each configuration as it is there".to_owned(),
        Scope::Configuration(number) => {
            let name = diagnosis.problem.configurations.get(number).map_or("?", String::as_str);
            format!("in configuration {name} only")
        }
        Scope::EachRecording(some) if some.len() == diagnosis.problem.recordings.len() => {
            "in each recording as it is there".to_owned()
        }
        Scope::Recordings(some) | Scope::EachRecording(some) => {
            let names: Vec<String> =
                some.iter().map(|number| diagnosis.problem.recordings[number].name.clone()).collect();
            let word = if names.len() == 1 { "recording" } else { "recordings" };
            let only = if matches!(scope, Scope::EachRecording(_)) { ", in each as it is there" } else { " only" };
            format!("in {word} {}{only}", super::words::listed(&names, "and"))
        }
    }
}
