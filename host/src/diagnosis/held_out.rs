//! Recordings that took no part: fitted on the others, shown on these.
//!
//! Whole recordings are left out, a part of them at a time, each part spread over the range of forces. Rig and mechanisms come from the
//! others; of the recording left out only what every recording has for itself is estimated (contact instant, offset, speed and spring
//! within their stated uncertainty).

use super::fit::{Effort, Fit};
use super::layout::Role;
use super::predict;
use super::problem::Problem;
use super::select::penalty;

/// In how many parts the recordings are left out.
const FOLDS: usize = 4;

/// How well recordings are shown that took no part.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Root mean square of recording minus model, in the channel's unit, for each recording.
    pub rmse: Vec<f64>,
    /// Values of the model at every sample, for each recording.
    pub model: Vec<Vec<f64>>,
    /// Square sum of whitened residuals of each recording, with what its own coordinates cost.
    pub cost: Vec<f64>,
}

impl HeldOut {
    /// Over all recordings, each sample counted once.
    #[must_use]
    pub fn overall(&self, problem: &Problem) -> f64 {
        pooled(problem, &self.rmse)
    }
}

/// Root mean square over all samples from that of each recording.
#[must_use]
pub fn pooled(problem: &Problem, rmse: &[f64]) -> f64 {
    let count = |number: usize| problem.recordings[number].raw.times_s.len() as f64;
    let sum: f64 = rmse.iter().enumerate().map(|(number, rmse)| rmse * rmse * count(number)).sum();
    (sum / (0..rmse.len()).map(count).sum::<f64>()).sqrt()
}

/// Which part each recording belongs to.
#[must_use]
pub fn folds(problem: &Problem) -> Vec<usize> {
    let mut order: Vec<usize> = (0..problem.recordings.len()).collect();
    let force = |number: &usize| {
        let recording = &problem.recordings[*number];
        recording.speed.value.abs() * recording.mass.value.sqrt()
    };
    order.sort_by(|a, b| force(a).total_cmp(&force(b)));
    let count = FOLDS.min(order.len());
    let mut folds = vec![0; order.len()];
    for (rank, number) in order.into_iter().enumerate() {
        folds[number] = rank % count.max(1);
    }
    folds
}

/// Leaves recordings out and shows them. What the others do not ask for by themselves is not in the model that they make: a mechanism
/// that only the recordings left out have met is not foretold. With one recording alone nothing can be left out: it is shown as fitted.
#[must_use]
pub fn held_out(problem: &Problem, baseline: &Fit, fit: &Fit) -> HeldOut {
    let folds = folds(problem);
    let count = problem.recordings.len();
    let mut shown = HeldOut { rmse: vec![0.0; count], model: vec![Vec::new(); count], cost: vec![0.0; count] };
    for fold in 0..FOLDS.min(count) {
        let part =
            |kept: bool| -> Vec<usize> { (0..count).filter(|number| (folds[*number] != fold) == kept).collect() };
        let (train, left_out) = (part(true), part(false));
        let again =
            if train.is_empty() { Some(fit.clone()) } else { foretold(problem, baseline, fit, &train, &left_out) };
        for number in left_out {
            let values = again.as_ref().and_then(|again| predict::raw(problem, &again.layout, &again.point, number));
            let values = values.unwrap_or_else(|| fit.model[number].clone());
            shown.rmse[number] = rmse(&problem.recordings[number].raw.values, &values);
            shown.cost[number] =
                again.as_ref().map_or(fit.recording_cost(number), |again| again.recording_cost(number));
            shown.model[number] = values;
        }
    }
    shown
}

/// A fit's model, or the baseline where these recordings do not ask for more, fitted to some recordings, with what others have for themselves; `None`
/// where it cannot be simulated.
fn foretold(problem: &Problem, baseline: &Fit, fit: &Fit, train: &[usize], left_out: &[usize]) -> Option<Fit> {
    let mut start = fit.point.clone();
    // What only the recordings left out could tell is as believed.
    for (coordinate, value) in fit.layout.globals.iter().zip(&mut start.globals) {
        if let Role::Mass(configuration) = coordinate.role
            && train.iter().all(|number| problem.recordings[*number].configuration != configuration)
        {
            *value = 0.0;
        }
    }
    let mut fitted = Fit::run(problem, fit.layout.clone(), start, train, Effort::AGAIN)?;
    if !fit.layout.entrants.is_empty() {
        let without = Fit::run(problem, baseline.layout.clone(), baseline.point.clone(), train, Effort::AGAIN)?;
        let asked = without.cost - fitted.cost > penalty(problem, fit);
        if !asked {
            fitted = without;
        }
    }
    let layout = fitted.layout;
    let known = if layout.entrants.is_empty() { baseline } else { fit };
    let fresh = layout.start(problem);
    let mut start = fitted.point;
    for number in left_out {
        for (place, coordinate) in layout.locals.iter().enumerate() {
            start.locals[*number][place] = match coordinate.role {
                Role::Contact | Role::Offset(_) | Role::Mechanism { .. } => known.point.locals[*number][place],
                _ => fresh.locals[*number][place],
            };
        }
    }
    Fit::run(problem, layout, start, left_out, Effort::LOCAL)
}

/// Root mean square of the difference.
#[must_use]
pub fn rmse(observed: &[f64], model: &[f64]) -> f64 {
    let sum: f64 = observed.iter().zip(model).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / observed.len().max(1) as f64).sqrt()
}
