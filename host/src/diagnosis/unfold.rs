//! Fits that grow with time, for what moves the robot where it touches again or in few recordings.
//!
//! ```text
//! what moves the robot, from every start ─▶ the first contact alone ─▶ the best of each mechanism
//!                                        ─▶ a little longer, again and again, ever fewer of them ─▶ whole recordings
//! ```
//!
//! A push that is too strong brings the robot back, and when the next contact begins depends on how the robot has left the last one: over
//! whole recordings χ² is all valleys, and a fit ends in that where it has begun. Over the first contact it has few; from there on every
//! stretch begins where the one before has led (multiple shooting does the same with all stretches at once: H. G. Bock, in
//! Modelling of Chemical Reaction Systems, Springer 1981, 102).

use rayon::prelude::*;
use thud_sim::mechanism::{Effect, Group, Mechanism, Search, Site};

use super::candidate::Reach;
use super::fit::{Effort, Fit, Part};
use super::layout::{Entrant, Scope};
use super::problem::{Prepared, Problem};
use super::select::Trial;
use super::subset::Subset;
use crate::recording::FORCE;

/// The robot touches again, or still, where so many contact times after the first contact a force is this part of the peak.
const AGAIN_CONTACTS: f64 = 1.6;
const AGAIN_FORCE: f64 = 0.1;
/// By how much each stretch is longer than the one before.
const LONGER: f64 = 1.15;
/// How many mechanisms are followed up to how many contact times.
const FOLLOWED: [(f64, usize); 3] = [(1.5, 6), (3.0, 3), (f64::INFINITY, 2)];
/// How many shapes of a form are fitted to the first contact: those that are nearest to it as they are.
const BEGUN: usize = 24;
/// And how many of them are left by each further effort: after the second the best one leads.
const NARROWED: [(Effort, usize); 3] = [(Effort::LOOK, 16), (Effort::AGAIN, 4), (Effort::FULL, 1)];
/// Steps along one tangent after the first: where a push holds the robot a valley is narrow, and each tangent gains little.
const FURTHER: usize = 3;
/// Where a shape that has one typical value is begun as well: this far into what is likely of it.
const LOW: f64 = 0.25;

/// The recordings that show that the robot touches the rig again, or has stayed.
#[must_use]
pub fn touching_again(problem: &Problem) -> Subset {
    let Some(force) = problem.channels.iter().position(|channel| channel.column == FORCE) else {
        return Subset::default();
    };
    let touches = |recording: &Prepared| {
        let offset = recording.offset_guess[force];
        let later = recording.contact_guess_s + AGAIN_CONTACTS * recording.contact_time_s;
        let from = recording.times_s.partition_point(|time| *time <= later);
        let highest = |forces: &[f64]| forces.iter().map(|force| force - offset).fold(0.0, f64::max);
        highest(&recording.series[force][from..]) > AGAIN_FORCE * highest(&recording.series[force])
    };
    let recordings = problem.recordings.iter().enumerate();
    recordings.filter(|(_, recording)| touches(recording)).map(|(number, _)| number).collect()
}

/// What moves the robot, beside what was stated and in each of these scopes, fitted from the first contact on. The best comes first.
#[must_use]
pub fn unfolded(
    problem: &Problem,
    base: &Fit,
    mechanisms: &[&'static Mechanism],
    scopes: &[Scope],
    part: Part<'_>,
) -> Vec<Trial> {
    let mut trials: Vec<Trial> =
        scopes.iter().flat_map(|scope| grown(problem, base, mechanisms, *scope, part)).collect();
    trials.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    trials
}

/// Fits that have grown from the first contact to whole recordings.
fn grown(problem: &Problem, base: &Fit, mechanisms: &[&'static Mechanism], scope: Scope, part: Part<'_>) -> Vec<Trial> {
    let reach = Reach::of(problem, Vec::new());
    let first = problem.until(1.0);
    let run = |problem: &Problem, fit: Fit, effort| {
        Fit::run(problem, fit.layout, fit.point, part, Effort { further: FURTHER, ..effort })
    };
    let begin = |effect: Effect| {
        let layout = base.layout.with(problem, Entrant { scope, ..Entrant::everywhere(effect) });
        let start = layout.as_stated(&layout.start_from(problem, &base.layout, &base.point));
        Fit::touching(&first, layout, start, part)
    };
    // Of each shape the strength that is nearest as it is: the nearest of all are of few shapes.
    let nearest = |shape: Vec<Effect>| {
        let begun = shape.into_par_iter().filter_map(begin);
        begun.min_by(|a, b| a.cost.total_cmp(&b.cost))
    };
    let best_from = |starts: Vec<Effect>| {
        let shapes = alike(starts, |a, b| a.values()[1..] == b.values()[1..]);
        let mut begun: Vec<Fit> = shapes.into_par_iter().filter_map(nearest).collect();
        begun.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        // What a form does not use makes no difference.
        begun.dedup_by(|a, b| a.cost == b.cost);
        begun.truncate(BEGUN);
        for (effort, most) in NARROWED {
            begun = begun.into_par_iter().filter_map(|fit| run(&first, fit, effort)).collect();
            begun.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            begun.truncate(most);
        }
        begun.into_iter().next()
    };
    // One of each form: what the first contact likes best is not what the whole shows.
    let best_of = |mechanism: &&'static Mechanism| {
        alike(starts(&reach, mechanism), Effect::has_form_of).into_iter().filter_map(best_from).collect::<Vec<Fit>>()
    };
    // In few recordings what else the robot does is found without.
    let moves = |mechanism: &Mechanism| scope == Scope::Everywhere || mechanism.site == Site::Drive;
    let of_robot = mechanisms.iter().filter(|mechanism| mechanism.group == Group::Robot && moves(mechanism));
    let mut fits: Vec<Fit> = of_robot.flat_map(best_of).collect();
    let lasts = |recording: &Prepared| recording.lasts_s() / recording.contact_time_s;
    let whole = problem.recordings.iter().map(lasts).fold(1.0, f64::max);
    let mut contacts = LONGER;
    while contacts < whole {
        let longer = problem.until(contacts);
        fits = fits.into_par_iter().filter_map(|fit| run(&longer, fit, Effort::AGAIN)).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let followed = FOLLOWED.iter().find(|(until, _)| contacts < *until).map_or(1, |(_, many)| *many);
        fits.truncate(followed);
        contacts *= LONGER;
    }
    fits.into_par_iter().filter_map(|fit| Some(Trial::new(problem, run(problem, fit, Effort::FULL)?))).collect()
}

/// A mechanism's starts, and the same with each typical value lower.
fn starts(reach: &Reach, mechanism: &'static Mechanism) -> Vec<Effect> {
    let starts = reach.starts(mechanism);
    let typical = mechanism.parameters.iter().enumerate().filter(|(_, one)| one.search == Search::Typical);
    let lower = typical.flat_map(|(place, parameter)| {
        let (low, high) = parameter.plausible;
        let value = if low > 0.0 { low * (high / low).powf(LOW) } else { low + LOW * (high - low) };
        starts.iter().filter_map(move |start| {
            let mut effect = start.clone();
            effect.set_value(place, value).ok()?;
            Some(effect)
        })
    });
    lower.chain(starts.iter().cloned()).collect()
}

/// Effects in groups of those that are alike.
fn alike(effects: Vec<Effect>, are: impl Fn(&Effect, &Effect) -> bool) -> Vec<Vec<Effect>> {
    let mut groups: Vec<Vec<Effect>> = Vec::new();
    for effect in effects {
        match groups.iter_mut().find(|group| are(&group[0], &effect)) {
            Some(group) => group.push(effect),
            None => groups.push(vec![effect]),
        }
    }
    groups
}
