//! scikit-learn's learners on the same rows and folds, by a Python that has it.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use serde::Deserialize;
use serde_json::json;
use thud_firmware::forecast::DEPTH;

use super::learner::{
    BOOSTED_DEPTH, BOOSTED_RATE, BOOSTED_SUBSAMPLE, BOOSTED_TREES, SVR_C, SVR_EPSILON, SVR_ROWS, TABLE_RATE,
    TABLE_TREES, TREE_LEAF, TREE_SPLIT,
};
use super::score::score;
use super::trial::Trial;

/// What is run.
const SCRIPT: &str = include_str!("../../../tests/python/learners.py");

#[derive(Deserialize)]
struct Answer {
    forecasts: Vec<Option<Vec<f64>>>,
}

/// Why it did not answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error("scikit-learn did not answer: {0}")]
#[diagnostic(help(
    "name a Python that has it: python3 -m venv venv && venv/bin/pip install scikit-learn, then --scikit-learn venv/bin/python"
))]
pub struct NoAnswer(String);

/// Adds scikit-learn's score to each trial that has a learner.
///
/// # Errors
/// A Python that cannot be run, lacks scikit-learn, or says something else.
pub fn compare(python: &Path, trials: &mut [Trial], fold_of: &[usize]) -> Result<(), NoAnswer> {
    let cases: Vec<_> = trials
        .iter()
        .map(|trial| {
            let rows = &trial.rows;
            json!({
                "learner": trial.case.learner.map(super::learner::Learner::name),
                "physics": trial.case.physics,
                "x": rows.x, "y": rows.y, "expected": rows.expected, "unit": rows.unit,
                "fold": rows.impact.iter().map(|impact| fold_of[*impact]).collect::<Vec<_>>(),
            })
        })
        .collect();
    let settings = json!({
        "svr_rows": SVR_ROWS, "svr_c": SVR_C, "svr_epsilon": SVR_EPSILON,
        "tree_leaf": TREE_LEAF, "tree_split": TREE_SPLIT,
        "boosted_trees": BOOSTED_TREES, "boosted_depth": BOOSTED_DEPTH, "boosted_rate": BOOSTED_RATE,
        "boosted_subsample": BOOSTED_SUBSAMPLE,
        "table_trees": TABLE_TREES, "table_depth": DEPTH, "table_rate": TABLE_RATE,
    });
    let asked = json!({ "settings": settings, "cases": cases }).to_string();
    let no = |error: std::io::Error| NoAnswer(format!("{}: {error}", python.display()));
    let mut child = Command::new(python)
        .args(["-c", SCRIPT])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(no)?;
    let Some(mut stdin) = child.stdin.take() else { return Err(NoAnswer("it takes no input".to_owned())) };
    // Written beside reading, or both sides would wait for each other.
    let writer = std::thread::spawn(move || stdin.write_all(asked.as_bytes()));
    let output = child.wait_with_output().map_err(no)?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(NoAnswer(said.trim().lines().last().unwrap_or("it failed without a word").to_owned()));
    }
    writer.join().map_err(|_| NoAnswer("the rows could not be handed over".to_owned()))?.map_err(no)?;
    let answer: Answer = serde_json::from_slice(&output.stdout).map_err(|error| NoAnswer(error.to_string()))?;
    for (trial, forecast) in trials.iter_mut().zip(answer.forecasts) {
        trial.beside = forecast.filter(|said| said.len() == trial.rows.len()).map(|said| score(&said, &trial.rows.y));
    }
    Ok(())
}
