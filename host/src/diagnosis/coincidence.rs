//! Where a lasting property of the rig may be missing from some recordings, and where that would be a coincidence.
//!
//! Pad, springs, guide, bodies and chain stay what they are from one recording to the next. They may change once (from a recording on, up to
//! one), be of some configurations, or show in the strongest or the weakest blows only, the fastest or the slowest, the heaviest or the
//! lightest. What acts in the second, the fourth and the seventh of twelve is a name for something else, unless nothing else can be it
//! (`verdict.rs`).
//!
//! What a logger loses it loses at any instant. Gaps at the same part of every contact, where it is touched, turns or separates, stand for something that
//! happens there.

use std::ops::Range;

use statrs::function::factorial::binomial;
use thud_sim::mechanism::Mechanism;

use super::fit::Fit;
use super::layout::{Entrant, Scope};
use super::problem::Problem;
use super::subset::Subset;

/// From so many recordings on one more may show too little of it to be counted.
const ONE_MORE: usize = 3;

/// Whether a mechanism would have to choose its recordings.
#[must_use]
pub fn is_coincidence(problem: &Problem, entrant: &Entrant) -> bool {
    let mechanism: &Mechanism = entrant.effect.mechanism();
    let Scope::Recordings(some) = entrant.scope else { return false };
    let count = problem.recordings.len();
    let one_more = || {
        let others = (0..count).filter(|number| some.len() >= ONE_MORE && !some.includes(*number));
        others
            .map(|number| some.iter().chain([number]).collect::<Subset>())
            .any(|more| have_something_in_common(problem, more))
    };
    mechanism.lasting && !have_something_in_common(problem, some) && !one_more()
}

/// Instants that lie so close together by chance in one of so many trials, or less, are at one place. Of sixteen campaigns of five simulators that had lost
/// samples, at any instant, the closest lie so in one of 40; of four that had not, two in one of more than 10⁷.
const TOGETHER: f64 = 2e-3;
/// Fewer are no crowd.
const CROWD: usize = 3;
/// Parts of a contact at which something happens by itself: it is touched, turns and separates.
const EVENTS: [f64; 3] = [0.0, 0.5, 1.0];
/// No farther from one of these than this part of the contact is there.
const BESIDE: f64 = 0.05;

/// Whether what has an instant of its own in each impact comes, in too many of them, at the same part of the contact, at which something happens by itself.
#[must_use]
pub fn is_at_an_event(problem: &Problem, fit: &Fit, entrant: usize) -> bool {
    let scope = fit.layout.entrants[entrant].scope;
    let instants = fit.layout.instants(entrant);
    if instants.is_empty() || !problem.has_springs() {
        return false;
    }
    // Where each begins and how long it lasts, in parts of the contact.
    let mut parts: Vec<(f64, f64)> = Vec::new();
    for (number, (recording, locals)) in problem.recordings.iter().zip(&fit.point.locals).enumerate() {
        if scope.includes(number, recording.configuration) {
            let lasts_s = fit.layout.effect_at(problem, entrant, &fit.point, number).value(0);
            let come = instants.iter().map(|local| locals[*local]).filter(|at_s| recording.shows(*at_s));
            parts.extend(come.map(|at_s| (at_s / recording.contact_time_s, lasts_s / recording.contact_time_s)));
        }
    }
    parts.sort_by(|one, other| one.0.total_cmp(&other.0));
    let begin: Vec<f64> = parts.iter().map(|(part, _)| *part).collect();
    let (p, crowd) = closest(&begin);
    let (begins, lasts) = parts.get(crowd.start.midpoint(crowd.end)).copied().unwrap_or_default();
    let is_beside = |event: &f64| (begins - BESIDE..=begins + lasts + BESIDE).contains(event);
    p < TOGETHER && EVENTS.iter().any(is_beside)
}

/// The crowd of instants anywhere in a unit of time, in order, that is least to be expected: a bound of its probability, C(n, k)·k·w^(k−1) for k of them
/// within w (given the first of the k, the others follow within w), and which they are.
fn closest(parts: &[f64]) -> (f64, Range<usize>) {
    let count = parts.len();
    let crowds = (CROWD..=count).flat_map(|crowd| (0..=count - crowd).map(move |first| first..first + crowd));
    let p = |crowd: &Range<usize>| {
        let width = (parts[crowd.end - 1] - parts[crowd.start]).max(f64::MIN_POSITIVE);
        binomial(count as u64, crowd.len() as u64) * crowd.len() as f64 * width.powi(crowd.len() as i32 - 1)
    };
    let rarest = crowds.map(|crowd| (p(&crowd), crowd)).min_by(|one, other| one.0.total_cmp(&other.0));
    rarest.filter(|(p, _)| *p < 1.0).unwrap_or((1.0, 0..0))
}

/// Whether recordings are those of some configurations, or the first or the last of all by something.
fn have_something_in_common(problem: &Problem, some: Subset) -> bool {
    let recordings = &problem.recordings;
    let of = |configuration: usize| {
        let of_it = (0..recordings.len()).filter(move |number| recordings[*number].configuration == configuration);
        let inside = of_it.clone().filter(|number| some.includes(*number)).count();
        inside == 0 || inside == of_it.count()
    };
    let is_end = |key: &dyn Fn(usize) -> f64| {
        let (inside, outside): (Vec<usize>, Vec<usize>) =
            (0..recordings.len()).partition(|number| some.includes(*number));
        let ends = |numbers: &[usize]| {
            let keys = numbers.iter().map(|number| key(*number));
            keys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), key| (low.min(key), high.max(key)))
        };
        let (inside, outside) = (ends(&inside), ends(&outside));
        inside.1 <= outside.0 || outside.1 <= inside.0
    };
    let energy = |number: usize| recordings[number].mass.value * recordings[number].speed.value.powi(2);
    (0..problem.configurations.len()).all(of)
        || is_end(&|number| f64::from(recordings[number].order))
        || is_end(&|number| recordings[number].speed.value)
        || is_end(&|number| recordings[number].mass.value)
        || is_end(&energy)
        || is_end(&|number| problem.peak_n(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of six in a unit of time, against a count of as many drawn ones.
    #[test]
    fn a_crowd_is_as_rare_as_it_is_in_drawn_instants() {
        let mut state = 1_u64;
        let mut uniform = || {
            // D. E. Knuth's MMIX generator.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut drawn = |_| {
            let mut parts: Vec<f64> = (0..6).map(|_| uniform()).collect();
            parts.sort_by(f64::total_cmp);
            closest(&parts).0
        };
        let trials: Vec<f64> = (0..20_000).map(&mut drawn).collect();
        for limit in [0.1, 0.02, TOGETHER] {
            let rarer = trials.iter().filter(|p| **p < limit).count() as f64 / 20_000.0;
            // The least of four bounds.
            assert!(rarer < 4.0 * limit, "{rarer} below {limit}");
        }
        let (p, crowd) = closest(&[0.2, 0.44, 0.44, 0.45, 0.45, 0.46, 0.9]);
        assert!(p < TOGETHER && crowd == (1..6), "{p} {crowd:?}");
        assert!(closest(&[0.41, 0.58, 0.63, 0.64, 0.65]).0 > TOGETHER);
        assert_eq!(closest(&[0.2, 0.2]), (1.0, 0..0));
    }
}
