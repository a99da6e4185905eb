//! From numbers to one of four words.
//!
//! | | |
//! |---|---|
//! | `consistent` | nothing was needed, and nothing is left |
//! | `named` | these mechanisms, and nothing significant is left |
//! | `ambiguous` | at least one of them is known only up to a set |
//! | `unexplained` | something significant is left that no mechanism of the list explains, or only one in a shape that nothing has |

use thud_sim::mechanism::Scale;

use super::layout::{Role, coordinate_of, value_of};
use super::select::{Selection, WITHIN_REACH};

/// A rest is significant from here, in standard deviations of the omnibus test.
pub const SIGNIFICANT: f64 = 6.0;
/// One recording alone speaks from this p on: beyond what traces of hum and drift do.
pub const UNLIKELY: f64 = 1e-8;
/// And worth a word from this part of what the baseline leaves. No rig is quite like an equation: of the effects that the concealing
/// simulator hides, one in ten leaves 1 to 4 % of itself beyond the mechanism that it is; of those that the list does not know half
/// leave more than 5 %.
const WORTH: f64 = 0.02;

/// No rig is quite like an equation: of two that differ by less than this part of what both explain there,
/// either may be it.
const LIKENESS: f64 = 0.015;

/// A shape this far beyond what is likely is far: in natural logarithms, or in widths of what is likely.
const FAR: f64 = 0.9;
/// And surely so where it is this many of its own deviations.
const SURELY: f64 = 6.0;

/// The verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The simulation holds.
    Consistent,
    /// These mechanisms are missing from it.
    Named,
    /// Some are known up to a set only.
    Ambiguous,
    /// Something is missing that is not in the list.
    Unexplained,
}

impl Verdict {
    /// The contract's word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Named => "named",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }

    /// Of a selection.
    #[must_use]
    pub fn of(selection: &Selection) -> Self {
        let named = selection.best.fit.layout.entrants.len();
        if remains(selection) {
            Self::Unexplained
        } else if named == 0 {
            Self::Consistent
        } else if (0..named).any(|place| !twins(selection, place).is_empty()) {
            Self::Ambiguous
        } else {
            Self::Named
        }
    }
}

/// A shape that a mechanism has taken and that nothing likely has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unlikely {
    /// Name of the parameter.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// What is likely.
    pub likely: (f64, f64),
}

/// The shape of the mechanism in this place that is surely far from anything likely. Such a mechanism is a name for something else: a
/// relaxation within a tenth of a millisecond is no rubber's. (A strength may be anything.)
#[must_use]
pub fn unlikely(selection: &Selection, place: usize) -> Option<Unlikely> {
    let fit = &selection.best.fit;
    let deviations = selection.deviations.as_ref()?;
    let parameters = fit.layout.entrants.get(place)?.effect.mechanism().parameters;
    let globals = fit.layout.globals.iter().zip(&fit.point.globals).zip(deviations.iter());
    globals
        .filter_map(|((coordinate, here), sd)| match coordinate.role {
            Role::Mechanism { entrant, place: number } if entrant == place => Some((&parameters[number], *here, *sd)),
            _ => None,
        })
        .filter(|(parameter, ..)| parameter.null.is_none())
        .map(|(parameter, here, sd)| {
            let (low, high) = parameter.plausible;
            let (from, to) = (coordinate_of(parameter, low), coordinate_of(parameter, high));
            let unit = if parameter.scale == Scale::Logarithmic { 1.0 } else { to - from };
            let beyond = (from - here).max(here - to) / unit;
            let value = value_of(parameter, here);
            (beyond, sd / unit, Unlikely { name: parameter.name, unit: parameter.unit, value, likely: (low, high) })
        })
        .filter(|(beyond, sd, _)| *beyond > FAR && *beyond > SURELY * sd)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(.., unlikely)| unlikely)
}

/// Whether something significant is left that is worth a word, or is called by a name that cannot be its.
#[must_use]
pub fn remains(selection: &Selection) -> bool {
    // The equations of each mechanism have their own error.
    let mechanisms = selection.best.fit.layout.entrants.len().max(1);
    rest_share(selection) > WORTH * mechanisms as f64
}

/// The part of what the baseline leaves that is still left, as far as it is significant: the excess of the rest, or of one recording
/// alone, beside what the mechanisms have taken off χ²; and what mechanisms of unlikely shape have taken off.
#[must_use]
pub fn rest_share(selection: &Selection) -> f64 {
    let together = if selection.rest.z() > SIGNIFICANT { selection.rest.excess } else { 0.0 };
    let alone = if selection.alone.p_value < UNLIKELY { selection.alone.excess } else { 0.0 };
    let left = together.max(alone);
    let gained = (selection.baseline.cost - selection.best.fit.cost).max(0.0);
    let misnamed = |place: &usize| unlikely(selection, *place).is_some();
    let of_place = |place: usize| selection.worth.get(place).map_or(gained, |worth| worth.clamp(0.0, gained));
    let places = 0..selection.best.fit.layout.entrants.len();
    let unnamed = left + places.filter(misnamed).map(of_place).sum::<f64>().min(gained);
    if unnamed == 0.0 { 0.0 } else { unnamed / (left + gained) }
}

/// Mechanisms that these recordings cannot tell from the one in this place: id and gap in BIC, nearest first.
#[must_use]
pub fn twins(selection: &Selection, place: usize) -> Vec<(&'static str, f64)> {
    let mut twins: Vec<(&'static str, f64)> = Vec::new();
    let reach = WITHIN_REACH.max(LIKENESS * selection.worth.get(place).copied().unwrap_or(0.0));
    let chosen = &selection.best.fit.layout.entrants[place];
    for (of, trial) in &selection.rivals {
        let gap = trial.bic - selection.best.bic;
        let Some(rival) = trial.fit.layout.entrants.last() else { continue };
        let id = rival.effect.mechanism().id;
        let same_size = trial.fit.layout.entrants.len() == selection.best.fit.layout.entrants.len();
        if *of == place && same_size && gap < reach && id != chosen.effect.mechanism().id {
            match twins.iter_mut().find(|(known, _)| *known == id) {
                Some((_, known)) => *known = known.min(gap),
                None => twins.push((id, gap)),
            }
        }
    }
    twins.sort_by(|a, b| a.1.total_cmp(&b.1));
    twins
}
