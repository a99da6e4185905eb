//! What `thud predict test` shows: a table on the terminal, and a page with pictures.

mod figure;
mod page;
mod terminal;

pub use page::page;
pub use terminal::table;

use super::dataset::Dataset;
use super::trial::{Trial, Whole};

/// A whole test.
#[derive(Clone, Debug)]
pub struct Tested {
    /// The impacts.
    pub dataset: Dataset,
    /// What was tried.
    pub trials: Vec<Trial>,
    /// Into how many folds they were divided.
    pub folds: usize,
    /// What stayed together in one.
    pub whole: Whole,
    /// What drew them.
    pub seed: u64,
    /// Where the campaigns are, as given.
    pub from: Vec<String>,
}

impl Tested {
    /// Standard deviation of the peaks, N: what R² and RMSE are to be read against.
    #[must_use]
    pub fn peak_sd_n(&self) -> f64 {
        let peaks = self.dataset.impacts.iter().map(|impact| impact.peak_n);
        let count = self.dataset.impacts.len().max(1) as f64;
        let mean = peaks.clone().sum::<f64>() / count;
        (peaks.map(|peak| (peak - mean).powi(2)).sum::<f64>() / count).sqrt()
    }

    /// Smallest and largest peak, N.
    #[must_use]
    pub fn peaks_n(&self) -> (f64, f64) {
        let peaks = self.dataset.impacts.iter().map(|impact| impact.peak_n);
        (peaks.clone().fold(f64::INFINITY, f64::min), peaks.fold(0.0, f64::max))
    }
}
