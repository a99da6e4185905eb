//! Scores with their uncertainty: 95 % intervals of shares, means and medians.

use serde::Serialize;

/// Two-sided 95 % of a normal distribution.
const Z: f64 = 1.959_964;

/// How many of how many, with Wilson's interval (1927), which holds for few cases and for shares near 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
    /// The share; absent of none.
    pub share: Option<f64>,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Share {
    /// `hits` of `of`.
    #[must_use]
    pub fn new(hits: usize, of: usize) -> Self {
        if of == 0 {
            return Self { hits, of, share: None, low: 0.0, high: 1.0 };
        }
        let n = of as f64;
        let p = hits as f64 / n;
        let scale = 1.0 / (1.0 + Z * Z / n);
        let middle = scale * (p + Z * Z / (2.0 * n));
        let half = scale * Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        Self { hits, of, share: Some(p), low: (middle - half).max(0.0), high: (middle + half).min(1.0) }
    }

    /// How many of `all` are so.
    pub fn count<T>(all: impl IntoIterator<Item = T>, is_so: impl Fn(&T) -> bool) -> Self {
        let (mut hits, mut of) = (0, 0);
        for one in all {
            of += 1;
            hits += usize::from(is_so(&one));
        }
        Self::new(hits, of)
    }
}

/// A number with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Number {
    /// From how many.
    pub of: usize,
    /// The number; absent of none.
    pub value: Option<f64>,
    /// Lower end.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

impl Number {
    /// The median. Its interval is between order statistics: the number of values below the median is binomial with p = ½, so the
    /// ranks n/2 ± 1.96·√n/2 hold it in 95 %.
    #[must_use]
    pub fn median(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        if n == 0 {
            return Self { of: 0, value: None, low: None, high: None };
        }
        let middle = if n % 2 == 1 { values[n / 2] } else { f64::midpoint(values[n / 2 - 1], values[n / 2]) };
        let half = Z * (n as f64).sqrt() / 2.0;
        let low = (n as f64 / 2.0 - half).floor();
        let high = (n as f64 / 2.0 + half).ceil();
        // Of fewer than six values no two hold the median in 95 %.
        let ends = n >= 6;
        let at = |rank: f64| values[(rank.max(1.0) as usize - 1).min(n - 1)];
        Self { of: n, value: Some(middle), low: ends.then(|| at(low)), high: ends.then(|| at(high + 1.0)) }
    }

    /// The mean, with the interval of a mean of many.
    #[must_use]
    pub fn mean(values: &[f64]) -> Self {
        let n = values.len() as f64;
        if values.is_empty() {
            return Self { of: 0, value: None, low: None, high: None };
        }
        let mean = values.iter().sum::<f64>() / n;
        if values.len() < 2 {
            return Self { of: 1, value: Some(mean), low: None, high: None };
        }
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let half = Z * (variance / n).sqrt();
        Self { of: values.len(), value: Some(mean), low: Some(mean - half), high: Some(mean + half) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures of Newcombe (1998), table I: 81 of 263, 0 of 20, 1 of 29.
    #[test]
    fn wilson_is_as_in_the_literature() {
        for (hits, of, low, high) in [(81, 263, 0.2553, 0.3662), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)] {
            let share = Share::new(hits, of);
            assert!((share.low - low).abs() < 5e-5 && (share.high - high).abs() < 5e-5, "{share:?}");
        }
        assert_eq!(Share::new(0, 0).share, None);
    }

    /// Of a hundred values the 40th and the 61st hold the median (Conover, Practical Nonparametric Statistics).
    #[test]
    fn the_median_is_held_by_order_statistics() {
        let median = Number::median((1..=100).map(f64::from).rev().collect());
        assert_eq!((median.value, median.low, median.high), (Some(50.5), Some(40.0), Some(61.0)));
        assert_eq!(Number::median(vec![3.0, 1.0, 2.0]).low, None);
    }

    #[test]
    fn a_mean_of_many_has_its_interval() {
        let mean = Number::mean(&[1.0, 2.0, 3.0]);
        assert!((mean.value.unwrap() - 2.0).abs() < 1e-12);
        assert!((mean.high.unwrap() - 2.0 - Z / 3f64.sqrt()).abs() < 1e-12);
    }
}
