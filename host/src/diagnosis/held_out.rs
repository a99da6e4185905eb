//! Recordings that took no part: fitted on the others, shown on these.
//!
//! Whole recordings are left out, a part of them at a time, each part spread over the range of forces and, as far as that goes, without a
//! configuration that no other part has: its mass would be as stated. Rig and mechanisms come from the others; of the recording left out only what every recording has for itself is estimated (contact instant, offset, speed and spring
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
    let force = |number: usize| {
        let recording = &problem.recordings[number];
        recording.speed.value.abs() * recording.mass.value.sqrt()
    };
    let all = 0..problem.recordings.len();
    let configurations: Vec<usize> = all.clone().map(|number| problem.recordings[number].configuration).collect();
    spread(&all.map(force).collect::<Vec<_>>(), &configurations)
}

/// Parts of recordings with these forces, in these configurations.
fn spread(forces: &[f64], configurations: &[usize]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..forces.len()).collect();
    order.sort_by(|a, b| forces[*a].total_cmp(&forces[*b]));
    let count = FOLDS.min(order.len()).max(1);
    // With every mass at every speed, in the order of forces, each part would be one of the masses: each row of parts is turned by so many.
    let turned = |turn: usize| {
        let mut folds = vec![0; order.len()];
        for (rank, number) in order.iter().enumerate() {
            folds[*number] = (rank + turn * (rank / count)) % count;
        }
        folds
    };
    let unknown = |folds: &Vec<usize>| {
        let knows = |number: usize, other: usize| {
            folds[other] != folds[number] && configurations[other] == configurations[number]
        };
        let is_unknown = |number: &usize| !(0..folds.len()).any(|other| knows(*number, other));
        (0..folds.len()).filter(is_unknown).count()
    };
    (0..count).map(turned).min_by_key(unknown).unwrap_or_default()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mass_at_every_speed_leaves_no_mass_out() {
        let masses: [f64; 4] = [7.9, 8.5, 10.1, 11.9];
        let forces: Vec<f64> =
            [0.07, 0.33, 0.6].iter().flat_map(|speed| masses.map(|mass| speed * mass.sqrt())).collect();
        let configurations: Vec<usize> = (0..12).map(|number| number % 4).collect();
        let folds = spread(&forces, &configurations);
        assert_eq!(folds, [0, 1, 2, 3, 1, 2, 3, 0, 2, 3, 0, 1]);
        // Of one mass, and where turning does not help, by rank.
        assert_eq!(spread(&forces, &[0; 12]), [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]);
        let own: Vec<usize> = (0..12).collect();
        assert_eq!(spread(&forces, &own), [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]);
        assert_eq!(spread(&[1.0], &[0]), [0]);
        assert!(spread(&[], &[]).is_empty());
    }
}
