//! Where a search for a mechanism begins: a grid over the values that shape it.
//!
//! A shape that is a place on the way (a stroke, a force, a time) is sought where the recordings have been: at parts of the strokes,
//! forces and contact times that the fit so far has. The strength is not gridded: one signature tells it to first order.

use thud_sim::mechanism::{Effect, Mechanism, Needed, Parameter, Scale, Search};
use thud_sim::rig::Quantity;

use super::problem::Problem;
use super::repeats::{Repeat, repeats};

/// The most starts of a form of a mechanism.
const MOST_STARTS: usize = 48;

/// The golden section, whose multiples are spread evenly whatever the period.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Strengths that are tried, at equal ratios over the likely ones.
const STRENGTHS: usize = 3;

/// The part of the likely values that a strength of either sign is tried with.
const SMALL_PART: f64 = 0.003;

/// Speeds that differ by this factor tell what grows with the speed from what does not.
const DIFFERENT: f64 = 1.2;

/// How far the recordings reach, each sorted upwards.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Largest stroke of the body springs in each recording, m.
    strokes_m: Vec<f64>,
    /// Largest depth of the pad in each recording, m.
    depths_m: Vec<f64>,
    /// Peak force of each recording, N.
    peaks_n: Vec<f64>,
    /// Contact time of each recording, s.
    contact_times_s: Vec<f64>,
    /// Stiffness of the body springs and of the pad, N/m.
    body_n_per_m: f64,
    pad_n_per_m: Option<f64>,
    /// Whether a channel shows where the robot is.
    shows_position: bool,
    /// Whether one shows how it moves: where it is, its speed or its acceleration.
    shows_motion: bool,
    /// Whether the robot came at different speeds.
    speeds_differ: bool,
    /// Frequencies at which the residual is strong, Hz, strongest first.
    lines_hz: Vec<f64>,
    /// Runs of equal values in each recording, the longest first.
    pub repeats: Vec<Vec<Repeat>>,
    /// How long the longest of each are, s: of the recordings that have any, the one in the middle.
    repeats_s: Option<f64>,
}

impl Reach {
    /// From what the recordings show: their peaks over the springs' stiffness.
    #[must_use]
    pub fn of(problem: &Problem, lines_hz: Vec<f64>) -> Self {
        let rig = crate::model::simulated(&problem.rig);
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        let peaks_n = sorted((0..problem.recordings.len()).map(|number| problem.peak_n(number)).collect());
        let speeds = sorted(problem.recordings.iter().map(|recording| recording.speed.value.abs()).collect());
        let over = |stiffness: f64| peaks_n.iter().map(|peak| peak / stiffness).collect();
        let longest_s = |runs: &Vec<Repeat>| runs.first().map(|run| run.lasts_s);
        let repeats = repeats(problem);
        let repeats_s = sorted(repeats.iter().filter_map(longest_s).collect());
        let shows =
            |quantities: &[Quantity]| problem.channels.iter().any(|channel| quantities.contains(&channel.quantity));
        Self {
            repeats_s: repeats_s.get(repeats_s.len() / 2).copied(),
            repeats,
            strokes_m: over(rig.body_stiffness_n_per_m),
            depths_m: over(rig.pad_stiffness_n_per_m.unwrap_or(rig.body_stiffness_n_per_m)),
            contact_times_s: sorted(problem.recordings.iter().map(|recording| recording.contact_time_s).collect()),
            peaks_n,
            body_n_per_m: rig.body_stiffness_n_per_m,
            pad_n_per_m: rig.pad_stiffness_n_per_m,
            speeds_differ: speeds.first().zip(speeds.last()).is_some_and(|(low, high)| *high > DIFFERENT * low),
            shows_position: shows(&[Quantity::Position]),
            shows_motion: shows(&[Quantity::Position, Quantity::Velocity, Quantity::Acceleration]),
            lines_hz,
        }
    }

    /// Whether the campaign has what a form is about.
    fn has(&self, needed: Needed) -> bool {
        match needed {
            Needed::Pad => self.pad_n_per_m.is_some(),
            Needed::Position => self.shows_position,
            Needed::Motion => self.shows_motion,
            Needed::Speeds => self.speeds_differ,
        }
    }

    /// A mechanism, with the values that it has, in each form that is tried later.
    #[must_use]
    pub fn later_forms(&self, effect: &Effect) -> Vec<Effect> {
        effect.later_forms(|needed| self.has(needed))
    }

    /// The mechanism at every start of its grid, in each of its forms.
    #[must_use]
    pub fn starts(&self, mechanism: &'static Mechanism) -> Vec<Effect> {
        self.forms(mechanism.typical()).into_iter().flat_map(|form| self.starts_of(form)).collect()
    }

    /// The same in the form that an effect has.
    #[must_use]
    pub fn starts_of(&self, form: Effect) -> Vec<Effect> {
        let mut starts = self.on_grid(form.mechanism(), vec![form], |parameter| !parameter.is_form());
        while starts.len() > MOST_STARTS {
            // By the golden section and not one in two, which would take one value of two away for good.
            let mut place = 0.0;
            starts.retain(|_| {
                place = (place + GOLDEN) % 1.0;
                place < 0.5
            });
        }
        starts
    }

    /// An effect in each of its mechanism's forms, with the values that it has.
    #[must_use]
    pub fn forms(&self, effect: Effect) -> Vec<Effect> {
        self.on_grid(effect.mechanism(), vec![effect], Parameter::is_form)
    }

    /// Each start at every value of the grid over some parameters.
    fn on_grid(
        &self,
        mechanism: &'static Mechanism,
        starts: Vec<Effect>,
        of: impl Fn(&Parameter) -> bool,
    ) -> Vec<Effect> {
        let places = (0..mechanism.parameters.len()).filter(|place| of(&mechanism.parameters[*place]));
        places.fold(starts, |starts, place| self.along(mechanism, starts, place))
    }

    /// Each start with every value at which this parameter's search begins.
    fn along(&self, mechanism: &Mechanism, starts: Vec<Effect>, place: usize) -> Vec<Effect> {
        let (low, high) = mechanism.parameters[place].range;
        let each = |start: Effect| {
            let values = self.values(&start, place);
            if values.is_empty() {
                return vec![start];
            }
            let with = |value: &f64| {
                let mut effect = start.clone();
                effect.set_value(place, value.clamp(low, high)).ok()?;
                Some(effect)
            };
            values.iter().filter_map(with).collect::<Vec<_>>()
        };
        starts.into_iter().flat_map(each).collect()
    }

    /// Values at which the search of a parameter of an effect begins; none: at its typical value, or it does nothing in this form.
    fn values(&self, effect: &Effect, place: usize) -> Vec<f64> {
        let mechanism = effect.mechanism();
        if !effect.takes_part(place) {
            return Vec::new();
        }
        let parameter = &mechanism.parameters[place];
        let (low, high) = parameter.plausible;
        let spaced = |count: usize, low: f64, high: f64| -> Vec<f64> {
            let part = |number: usize| (number as f64 + 0.5) / count as f64;
            (0..count)
                .map(|number| match parameter.scale {
                    Scale::Logarithmic => low * (high / low).powf(part(number)),
                    Scale::Linear => low + (high - low) * part(number),
                })
                .collect()
        };
        let parts = |of: &[f64], parts: &[f64]| -> Vec<f64> {
            let most = of.last().copied().unwrap_or(1.0);
            parts.iter().map(|part| part * most).collect()
        };
        match parameter.search {
            Search::LaterForm(_)
            | Search::Held
            | Search::EachImpact
            | Search::EachInstant
            | Search::Again
            | Search::Typical => Vec::new(),
            Search::FormWith(needed, values, without) | Search::FormWithLater(needed, values, without, _)
                if !self.has(needed) =>
            {
                values[..without].to_vec()
            }
            Search::FormWith(_, values, _)
            | Search::FormWithLater(_, values, _, _)
            | Search::OneOf(values)
            | Search::Whole(values)
            | Search::Form(values) => values.to_vec(),
            // Finite strengths over all that is likely: what a mechanism shows need not be in proportion. On a scale of differences,
            // where it may have either sign, it mostly is: a little of it.
            Search::Strength if parameter.scale == Scale::Linear => vec![SMALL_PART * high.abs().max(low.abs())],
            // What is lost may have been filled.
            Search::Strength if mechanism.parameters.iter().any(|other| other.search == Search::EachInstant) => {
                spaced(STRENGTHS, low, high).into_iter().chain(self.repeats_s).collect()
            }
            Search::Strength => spaced(STRENGTHS, low, high),
            Search::Plausible => spaced(if parameter.scale == Scale::Linear { 2 } else { 4 }, low, high),
            Search::OfStroke => parts(&self.strokes_m, &[0.1, 0.3, 0.5, 0.7, 0.85, 0.95]),
            Search::OfDepth => {
                let pad_n_per_m = self.pad_n_per_m.filter(|_| effect.get(Parameter::WHOLE.name) == Ok(1.0));
                let behind = pad_n_per_m.map_or(0.0, |pad_n_per_m| pad_n_per_m / self.body_n_per_m);
                parts(&self.depths_m, &[1.1, 1.6, 3.0].map(|part| part * (1.0 + behind)))
            }
            // A chain that clips shows its limit.
            Search::OfPeak => parts(&self.peaks_n, &[0.06, 0.15, 0.35, 0.6, 0.8, 0.93, 1.0]),
            Search::OfContactTime | Search::WithinContact => {
                let middle = self.contact_times_s[self.contact_times_s.len() / 2];
                let parts = if parameter.search == Search::WithinContact {
                    [0.1, 0.25, 0.4, 0.6]
                } else {
                    [0.1, 0.3, 1.0, 5.0]
                };
                parts.map(|part| part * middle).into_iter().filter(|t| *t > 0.3 * low && *t < 3.0 * high).collect()
            }
            Search::Resonance => {
                let stiffness = self.body_n_per_m + self.pad_n_per_m.unwrap_or(0.0);
                let mut values = spaced(5, low, high);
                for hz in &self.lines_hz {
                    let square = (std::f64::consts::TAU * hz).powi(2);
                    if parameter.unit == "kg" {
                        values.extend([self.body_n_per_m / square, stiffness / square]);
                    } else {
                        let mass = mechanism.parameters.iter().find(|other| other.unit == "kg");
                        values.push(1.0 / (square * mass.map_or(1.0, |mass| mass.typical)));
                    }
                }
                values.retain(|value| (parameter.range.0..=parameter.range.1).contains(value));
                values
            }
            Search::OfLines => {
                let mut values: Vec<f64> =
                    self.lines_hz.iter().copied().filter(|f| *f > low && *f < high).take(2).collect();
                values.extend(spaced(3, low, high));
                values
            }
        }
    }
}
