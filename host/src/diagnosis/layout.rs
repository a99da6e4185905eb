//! What is free in a fit: the coordinates of rig, recordings and mechanisms, each with its prior and bounds.
//!
//! ```text
//! global   ln k_body  ln k_pad  ln m of each configuration  width of the converter's filter  delays of further channels
//!          parameters of the mechanisms
//! local    contact instant  ln v  ln k of this recording  offset of each channel  parameters that each recording has for itself
//! ```
//!
//! Global coordinates are shared by all recordings, local ones belong to one. What the experimenter believes is a prior with its
//! stated deviation; contact instant and offset are free.

use std::cmp::Reverse;

use nalgebra::DVector;
use thud_sim::mechanism::{Effect, Mechanism, Parameter, Scale, Search};
use thud_sim::rig::Assembly;

use super::fit::Imitation;
use super::problem::Problem;
use super::subset::Subset;
use crate::campaign::Rig;

/// Uncertainties below this are no freedom at all, relative.
const LEAST_SD: f64 = 1e-5;
/// Half the variance, in samples, of the response of the filter before a converter, and its deviation: 0.008·(rate/corner)² for a Bessel
/// filter of four poles (from the second cumulant of 105/(s⁴ + 10s³ + 45s² + 105s + 105)), whose corner lies at a half to a fifth of
/// the rate. It rounds what jumps: a pad that comes off, a dashpot that is touched.
const CONVERTER: (f64, f64) = (0.06, 0.05);
/// Beyond this the filter is a lag of its own (`filter-lag`).
const WIDEST_CONVERTER: f64 = 0.2;
/// By how many samples a further channel may be read later or sooner than the observed one: such a filter delays by 2.11·rate/(2π·corner), 0.7 to
/// 1.7 samples, and a displacement need not have come through one.
const DELAY_SD: f64 = 0.7;
const LONGEST_DELAY: f64 = 3.0;
/// Where the prior of a mechanism's parameter ends: its plausible range is this many deviations to either side.
const PLAUSIBLE_DEVIATIONS: f64 = 1.5;

/// A lighter piece rings faster than recordings show, and takes minutes to simulate.
const LIGHTEST_PIECE_KG: f64 = 1e-3;

/// A limit of the force below this part of the highest peak limits nothing: with most of the mass before it a ceiling of a few newtons is a
/// damped joint.
const LEAST_LIMIT: f64 = 0.1;

/// Of a gap in a log at least this part of a sample is missing: a whole one, but for what jitters.
const LEAST_GAP: f64 = 0.5;

/// By how much an instant is moved for a difference, s: that of contact and those after it alike, so that one can move without the others.
const INSTANT_STEP_S: f64 = 1e-5;

/// A mechanism that takes part, everywhere or in some recordings only.
#[derive(Clone, Debug, PartialEq)]
pub struct Entrant {
    /// Which, with the values that are held where they are no coordinates.
    pub effect: Effect,
    /// The recordings that it acts in.
    pub scope: Scope,
    /// Where each recording's own value begins (a phase or an instant, where the mechanism has one); empty: at the effect's.
    pub own: Vec<f64>,
}

impl Entrant {
    /// A mechanism that acts in every recording.
    #[must_use]
    pub fn everywhere(effect: Effect) -> Self {
        Self { effect, scope: Scope::Everywhere, own: Vec::new() }
    }

    /// Whether each configuration has a value of its own for this parameter.
    #[must_use]
    pub fn is_by_configuration(&self, place: usize) -> bool {
        let mechanism = self.effect.mechanism();
        self.scope == Scope::EachConfiguration && mechanism.by_configuration.contains(&mechanism.parameters[place].name)
    }

    /// Whether each recording that it acts in has a value of its own for this parameter.
    #[must_use]
    pub fn is_by_recording(&self, place: usize) -> bool {
        let mechanism = self.effect.mechanism();
        matches!(self.scope, Scope::EachRecording(_))
            && mechanism.by_recording.contains(&mechanism.parameters[place].name)
    }

    /// Whether each impact or recording that it acts in has a value of its own for this parameter.
    #[must_use]
    pub fn is_own(&self, place: usize) -> bool {
        self.effect.is_own(place) || self.is_by_recording(place)
    }

    /// Whether [`own`](Self::own) is of this parameter.
    fn begins_own(&self, place: usize) -> bool {
        let parameters = self.effect.mechanism().parameters;
        let is_own = parameters[place].is_of_each_impact() && parameters[place].search != Search::Again;
        is_own || !self.effect.is_of_each_impact()
    }

    /// Whether it may happen several times in a recording.
    #[must_use]
    pub fn is_repeated(&self) -> bool {
        let mut parameters = self.effect.mechanism().parameters.iter().enumerate();
        parameters.any(|(place, parameter)| parameter.search == Search::Again && self.effect.takes_part(place))
    }

    /// Whether it has a value of its own for each impact or recording.
    #[must_use]
    pub fn is_loose(&self) -> bool {
        matches!(self.scope, Scope::EachRecording(_)) || self.effect.is_of_each_impact()
    }

    /// Whether it acts in every recording, in each as in the others.
    #[must_use]
    pub fn is_alike_everywhere(&self) -> bool {
        self.scope == Scope::Everywhere && !self.is_loose()
    }

    /// Whether both are the same mechanism in the same recordings.
    #[must_use]
    pub fn is_same_as(&self, other: &Self) -> bool {
        self.effect.mechanism().id == other.effect.mechanism().id && self.scope == other.scope
    }
}

/// Where a mechanism acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scope {
    /// In every recording.
    Everywhere,
    /// In every recording, in each configuration as it is there.
    EachConfiguration,
    /// In the recordings of one configuration.
    Configuration(usize),
    /// In these recordings.
    Recordings(Subset),
    /// In these recordings, in each as it is there.
    EachRecording(Subset),
}

impl Scope {
    /// Of some recordings: a configuration where they are just its.
    #[must_use]
    pub fn of(problem: &Problem, some: Subset) -> Self {
        let is_all_of = |configuration: &usize| {
            let mut recordings = problem.recordings.iter().enumerate();
            recordings.all(|(number, recording)| some.includes(number) == (recording.configuration == *configuration))
        };
        let configuration = (0..problem.configurations.len()).find(is_all_of);
        configuration.map_or(Self::Recordings(some), Self::Configuration)
    }

    /// Whether it includes a recording, given its number and that of its configuration.
    #[must_use]
    pub fn includes(self, recording: usize, configuration: usize) -> bool {
        match self {
            Self::Everywhere | Self::EachConfiguration => true,
            Self::Configuration(number) => number == configuration,
            Self::Recordings(some) | Self::EachRecording(some) => some.includes(recording),
        }
    }
}

/// What a coordinate is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// ln of the body springs' stiffness over the stated one.
    Body,
    /// ln of the pad's stiffness over the stated one.
    Pad,
    /// ln of a configuration's mass over the stated one.
    Mass(usize),
    /// Instant at which the measuring chain shows the contact, in a recording's time, s.
    Contact,
    /// A recording's speed less the stated one, over [`Prepared::speed_scale`](super::problem::Prepared::speed_scale).
    Speed,
    /// Half the variance of the filter before the converter, samples².
    Converter,
    /// By how much a further channel is read later than the observed one, samples.
    Delay(usize),
    /// ln of a recording's spring stiffness over the campaign's.
    Repeat,
    /// Offset of a channel.
    Offset(usize),
    /// A parameter of a mechanism.
    Mechanism {
        /// Which entrant.
        entrant: usize,
        /// Which of its parameters.
        place: usize,
    },
    /// A parameter of a mechanism in a configuration, where each has its own.
    InConfiguration {
        /// Which entrant.
        entrant: usize,
        /// Which of its parameters.
        place: usize,
        /// In which configuration.
        configuration: usize,
    },
}

impl Role {
    /// Of which entrant it is.
    #[must_use]
    pub fn entrant(self) -> Option<usize> {
        match self {
            Self::Mechanism { entrant, .. } | Self::InConfiguration { entrant, .. } => Some(entrant),
            _ => None,
        }
    }

    /// Which of its parameters it is.
    #[must_use]
    pub fn place(self) -> Option<usize> {
        match self {
            Self::Mechanism { place, .. } | Self::InConfiguration { place, .. } => Some(place),
            _ => None,
        }
    }

    /// The same of another entrant.
    fn of_entrant(self, entrant: usize) -> Self {
        match self {
            Self::Mechanism { place, .. } => Self::Mechanism { entrant, place },
            Self::InConfiguration { place, configuration, .. } => {
                Self::InConfiguration { entrant, place, configuration }
            }
            role => role,
        }
    }
}

/// One free number.
#[derive(Clone, Copy, Debug)]
pub struct Coordinate {
    /// What it is of.
    pub role: Role,
    /// Mean and standard deviation of what is believed; `None`: nothing.
    pub prior: Option<(f64, f64)>,
    /// Whether that is nothing of this rig, only what is likely of any.
    pub is_guess: bool,
    /// Step of a finite difference.
    pub step: f64,
    /// The longest step of an iteration.
    pub stride: f64,
    /// Bounds.
    pub range: (f64, f64),
}

impl Coordinate {
    /// Where it comes to from a value by a step: at most its stride, and not out of its range.
    #[must_use]
    pub fn moved(&self, value: f64, by: f64) -> f64 {
        (value + by.clamp(-self.stride, self.stride)).clamp(self.range.0, self.range.1)
    }
}

/// All coordinates of a fit.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Mechanisms that take part.
    pub entrants: Vec<Entrant>,
    /// Shared coordinates.
    pub globals: Vec<Coordinate>,
    /// Coordinates that each recording has.
    pub locals: Vec<Coordinate>,
    /// How many of the globals are the rig's.
    pub of_rig: usize,
    /// Whether offsets are held where the quiet before contact shows them. A fit is free to move them, which hides a rest after
    /// contact; to see where a misfit is, they must not.
    pub offsets_as_seen: bool,
}

/// Values for all coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// One for each of [`Layout::globals`].
    pub globals: Vec<f64>,
    /// For each recording, one for each of [`Layout::locals`].
    pub locals: Vec<Vec<f64>>,
}

/// The number that a fit moves instead of a parameter's value: ln of it where its values are spaced by ratios.
#[must_use]
pub fn coordinate_of(parameter: &Parameter, value: f64) -> f64 {
    match parameter.scale {
        Scale::Logarithmic => value.max(1e-300).ln(),
        Scale::Linear => value,
    }
}

/// The value that belongs to a coordinate.
#[must_use]
pub fn value_of(parameter: &Parameter, coordinate: f64) -> f64 {
    let value = match parameter.scale {
        Scale::Logarithmic => coordinate.exp(),
        Scale::Linear => coordinate,
    };
    value.clamp(parameter.range.0, parameter.range.1)
}

impl Layout {
    /// Whether a global coordinate should be where it was stated, within what was stated of it: a stiffness or a mass of which no mechanism
    /// says that it is otherwise. (That one mass is wrong casts doubt on all: they have one source. Where a curve is bent its stiffness is
    /// that of the stroke at which it was measured, and force alone does not tell which of two springs in series is bent.)
    #[must_use]
    pub fn holds_stated(&self, role: Role) -> bool {
        let names = |id: &str| self.entrants.iter().any(|entrant| entrant.effect.mechanism().id == id);
        match role {
            Role::Body | Role::Pad => !names("hardening"),
            Role::Mass(_) => !names("pose-dependent-mass"),
            _ => false,
        }
    }

    /// The coordinates of a campaign with these mechanisms.
    #[must_use]
    pub fn new(problem: &Problem, entrants: Vec<Entrant>) -> Self {
        let mut globals = Vec::new();
        let rig = &problem.rig;
        let relative = |role: Role, sd: f64| Coordinate {
            role,
            prior: Some((0.0, sd.max(LEAST_SD))),
            is_guess: false,
            step: 1e-3,
            stride: 0.3,
            range: (-3.0, 3.0),
        };
        if problem.has_springs() {
            if let Some(body) = rig.body_stiffness_n_per_m {
                globals.push(relative(Role::Body, body.sd / body.value));
            }
            if let Some(pad) = rig.pad_stiffness_n_per_m {
                globals.push(relative(Role::Pad, pad.sd / pad.value));
            }
        }
        for (configuration, sd) in problem.mass_sd.iter().enumerate() {
            globals.push(relative(Role::Mass(configuration), *sd));
        }
        let of_rig = globals.len();
        if problem.has_springs() {
            let (mean, sd) = CONVERTER;
            globals.push(Coordinate {
                role: Role::Converter,
                prior: Some((mean, sd)),
                is_guess: false,
                step: 0.02,
                stride: 0.1,
                range: (0.0, WIDEST_CONVERTER),
            });
        }
        globals.extend((1..problem.channels.len()).map(|channel| Coordinate {
            role: Role::Delay(channel),
            prior: Some((0.0, DELAY_SD)),
            is_guess: false,
            step: 0.02,
            stride: 0.5,
            range: (-LONGEST_DELAY, LONGEST_DELAY),
        }));
        let mut locals = vec![Coordinate {
            role: Role::Contact,
            prior: None,
            is_guess: false,
            step: INSTANT_STEP_S,
            stride: 2e-3,
            range: (f64::NEG_INFINITY, f64::INFINITY),
        }];
        locals.push(relative(Role::Speed, 1.0));
        if problem.has_springs() {
            locals.push(relative(Role::Repeat, rig.spring_repeatability * repeating_part(rig)));
        }
        for channel in 0..problem.channels.len() {
            locals.push(Coordinate {
                role: Role::Offset(channel),
                prior: None,
                is_guess: false,
                step: 1.0,
                stride: f64::INFINITY,
                range: (f64::NEG_INFINITY, f64::INFINITY),
            });
        }
        for (number, entrant) in entrants.iter().enumerate() {
            for (place, parameter) in entrant.effect.mechanism().parameters.iter().enumerate() {
                if parameter.is_held() || !entrant.effect.takes_part(place) {
                    continue;
                }
                let coordinate = mechanism_coordinate(problem, entrant.effect.mechanism(), number, place);
                if entrant.is_by_configuration(place) {
                    let role = |configuration| Role::InConfiguration { entrant: number, place, configuration };
                    let configurations = 0..problem.configurations.len();
                    globals.extend(configurations.map(|number| Coordinate { role: role(number), ..coordinate }));
                    continue;
                }
                if entrant.is_own(place) { locals.push(coordinate) } else { globals.push(coordinate) }
            }
        }
        Self { entrants, globals, locals, of_rig, offsets_as_seen: false }
    }

    /// How many parameters its mechanisms have; one of each impact counts once.
    #[must_use]
    pub fn parameters(&self) -> usize {
        let of_mechanism = |coordinate: &&Coordinate| coordinate.role.entrant().is_some();
        self.globals.iter().chain(&self.locals).filter(of_mechanism).count()
    }

    /// How many of these each impact or recording has for itself.
    #[must_use]
    pub fn own_parameters(&self) -> usize {
        self.locals.iter().filter(|coordinate| coordinate.role.entrant().is_some()).count()
    }

    /// Whether one of its mechanisms has values of its own for each impact.
    #[must_use]
    pub fn is_loose(&self) -> bool {
        self.entrants.iter().any(Entrant::is_loose)
    }

    /// The same with one mechanism more.
    #[must_use]
    pub fn with(&self, problem: &Problem, entrant: Entrant) -> Self {
        let mut entrants = self.entrants.clone();
        entrants.push(entrant);
        Self::new(problem, entrants)
    }

    /// The same without the mechanism in one place.
    #[must_use]
    pub fn without(&self, problem: &Problem, place: usize) -> Self {
        let mut entrants = self.entrants.clone();
        entrants.remove(place);
        Self::new(problem, entrants)
    }

    /// The same with another mechanism, or the same in another form, in one place.
    #[must_use]
    pub fn in_place(&self, problem: &Problem, place: usize, entrant: Entrant) -> Self {
        let mut entrants = self.entrants.clone();
        entrants[place] = entrant;
        Self::new(problem, entrants)
    }

    /// Where a fit without experience begins: everything as believed, contact and offsets as guessed, mechanisms as given.
    #[must_use]
    pub fn start(&self, problem: &Problem) -> Point {
        let initial = |coordinate: &Coordinate| match coordinate.role {
            Role::Converter => CONVERTER.0,
            role => role.entrant().zip(role.place()).map_or(0.0, |(entrant, place)| {
                let effect = &self.entrants[entrant].effect;
                let (low, high) = coordinate.range;
                coordinate_of(&effect.mechanism().parameters[place], effect.value(place)).clamp(low, high)
            }),
        };
        Point {
            globals: self.globals.iter().map(initial).collect(),
            locals: problem
                .recordings
                .iter()
                .enumerate()
                .map(|(number, recording)| {
                    let local = |coordinate: &Coordinate| match coordinate.role {
                        Role::Contact => recording.contact_guess_s,
                        Role::Offset(channel) => recording.offset_guess[channel],
                        Role::Mechanism { entrant, place } if self.entrants[entrant].begins_own(place) => {
                            let own = self.entrants[entrant].own.get(number).copied();
                            own.unwrap_or_else(|| initial(coordinate))
                        }
                        _ => initial(coordinate),
                    };
                    self.locals.iter().map(local).collect()
                })
                .collect(),
        }
    }

    /// A start that keeps what another fit has found for the coordinates that both have.
    #[must_use]
    pub fn start_from(&self, problem: &Problem, other: &Self, found: &Point) -> Point {
        let same = |role: Role, theirs: &[Coordinate]| {
            let known = |role: Role| match role.entrant() {
                Some(entrant) => {
                    let mine = &self.entrants[entrant];
                    let theirs = other.entrants.iter().position(|them| them.is_same_as(mine));
                    theirs.map(|entrant| role.of_entrant(entrant))
                }
                None => Some(role),
            };
            known(role).and_then(|role| theirs.iter().position(|coordinate| coordinate.role == role))
        };
        let mut start = self.start(problem);
        for (coordinate, value) in self.globals.iter().zip(&mut start.globals) {
            if let Some(place) = same(coordinate.role, &other.globals) {
                *value = found.globals[place];
            }
        }
        for (local, theirs) in start.locals.iter_mut().zip(&found.locals) {
            for (coordinate, value) in self.locals.iter().zip(local) {
                if let Some(place) = same(coordinate.role, &other.locals) {
                    *value = theirs[place];
                }
            }
        }
        start
    }

    /// Places of a mechanism's instants among the local coordinates.
    #[must_use]
    pub fn instants(&self, entrant: usize) -> Vec<usize> {
        let parameters = self.entrants[entrant].effect.mechanism().parameters;
        let is_instant = |role: Role| {
            role.entrant() == Some(entrant) && role.place().is_some_and(|place| parameters[place].is_instant())
        };
        (0..self.locals.len()).filter(|local| is_instant(self.locals[*local].role)).collect()
    }

    /// A shared value at a point; `None` where it is no coordinate.
    #[must_use]
    pub fn global(&self, point: &Point, role: Role) -> Option<f64> {
        self.globals.iter().position(|coordinate| coordinate.role == role).map(|place| point.globals[place])
    }

    /// A recording's own value at a point; `None` where it is no coordinate.
    #[must_use]
    pub fn local(&self, point: &Point, recording: usize, role: Role) -> Option<f64> {
        let place = self.locals.iter().position(|coordinate| coordinate.role == role)?;
        Some(point.locals[recording][place])
    }

    /// Instant of contact at a point, s in the recording's time: the coordinate is where the measuring chain shows it, so that whatever comes late in the
    /// chain leaves it where it was. Every layout has that coordinate.
    #[must_use]
    pub fn contact_s(&self, problem: &Problem, point: &Point, recording: usize) -> f64 {
        let shown_s = self.local(point, recording, Role::Contact).expect("every layout has the instant of contact");
        let configuration = problem.recordings[recording].configuration;
        let late_s = self.entrants.iter().enumerate().map(|(number, entrant)| {
            let is_here = entrant.effect.mechanism().is_seen_only() && entrant.scope.includes(recording, configuration);
            if is_here { Assembly::delay_s(&self.effect_at(problem, number, point, recording)) } else { 0.0 }
        });
        shown_s - late_s.sum::<f64>()
    }

    /// A point from which every coordinate has gone so many times a step, at most its stride and not out of its range.
    #[must_use]
    pub fn moved(&self, from: &Point, step: &Imitation, times: f64) -> Point {
        let go = |coordinates: &[Coordinate], values: &[f64], step: &DVector<f64>| -> Vec<f64> {
            let go = |((coordinate, value), by): ((&Coordinate, &f64), &f64)| coordinate.moved(*value, times * by);
            coordinates.iter().zip(values).zip(step.iter()).map(go).collect()
        };
        Point {
            globals: go(&self.globals, &from.globals, &step.globals),
            locals: from.locals.iter().zip(&step.locals).map(|(local, step)| go(&self.locals, local, step)).collect(),
        }
    }

    /// A point whose rig, masses, speeds and filter are what was stated, and everything else as it is.
    #[must_use]
    pub fn as_stated(&self, point: &Point) -> Point {
        let mut stated = point.clone();
        stated.globals[..self.of_rig].fill(0.0);
        for (coordinate, value) in self.globals.iter().zip(&mut stated.globals) {
            match coordinate.role {
                Role::Converter => *value = CONVERTER.0,
                Role::Delay(_) => *value = 0.0,
                _ => (),
            }
        }
        for local in &mut stated.locals {
            for (coordinate, value) in self.locals.iter().zip(local) {
                if matches!(coordinate.role, Role::Speed | Role::Repeat) {
                    *value = 0.0;
                }
            }
        }
        stated
    }

    /// Deviation of the prior of a local coordinate in one recording: speeds have their own each.
    #[must_use]
    pub fn local_prior(&self, problem: &Problem, recording: usize, place: usize) -> Option<(f64, f64)> {
        let coordinate = &self.locals[place];
        match coordinate.role {
            Role::Speed => {
                let speed = problem.recordings[recording].speed;
                Some((0.0, (speed.sd / problem.recordings[recording].speed_scale()).max(LEAST_SD)))
            }
            Role::Offset(channel) if self.offsets_as_seen => {
                let seen = problem.recordings[recording].offset_guess[channel];
                problem.zero_deviation(recording, channel).map(|deviation| (seen, deviation)).or(coordinate.prior)
            }
            _ => coordinate.prior,
        }
    }

    /// A mechanism's values at a point, in the first recording that it acts in, as often as in any.
    #[must_use]
    pub fn effect(&self, problem: &Problem, entrant: usize, point: &Point) -> Effect {
        let scope = self.entrants[entrant].scope;
        let acts = |number: &usize| scope.includes(*number, problem.recordings[*number].configuration);
        let instants = self.instants(entrant);
        let comes = |number: usize| {
            let shown = |local: &&usize| problem.recordings[number].shows(point.locals[number][**local]);
            instants.iter().filter(shown).count()
        };
        let often = (0..problem.recordings.len()).filter(acts).map(|number| (comes(number), number));
        let most = often.max_by_key(|(comes, number)| (*comes, Reverse(*number)));
        self.effect_at(problem, entrant, point, most.map_or(0, |(_, number)| number))
    }

    /// The same in the first recording of a configuration.
    #[must_use]
    pub fn effect_in(&self, problem: &Problem, entrant: usize, point: &Point, configuration: usize) -> Effect {
        let mut recordings = problem.recordings.iter();
        let first = recordings.position(|recording| recording.configuration == configuration);
        self.effect_at(problem, entrant, point, first.unwrap_or(0))
    }

    /// The coordinate of a mechanism's parameter in a configuration.
    #[must_use]
    pub fn role_in(&self, entrant: usize, place: usize, configuration: usize) -> Role {
        if self.entrants[entrant].is_by_configuration(place) {
            Role::InConfiguration { entrant, place, configuration }
        } else {
            Role::Mechanism { entrant, place }
        }
    }

    /// Whether a coordinate leaves the motion as it is: the measuring chain alone sees it.
    #[must_use]
    pub fn is_seen_only(&self, role: Role) -> bool {
        match role {
            Role::Converter | Role::Delay(_) => true,
            role => role.entrant().is_some_and(|entrant| self.entrants[entrant].effect.mechanism().is_seen_only()),
        }
    }

    /// A mechanism's values at a point, in one recording.
    #[must_use]
    pub fn effect_at(&self, problem: &Problem, entrant: usize, point: &Point, recording: usize) -> Effect {
        let here = problem.recordings[recording].configuration;
        let mut effect = self.entrants[entrant].effect.clone();
        let parameters = effect.mechanism().parameters;
        let mut set = |coordinates: &[Coordinate], values: &[f64]| {
            for (coordinate, value) in coordinates.iter().zip(values) {
                let is_elsewhere =
                    matches!(coordinate.role, Role::InConfiguration { configuration, .. } if configuration != here);
                if coordinate.role.entrant() == Some(entrant)
                    && !is_elsewhere
                    && let Some(place) = coordinate.role.place()
                {
                    // Within range by construction.
                    let _ = effect.set_value(place, value_of(&parameters[place], *value));
                }
            }
        };
        set(&self.globals, &point.globals);
        set(&self.locals, &point.locals[recording]);
        effect
    }
}

/// Which part of the springs' repeatability the force shows: body springs and pad repeat each by itself, and what both are together by
/// √(w_b² + w_p²), w_b = k/k_b and w_p = k/k_p their parts of ln k = −ln(1/k_b + 1/k_p).
fn repeating_part(rig: &Rig) -> f64 {
    let (Some(body), Some(pad)) = (rig.body_stiffness_n_per_m, rig.pad_stiffness_n_per_m) else { return 1.0 };
    body.value.hypot(pad.value) / (body.value + pad.value)
}

/// The shortest time between two samples of a converter, s.
#[must_use]
pub fn shortest_s(problem: &Problem) -> f64 {
    problem.recordings.iter().map(|recording| recording.sample_s).fold(f64::INFINITY, f64::min)
}

/// The highest peak force, N.
fn highest_n(problem: &Problem) -> f64 {
    (0..problem.recordings.len()).map(|number| problem.peak_n(number)).fold(0.0, f64::max)
}

fn mechanism_coordinate(problem: &Problem, mechanism: &'static Mechanism, entrant: usize, place: usize) -> Coordinate {
    let parameter = &mechanism.parameters[place];
    let (likely_low, likely_high) = parameter.plausible;
    let shape = parameter.null.is_none();
    // A picture is scaled by a length in it and taken at once: a gain or a lag beyond what is likely is a name for what holds a falling body
    // back.
    let is_of_picture = matches!(mechanism.id, "gain-error" | "filter-lag") && !shape && problem.is_of_places;
    let (low, high) = if is_of_picture { parameter.plausible } else { parameter.range };
    let is_piece = mechanism.id == "moving-piece-inertia" && place == 0;
    let stated = is_piece.then_some(problem.rig.moving_mass_kg).flatten();
    let (range, prior, stride) = match parameter.scale {
        Scale::Logarithmic => {
            // Beyond a hundredth of anything likely it is nothing. And what limits the force limits it where it is high.
            let limits = parameter.search == Search::OfPeak && !shape;
            let is_gap = mechanism.id == "lost-samples" && !shape;
            let least = if is_gap {
                LEAST_GAP * shortest_s(problem)
            } else if limits {
                LEAST_LIMIT * highest_n(problem)
            } else if is_piece {
                LIGHTEST_PIECE_KG
            } else {
                0.0
            };
            // (A whole sample of a slow recorder may be longer than any gap.)
            let low = low.max(likely_low * 1e-2).max(least).min(high).ln();
            let middle = 0.5 * (likely_low.ln() + likely_high.ln());
            let sd = (likely_high / likely_low).ln() / 2.0 / PLAUSIBLE_DEVIATIONS;
            ((low, high.ln()), shape.then_some((middle, sd)), 0.7)
        }
        Scale::Linear => {
            let width = likely_high - likely_low;
            let prior = ((likely_low + likely_high) / 2.0, width / 2.0 / PLAUSIBLE_DEVIATIONS);
            ((low, high), (shape && !parameter.is_of_each_impact()).then_some(prior), 0.3 * width)
        }
    };
    let is_guess = stated.is_none();
    let prior = stated.map(|mass| (mass.value.ln(), (mass.sd / mass.value).max(LEAST_SD))).or(prior);
    let step = match parameter.scale {
        _ if parameter.is_instant() => INSTANT_STEP_S,
        // A jump that moves (what pulls comes off later) shows only where it moves by a part of a sample.
        Scale::Logarithmic if parameter.search == Search::Strength => 5e-2,
        Scale::Logarithmic => 2e-3,
        Scale::Linear => 2e-3 * (likely_high - likely_low),
    };
    Coordinate { role: Role::Mechanism { entrant, place }, prior, is_guess, step, stride, range }
}
