//! From numbers to one of four words.
//!
//! | | |
//! |---|---|
//! | `consistent` | nothing was needed, and nothing is left |
//! | `named` | these mechanisms, and nothing significant is left |
//! | `ambiguous` | at least one of them is known only up to a set |
//! | `unexplained` | something significant is left that no mechanism of the list explains, or only one in a shape that nothing has, one of several in recordings that have nothing in common, or one on a rig that is not the stated one |

use thud_sim::mechanism::{Mechanism, Parameter, Scale};

use super::fit::Fit;
use super::layout::{Entrant, Point, coordinate_of, value_of};
use super::omnibus::Omnibus;
use super::select::{Selection, Trial, WITHIN_REACH};

/// A rest is significant from here, in standard deviations of the omnibus test.
pub const SIGNIFICANT: f64 = 6.0;
/// What is odd in one place (a phase, a recording, a band, a moment) speaks from this p on. Of 500 campaigns with traces of the usual
/// imperfections the oddest had 1.5e-4, the next 3.5e-3; of 240 with one effect 7 had less than 1e-7, and three of these the
/// right name and nothing else.
pub const UNLIKELY: f64 = 1e-7;
/// And worth a word from this part of what the baseline leaves. No rig is quite like an equation: of the effects that the concealing
/// simulator hides, one in ten leaves 1 to 4 % of itself beyond the mechanism that it is; of those that the list does not know half
/// leave more than 5 %.
pub const WORTH: f64 = 0.02;

/// No rig is quite like an equation: of two that differ by less than this part of what both explain there,
/// either may be it.
const LIKENESS: f64 = 0.015;

/// And of two of which the second leaves no more than this of χ² beyond the first, whatever it has more to bend, the recordings exclude
/// neither: two standard deviations. (What has values of its own for each impact is as good as anything.)
pub const AS_GOOD: f64 = 4.0;

/// A shape this far beyond what is likely is far: in natural logarithms, or in widths of what is likely.
const FAR: f64 = 0.9;
/// And from here on where it is surely beyond: of 43 wrong names of three simulators nine were, of 166 right ones five, of which four asked for another range.
const SURELY_FAR: f64 = 0.3;
/// Surely, by this many of its own deviations.
const SURELY: f64 = 3.0;
/// A strength may be as little as can be seen, but this far above what is likely, in natural logarithms, it is something else's.
const TOO_STRONG: f64 = 1.0;

/// What is re-estimated by so many of its stated deviations is not what was stated. Of some hundred right names the farthest went
/// 5.7 of them; of 68 models of what the list does not have five went 6 to 18.
pub const IMPOSSIBLE: f64 = 6.0;

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
/// relaxation within a tenth of a millisecond is no rubber's, a gap of 3 µm none. (A strength that is no thing's size may be as little as it likes.)
#[must_use]
pub fn unlikely(selection: &Selection, place: usize) -> Option<Unlikely> {
    let deviations = selection.deviations.as_ref()?;
    shapes(&selection.best.fit, place)
        .filter(|shape| shape.is_surely_far() && shape.beyond > SURELY * deviations[shape.global] / shape.width)
        .max_by(|a, b| a.beyond.total_cmp(&b.beyond))
        .map(|shape| Unlikely {
            name: shape.parameter.name,
            unit: shape.parameter.unit,
            value: value_of(shape.parameter, selection.best.fit.point.globals[shape.global]),
            likely: shape.parameter.plausible,
        })
}

/// Whether no shape of a fit's mechanisms is far from anything likely.
#[must_use]
pub fn is_likely(fit: &Fit) -> bool {
    all_shapes(fit).all(|shape| shape.beyond <= FAR.max(shape.far))
}

/// The same where its shapes are known: whether none is far then.
#[must_use]
pub fn is_quite_likely(fit: &Fit) -> bool {
    !all_shapes(fit).any(|shape| shape.is_surely_far())
}

/// Where a fit is, but for shapes that are far from anything likely: these are at the end of what is.
#[must_use]
pub fn made_likely(fit: &Fit) -> Point {
    let mut point = fit.point.clone();
    for Shape { parameter, global, .. } in all_shapes(fit).filter(Shape::is_surely_far) {
        let (low, high) = parameter.plausible;
        let here = &mut point.globals[global];
        *here = here.clamp(coordinate_of(parameter, low), coordinate_of(parameter, high));
    }
    point
}

/// A parameter that shapes a mechanism.
struct Shape {
    parameter: &'static Parameter,
    /// Which global coordinate it is.
    global: usize,
    /// What distances of that coordinate are counted in.
    width: f64,
    /// How far it is beyond what is likely.
    beyond: f64,
    /// From where on that is far, if it is surely so.
    far: f64,
}

impl Shape {
    fn is_surely_far(&self) -> bool {
        self.beyond > self.far
    }
}

/// The shapes of all mechanisms of a fit.
fn all_shapes(fit: &Fit) -> impl Iterator<Item = Shape> {
    (0..fit.layout.entrants.len()).flat_map(|place| shapes(fit, place))
}

/// The shapes of the mechanism in one place of a fit.
fn shapes(fit: &Fit, place: usize) -> impl Iterator<Item = Shape> {
    let Mechanism { parameters, sized, .. } = fit.layout.entrants[place].effect.mechanism();
    fit.layout.globals.iter().zip(&fit.point.globals).enumerate().filter_map(move |(global, (coordinate, here))| {
        let number = coordinate.role.place().filter(|_| coordinate.role.entrant() == Some(place))?;
        let parameter = &parameters[number];
        let (low, high) = parameter.plausible;
        let (from, to) = (coordinate_of(parameter, low), coordinate_of(parameter, high));
        let width = if parameter.scale == Scale::Logarithmic { 1.0 } else { to - from };
        let is_sized = sized.contains(&parameter.name);
        let (beyond, far) = match parameter.null {
            // A size is known no better than what it makes a frequency with, which is only likely.
            _ if is_sized => ((from - here).max(here - to), FAR),
            None => {
                // What may be nothing at all, as a loss may, cannot be too little.
                let too_little = if parameter.range.0 == 0.0 { f64::NEG_INFINITY } else { from - here };
                (too_little.max(here - to), SURELY_FAR)
            }
            Some(0.0) if parameter.scale == Scale::Logarithmic => (here - to, TOO_STRONG),
            Some(_) => return None,
        };
        Some(Shape { parameter, global, width, beyond: beyond / width, far })
    })
}

/// Whether something significant is left that is worth a word, or is called by a name that cannot be its.
#[must_use]
pub fn remains(selection: &Selection) -> bool {
    is_worth_a_word(selection, rest_share(selection)) || is_of_another_rig(selection)
}

/// Whether nothing is left beside the chosen model that is worth a word, whatever its names are worth.
#[must_use]
pub fn leaves_nothing(selection: &Selection) -> bool {
    balances(selection)
        .iter()
        .all(|Balance { left, gained }| *left == 0.0 || !is_worth_a_word(selection, left / (left + gained)))
}

/// The equations of each mechanism have their own error.
fn is_worth_a_word(selection: &Selection, share: f64) -> bool {
    share > WORTH * selection.best.fit.layout.entrants.len().max(1) as f64
}

/// Whether the chosen model, and every one that the recordings cannot tell from it, asks for a rig or masses that are not what was stated.
#[must_use]
pub fn is_of_another_rig(selection: &Selection) -> bool {
    let best = &selection.best.fit;
    let possible = |(_, trial): (_, &Trial)| trial.fit.strayed() <= IMPOSSIBLE;
    best.strayed() > IMPOSSIBLE
        && !(0..best.layout.entrants.len()).any(|place| within_reach(selection, place).any(possible))
}

/// What is left, as far as it is significant (the excess of the rest, of its oddest place or of the mains in the quiet), and what the mechanisms have
/// taken off χ².
struct Balance {
    left: f64,
    gained: f64,
}

/// Of all channels together; beside further ones, of what is observed alone, too. (A gauge of 10 µm beside a long free flight is told something by the
/// smallest step of the speed, and a fiftieth of that hides whatever the force shows.)
fn balances(selection: &Selection) -> Vec<Balance> {
    let odd = if selection.oddity.p_value < UNLIKELY { selection.oddity.excess } else { 0.0 };
    let hum = if selection.hum.is_there() { selection.hum.excess } else { 0.0 };
    let balance = |rest: &Omnibus, gained: f64| {
        let together = if rest.z() > SIGNIFICANT { rest.excess } else { 0.0 };
        Balance { left: together.max(odd).max(hum), gained: gained.max(0.0) }
    };
    let all = balance(&selection.rest, selection.baseline.cost - selection.best.fit.cost);
    let observed = selection.observed.as_ref().map(|observed| balance(&observed.rest, observed.gained));
    std::iter::once(all).chain(observed).collect()
}

/// The part of what the baseline leaves that is still left, as far as it is significant; and what mechanisms of unlikely shape, or on another
/// rig than the stated one, have taken off.
#[must_use]
pub fn rest_share(selection: &Selection) -> f64 {
    // One in whose place a likelier one may be is known up to a set, not wrong.
    let likelier = |place: usize| {
        let mut rivals = within_reach(selection, place);
        rivals.any(|(_, trial)| trial.coincidences.is_empty() && is_likely(&trial.fit))
    };
    let elsewhere = is_of_another_rig(selection);
    let misnamed = |place: &usize| elsewhere || is_doubtful(selection, *place) && !likelier(*place);
    let misnamed: Vec<usize> = (0..selection.best.fit.layout.entrants.len()).filter(misnamed).collect();
    let share = |Balance { left, gained }: Balance| {
        let of_place = |place: &usize| selection.worth.get(*place).map_or(gained, |worth| worth.clamp(0.0, gained));
        let unnamed = left + misnamed.iter().map(of_place).sum::<f64>().min(gained);
        if unnamed == 0.0 { 0.0 } else { unnamed / (left + gained) }
    };
    balances(selection).into_iter().map(share).fold(0.0, f64::max)
}

/// Whether the mechanism in this place is rather something that looks like it: its shape is unlikely, its choice of recordings or that of an event in each.
#[must_use]
pub fn is_doubtful(selection: &Selection, place: usize) -> bool {
    unlikely(selection, place).is_some() || is_doubtful_choice(selection, place)
}

/// Whether the mechanism in this place would have to choose its recordings, or an event in each, which is believed only of one that explains everything by itself and
/// that nothing else can stand in for: whoever did the test may know what those recordings have in common.
#[must_use]
pub fn is_doubtful_choice(selection: &Selection, place: usize) -> bool {
    let Trial { fit, coincidences, .. } = &selection.best;
    coincidences.contains(&place) && (fit.layout.entrants.len() > 1 || !twins(selection, place).is_empty())
}

/// Mechanisms that these recordings cannot tell from the one in this place: id and gap in BIC, nearest first.
#[must_use]
pub fn twins(selection: &Selection, place: usize) -> Vec<(&'static str, f64)> {
    let mut twins: Vec<(&'static str, f64)> = Vec::new();
    for (id, trial) in within_reach(selection, place) {
        let gap = trial.bic - selection.best.bic;
        match twins.iter_mut().find(|(known, _)| *known == id) {
            Some((_, known)) => *known = known.min(gap),
            None => twins.push((id, gap)),
        }
    }
    twins.sort_by(|a, b| a.1.total_cmp(&b.1));
    twins
}

/// Models with another mechanism in this place that are as good, and which it is.
fn within_reach(selection: &Selection, place: usize) -> impl Iterator<Item = (&'static str, &Trial)> {
    let observed = selection.observed.as_ref().map_or(f64::INFINITY, |observed| observed.gained.max(0.0));
    let worth = selection.worth.get(place).map_or(0.0, |worth| worth.min(observed));
    let reach = WITHIN_REACH.max(LIKENESS * worth);
    let Trial { fit: best, bic, .. } = &selection.best;
    let chosen = &best.layout.entrants;
    let mechanism = |entrant: &Entrant| entrant.effect.mechanism();
    let in_place = move |(of, trial): &&(usize, Trial)| *of == place && trial.fit.layout.entrants.len() == chosen.len();
    // The chosen one need not have the lowest BIC; what bends to each impact has no say in it.
    let steady = selection.rivals.iter().filter(in_place).filter(|(_, trial)| !trial.fit.layout.is_loose());
    let lowest = steady.map(|(_, trial)| trial.bic).fold(*bic, f64::min);
    selection.rivals.iter().filter(in_place).filter_map(move |(_, trial)| {
        let mut others = trial.fit.layout.entrants.iter();
        let other = others.find(|other| chosen.iter().all(|chosen| mechanism(chosen).id != mechanism(other).id))?;
        let as_good = !other.is_loose() && trial.fit.cost - best.cost < AS_GOOD;
        (as_good || trial.bic - lowest < reach).then_some((mechanism(other).id, trial))
    })
}
