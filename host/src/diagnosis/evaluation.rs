//! Does a model still hold? A model that was found earlier against a campaign that it has never seen.
//!
//! The model is frozen. Of each recording only what every recording has for itself is estimated: contact instant, offset, its speed
//! within the stated uncertainty, its configuration's mass within that, the springs' repeatability. What is then left says how far off
//! the model is. Whether that is more than the model itself admits is asked in a second fit, in which its stiffnesses and parameters
//! may move within their stated uncertainty:
//!
//! | | |
//! |---|---|
//! | `holds` | nothing is left, and nothing had to move |
//! | `changed` | it fits, but only with a stiffness or parameter that has moved beyond its uncertainty |
//! | `unexplained` | something is left that no such move explains |

use serde::Serialize;
use thud_sim::mechanism::Search;

use super::answer::FORMAT_EVALUATION;
use super::fit::{Effort, Fit};
use super::held_out::{pooled, rmse};
use super::layout::{Coordinate, Entrant, Layout, Point, Role, Scope, coordinate_of};
use super::omnibus::omnibus;
use super::predict;
use super::problem::Problem;
use super::words;
use super::{DiagnosisError, Note};
use crate::campaign::{Loaded, Rig};
use crate::model::Model;

/// A move beyond this many of its own deviations is a change: with ten moves looked at, chance makes one in 1500 campaigns.
const CHANGED: f64 = 4.0;
/// A rest is significant from here, in standard deviations of the omnibus test: as for the verdict of a diagnosis.
const SIGNIFICANT: f64 = 6.0;
/// And it is worth a word where it raises the rmse by this part of the noise: no rig is without traces of something.
const WORTH: f64 = 0.005;
/// Two-sided 95 % of a normal distribution.
const DEVIATIONS_95: f64 = 1.959_964;
/// Parts of a turn at which a fit is started where each impact has its own phase.
const PHASES: usize = 4;
/// Parts of the contact at which one is started where each impact has its own instant, as many as the search for it tries: a fit finds
/// an instant from a few samples off, not from further.
const INSTANTS: usize = 40;

/// What the evaluation says.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys, and those that stand beside them")]
pub struct Evaluation {
    pub format: &'static str,
    /// Over all recordings, each sample counted once, in the observed channel's unit.
    pub rmse: f64,
    /// That over the noise before contact.
    pub noise_ratio: f64,
    /// `holds`, `changed` or `unexplained`.
    pub verdict: &'static str,
    /// The verdict in a sentence, with its reason.
    pub because: String,
    pub recordings: Vec<Evaluated>,
    /// What of the model would have to move, and by how many of its own deviations.
    pub moved: Vec<Moved>,
    /// What was odd.
    pub notes: Vec<String>,
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the contract's own keys, and those that stand beside them")]
pub struct Evaluated {
    pub file: String,
    pub rmse: f64,
    pub noise_ratio: f64,
    /// Estimated instant of contact in the recording's own time.
    pub contact_s: f64,
    /// Estimated speed at contact.
    pub impact_speed_m_per_s: f64,
    /// Estimated effective mass.
    pub effective_mass_kg: f64,
}

/// A number of the model that these recordings would move.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[expect(missing_docs, reason = "keys of a file")]
pub struct Moved {
    pub name: String,
    pub from: f64,
    pub to: f64,
    /// Signed, in standard deviations that the model states.
    pub deviations: f64,
}

/// Evaluates a model on a campaign.
///
/// # Errors
/// A campaign that cannot be used, or that is of another kind than the model.
pub fn evaluate(model: &Model, loaded: &Loaded) -> Result<Evaluation, DiagnosisError> {
    if model.rig.kind != loaded.campaign.rig.kind {
        return Err(DiagnosisError::OtherKind {
            model: model.rig.kind.name(),
            campaign: loaded.campaign.rig.kind.name(),
        });
    }
    let mut loaded = loaded.clone();
    loaded.campaign.rig = Rig {
        spring_repeatability: loaded.campaign.rig.spring_repeatability,
        gravity_along_impact_m_per_s2: loaded.campaign.rig.gravity_along_impact_m_per_s2,
        ..model.rig.clone()
    };
    let mut notes: Vec<Note> = Vec::new();
    let problem = Problem::new(&loaded, &mut notes)?;
    let entrants = entrants(model, &problem, &mut notes);
    let whole = Layout::new(&problem, entrants);
    let frozen_layout = frozen(whole.clone());
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let impossible = || DiagnosisError::Impossible("its motion cannot be followed".to_owned());
    let fit = best_own(&problem, &frozen_layout, &all).ok_or_else(impossible)?;
    let each: Vec<f64> = all
        .iter()
        .map(|number| {
            predict::raw(&problem, &fit.layout, &fit.point, *number)
                .map_or(f64::NAN, |values| rmse(&problem.recordings[*number].raw.values, &values))
        })
        .collect();
    let noise = problem.noise_rms();
    let overall = pooled(&problem, &each);
    let free = Fit::run(
        &problem,
        admitted(model, whole.clone()),
        whole.start_from(&problem, &fit.layout, &fit.point),
        &all,
        Effort::FULL,
    );
    let (verdict, because, moved) = judge(&problem, free.as_ref().unwrap_or(&fit), &all, overall, noise);
    let recordings = all
        .iter()
        .map(|&number| {
            let recording = &problem.recordings[number];
            let speed = fit.layout.local(&fit.point, number, Role::Speed).unwrap_or(0.0);
            let mass = fit.layout.global(&fit.point, Role::Mass(recording.configuration)).unwrap_or(0.0);
            Evaluated {
                file: recording.file.clone(),
                rmse: each[number],
                noise_ratio: each[number] / recording.raw.quiet_rms.unwrap_or(noise),
                contact_s: fit.layout.contact_s(&problem, &fit.point, number),
                impact_speed_m_per_s: recording.speed.value + recording.speed_scale() * speed,
                effective_mass_kg: recording.mass.value * mass.exp(),
            }
        })
        .collect();
    Ok(Evaluation {
        format: FORMAT_EVALUATION,
        rmse: overall,
        noise_ratio: overall / noise,
        verdict,
        because,
        recordings,
        moved,
        notes: notes.iter().map(ToString::to_string).collect(),
    })
}

/// The model's mechanisms; one that acts in a configuration that this campaign has not is left out.
fn entrants(model: &Model, problem: &Problem, notes: &mut Vec<Note>) -> Vec<Entrant> {
    model
        .mechanisms
        .iter()
        .filter_map(|mechanism| {
            let scope = match &mechanism.only_in {
                None => Scope::Everywhere,
                Some(name) => match problem.configurations.iter().position(|known| known == name) {
                    Some(number) => Scope::Configuration(number),
                    None => {
                        let id = mechanism.effect.mechanism().id;
                        notes.push(Note::general(&format!(
                            "`{id}` acts in configuration {name} only, which this campaign has not; it is left out"
                        )));
                        return None;
                    }
                },
            };
            Some(Entrant { scope, ..Entrant::everywhere(mechanism.effect.clone()) })
        })
        .collect()
}

/// Only masses, delays between channels and what each recording has for itself.
fn frozen(mut layout: Layout) -> Layout {
    layout.globals.retain(|coordinate| matches!(coordinate.role, Role::Mass(_) | Role::Delay(_)));
    layout.of_rig = layout.globals.iter().filter(|coordinate| matches!(coordinate.role, Role::Mass(_))).count();
    layout
}

/// Stiffnesses and parameters free within what the model itself says of them; what it holds stays held.
fn admitted(model: &Model, mut layout: Layout) -> Layout {
    for coordinate in &mut layout.globals {
        if let Role::Mechanism { entrant, place } = coordinate.role {
            let effect = &layout.entrants[entrant].effect;
            let parameter = &effect.mechanism().parameters[place];
            let stated = model.mechanisms.iter().find(|mechanism| mechanism.effect == *effect);
            let interval = stated.and_then(|mechanism| mechanism.intervals.get(place).copied().flatten());
            let mean = coordinate_of(parameter, effect.value(place));
            let half = interval.map_or(0.0, |interval| {
                0.5 * (coordinate_of(parameter, interval.high) - coordinate_of(parameter, interval.low)).abs()
            });
            // Rounding of a file, at least.
            coordinate.prior = Some((mean, (half / DEVIATIONS_95).max(1e-4 * mean.abs()).max(1e-6)));
        }
    }
    layout
}

/// The fit of what is each recording's own. Where mechanisms have a phase or an instant of each impact, several are tried and each
/// recording keeps its best.
fn best_own(problem: &Problem, layout: &Layout, all: &[usize]) -> Option<Fit> {
    let run = |start: Point| Fit::run(problem, layout.clone(), start, all, Effort::FULL);
    let mut starts = starts(problem, layout);
    if starts.len() == 1 {
        return run(starts.remove(0));
    }
    let mut best: Option<Fit> = None;
    for start in starts {
        let Some(fit) = run(start) else { continue };
        best = Some(match best {
            None => fit,
            Some(mut best) => {
                for number in all {
                    if fit.recording_cost(*number) < best.recording_cost(*number) {
                        best.point.locals[*number].clone_from(&fit.point.locals[*number]);
                        best.residuals[*number].clone_from(&fit.residuals[*number]);
                    }
                }
                best
            }
        });
    }
    run(best?.point)
}

/// Where fits begin: phases at parts of a turn. Instants as the model has them, at parts of the contact, and at the end of the
/// recording, which it then does not concern. One start where no mechanism has either.
fn starts(problem: &Problem, layout: &Layout) -> Vec<Point> {
    let own: Vec<(usize, Search)> = layout
        .locals
        .iter()
        .enumerate()
        .filter_map(|(local, coordinate)| match coordinate.role {
            Role::Mechanism { entrant, place } => {
                Some((local, layout.entrants[entrant].effect.mechanism().parameters[place].search))
            }
            _ => None,
        })
        .collect();
    let instants = own.iter().any(|(_, search)| *search == Search::EachInstant);
    let count = match (own.is_empty(), instants) {
        (true, _) => 1,
        (false, false) => PHASES,
        (false, true) => INSTANTS + 2,
    };
    let as_given = layout.start(problem);
    (0..count)
        .map(|number| {
            let mut start = as_given.clone();
            for (place, locals) in start.locals.iter_mut().enumerate() {
                for (local, search) in &own {
                    let value = &mut locals[*local];
                    *value = match search {
                        Search::EachInstant | Search::Again if number == 0 => *value,
                        Search::Again => problem.recordings[place].lasts_s(),
                        Search::EachInstant if number > INSTANTS => problem.recordings[place].lasts_s(),
                        Search::EachInstant => problem.eventful_s(place) * (number as f64 - 0.5) / INSTANTS as f64,
                        _ => *value + std::f64::consts::TAU * number as f64 / count as f64,
                    };
                }
            }
            start
        })
        .collect()
}

fn judge(problem: &Problem, fit: &Fit, all: &[usize], overall: f64, noise: f64) -> (&'static str, String, Vec<Moved>) {
    let moved: Vec<Moved> = fit
        .layout
        .globals
        .iter()
        .zip(&fit.point.globals)
        .filter_map(|(coordinate, value)| moved(problem, fit, coordinate, *value))
        .collect();
    let rest = fit.tangent(problem, all).map(|tangent| omnibus(problem, fit, &tangent));
    let rest_z = rest.map_or(f64::INFINITY, |rest| rest.z());
    let rows = problem.rows() as f64;
    // The excess is a sum of squares in units of the noise, over all samples.
    let raises = rest.map_or(1.0, |rest| 0.5 * rest.excess / rows);
    let count = problem.recordings.len();
    let recordings = if count == 1 { "this recording".to_owned() } else { format!("these {count} recordings") };
    let ratio = overall / noise;
    let most = moved.iter().max_by(|a, b| a.deviations.abs().total_cmp(&b.deviations.abs()));
    if rest_z > SIGNIFICANT && raises > WORTH {
        let because = format!(
            "The model does not hold: it leaves {ratio:.2} times the noise in {recordings}, and nothing that it admits as uncertain explains it (the rest is {rest_z:.0} standard deviations of a test against anything smooth). `thud diagnose` says what is new."
        );
        return ("unexplained", because, moved);
    }
    if let Some(most) = most
        && most.deviations.abs() > CHANGED
    {
        let because = format!(
            "The rig has changed: {recordings} fit only with {} = {} instead of {}, {:.0} of its own standard deviations away.",
            most.name,
            words::short(most.to),
            words::short(most.from),
            most.deviations.abs()
        );
        return ("changed", because, moved);
    }
    let because = format!(
        "The model still holds: {recordings} show {ratio:.2} times the noise, and nothing in the rest is significant."
    );
    ("holds", because, moved)
}

fn moved(problem: &Problem, fit: &Fit, coordinate: &Coordinate, value: f64) -> Option<Moved> {
    let (mean, sd) = coordinate.prior?;
    let deviations = (value - mean) / sd;
    let of_rig = |name: String, stated: f64| Moved { name, from: stated, to: stated * value.exp(), deviations };
    Some(match coordinate.role {
        Role::Body => of_rig("body_stiffness_N_per_m".to_owned(), problem.rig.body_stiffness_n_per_m?.value),
        Role::Pad => of_rig("pad_stiffness_N_per_m".to_owned(), problem.rig.pad_stiffness_n_per_m?.value),
        Role::Mass(number) => of_rig(format!("effective_mass_ratio[{}]", problem.configurations[number]), 1.0),
        Role::Mechanism { entrant, place } => {
            let effect = &fit.layout.entrants[entrant].effect;
            let parameter = &effect.mechanism().parameters[place];
            Moved {
                name: format!("{} of {}", parameter.name, effect.mechanism().id),
                from: effect.value(place),
                to: super::layout::value_of(parameter, value),
                deviations,
            }
        }
        _ => return None,
    })
}
