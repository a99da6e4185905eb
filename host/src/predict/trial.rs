//! Every case on folds of impacts: what is forecast took no part in learning.

use rayon::prelude::*;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::model_selection::{BaseKFold as _, KFold};

use super::dataset::Dataset;
use super::learner::{Learner, NotLearned, learn};
use super::score::{Score, score};
use super::task::{Case, Rows};

/// A case with what came out.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Which.
    pub case: Case,
    /// Impacts that have its inputs.
    pub impacts: usize,
    /// Forecast of each row when it took no part, N.
    pub forecast_n: Vec<f64>,
    /// The rows.
    pub rows: Rows,
    /// How good that is.
    pub score: Score,
    /// scikit-learn's learner of the same kind, on the same rows and folds.
    pub beside: Option<Score>,
}

/// Why there is no trial.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum NoTrial {
    /// More folds than impacts, or fewer than two.
    #[error("{impacts} {what} cannot be divided into {folds} folds")]
    #[diagnostic(help("give more campaigns, or from 2 to as many folds as there are {what}"))]
    Folds {
        /// Impacts or campaigns.
        what: &'static str,
        /// How many there are.
        impacts: usize,
        /// How many were asked for.
        folds: usize,
    },
    /// A learner refused.
    #[error(transparent)]
    #[diagnostic(transparent)]
    NotLearned(#[from] NotLearned),
}

/// What stays together in one fold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Whole {
    /// An impact: others of its campaign, on the same rig, may be learned from.
    #[default]
    Impact,
    /// A campaign: what is forecast is on a rig that nothing was learned from. Harder, and what a new rig will see.
    Campaign,
}

impl Whole {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Impact, Self::Campaign];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Impact => "impact",
            Self::Campaign => "campaign",
        }
    }
}

/// The fold of each impact, from 0: drawn by the seed, of equal size within one.
///
/// # Errors
/// [`NoTrial::Folds`].
pub fn folds(dataset: &Dataset, whole: Whole, count: usize, seed: u64) -> Result<Vec<usize>, NoTrial> {
    match whole {
        Whole::Impact => divided("impacts", dataset.impacts.len(), count, seed),
        Whole::Campaign => {
            let fold_of = divided("campaigns", dataset.campaigns, count, seed)?;
            Ok(dataset.impacts.iter().map(|impact| fold_of[impact.campaign]).collect())
        }
    }
}

fn divided(what: &'static str, impacts: usize, count: usize, seed: u64) -> Result<Vec<usize>, NoTrial> {
    if count < 2 || count > impacts {
        return Err(NoTrial::Folds { what, impacts, folds: count });
    }
    let places = DenseMatrix::new(impacts, 1, vec![0.0; impacts], false)
        .map_err(|error| NotLearned::Refused(error.to_string()))?;
    let divided = KFold::default().with_n_splits(count).with_shuffle(true).with_seed(Some(seed));
    let mut fold_of = vec![0; impacts];
    for (fold, (_, tested)) in divided.split(&places).enumerate() {
        tested.into_iter().for_each(|impact| fold_of[impact] = fold);
    }
    Ok(fold_of)
}

/// Rows of which the impact is not in the fold, and those of which it is.
#[must_use]
pub fn parted(rows: &Rows, fold_of: &[usize], fold: usize) -> (Vec<usize>, Vec<usize>) {
    (0..rows.len()).partition(|row| fold_of[rows.impact[*row]] != fold)
}

/// Forecast of each row by what was learned from the other folds, N.
///
/// # Errors
/// What a learner says.
pub fn forecasts(
    rows: &Rows,
    learner: Option<Learner>,
    physics: bool,
    fold_of: &[usize],
) -> Result<Vec<f64>, NotLearned> {
    let Some(learner) = learner else { return Ok(rows.expected.clone()) };
    let count = fold_of.iter().max().map_or(0, |last| last + 1);
    let parts: Vec<Vec<(usize, f64)>> = (0..count)
        .into_par_iter()
        .map(|fold| {
            let (seen, tested) = parted(rows, fold_of, fold);
            let x: Vec<Vec<f64>> = seen.iter().map(|&row| rows.x[row].clone()).collect();
            let learned = learn(learner, &x, &rows.wanted(physics, &seen))?;
            let said = |row: usize| (row, rows.force_n(physics, row, learned.forecast(&rows.x[row])));
            Ok(tested.into_iter().map(said).collect())
        })
        .collect::<Result<_, NotLearned>>()?;
    let mut forecast = vec![0.0; rows.len()];
    parts.into_iter().flatten().for_each(|(row, value)| forecast[row] = value);
    Ok(forecast)
}

/// Tries the cases that the data set has the inputs for; `progress` is told each one.
///
/// # Errors
/// [`NoTrial`].
pub fn trials(
    dataset: &Dataset,
    cases: &[Case],
    fold_of: &[usize],
    mut progress: impl FnMut(&Case),
) -> Result<Vec<Trial>, NoTrial> {
    let mut all = Vec::new();
    for case in cases {
        let rows = Rows::new(case.task, case.inputs, dataset);
        if rows.is_empty() {
            continue;
        }
        progress(case);
        let forecast_n = forecasts(&rows, case.learner, case.physics, fold_of)?;
        let score = score(&forecast_n, &rows.y);
        all.push(Trial { case: *case, impacts: rows.impacts(), forecast_n, rows, score, beside: None });
    }
    Ok(all)
}
