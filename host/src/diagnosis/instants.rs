//! Instants that each recording has for itself, sought anew at the strength that a fit has found.
//!
//! A signature is placed where it fits best at the strength that it is tried with. From there strength and instants move together, and χ² over an
//! instant is flat between the samples and steep across them: a fit that begins with a third of what was lost ends beside where it was lost.

use rayon::prelude::*;
use thud_sim::mechanism::Search;
use thud_sim::rig::Impact;

use super::fit::{Effort, Fit, Part, cost_of_one};
use super::layout::{Point, Role, Scope};
use super::predict;
use super::problem::Problem;

/// Instants that are tried over what a recording shows, and how often their distance is halved about the best.
const SPREAD: usize = 64;
const HALVINGS: i32 = 6;
/// An instant elsewhere that gains more than this in χ² was missed.
const MISSED: f64 = 1.0;
/// How often they are sought: with each round the strength is nearer to what it should be.
const ROUNDS: usize = 4;

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
    let layout = &fit.layout;
    let instants = layout.locals.iter().enumerate().filter_map(|(local, coordinate)| match coordinate.role {
        Role::Mechanism { entrant, place } => {
            let entrant = &layout.entrants[entrant];
            let is_instant = entrant.effect.mechanism().parameters[place].search == Search::EachInstant;
            is_instant.then_some((local, entrant.scope))
        }
        _ => None,
    });
    let instants: Vec<_> = instants.collect();
    if instants.is_empty() {
        return None;
    }
    let mut point = fit.point.clone();
    let locals: Vec<Vec<f64>> =
        part.par_iter().map(|recording| sought_in(problem, fit, *recording, &instants)).collect();
    for (recording, locals) in part.iter().zip(locals) {
        point.locals[*recording] = locals;
    }
    Fit::at(problem, layout.clone(), point, part)
}

/// What one recording has for itself, with each instant where it fits best.
fn sought_in(problem: &Problem, fit: &Fit, recording: usize, instants: &[(usize, Scope)]) -> Vec<f64> {
    let mut point = fit.point.clone();
    if let Ok(impact) = predict::strike(problem, &fit.layout, &point, recording) {
        let configuration = problem.recordings[recording].configuration;
        for (local, _) in instants.iter().filter(|(_, scope)| scope.includes(recording, configuration)) {
            point = best_of(problem, fit, point, recording, &impact, *local);
        }
    }
    point.locals.swap_remove(recording)
}

/// A point with one instant where it fits best: spread over what the recording shows, and ever nearer to the best of these.
fn best_of(problem: &Problem, fit: &Fit, point: Point, recording: usize, impact: &Impact, local: usize) -> Point {
    let at = |instant_s: f64| {
        let mut point = point.clone();
        point.locals[recording][local] = instant_s;
        let impact = predict::through(problem, &fit.layout, &point, recording, impact);
        let cost = impact.map_or(f64::INFINITY, |impact| {
            let values = predict::read(problem, &fit.layout, &point, recording, &impact, 0.0);
            cost_of_one(problem, &fit.layout, &point, recording, &values)
        });
        (cost, instant_s)
    };
    let better = |best: (f64, f64), other: (f64, f64)| if other.0 < best.0 { other } else { best };
    let apart_s = problem.eventful_s(recording) / SPREAD as f64;
    let spread = (0..SPREAD).map(|place| at(apart_s * (place as f64 + 0.5)));
    let mut best = spread.fold(at(point.locals[recording][local]), better);
    for halving in 1..=HALVINGS {
        let step_s = apart_s * 0.5_f64.powi(halving);
        best = [best.1 - step_s, best.1 + step_s].map(at).into_iter().fold(best, better);
    }
    let mut point = point;
    point.locals[recording][local] = best.1;
    point
}
