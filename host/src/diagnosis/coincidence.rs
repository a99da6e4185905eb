//! Where a lasting property of the rig may be missing from some recordings, and where that would be a coincidence.
//!
//! Pad, springs, guide, bodies and chain stay what they are from one recording to the next. They may change once (from a recording on, up to
//! one), be of some configurations, or show in the strongest or the weakest blows only, the fastest or the slowest, the heaviest or the
//! lightest. What acts in the second, the fourth and the seventh of twelve is a name for something else, unless nothing else can be it
//! (`verdict.rs`).

use thud_sim::mechanism::Mechanism;

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
