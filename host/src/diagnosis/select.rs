//! Which mechanisms: one after the other, each refitted in full beside its rivals, and dropped again where it is not needed.
//!
//! ```text
//! baseline ─▶ screen ─▶ refit the promising ─▶ best by BIC ─▶ is there a rest? ─▶ again … ─▶ drop what is not missed
//! ```
//!
//! BIC = χ² + p·ln N, N whitened samples, p parameters of the mechanisms (G. Schwarz, Ann. Stat. 6 (1978) 461); a mechanism
//! that acts in some recordings only pays for the choice as well.

use statrs::function::factorial::ln_binomial;
use thud_sim::mechanism::Mechanism;

use super::candidate::Reach;
use super::fit::{Effort, Fit, Part, Tangent};
use super::layout::{Layout, Role, Scope};
use super::locate::{Alone, alone};
use super::omnibus::{Omnibus, omnibus};
use super::problem::{Prepared, Problem};
use super::refit::{Breadth, refit};
use super::screen::{Screened, screen};
use super::verdict::{SIGNIFICANT, UNLIKELY};

/// Fall of BIC that the first mechanism must bring: with its parameter's ln N a fall of χ² of about 5.5².
const ENOUGH: f64 = 20.0;
/// A further one that no smooth rest asks for (it rings, hums or jumps) must bring this.
const UNASKED: f64 = 150.0;
/// And a further one this part of what the model has gained so far.
const FURTHER: f64 = 0.025;
/// Rivals within this of the best in BIC cannot be told apart.
pub const WITHIN_REACH: f64 = 10.0;
/// A baseline that is this much worse than it could be has not converged.
const UNCONVERGED: f64 = 1.0;
/// How often a model grows again after one of its mechanisms was exchanged for a better one.
const ROUNDS: usize = 2;
/// The most mechanisms in one model.
const MOST_MECHANISMS: usize = 3;
/// A model that was fitted, with what it costs.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The fit.
    pub fit: Fit,
    /// Its BIC.
    pub bic: f64,
}

/// A model, and what it leaves.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The model.
    pub trial: Trial,
    /// Derivatives there.
    pub tangent: Tangent,
    /// What it leaves in all recordings together.
    pub rest: Omnibus,
    /// What one recording alone says against it.
    pub alone: Alone,
}

/// What the selection came to.
#[derive(Debug)]
pub struct Selection {
    /// The baseline, re-tuned.
    pub baseline: Fit,
    /// Derivatives there.
    pub baseline_tangent: Tangent,
    /// Scores against the baseline.
    pub screened: Vec<Screened>,
    /// The chosen model; the baseline itself where nothing is needed.
    pub best: Trial,
    /// Derivatives there.
    pub tangent: Tangent,
    /// Whether it leaves a rest.
    pub rest: Omnibus,
    /// What one recording alone says against it.
    pub alone: Alone,
    /// Every other model that was refitted: which mechanism of the best it stands in for, and the model.
    pub rivals: Vec<(usize, Trial)>,
    /// By how much χ² grows without each mechanism of the best.
    pub worth: Vec<f64>,
}

impl Trial {
    /// Counts what its mechanisms cost.
    #[must_use]
    pub fn new(problem: &Problem, fit: Fit) -> Self {
        let bic = fit.cost + penalty(problem, &fit.layout);
        Self { fit, bic }
    }
}

/// What a model's mechanisms cost in BIC.
#[must_use]
pub fn penalty(problem: &Problem, layout: &Layout) -> f64 {
    let rows = problem.rows() as f64;
    let recordings = problem.recordings.len() as f64;
    let of_mechanism = |role: Role| matches!(role, Role::Mechanism { .. });
    let globals = layout.globals.iter().filter(|coordinate| of_mechanism(coordinate.role)).count() as f64;
    let acts_in = |entrant: usize| {
        let scope = layout.entrants[entrant].scope;
        let acts = |(number, recording): &(usize, &Prepared)| scope.includes(*number, recording.configuration);
        problem.recordings.iter().enumerate().filter(acts).count() as f64
    };
    let locals: f64 = layout
        .locals
        .iter()
        .map(|coordinate| match coordinate.role {
            Role::Mechanism { entrant, .. } => acts_in(entrant),
            _ => 0.0,
        })
        .sum();
    let choices: f64 = layout
        .entrants
        .iter()
        .map(|entrant| match entrant.scope {
            Scope::Everywhere => 0.0,
            Scope::Configuration(_) => 2.0 * recordings.ln(),
            // How many of them, and which.
            Scope::Recordings(some) => {
                let (n, k) = (problem.recordings.len() as u64, some.len() as u64);
                2.0 * (recordings.ln() + ln_binomial(n, k.min(n)))
            }
        })
        .sum();
    globals * rows.ln() + locals * (rows / recordings).ln() + choices
}

impl Standing {
    fn of(problem: &Problem, trial: Trial, part: Part<'_>) -> Option<Self> {
        let tangent = trial.fit.tangent(problem, part)?;
        let rest = omnibus(problem, &trial.fit, &tangent);
        let alone = alone(problem, &trial.fit);
        Some(Self { trial, tangent, rest, alone })
    }

    fn mechanisms(&self) -> usize {
        self.trial.fit.layout.entrants.len()
    }

    /// Whether what it leaves is more than noise and traces of the usual imperfections.
    fn asks(&self) -> bool {
        self.rest.z() > SIGNIFICANT || self.alone.p_value < UNLIKELY
    }
}

/// Selects among the given mechanisms.
#[must_use]
pub fn select(
    problem: &Problem,
    baseline: Fit,
    mechanisms: &[&'static Mechanism],
    lines_hz: &dyn Fn(&Fit) -> Vec<f64>,
    progress: &mut dyn FnMut(&str),
) -> Option<Selection> {
    let all: Vec<usize> = (0..problem.recordings.len()).collect();
    let retuned = Standing::of(problem, Trial::new(problem, baseline), &all)?;
    let mut selecting = Selecting {
        problem,
        mechanisms,
        lines_hz,
        part: &all,
        retuned,
        screened: Vec::new(),
        rivals: Vec::new(),
        worth: Vec::new(),
    };
    let mut here = selecting.retuned.clone();
    for _ in 0..ROUNDS {
        here = selecting.grow(here, progress)?;
        selecting.worth = vec![selecting.gained(&here.trial); here.mechanisms()];
        if here.mechanisms() < 2 {
            break;
        }
        progress("is each of them needed");
        let Some(better) = selecting.exchanged(&here) else { break };
        here = Standing::of(problem, better, &all)?;
    }
    let Selecting { retuned, screened, rivals, worth, .. } = selecting;
    let Standing { trial: best, tangent, rest, alone } = here;
    let (baseline, baseline_tangent) = (retuned.trial.fit, retuned.tangent);
    Some(Selection { baseline, baseline_tangent, screened, best, tangent, rest, alone, rivals, worth })
}

/// A selection under way.
struct Selecting<'a> {
    problem: &'a Problem,
    mechanisms: &'a [&'static Mechanism],
    lines_hz: &'a dyn Fn(&Fit) -> Vec<f64>,
    part: Part<'a>,
    retuned: Standing,
    /// Scores against the baseline.
    screened: Vec<Screened>,
    rivals: Vec<(usize, Trial)>,
    worth: Vec<f64>,
}

impl Selecting<'_> {
    /// By how much a model lowers χ².
    fn gained(&self, trial: &Trial) -> f64 {
        (self.retuned.trial.fit.cost - trial.fit.cost).max(0.0)
    }

    /// One mechanism more, as long as one is worth it.
    fn grow(&mut self, from: Standing, progress: &mut dyn FnMut(&str)) -> Option<Standing> {
        let mut here = from;
        while here.mechanisms() < MOST_MECHANISMS {
            let number = here.mechanisms();
            progress(if number == 0 { "which mechanism" } else { "is there another" });
            let scores = self.scores(&here, &here.trial.fit);
            if number == 0 {
                self.screened.clone_from(&scores);
            }
            let trials = refit(self.problem, &here.trial.fit, &scores, here.rest, Breadth::MORE, self.part);
            let Some(next) = trials.first() else { break };
            // A further one has to be worth something beside what is explained already: no rig is quite like its equations.
            let gained = self.gained(&here.trial);
            let enough = if number == 0 || here.asks() { ENOUGH } else { UNASKED };
            if here.trial.bic - next.bic < enough + FURTHER * gained {
                if number == 0 {
                    self.rivals.extend(trials.into_iter().map(|trial| (0, trial)));
                }
                break;
            }
            // What falls without the mechanism as well is the baseline's, which had not converged.
            if number == 0
                && let Some(again) = without(self.problem, next, 0, self.part)
                && again.fit.cost < here.trial.fit.cost - UNCONVERGED
            {
                here = Standing::of(self.problem, again, self.part)?;
                self.retuned = here.clone();
                continue;
            }
            let mut larger = next.clone();
            if number > 0 {
                self.drop_unneeded(&mut larger);
                if larger.fit.layout.entrants.len() <= number {
                    self.rivals.clear();
                    return Standing::of(self.problem, larger, self.part);
                }
            }
            let larger = Standing::of(self.problem, larger, self.part)?;
            // Three that still leave a rest are no explanation: with enough of them anything bends to anything.
            if larger.mechanisms() > 2 && larger.asks() {
                break;
            }
            self.rivals.extend(trials.into_iter().skip(1).map(|trial| (number, trial)));
            here = larger;
        }
        Some(here)
    }

    /// Refits the others in the place of each mechanism; a better model, if there is one.
    fn exchanged(&mut self, here: &Standing) -> Option<Trial> {
        let best = &here.trial;
        self.rivals.clear();
        self.worth.clear();
        for place in 0..here.mechanisms() {
            let fewer = without(self.problem, best, place, self.part);
            self.worth.push(fewer.as_ref().map_or(f64::INFINITY, |fewer| fewer.fit.cost - best.fit.cost));
            let fewer = fewer.and_then(|fewer| Standing::of(self.problem, fewer, self.part));
            let stand_ins = fewer.map(|fewer| {
                let scores = self.scores(&fewer, &best.fit);
                refit(self.problem, &fewer.trial.fit, &scores, fewer.rest, Breadth::INSTEAD, self.part)
            });
            self.rivals.extend(stand_ins.into_iter().flatten().map(|trial| (place, trial)));
        }
        let better = self.rivals.iter().filter(|(_, trial)| trial.bic < best.bic - 1.0);
        let (place, trial) = better.min_by(|a, b| a.1.bic.total_cmp(&b.1.bic)).cloned()?;
        self.rivals.retain(|(of, other)| *of == place && other.bic > trial.bic);
        self.rivals.push((place, best.clone()));
        Some(trial)
    }

    /// Scores beside a model, of all mechanisms that another one has not.
    fn scores(&self, here: &Standing, without: &Fit) -> Vec<Screened> {
        let fit = &here.trial.fit;
        let reach = Reach::of(self.problem, (self.lines_hz)(fit));
        screen(self.problem, fit, &here.tangent, &reach, &remaining(self.mechanisms, without))
    }

    fn drop_unneeded(&self, best: &mut Trial) {
        let gained = self.gained(best);
        while best.fit.layout.entrants.len() > 1 {
            let places = 0..best.fit.layout.entrants.len();
            let smaller = places.filter_map(|place| without(self.problem, best, place, self.part));
            match smaller.min_by(|a, b| a.bic.total_cmp(&b.bic)) {
                Some(trial) if trial.bic < best.bic + ENOUGH + FURTHER * gained => *best = trial,
                _ => break,
            }
        }
    }
}

fn remaining(mechanisms: &[&'static Mechanism], fit: &Fit) -> Vec<&'static Mechanism> {
    let taken =
        |mechanism: &Mechanism| fit.layout.entrants.iter().any(|entrant| entrant.effect.mechanism().id == mechanism.id);
    mechanisms.iter().copied().filter(|mechanism| !taken(mechanism)).collect()
}

/// The model without the mechanism in one place.
#[must_use]
pub fn without(problem: &Problem, trial: &Trial, place: usize, part: Part<'_>) -> Option<Trial> {
    let mut entrants = trial.fit.layout.entrants.clone();
    entrants.remove(place);
    let layout = Layout::new(problem, entrants);
    let start = layout.start_from(problem, &trial.fit.layout, &trial.fit.point);
    Fit::run(problem, layout, start, part, Effort::FULL).map(|fit| Trial::new(problem, fit))
}
