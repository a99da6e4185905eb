//! The table.

use super::Tested;
use crate::predict::trial::Trial;
use crate::table::{Side, Table};

/// One line for each trial.
#[must_use]
pub fn table(tested: &Tested) -> Table {
    let mut table = Table::new(&[
        ("forecast", Side::Left),
        ("from", Side::Left),
        ("by", Side::Left),
        ("R²", Side::Right),
        ("RMSE N", Side::Right),
        ("95 % within N", Side::Right),
        ("paper R²", Side::Right),
        ("N", Side::Right),
        ("scikit-learn R²", Side::Right),
        ("N", Side::Right),
        ("", Side::Left),
    ]);
    for trial in &tested.trials {
        table.row(cells(trial));
    }
    table
}

/// The cells of a line, in the order of the headings.
pub(super) fn cells(trial: &Trial) -> [String; 11] {
    let pair = |values: Option<(f64, f64)>| {
        values
            .map_or_else(<[String; 2]>::default, |(r_squared, rmse)| [format!("{r_squared:.3}"), format!("{rmse:.1}")])
    };
    let [paper, paper_n] = pair(trial.case.printed.map(|printed| (printed.r_squared, printed.rmse_N)));
    let [beside, beside_n] = pair(trial.beside.map(|score| (score.r_squared, score.rmse_N)));
    [
        trial.case.task.name().to_owned(),
        trial.case.from(),
        trial.case.by(),
        format!("{:.3}", trial.score.r_squared),
        format!("{:.1}", trial.score.rmse_N),
        format!("{:.1}", trial.score.error_95_N),
        paper,
        paper_n,
        beside,
        beside_n,
        if trial.case.leaky() { "leaky".to_owned() } else { String::new() },
    ]
}
