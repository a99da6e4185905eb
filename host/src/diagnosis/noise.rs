//! What the recordings show before contact is noise: how strong, and how coloured.
//!
//! An autoregressive model, e_t = Σ a_k·e_{t−k} + w_t, fitted to all quiet stretches together (Yule and Walker's equations, lags
//! pooled over the stretches, each freed of its mean, or where they show one of its straight line: a zero that drifts is no noise, and
//! taken for some it would hide whatever is as slow; what that takes of slow noise is made up for). Whitening with it makes the residual of a right model white with unit
//! variance, so that a sum of squares is a χ².
//!
//! Source: G. E. P. Box, G. M. Jenkins, Time Series Analysis (1970), ch. 3.

use nalgebra::{DMatrix, DVector};

/// The order of the model: colour over eight samples, which a chain's filter and a hum's slope fit into.
const ORDER: usize = 6;
/// Quiet samples for each coefficient, at least; fewer make a lower order, and the fewest none.
const SAMPLES_PER_COEFFICIENT: usize = 25;
/// Turns in which what a mean or a line takes of slow noise is found, and the part of what they leave beyond which they stop: of noise that
/// hardly changes in a stretch that shows nothing.
const TURNS: usize = 6;
const MOST_TAKEN: f64 = 1.0;
/// Of a stretch of more samples they take next to nothing.
const LONG: usize = 600;
/// Straight lines through the quiet stretches that take less than this part of their squares are chance: of noise that goes together over
/// twenty samples they take as much of some hundred.
const DRIFTS: f64 = 0.05;
/// Noise that is only stated goes together over three samples at most, e^(−1/3): what lasts longer is no different from a course.
const MOST_ALIKE: f64 = 0.72;
/// Halvings of an interval of that length.
const HALVINGS: usize = 40;

/// An autoregressive noise model.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// a_1, a_2, …; empty: white.
    coefficients: Vec<f64>,
    /// Standard deviation of w, in the channel's unit.
    innovation: f64,
    /// Standard deviation of e, in the channel's unit.
    rms: f64,
    /// How many quiet samples told it; 0: none.
    samples: usize,
}

impl Noise {
    /// Noise that no quiet stretch has shown, of this strength and, as scattered from sample to sample, of that: what does not scatter goes together, as in
    /// an autoregressive model of order 1 with both strengths.
    #[must_use]
    pub fn unseen(rms: f64, quick: f64) -> Self {
        let alike = alike(quick / rms);
        let coefficients = if alike > 0.0 { vec![alike] } else { Vec::new() };
        Self { coefficients, innovation: rms * (1.0 - alike * alike).sqrt(), rms, samples: 0 }
    }

    /// Fitted to quiet stretches of evenly spaced samples; `coloured` is whether an order above zero may be used.
    /// `None` where there are too few samples to tell even the strength.
    #[must_use]
    pub fn of_quiet(stretches: &[impl AsRef<[f64]>], coloured: bool) -> Option<Self> {
        let long = || stretches.iter().map(AsRef::as_ref).filter(|stretch| stretch.len() > 2 * ORDER);
        let level: Vec<Vec<f64>> = long().map(beside_mean).collect();
        let straight: Vec<Vec<f64>> = level.iter().map(|stretch| beside_line(stretch)).collect();
        let squares = |all: &[Vec<f64>]| all.iter().flatten().map(|value| value * value).sum::<f64>();
        let drifts = squares(&straight) < (1.0 - DRIFTS) * squares(&level);
        let fitted = if drifts { &straight } else { &level };
        let freed = 1 + usize::from(drifts);
        let all: usize = fitted.iter().map(Vec::len).sum();
        let samples = all - freed * fitted.len();
        if samples < 2 * ORDER {
            return None;
        }
        let left = left_in(fitted);
        if left[0] <= 0.0 {
            return None;
        }
        let white = |variance: f64| {
            let rms = variance.sqrt();
            Self { coefficients: Vec::new(), innovation: rms, rms, samples }
        };
        let orders = if coloured { (samples / SAMPLES_PER_COEFFICIENT).min(ORDER) } else { 0 };
        let length = all / fitted.len();
        // Lags of short stretches need not be those of any noise; the first of them are.
        let fit = (1..=orders).rev().find_map(|order| beside_taken(&left[..=order], length, drifts));
        let Some((variance, coefficients, innovation)) = fit else {
            return Some(white(left[0] * all as f64 / samples as f64));
        };
        Some(Self { coefficients, innovation: innovation.sqrt(), ..white(variance) })
    }

    /// Standard deviation of the noise itself, in the channel's unit.
    #[must_use]
    pub fn rms(&self) -> f64 {
        self.rms
    }

    /// How many quiet samples told it; 0: it is only stated.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Whether its samples have nothing to do with each other.
    #[must_use]
    pub fn is_white(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Relative variance of the strength that it says of slow noise: 2/N of N samples where it is white, 4·p/N of a model of order p, whose spectrum is
    /// twice as uncertain at its lower end as elsewhere (K. N. Berk, Ann. Stat. 2 (1974) 489). Nothing of noise that is only stated.
    #[must_use]
    pub fn slow_variance(&self) -> f64 {
        let free = (2 * self.coefficients.len()).max(1);
        if self.samples == 0 { 0.0 } else { 2.0 * free as f64 / self.samples as f64 }
    }

    /// Turns a residual into one that is white with unit variance, in place. The first samples, whose past is not known, are
    /// only scaled.
    pub fn whiten(&self, residual: &mut [f64]) {
        // What is nothing stays nothing: most of what a coordinate changes is the contact.
        let Some(from) = residual.iter().position(|value| *value != 0.0) else { return };
        let last = residual.iter().rposition(|value| *value != 0.0).unwrap_or(from);
        let order = self.coefficients.len().min(residual.len());
        let end = (last + 1 + order).min(residual.len());
        let known = from.max(order);
        let past = residual[..end].to_vec();
        let (first, others) = residual[..end].split_at_mut(known.min(end));
        for (lag, coefficient) in self.coefficients.iter().enumerate().take(order) {
            for (value, before) in others.iter_mut().zip(&past[known - 1 - lag..]) {
                *value -= coefficient * before;
            }
        }
        first.iter_mut().for_each(|value| *value /= self.rms);
        others.iter_mut().for_each(|value| *value /= self.innovation);
    }
}

/// What is left of the covariances at the lags 0 to [`ORDER`] in stretches that have been freed of their level or line.
fn left_in(stretches: &[Vec<f64>]) -> [f64; ORDER + 1] {
    std::array::from_fn(|lag| {
        let products = |stretch: &Vec<f64>| stretch[lag..].iter().zip(stretch).map(|(a, b)| a * b).sum::<f64>();
        let pairs: usize = stretches.iter().map(|stretch| stretch.len() - lag).sum();
        stretches.iter().map(products).sum::<f64>() / pairs as f64
    })
}

/// Variance, coefficients and innovation's variance of a model that leaves these covariances in stretches of that length once each is freed of
/// its level or line: that takes much where noise is slow and stretches are short.
fn beside_taken(left: &[f64], length: usize, line: bool) -> Option<(f64, Vec<f64>, f64)> {
    let mut covariance = left.to_vec();
    let mut found = None;
    for _ in 0..TURNS {
        let Some((coefficients, innovation)) = autoregressive(&covariance) else { break };
        let taken = (length <= LONG).then(|| taken(&covariance, &coefficients, length, line));
        found = Some((covariance[0], coefficients, innovation));
        let Some(taken) = taken.filter(|taken| taken[0] < MOST_TAKEN * left[0]) else { break };
        covariance = left.iter().zip(taken).map(|(left, taken)| left + taken).collect();
    }
    found
}

/// What freeing a stretch of its level or line takes from its covariances: at each lag the mean over the diagonal of Γ − MΓM, where Γ has the
/// covariances, which the coefficients tell at longer lags, and M projects.
fn taken(covariance: &[f64], coefficients: &[f64], length: usize, line: bool) -> Vec<f64> {
    let mut lags = covariance.to_vec();
    while lags.len() < length {
        let next = coefficients.iter().zip(lags.iter().rev()).map(|(coefficient, before)| coefficient * before).sum();
        lags.push(next);
    }
    let level = DVector::from_element(length, 1.0).normalize();
    let slope = DVector::from_fn(length, |place, _| place as f64 - 0.5 * (length - 1) as f64).normalize();
    let freed = if line { vec![level, slope] } else { vec![level] };
    let seen = |of: &DVector<f64>| {
        DVector::from_fn(length, |row, _| (0..length).map(|place| lags[row.abs_diff(place)] * of[place]).sum())
    };
    let seen: Vec<DVector<f64>> = freed.iter().map(seen).collect();
    let at = |lag: usize| {
        let head = length - lag;
        let shifted = |a: &DVector<f64>, b: &DVector<f64>| a.rows(0, head).dot(&b.rows(lag, head));
        let once = freed.iter().zip(&seen).map(|(freed, seen)| shifted(freed, seen) + shifted(seen, freed));
        let twice =
            freed.iter().flat_map(|a| freed.iter().zip(&seen).map(move |(b, seen)| a.dot(seen) * shifted(a, b)));
        (once.sum::<f64>() - twice.sum::<f64>()) / head as f64
    };
    (0..covariance.len()).map(at).collect()
}

/// The coefficients and the innovation's variance of the model whose order is that of the lags, by Yule and Walker's equations; `None`
/// where these are no noise's, or nothing is left to chance.
fn autoregressive(covariance: &[f64]) -> Option<(Vec<f64>, f64)> {
    let (variance, order) = (covariance[0], covariance.len() - 1);
    let toeplitz = DMatrix::from_fn(order, order, |row, column| {
        covariance[row.abs_diff(column)] + if row == column { 1e-9 * variance } else { 0.0 }
    });
    let lags = DVector::from_column_slice(&covariance[1..]);
    let coefficients = toeplitz.cholesky()?.solve(&lags);
    let innovation = variance - coefficients.dot(&lags);
    (innovation > 0.01 * variance).then(|| (coefficients.iter().copied().collect(), innovation))
}

/// How alike neighbouring samples of an autoregressive model of order 1 are whose third differences are so much of white noise's: their variance is
/// (20 − 30ρ + 12ρ² − 2ρ³)/20 of it.
fn alike(quick: f64) -> f64 {
    let scatter = |alike: f64| 1.0 - 1.5 * alike + 0.6 * alike.powi(2) - 0.1 * alike.powi(3);
    let (mut low, mut high) = (0.0, MOST_ALIKE);
    if scatter(high) >= quick * quick {
        return high;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if scatter(middle) > quick * quick { low = middle } else { high = middle }
    }
    low
}

fn beside_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

/// Evenly spaced values of mean zero less the straight line through them.
fn beside_line(values: &[f64]) -> Vec<f64> {
    let from_middle = |place: usize| place as f64 - 0.5 * (values.len() - 1) as f64;
    let (mut along, mut square) = (0.0, 0.0);
    for (place, value) in values.iter().enumerate() {
        along += from_middle(place) * value;
        square += from_middle(place).powi(2);
    }
    let slope = along / square;
    values.iter().enumerate().map(|(place, value)| value - slope * from_middle(place)).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    pub fn coloured(samples: usize, seed: u64) -> Vec<f64> {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut values = vec![0.0; samples + 100];
        for place in 2..values.len() {
            let fresh: f64 = StandardNormal.sample(&mut chance);
            values[place] = 1.2 * values[place - 1] - 0.5 * values[place - 2] + 0.3 * fresh;
        }
        values.split_off(100)
    }

    #[test]
    fn whitened_noise_is_white_with_unit_variance() {
        let values = coloured(4000, 1);
        let noise = Noise::of_quiet(&[&values[..2000], &values[2000..]], true).unwrap();
        let mut fresh = coloured(4000, 2);
        noise.whiten(&mut fresh);
        let lag = |lag: usize| fresh[lag..].iter().zip(&fresh).map(|(a, b)| a * b).sum::<f64>() / 4000.0;
        assert!((lag(0) - 1.0).abs() < 0.1, "{}", lag(0));
        assert!((1..5).all(|shift| lag(shift).abs() < 0.08));
    }

    /// What is nothing before and after a pulse is skipped, not lost.
    #[test]
    fn a_pulse_whitens_alike_wherever_it_is() {
        let noise = Noise::of_quiet(&[coloured(4000, 1)], true).unwrap();
        let order = noise.coefficients.len();
        let pulse = coloured(30, 5);
        for (before, after) in [(order, order), (2, 50), (50, 2), (0, 0), (70, 70)] {
            let silence = |samples: usize| vec![0.0; samples];
            let column = [silence(before), pulse.clone(), silence(after)].concat();
            let mut whitened = column.clone();
            noise.whiten(&mut whitened);
            for (place, value) in whitened.iter().enumerate() {
                let past = noise.coefficients.iter().zip(column[..place].iter().rev());
                let expected = match place < order {
                    true => column[place] / noise.rms,
                    false => (column[place] - past.map(|(a, b)| a * b).sum::<f64>()) / noise.innovation,
                };
                assert!((value - expected).abs() < 1e-12, "{before} {place}: {value} {expected}");
            }
        }
    }

    /// The model's strength at the frequency zero, innovation over 1 − Σ a, in 300 stretches of 300 samples.
    #[test]
    fn slow_noise_is_known_as_well_as_its_samples_tell() {
        let slow = |seed: u64| {
            let noise = Noise::of_quiet(&[coloured(300, seed)], true).unwrap();
            let gain = noise.innovation / (1.0 - noise.coefficients.iter().sum::<f64>());
            (2.0 * gain.ln(), noise.slow_variance())
        };
        let (logarithms, said): (Vec<f64>, Vec<f64>) = (0..300).map(slow).unzip();
        let mean = logarithms.iter().sum::<f64>() / 300.0;
        let scatter = logarithms.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 299.0;
        assert!((0.5..2.0).contains(&(scatter / said[0])), "{scatter} {}", said[0]);
    }

    /// The strength at the frequency zero as above, of stretches of 30 samples, whose own lines have a fifth of the noise's squares.
    #[test]
    fn short_stretches_show_slow_noise() {
        let slow = |noise: &Noise| noise.innovation / (1.0 - noise.coefficients.iter().sum::<f64>());
        let long = slow(&Noise::of_quiet(&[coloured(100_000, 7)], true).unwrap());
        let stretches: Vec<Vec<f64>> = (0..200).map(|seed| coloured(30, 100 + seed)).collect();
        let short = slow(&Noise::of_quiet(&stretches, true).unwrap());
        assert!((short / long - 1.0).abs() < 0.06, "{short} {long}");
    }

    #[test]
    fn a_drifting_zero_is_no_noise() {
        let steady = coloured(2000, 3);
        let drifting = steady.iter().enumerate().map(|(place, value)| value + 1e-3 * place as f64).collect::<Vec<_>>();
        let [steady, drifting] = [steady, drifting].map(|values| Noise::of_quiet(&[values], true).unwrap());
        assert!((drifting.rms() / steady.rms() - 1.0).abs() < 1e-2, "{} {}", drifting.rms(), steady.rms());
        for (with, without) in drifting.coefficients.iter().zip(&steady.coefficients) {
            assert!((with - without).abs() < 2e-2, "{with} {without}");
        }
    }

    /// Noise of which neighbours are alike by 0.6, told by its strength and its scatter alone.
    #[test]
    fn stated_noise_that_hardly_scatters_goes_together() {
        let mut chance = ChaCha8Rng::seed_from_u64(5);
        let mut values = vec![0.0; 4000];
        for place in 1..values.len() {
            let fresh: f64 = StandardNormal.sample(&mut chance);
            values[place] = 0.6 * values[place - 1] + 0.8 * fresh;
        }
        let third = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).powi(2) / 20.0;
        let quick = (values.windows(4).map(third).sum::<f64>() / (values.len() - 3) as f64).sqrt();
        Noise::unseen(1.0, quick).whiten(&mut values);
        let lag = |lag: usize| values[lag..].iter().zip(&values).map(|(a, b)| a * b).sum::<f64>() / 4000.0;
        assert!((lag(0) - 1.0).abs() < 0.06 && lag(1).abs() < 0.06, "{} {}", lag(0), lag(1));
    }

    #[test]
    fn stated_noise_that_scatters_is_white_and_none_is_a_course() {
        assert!(Noise::unseen(0.2, 0.2).is_white());
        assert!(Noise::unseen(0.2, 0.3).is_white());
        assert_eq!(Noise::unseen(0.2, 0.0).coefficients, [MOST_ALIKE]);
    }

    #[test]
    fn few_quiet_samples_make_little_colour() {
        let values = coloured(100, 1);
        let orders = [20, 40, 100].map(|few| Noise::of_quiet(&[&values[..few]], true).unwrap().coefficients.len());
        assert_eq!(orders, [0, 1, 3]);
        assert_eq!(Noise::of_quiet(&[&values[..8]], true), None);
    }
}
