//! Where each recording has lost samples, and how much: sought anew at the strength that a fit has found.
//!
//! ```text
//! a fit with one length for all ─▶ each instant where it fits best (placed)
//!                               ─▶ instant, length and contact of each recording, of the recordings that ask for any (each_its_own)
//!                          ─▶ further gaps of one length, in the recordings that ask for them (several)
//! ```
//!
//! A signature is placed where it fits best at the strength that it is tried with. From there strength and instants move together, and χ² over an
//! instant is flat between the samples and steep across them: a fit that begins with a third of what was lost ends beside where it was lost. What
//! comes after a gap in the log stands too early; a fit that has not found the gap has moved the contact for it, by as much as was lost at most.

use rayon::prelude::*;
use thud_sim::mechanism::Search;
use thud_sim::rig::Impact;

use super::fit::{Effort, Fit, Part, cost_of_one};
use super::layout::{Entrant, Layout, Point, Role, Scope, shortest_s, value_of};
use super::predict::{self, Unlogged};
use super::problem::Problem;
use super::select::{ENOUGH, Trial};
use super::subset::Subset;

/// Instants that are tried over what a recording shows, and how often their distance is halved about the best.
const SPREAD: usize = 64;
/// The same for several gaps in a recording: what is lost just before the end of a contact shows between there and the end only.
const DENSELY: usize = 192;
const HALVINGS: i32 = 6;
/// An instant elsewhere that gains more than this in χ² was missed.
const MISSED: f64 = 1.0;
/// How often they are sought: with each round the strength is nearer to what it should be.
const ROUNDS: usize = 4;
/// Lengths that are tried in each recording, over the one that all have; its coordinate is a logarithm.
const LENGTHS: [f64; 6] = [0.25, 0.4, 0.63, 1.0, 1.6, 2.5];

/// The coordinates of one mechanism's gaps in a layout: of the first in each recording, or of a further one.
#[derive(Clone, Copy, Debug)]
struct Gaps {
    entrant: usize,
    /// Which local coordinate the instant is.
    instant: usize,
    /// And which one the contact.
    contact: usize,
    /// The coordinate of the length: a local one where each recording has its own.
    length: Place,
}

/// Where a coordinate is.
#[derive(Clone, Copy, Debug)]
enum Place {
    Global(usize),
    Local(usize),
}

/// A gap in a recording.
#[derive(Clone, Copy, Debug)]
struct Gap {
    /// χ² of the recording with it.
    cost: f64,
    /// Its instant, s after contact.
    instant_s: f64,
    /// Coordinate of its length.
    length: f64,
    /// By how much it moves the contact, s.
    shift_s: f64,
}

impl Gaps {
    /// Of all mechanisms of a layout that have instants.
    fn of(layout: &Layout) -> Vec<Self> {
        let local = |role: Role| layout.locals.iter().position(|coordinate| coordinate.role == role);
        let of_instant = |entrant: usize, place: usize| {
            let strength = Role::Mechanism { entrant, place: 0 };
            let global = || layout.globals.iter().position(|coordinate| coordinate.role == strength);
            Some(Self {
                entrant,
                instant: local(Role::Mechanism { entrant, place })?,
                contact: local(Role::Contact)?,
                length: local(strength).map(Place::Local).or_else(|| global().map(Place::Global))?,
            })
        };
        let of_entrant = |(number, entrant): (usize, &Entrant)| {
            let parameters = entrant.effect.mechanism().parameters.iter().enumerate();
            let instants = parameters.filter(|(_, parameter)| parameter.is_instant());
            instants.filter_map(|(place, _)| of_instant(number, place)).collect::<Vec<_>>()
        };
        layout.entrants.iter().enumerate().flat_map(of_entrant).collect()
    }

    fn length(self, point: &Point, recording: usize) -> f64 {
        match self.length {
            Place::Global(place) => point.globals[place],
            Place::Local(place) => point.locals[recording][place],
        }
    }

    /// The coordinate of the length that all recordings share.
    fn global(self) -> Option<usize> {
        match self.length {
            Place::Global(place) => Some(place),
            Place::Local(_) => None,
        }
    }

    /// A point with another gap in a recording.
    fn with(self, point: &Point, recording: usize, gap: Gap) -> Point {
        let mut point = point.clone();
        let locals = &mut point.locals[recording];
        locals[self.instant] = gap.instant_s;
        locals[self.contact] += gap.shift_s;
        match self.length {
            Place::Global(place) => point.globals[place] = gap.length,
            Place::Local(place) => locals[place] = gap.length,
        }
        point
    }

    /// A point with the gap of a recording at another instant, s after contact.
    fn at(self, point: &Point, recording: usize, instant_s: f64) -> Point {
        let mut point = point.clone();
        point.locals[recording][self.instant] = instant_s;
        point
    }

    /// The instant at which a gap, where there was none, takes most off what a fit of a recording leaves, to first order of all else. `None`: it cannot be
    /// simulated.
    fn most_asked_for(self, problem: &Problem, fit: &Fit, recording: usize) -> Option<f64> {
        let Fit { layout, point, .. } = fit;
        let motion = predict::strike(problem, layout, point, recording).ok()?;
        let tangent = fit.tangent(problem, &[recording])?;
        let normal = tangent.normal(0.0)?;
        let shown = |point: &Point| predict::through(problem, layout, point, recording, &motion).ok();
        let unlogged = predict::unlogged(problem, layout, point, recording, &shown(point)?, 0.0);
        let gains = |instant_s: f64| {
            let values = unlogged.clone().logged(problem, &shown(&self.at(point, recording, instant_s))?);
            let mut change: Vec<f64> =
                values.iter().zip(&fit.model[recording]).map(|(with, without)| with - without).collect();
            problem.recordings[recording].whiten(&mut change);
            let (global, locals) = tangent.transposed(std::slice::from_ref(&change));
            let imitated = tangent.times(&normal.solve(&global, &locals)).pop()?;
            let along = |with: &[f64]| change.iter().zip(with).map(|(a, b)| a * b).sum::<f64>();
            Some((2.0 * along(&fit.residuals[recording]) - along(&change) + along(&imitated), instant_s))
        };
        let better =
            |best: (f64, f64), instant_s: f64| gains(instant_s).filter(|other| other.0 > best.0).unwrap_or(best);
        let apart_s = problem.eventful_s(recording) / DENSELY as f64;
        let spread = (0..DENSELY).map(|place| apart_s * (place as f64 + 0.5));
        let mut best = spread.fold((f64::NEG_INFINITY, 0.0), better);
        for halving in 1..=HALVINGS {
            let nearer_s = apart_s * 0.5_f64.powi(halving);
            best = [best.1 - nearer_s, best.1 + nearer_s].into_iter().fold(best, better);
        }
        Some(best.1)
    }

    /// The gap of these lengths, over the one at a point, that fits a recording best: instants spread over what the recording shows, with the contact
    /// where it is and as much sooner or later as is lost, and ever nearer to the best of these.
    fn best(self, sought: &Sought<'_>, recording: usize, lengths: &[f64]) -> Gap {
        let Sought { problem, layout, point, .. } = *sought;
        let apart_s = problem.eventful_s(recording) / SPREAD as f64;
        let strength = &layout.entrants[self.entrant].effect.mechanism().parameters[0];
        let seconds = |length: f64| value_of(strength, length);
        let at = |gap: Gap| {
            let cost = Sought { point: &self.with(point, recording, gap), ..*sought }.cost(recording);
            Gap { cost, ..gap }
        };
        // Until it comes to the log the instant of a gap makes no difference.
        let spread = |gap: Gap| {
            let anywhere = Sought { point: &self.with(point, recording, gap), ..*sought };
            let unlogged = anywhere.shown(recording).map(|shown| anywhere.unlogged(recording, &shown));
            let costs = move |unlogged: Unlogged| {
                (0..SPREAD).map(move |place| {
                    let gap = Gap { instant_s: apart_s * (place as f64 + 0.5), ..gap };
                    let point = self.with(point, recording, gap);
                    let here = Sought { point: &point, ..*sought };
                    let cost = |shown| here.cost_of(recording, &shown, unlogged.clone());
                    Gap { cost: here.shown(recording).map_or(f64::INFINITY, cost), ..gap }
                })
            };
            unlogged.into_iter().flat_map(costs)
        };
        let better = |best: Gap, other: Gap| if other.cost < best.cost { other } else { best };
        let here = self.length(point, recording);
        let as_it_is =
            Gap { cost: f64::INFINITY, instant_s: point.locals[recording][self.instant], length: here, shift_s: 0.0 };
        let tried = lengths.iter().map(|times| here + times.ln()).flat_map(|length| {
            let shifts = [0.0, -1.0, 1.0].map(|times| times * seconds(length));
            shifts.into_iter().map(move |shift_s| Gap { length, shift_s, ..as_it_is })
        });
        let mut best = tried.flat_map(spread).fold(at(as_it_is), better);
        let between = if lengths.len() > 1 { (lengths[1] / lengths[0]).ln() } else { 0.0 };
        for halving in 1..=HALVINGS {
            let nearer = 0.5_f64.powi(halving);
            for way in [-nearer, nearer] {
                best = better(best, at(Gap { instant_s: best.instant_s + way * apart_s, ..best }));
                if between > 0.0 {
                    best = better(best, at(Gap { length: best.length + way * between, ..best }));
                }
                best = better(best, at(Gap { shift_s: best.shift_s + way * seconds(best.length), ..best }));
            }
        }
        best
    }
}

/// Where a gap is sought.
#[derive(Clone, Copy)]
struct Sought<'a> {
    problem: &'a Problem,
    layout: &'a Layout,
    point: &'a Point,
    /// The motion of the recording.
    motion: &'a Impact,
}

impl Sought<'_> {
    /// χ² of the recording, its motion as it is.
    fn cost(&self, recording: usize) -> f64 {
        let cost = |shown| self.cost_of(recording, &shown, self.unlogged(recording, &shown));
        self.shown(recording).map_or(f64::INFINITY, cost)
    }

    /// What the channels show of that motion before the log.
    fn unlogged(&self, recording: usize, shown: &Impact) -> Unlogged {
        predict::unlogged(self.problem, self.layout, self.point, recording, shown, 0.0)
    }

    /// χ² of the recording where the channels have shown this before the log.
    fn cost_of(&self, recording: usize, shown: &Impact, unlogged: Unlogged) -> f64 {
        let Self { problem, layout, point, .. } = *self;
        cost_of_one(problem, layout, point, recording, &unlogged.logged(problem, shown))
    }

    /// That motion, with the measuring chain as it is here. `None`: there is no such chain.
    fn shown(&self, recording: usize) -> Option<Impact> {
        predict::through(self.problem, self.layout, self.point, recording, self.motion).ok()
    }
}

/// A fit whose instants are where they fit best, and what follows from that; itself, where none was missed.
#[must_use]
pub fn placed(problem: &Problem, mut fit: Fit, part: Part<'_>) -> Fit {
    for _ in 0..ROUNDS {
        match sought(problem, &fit, part) {
            Some(better) if better.cost < fit.cost - MISSED => fit = better.further(problem, part, Effort::FULL),
            _ => break,
        }
    }
    fit
}

/// A fit with each instant where it fits its recording best, all else as it is. `None`: it has no instants.
fn sought(problem: &Problem, fit: &Fit, part: Part<'_>) -> Option<Fit> {
    let gaps = Gaps::of(&fit.layout);
    if gaps.is_empty() {
        return None;
    }
    let sought_in = |recording: &usize| {
        let mut point = fit.point.clone();
        if let Ok(motion) = predict::strike(problem, &fit.layout, &point, *recording) {
            let configuration = problem.recordings[*recording].configuration;
            let acts = |gaps: &&Gaps| fit.layout.entrants[gaps.entrant].scope.includes(*recording, configuration);
            for gaps in gaps.iter().filter(acts) {
                let sought = Sought { problem, layout: &fit.layout, point: &point, motion: &motion };
                point = gaps.with(&point, *recording, gaps.best(&sought, *recording, &[1.0]));
            }
        }
        point.locals.swap_remove(*recording)
    };
    let locals: Vec<Vec<f64>> = part.par_iter().map(sought_in).collect();
    let mut point = fit.point.clone();
    for (recording, locals) in part.iter().zip(locals) {
        point.locals[*recording] = locals;
    }
    Fit::at(problem, fit.layout.clone(), point, part)
}

/// A model whose mechanism with gaps has one of its own length in each recording that asks for one by more than it costs; itself, where that is no
/// better by what a further mechanism has to bring.
#[must_use]
pub fn each_its_own(problem: &Problem, trial: Trial, part: Part<'_>) -> Trial {
    let freed = freed(problem, &trial.fit, part);
    lightest(problem, freed, trial)
}

/// The lightest of these models; the other, where that is no better by what a further mechanism has to bring.
fn lightest(problem: &Problem, fits: Vec<Fit>, other: Trial) -> Trial {
    let trials = fits.into_iter().map(|fit| Trial::new(problem, fit));
    let lightest = trials.min_by(|a, b| a.bic.total_cmp(&b.bic));
    lightest.filter(|lightest| lightest.bic < other.bic - ENOUGH).unwrap_or(other)
}

/// The length in the middle of these, as a coordinate.
fn usual(lengths: impl Iterator<Item = f64>) -> Option<f64> {
    let mut lengths: Vec<f64> = lengths.collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied()
}

/// With a length for each recording that asks for a gap and, where all do, with one for all from there.
fn freed(problem: &Problem, fit: &Fit, part: Part<'_>) -> Vec<Fit> {
    let Some(Asking { layout: freed, gaps, found }) = asking(problem, fit, part) else { return Vec::new() };
    let begun = |layout: Layout, gaps: Gaps, found: &[(usize, Gap)]| {
        let start = layout.start_from(problem, &fit.layout, &fit.point);
        let start = found.iter().fold(start, |start, (recording, gap)| gaps.with(&start, *recording, *gap));
        Fit::run(problem, layout, start, part, Effort::FULL)
    };
    let alike = (found.len() == part.len()).then(|| {
        let usual = usual(found.iter().map(|(_, gap)| gap.length))?;
        let (layout, gaps) = acting(problem, &freed, gaps.entrant, Scope::Everywhere)?;
        let found: Vec<_> = found.iter().map(|(one, gap)| (*one, Gap { length: usual, ..*gap })).collect();
        begun(layout, gaps, &found)
    });
    begun(freed, gaps, &found).into_iter().chain(alike.flatten()).collect()
}

/// A layout with one of its mechanisms in another scope, and its gaps.
fn acting(problem: &Problem, layout: &Layout, place: usize, scope: Scope) -> Option<(Layout, Gaps)> {
    let mut entrants = layout.entrants.clone();
    entrants[place].scope = scope;
    let layout = Layout::new(problem, entrants);
    let gaps = Gaps::of(&layout).into_iter().find(|gaps| gaps.entrant == place)?;
    Some((layout, gaps))
}

/// The recordings that ask for a gap.
struct Asking {
    /// In which each of them has its own.
    layout: Layout,
    gaps: Gaps,
    /// The best one of each.
    found: Vec<(usize, Gap)>,
}

/// `None`: no mechanism has gaps whose lengths may differ, no recording asks for any, or those that ask have theirs already.
fn asking(problem: &Problem, fit: &Fit, part: Part<'_>) -> Option<Asking> {
    let Fit { layout, point, .. } = fit;
    let before = Gaps::of(layout).into_iter().find(|gaps| {
        let mechanism = layout.entrants[gaps.entrant].effect.mechanism();
        mechanism.by_recording.contains(&mechanism.parameters[0].name)
    })?;
    let place = before.entrant;
    // Of several in a recording each is as long as the others.
    if layout.entrants[place].is_repeated() {
        return None;
    }
    let every = (0..problem.recordings.len()).collect();
    let (whole, gaps) = acting(problem, layout, place, Scope::EachRecording(every))?;
    let Place::Local(length) = gaps.length else { return None };
    let scope = layout.entrants[place].scope;
    let acted_in: Vec<usize> =
        part.iter().copied().filter(|one| scope.includes(*one, problem.recordings[*one].configuration)).collect();
    let usual = usual(acted_in.iter().map(|recording| before.length(point, *recording)))?;
    let start = whole.start_from(problem, layout, point);
    let price = price(problem);
    let sought = |&recording: &usize| {
        let instant_s = point.locals[recording][before.instant];
        let gap = |length| Gap { cost: f64::INFINITY, instant_s, length, shift_s: 0.0 };
        let none = gaps.with(&start, recording, gap(whole.locals[length].range.0));
        let known = if acted_in.contains(&recording) { before.length(point, recording) } else { usual };
        let point = gaps.with(&start, recording, gap(known));
        let motion = predict::strike(problem, &whole, &none, recording).ok()?;
        let whole = Sought { problem, layout: &whole, point: &point, motion: &motion };
        let without = Sought { point: &none, ..whole }.cost(recording);
        let found = gaps.best(&whole, recording, &LENGTHS);
        (without - found.cost > price).then_some((recording, found))
    };
    let found: Vec<(usize, Gap)> = part.par_iter().filter_map(sought).collect();
    let some: Subset = found.iter().map(|(recording, _)| *recording).collect();
    let scope = Scope::EachRecording(some);
    if some.is_empty() || layout.entrants[place].scope == scope {
        return None;
    }
    let (freed, gaps) = acting(problem, layout, place, scope)?;
    Some(Asking { layout: freed, gaps, found })
}

/// What a gap's instant and length cost in χ², and the choice of its recording.
fn price(problem: &Problem) -> f64 {
    let recordings = problem.recordings.len() as f64;
    2.0 * (problem.rows() as f64 / recordings).ln() + 2.0 * recordings.ln()
}

/// Samples that are missed most and may be edges of a further gap.
const JUMPS: usize = 4;

/// Parts of the usual length that are tried for several gaps in a recording, as whole samples: one that stands for two or three of them is as long as
/// they are together.
const PARTS: [f64; 3] = [1.0, 0.5, 1.0 / 3.0];

/// A model whose mechanism with gaps has further ones in the recordings that ask for them by more than they cost, all of one length; itself, where that
/// is no better by what a further mechanism has to bring.
#[must_use]
pub fn several(problem: &Problem, trial: Trial, part: Part<'_>) -> Trial {
    let several = with_several(problem, &trial.fit, part);
    lightest(problem, several, trial)
}

/// With gaps of each length that may be theirs, where any recording asks for more than one.
fn with_several(problem: &Problem, fit: &Fit, part: Part<'_>) -> Vec<Fit> {
    let Some(first) = Gaps::of(&fit.layout).into_iter().next() else { return Vec::new() };
    let scope = fit.layout.entrants[first.entrant].scope;
    let acts = |one: &usize| scope.includes(*one, problem.recordings[*one].configuration);
    let lengths = part.iter().copied().filter(acts).map(|one| first.length(&fit.point, one));
    let Some(usual) = usual(lengths) else { return Vec::new() };
    let sample_s = shortest_s(problem);
    let mut samples: Vec<u64> =
        PARTS.iter().map(|part| (part * usual.exp() / sample_s).round().max(1.0) as u64).collect();
    samples.dedup();
    let of_length = |samples: u64| one_by_one(problem, fit, first.entrant, (samples as f64 * sample_s).ln(), part);
    samples.into_iter().filter_map(of_length).collect()
}

/// A fit with gaps of this length, at first, one more in each recording that asks for it as long as any does, everything fitted anew with each. `None`: none
/// has more than one, or it cannot be simulated.
fn one_by_one(problem: &Problem, fit: &Fit, place: usize, length: f64, part: Part<'_>) -> Option<Fit> {
    let (layout, gaps) = repeating(problem, &fit.layout, place, usize::MAX);
    let mut start = layout.start_from(problem, &fit.layout, &fit.point);
    start.globals[gaps.first()?.global()?] = length;
    for recording in part {
        let never_s = problem.recordings[*recording].never_s();
        start = gaps.iter().fold(start, |point, gaps| gaps.at(&point, *recording, never_s));
    }
    let mut here = Fit::at(problem, layout, start, part)?;
    let mut counts = vec![0; part.len()];
    for _ in 0..ROUNDS {
        let more = |(recording, count): (&usize, &usize)| with_one_more(problem, &here, *gaps.get(*count)?, *recording);
        let found: Vec<Option<Vec<f64>>> = part.par_iter().zip(&counts).map(more).collect();
        if found.iter().all(Option::is_none) {
            break;
        }
        let mut point = here.point.clone();
        for ((recording, count), found) in part.iter().zip(&mut counts).zip(found) {
            if let Some(locals) = found {
                point.locals[*recording] = locals;
                *count += 1;
            }
        }
        here = Fit::run(problem, here.layout, point, part, Effort::FULL)?;
    }
    let most = counts.into_iter().max().filter(|most| *most > 1)?;
    let (fewer, _) = repeating(problem, &fit.layout, place, most);
    let start = fewer.start_from(problem, &here.layout, &here.point);
    Some(placed(problem, Fit::at(problem, fewer, start, part)?, part))
}

/// What a recording has of its own with a gap where it asks for it most, if that takes more off χ² than it costs. Looked at alone: what the rig has
/// given way for a gap that nobody had looked for keeps others from showing.
fn with_one_more(problem: &Problem, fit: &Fit, gaps: Gaps, recording: usize) -> Option<Vec<f64>> {
    let fitted = |point: Point| Fit::run(problem, fit.layout.clone(), point, &[recording], Effort::FULL);
    let without = fitted(fit.point.clone())?;
    let asked_for = gaps.most_asked_for(problem, &without, recording);
    let instants = asked_for.into_iter().chain(jumps_s(problem, &without, recording));
    let with = instants.filter_map(|instant_s| fitted(gaps.at(&without.point, recording, instant_s)));
    let with = with.min_by(|one, other| one.cost.total_cmp(&other.cost))?;
    (without.cost - with.cost > price(problem)).then(|| with.point.locals[recording].clone())
}

/// Instants just before the samples of a recording that a fit misses most, s after contact: a further gap jumps there, however much else it moves.
fn jumps_s(problem: &Problem, fit: &Fit, recording: usize) -> Vec<f64> {
    let prepared = &problem.recordings[recording];
    let contact_s = fit.layout.contact_s(problem, &fit.point, recording);
    let mut missed: Vec<(f64, f64)> =
        prepared.times_s.iter().zip(&fit.residuals[recording]).map(|(time_s, left)| (left.abs(), *time_s)).collect();
    missed.sort_by(|one, other| other.0.total_cmp(&one.0));
    let before_s = 0.5 * prepared.sample_s * prepared.averaged as f64;
    missed.iter().take(JUMPS).map(|(_, time_s)| time_s - before_s - contact_s).collect()
}

/// A layout one of whose mechanisms acts in every recording and so many times at most, and its gaps.
fn repeating(problem: &Problem, layout: &Layout, place: usize, most: usize) -> (Layout, Vec<Gaps>) {
    let mut entrants = layout.entrants.clone();
    let Entrant { effect, scope, .. } = &mut entrants[place];
    *scope = Scope::Everywhere;
    let parameters = effect.mechanism().parameters.iter().enumerate();
    let again = parameters.filter(|(_, parameter)| parameter.search == Search::Again);
    for (number, (place, parameter)) in again.enumerate() {
        // Where it begins matters not: each recording is given its own.
        let value = if number + 1 < most { parameter.plausible.1 } else { parameter.range.1 };
        // Within range by construction.
        let _ = effect.set_value(place, value);
    }
    let layout = Layout::new(problem, entrants);
    let gaps = Gaps::of(&layout).into_iter().filter(|gaps| gaps.entrant == place).collect();
    (layout, gaps)
}
