//! How good a forecast is.

use serde::Serialize;

/// What is said of forecasts beside what came true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(non_snake_case, reason = "the keys carry their units")]
pub struct Score {
    /// Share of the variance that is foretold: 1 − Σ(y − ŷ)²/Σ(y − ȳ)².
    pub r_squared: f64,
    /// Root of the mean square error.
    pub rmse_N: f64,
    /// 95 % of the errors are smaller.
    pub error_95_N: f64,
    /// Mean of forecast less truth: positive is on the safe side.
    pub bias_N: f64,
}

/// Of these, forecast and true, of equal length and at least two.
#[must_use]
pub fn score(forecast_n: &[f64], true_n: &[f64]) -> Score {
    let count = true_n.len() as f64;
    let mean = true_n.iter().sum::<f64>() / count;
    let spread: f64 = true_n.iter().map(|value| (value - mean).powi(2)).sum();
    let errors: Vec<f64> = forecast_n.iter().zip(true_n).map(|(forecast, truth)| forecast - truth).collect();
    let square: f64 = errors.iter().map(|error| error * error).sum();
    Score {
        r_squared: 1.0 - square / spread,
        rmse_N: (square / count).sqrt(),
        error_95_N: quantile(errors.iter().map(|error| error.abs()).collect(), 0.95),
        bias_N: errors.iter().sum::<f64>() / count,
    }
}

/// The smallest value that at least this share of future ones stays below, by the order of those seen (split conformal: the
/// ⌈(n + 1)·share⌉-th, the largest where there are too few).
///
/// # Panics
/// Without values.
#[must_use]
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = ((values.len() + 1) as f64 * share).ceil() as usize;
    values[rank.clamp(1, values.len()) - 1]
}
