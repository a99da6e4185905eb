//! A trained forecast as a file: what was learned, from what, and how far it may be trusted.

use std::path::Path;

use serde::{Deserialize, Serialize};
use thud_firmware::forecast::{CLASSES, COVERED, class};

use super::dataset::{Dataset, Impact};
use super::learner::{Learned, Learner, NotLearned, learn};
use super::score::{quantile, score};
use super::task::{BEFORE, Input, PROFILE, RISE, Rows, Task};
use super::trial::{NoTrial, Whole, folds, forecasts};
use crate::input::{InputError, read_text};

/// What the `format` key says.
pub const FORMAT: &str = "thud-predictor/1";
/// Fewest impacts of a class of F₄ that has a bound of its own.
const CLASS_LEAST: usize = 40;

/// A trained forecast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct Predictor {
    /// [`FORMAT`].
    pub format: String,
    /// What it forecasts.
    pub task: Task,
    /// From what, in this order.
    pub inputs: Vec<Input>,
    /// Smallest and largest of each that was learned from.
    pub ranges: Vec<(f64, f64)>,
    /// Who learned.
    pub learner: Learner,
    /// Whether it multiplies what physics expects by 1 + what was learned.
    pub physics: bool,
    /// Impacts that were learned from.
    pub impacts: usize,
    /// Folds by which the next three were found: of whole campaigns, or, of fewer campaigns than folds, of impacts.
    pub folds: usize,
    /// R² on impacts that took no part.
    pub r_squared: f64,
    /// Root of the mean square error there.
    pub rmse_N: f64,
    /// The share of impacts within the bounds.
    pub covered: f64,
    /// Bounds relative to the forecast: for `online` one for each class of F₄, else one.
    pub bounds: Vec<f64>,
    /// What was learned.
    pub learned: Learned,
}

/// A forecast by a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// Force, N.
    pub force_n: f64,
    /// It is within this of the truth in [`Predictor::covered`] of the cases, N.
    pub bound_n: f64,
}

/// Trains on all impacts; the figures beside it come from folds.
///
/// # Errors
/// Too few impacts.
pub fn train(
    dataset: &Dataset,
    task: Task,
    learner: Learner,
    physics: bool,
    (count, seed): (usize, u64),
) -> Result<Predictor, NoTrial> {
    let inputs = match task {
        Task::Profile => PROFILE,
        Task::Peak => BEFORE,
        Task::Online => RISE,
    };
    let rows = Rows::new(task, inputs, dataset);
    // The bounds are to hold on a rig that nothing was learned from.
    let whole = if dataset.campaigns >= count { Whole::Campaign } else { Whole::Impact };
    let fold_of = folds(dataset, whole, count, seed)?;
    if rows.is_empty() {
        return Err(NotLearned::TooFew { rows: 0, inputs: inputs.len(), least: 4 * (inputs.len() + 1) }.into());
    }
    let forecast = forecasts(&rows, Some(learner), physics, &fold_of)?;
    let score = score(&forecast, &rows.y);
    let all: Vec<usize> = (0..rows.len()).collect();
    let learned = learn(learner, &rows.x, &rows.wanted(physics, &all))?;
    let ranges = (0..inputs.len())
        .map(|input| {
            let values = rows.x.iter().map(|row| row[input]);
            (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
        })
        .collect();
    Ok(Predictor {
        format: FORMAT.to_owned(),
        task,
        inputs: inputs.to_vec(),
        ranges,
        learner,
        physics,
        impacts: rows.impacts(),
        folds: count,
        r_squared: score.r_squared,
        rmse_N: score.rmse_N,
        covered: f64::from(COVERED),
        bounds: bounds(task, dataset, &rows, &forecast),
        learned,
    })
}

/// The bound that covers the wanted share of what took no part, relative to the forecast.
fn bounds(task: Task, dataset: &Dataset, rows: &Rows, forecast: &[f64]) -> Vec<f64> {
    let relative = |row: usize| ((rows.y[row] - forecast[row]) / reference(task, rows, forecast, row)).abs();
    let share = f64::from(COVERED);
    let everywhere = quantile((0..rows.len()).map(relative).collect(), share);
    if task != Task::Online {
        return vec![everywhere];
    }
    (0..=CLASSES.len())
        .map(|wanted| {
            let inside: Vec<f64> = (0..rows.len())
                .filter(|row| class(dataset.impacts[rows.impact[*row]].rise.force[3]) == wanted)
                .map(relative)
                .collect();
            if inside.len() < CLASS_LEAST { everywhere } else { quantile(inside, share) }
        })
        .collect()
}

/// What a bound is relative to: the forecast, or, where that goes through zero, the peak that physics expects.
fn reference(task: Task, rows: &Rows, forecast: &[f64], row: usize) -> f64 {
    match task {
        Task::Profile => rows.unit[row],
        Task::Peak | Task::Online => forecast[row].max(1e-9),
    }
}

impl Predictor {
    /// The forecasts of one impact: one, or one for each instant of its profile; empty where an input is missing.
    #[must_use]
    pub fn forecast(&self, impact: &Impact) -> Vec<(Said, f64)> {
        let alone = Dataset { impacts: vec![impact.clone()], campaigns: 1, notes: Vec::new() };
        let rows = Rows::new(self.task, &self.inputs, &alone);
        (0..rows.len())
            .map(|row| {
                let force_n = rows.force_n(self.physics, row, self.learned.forecast(&rows.x[row]));
                let of = if self.task == Task::Profile { rows.unit[row] } else { force_n };
                let place = if self.task == Task::Online { class(impact.rise.force[3]) } else { 0 };
                (Said { force_n, bound_n: self.bounds[place] * of }, rows.y[row])
            })
            .collect()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// What is wrong with it, with line and column where it is no JSON of this kind.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = read_text(path)?;
        let file = path.display().to_string();
        let remedy = "give a file that `thud predict train` has written";
        let found: Self = serde_json::from_str(&text).map_err(|error| {
            let line_start: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
            let place = (line_start + error.column().saturating_sub(1)).min(text.len());
            InputError::at(&file, &text, place..place + 1, format!("this is no predictor: {error}"), remedy)
        })?;
        let places = if found.task == Task::Online { CLASSES.len() + 1 } else { 1 };
        let problem = if found.format != FORMAT {
            Some(format!("its format is `{}`, not `{FORMAT}`", found.format))
        } else if found.learned.inputs() > found.inputs.len() || found.ranges.len() != found.inputs.len() {
            Some(format!("it asks for {} inputs and names {}", found.learned.inputs(), found.inputs.len()))
        } else if found.bounds.len() != places {
            Some(format!("it has {} bounds; {places} belong to `{}`", found.bounds.len(), found.task.name()))
        } else {
            None
        };
        problem.map_or(Ok(found), |problem| Err(InputError::whole(&file, problem, remedy)))
    }
}
