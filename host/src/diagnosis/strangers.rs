//! Recordings that the others do not foretell: what is different about them says what acts in them only.
//!
//! A fit to all recordings spreads what few of them have over all: springs and masses imitate it, and its tangent may point away from
//! it. The others alone tell the rig; beside it the few stand out.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::fit::{Effort, Fit};
use super::layout::Scope;
use super::locate::{SIGNIFICANT, speaking};
use super::problem::Problem;
use super::subset::Subset;

/// Rounds in which the recordings that stand out and those that tell the rig come to an agreement.
const SETTLING: usize = 6;
/// What is stated of each recording: its speed, and how well springs repeat.
const STATED: f64 = 2.0;

/// The fewest recordings that the others do not foretell while these agree with the fit's model; `None`: none, or more than half.
#[must_use]
pub fn strangers(problem: &Problem, fit: &Fit) -> Option<Scope> {
    let count = problem.recordings.len();
    let is_few = |some: &Subset| !some.is_empty() && 2 * some.len() <= count;
    let mut loudest: Vec<usize> = (0..count).collect();
    let excess = |number: usize| fit.recording_cost(number) - fit.residuals[number].len() as f64;
    loudest.sort_by(|a, b| excess(*b).total_cmp(&excess(*a)));
    let loudest: Subset = loudest.into_iter().take(count / 2).collect();
    let begun = (0..problem.configurations.len())
        .map(|number| of_configuration(problem, number))
        .chain([loudest])
        .filter(is_few);
    let settled = begun.filter_map(|begun| settled(problem, fit, begun)).filter(is_few);
    settled.min_by_key(|some| some.len()).map(|some| Scope::of(problem, some))
}

/// What the recordings of all other configurations tell, and this one's mass as stated: a mass that imitates what acts in its configuration alone hides it.
#[must_use]
pub fn told_by_others(problem: &Problem, fit: &Fit, configuration: usize) -> Option<Fit> {
    let told = told_without(problem, fit, &of_configuration(problem, configuration))?;
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    Fit::touching(problem, told.layout, told.point, &all)
}

/// The recordings of one configuration.
fn of_configuration(problem: &Problem, configuration: usize) -> Subset {
    let recordings = problem.recordings.iter().enumerate();
    recordings.filter(|(_, recording)| recording.configuration == configuration).map(|(number, _)| number).collect()
}

/// A fit's model by all but some recordings, from what was stated; `None`: there are no others.
fn told_without(problem: &Problem, fit: &Fit, some: &Subset) -> Option<Fit> {
    let others: Vec<usize> = (0..problem.recordings.len()).filter(|number| !some.includes(*number)).collect();
    if others.is_empty() {
        return None;
    }
    Fit::run(problem, fit.layout.clone(), fit.layout.as_stated(&fit.point), &others, Effort::FULL)
}

/// The recordings that stand out beside what the others tell, and the others beside these, until both agree.
fn settled(problem: &Problem, fit: &Fit, begun: Subset) -> Option<Subset> {
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let mut some = begun;
    for _ in 0..SETTLING {
        let told = told_without(problem, fit, &some)?;
        let shown = Fit::run(problem, told.layout, told.point, &all, Effort::LOCAL)?;
        let speaking = speaking(problem, &shown);
        let stands_out = |number: &usize| speaking.contains(number) || is_strained(problem, &shown, *number);
        let now: Subset = all.iter().copied().filter(stands_out).collect();
        if now == some {
            return Some(some);
        }
        some = now;
    }
    None
}

/// Whether what is stated of a recording alone, its speed and its springs, is further off than chance has it in any of so many.
fn is_strained(problem: &Problem, fit: &Fit, recording: usize) -> bool {
    let strain = fit.own_cost(problem, recording) - fit.recording_cost(recording);
    let by_chance = ChiSquared::new(STATED).map_or(1.0, |by_chance| by_chance.sf(strain));
    by_chance * (problem.recordings.len() as f64) < SIGNIFICANT
}
