//! What the recordings show before contact is noise: how strong, and how coloured.
//!
//! An autoregressive model, e_t = Σ a_k·e_{t−k} + w_t, whose later a_k are alike over ever longer stretches, as long a memory as the quiet shows, fitted to all quiet stretches together (Yule and Walker's equations, lags
//! pooled over the stretches, each freed of its mean, or where all go one way of its straight line: a zero that drifts is no noise, and
//! taken for some it would hide whatever is as slow; what that takes of slow noise is made up for). Whitening with it makes the residual of a right model white with unit
//! variance, so that a sum of squares is a χ².
//!
//! Source: G. E. P. Box, G. M. Jenkins, Time Series Analysis (1970), ch. 3.

use nalgebra::{DMatrix, DVector};

/// The order of the model: colour over eight samples, which a chain's filter and a hum's slope fit into.
const ORDER: usize = 6;
/// Beyond it coefficients are alike from the lag after one of these to the next: an amplifier's own slow noise, some per cent of all under white noise, goes
/// together over a tenth of a second. (In steps of two, as the averages of F. Corsi, J. Financ. Econom. 7 (2009) 174.)
const SLOWER: [usize; 5] = [ORDER, 12, 24, 48, 96];
/// A stretch of so many times its last lag shows one, and so many times that in all.
const STRETCHES: usize = 3;
const IN_ALL: usize = 16;
/// The half of a period of a hum has to be within what is remembered, else that is not told from slow noise: the third step is 10 ms of 5 kHz.
const LEAST_SLOWER: usize = 3;
/// A coefficient of nothing strays by 1/√(N·n), n of which are alike and N samples: so many of these below zero it turns, or anything below it where
/// less than a whole period may be remembered.
const STRAYS: f64 = 2.0;
/// And it must lower BIC by this: by chance one does so in some thousand campaigns.
const LONGER: f64 = 8.0;
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
/// Slopes of random sign whose sum is more than this times the root of their squares are one in a hundred.
const ONE_WAY: f64 = 2.6;
/// Noise that is only stated goes together over three samples at most, e^(−1/3): what lasts longer is no different from a course.
const MOST_ALIKE: f64 = 0.72;
/// Halvings of an interval of that length.
const HALVINGS: usize = 40;

/// An autoregressive noise model.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// With ever longer memories: none, a short one, and that of slow noise. At the start of a recording the past is not longer.
    memories: Vec<Memory>,
    /// Standard deviation of e, in the channel's unit.
    rms: f64,
    /// How many quiet samples told it; 0: none.
    samples: usize,
}

/// What the past says of the next sample.
#[derive(Clone, Debug, PartialEq)]
struct Memory {
    /// a_1, a_2, …; empty: nothing.
    coefficients: Vec<f64>,
    /// Up to which lag they are alike from the one before on.
    lags: Vec<usize>,
    /// Standard deviation of w, in the channel's unit.
    innovation: f64,
}

impl Memory {
    fn none(rms: f64) -> Self {
        Self { coefficients: Vec::new(), lags: Vec::new(), innovation: rms }
    }

    /// With coefficients that are alike up to each of these lags from the one before, by Yule and Walker's equations; `None` where the covariances
    /// are no noise's, or nothing is left to chance.
    fn of(covariance: &[f64], lags: &[usize]) -> Option<Self> {
        let stretch = |number: usize| if number == 0 { 1..=lags[0] } else { lags[number - 1] + 1..=lags[number] };
        let variance = covariance[0];
        let normal = DMatrix::from_fn(lags.len(), lags.len(), |row, column| {
            let pairs = stretch(row).flat_map(|a| stretch(column).map(move |b| covariance[a.abs_diff(b)]));
            pairs.sum::<f64>() + if row == column { 1e-9 * variance * stretch(row).count() as f64 } else { 0.0 }
        });
        let along = DVector::from_fn(lags.len(), |number, _| stretch(number).map(|lag| covariance[lag]).sum());
        let alike = normal.cholesky()?.solve(&along);
        let innovation = variance - alike.dot(&along);
        let coefficients =
            (0..lags.len()).flat_map(|number| stretch(number).map(|_| alike[number]).collect::<Vec<_>>());
        (innovation > 0.01 * variance).then(|| Self {
            coefficients: coefficients.collect(),
            lags: lags.to_vec(),
            innovation: innovation.sqrt(),
        })
    }
}

impl Noise {
    /// Noise that no quiet stretch has shown, of this strength and, as scattered from sample to sample, of that: what does not scatter goes together, as in
    /// an autoregressive model of order 1 with both strengths.
    #[must_use]
    pub fn unseen(rms: f64, quick: f64) -> Self {
        let alike = alike(quick / rms);
        let innovation = rms * (1.0 - alike * alike).sqrt();
        let last = (alike > 0.0).then(|| Memory { coefficients: vec![alike], lags: vec![1], innovation });
        Self { memories: std::iter::once(Memory::none(rms)).chain(last).collect(), rms, samples: 0 }
    }

    /// Fitted to quiet stretches of evenly spaced samples; `coloured` is whether an order above zero may be used.
    /// `None` where there are too few samples to tell even the strength.
    #[must_use]
    pub fn of_quiet(stretches: &[impl AsRef<[f64]>], coloured: bool) -> Option<Self> {
        let long = || stretches.iter().filter(|stretch| stretch.as_ref().len() > 2 * ORDER);
        let (fitted, drifts) = beside_courses(&long().collect::<Vec<_>>());
        let fitted = &fitted;
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
        let orders = if coloured { (samples / SAMPLES_PER_COEFFICIENT).min(ORDER) } else { 0 };
        let length = all / fitted.len();
        // Lags of short stretches need not be those of any noise; the first of them are.
        let short = (1..=orders).rev().find_map(|order| beside_taken(&left, &one_by_one(order), length, drifts));
        let Some(mut told) = short else {
            let rms = (left[0] * all as f64 / samples as f64).sqrt();
            return Some(Self { memories: vec![Memory::none(rms)], rms, samples });
        };
        let shortest = fitted.iter().map(Vec::len).min().unwrap_or(0);
        let shows =
            |lag: &usize| told.memory.lags.len() == ORDER && STRETCHES * lag <= shortest && IN_ALL * lag <= samples;
        let many = SLOWER[1..].iter().take_while(|lag| shows(lag)).count();
        let with = |many: usize| {
            let lags: Vec<usize> = one_by_one(ORDER).into_iter().chain(SLOWER[1..=many].iter().copied()).collect();
            beside_taken(&left, &lags, length, drifts)
        };
        // Slow noise goes on as it was; a hum, which is none, turns.
        let goes_on = |told: &Told| {
            let beyond =
                SLOWER.windows(2).filter_map(|two| Some((two[1] - two[0], told.memory.coefficients.get(two[0])?)));
            let mut sizes = beyond.map(|(alike, coefficient)| coefficient * ((samples * alike) as f64).sqrt());
            let strays = if many + 1 == SLOWER.len() { STRAYS } else { 0.0 };
            sizes.all(|size| size > -strays)
        };
        // A longer memory has to be worth its coefficients (BIC), the longest before others: one step ahead says little of the slowest noise.
        let misses = |memory: &Memory| {
            samples as f64 * memory.innovation.powi(2).ln() + memory.lags.len() as f64 * (samples as f64).ln()
        };
        let is_worth_it = |longer: &Told| misses(&longer.memory) < misses(&told.memory) - LONGER;
        let is_slow = many >= LEAST_SLOWER && with(many).is_some_and(|longest| goes_on(&longest));
        let longer =
            (1..=many).rev().filter(|_| is_slow).filter_map(with).find(|longer| goes_on(longer) && is_worth_it(longer));
        let rms = longer.as_ref().unwrap_or(&told).covariance[0].sqrt();
        let mut memories = vec![Memory::none(rms)];
        if let Some(longer) = longer {
            memories.extend(Memory::of(&longer.covariance, &one_by_one(ORDER)));
            told = longer;
        }
        memories.push(told.memory);
        Some(Self { memories, rms, samples })
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

    fn last(&self) -> &Memory {
        &self.memories[self.memories.len() - 1]
    }

    /// Whether its samples have nothing to do with each other.
    #[must_use]
    pub fn is_white(&self) -> bool {
        self.last().coefficients.is_empty()
    }

    /// Relative variance of the strength that it says of slow noise: 2/N of N samples where it is white, 4·p/N of a model of order p, whose spectrum is
    /// twice as uncertain at its lower end as elsewhere (K. N. Berk, Ann. Stat. 2 (1974) 489). Nothing of noise that is only stated.
    #[must_use]
    pub fn slow_variance(&self) -> f64 {
        let free = (2 * self.last().coefficients.len()).max(1);
        if self.samples == 0 { 0.0 } else { 2.0 * free as f64 / self.samples as f64 }
    }

    /// Turns a residual into one that is white with unit variance, in place. The first samples, whose past is not known, are only scaled, those after them
    /// know a short one.
    pub fn whiten(&self, residual: &mut [f64]) {
        // What is nothing stays nothing: most of what a coordinate changes is the contact.
        let Some(from) = residual.iter().position(|value| *value != 0.0) else { return };
        let last = residual.iter().rposition(|value| *value != 0.0).unwrap_or(from);
        let reach = |number: usize| self.memories.get(number).map_or(usize::MAX, |memory| memory.coefficients.len());
        let end = (last + 1 + reach(self.memories.len() - 1)).min(residual.len());
        let past = residual[..end].to_vec();
        // The sum of all values before each.
        let mut sums = vec![0.0; end + 1];
        (from..end).for_each(|place| sums[place + 1] = sums[place] + past[place]);
        for (number, memory) in self.memories.iter().enumerate() {
            let begin = reach(number).max(from);
            if begin >= end {
                continue;
            }
            let values = &mut residual[begin..reach(number + 1).clamp(begin, end)];
            let mut before = 0;
            for lag in &memory.lags {
                let coefficient = memory.coefficients[before];
                if *lag == before + 1 {
                    for (value, past) in values.iter_mut().zip(&past[begin - lag..]) {
                        *value -= coefficient * past;
                    }
                } else {
                    for (value, (to, from)) in
                        values.iter_mut().zip(sums[begin - before..].iter().zip(&sums[begin - lag..]))
                    {
                        *value -= coefficient * (to - from);
                    }
                }
                before = *lag;
            }
            values.iter_mut().for_each(|value| *value /= memory.innovation);
        }
    }
}

/// The lags up to each of which coefficients are alike, where each has its own.
fn one_by_one(order: usize) -> Vec<usize> {
    (1..=order).collect()
}

/// What is left of the covariances at the lags 0 to the last of [`SLOWER`] in stretches that have been freed of their level or line.
fn left_in(stretches: &[Vec<f64>]) -> Vec<f64> {
    let at = |lag: usize| {
        let long = || stretches.iter().filter(|stretch| stretch.len() > lag);
        let products = |stretch: &Vec<f64>| stretch[lag..].iter().zip(stretch).map(|(a, b)| a * b).sum::<f64>();
        let pairs: usize = long().map(|stretch| stretch.len() - lag).sum();
        long().map(products).sum::<f64>() / pairs.max(1) as f64
    };
    (0..=SLOWER[SLOWER.len() - 1]).map(at).collect()
}

/// What quiet stretches tell.
struct Told {
    covariance: Vec<f64>,
    memory: Memory,
}

/// A memory with coefficients that are alike up to each of these lags from the one before, which leaves these covariances in stretches of that length once
/// each is freed of its level or line: that takes much where noise is slow and stretches are short.
fn beside_taken(left: &[f64], lags: &[usize], length: usize, line: bool) -> Option<Told> {
    let left = &left[..=lags[lags.len() - 1]];
    let mut covariance = left.to_vec();
    let mut found = None;
    for _ in 0..TURNS {
        let Some(memory) = Memory::of(&covariance, lags) else { break };
        let taken = (length <= LONG).then(|| taken(&covariance, &memory.coefficients, length, line));
        found = Some(Told { covariance: covariance.clone(), memory });
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

/// The standard deviation of each of several quiet stretches, which a zero that drifts does not add to.
#[must_use]
pub fn scatters(stretches: &[&[f64]]) -> Vec<f64> {
    let (beside, drifts) = beside_courses(stretches);
    let freed = 1 + usize::from(drifts);
    let scatter = |values: Vec<f64>| {
        let free = values.len().saturating_sub(freed).max(1);
        (values.iter().map(|value| value * value).sum::<f64>() / free as f64).sqrt()
    };
    beside.into_iter().map(scatter).collect()
}

/// Quiet stretches, each freed of its mean, or where all go one way of its straight line, and whether they do.
fn beside_courses(stretches: &[impl AsRef<[f64]>]) -> (Vec<Vec<f64>>, bool) {
    let level: Vec<Vec<f64>> = stretches.iter().map(|stretch| beside_mean(stretch.as_ref())).collect();
    let straight: Vec<Vec<f64>> = level.iter().map(|stretch| beside_line(stretch)).collect();
    let squares = |all: &[Vec<f64>]| all.iter().flatten().map(|value| value * value).sum::<f64>();
    let drifts = squares(&straight) < (1.0 - DRIFTS) * squares(&level) && go_one_way(&level);
    (if drifts { straight } else { level }, drifts)
}

/// Whether stretches of mean zero rise, or fall, together: what rises in one and falls in the next is slow noise.
fn go_one_way(stretches: &[Vec<f64>]) -> bool {
    let slopes: Vec<f64> = stretches.iter().map(|stretch| slope(stretch)).collect();
    let few = slopes.len() < 2;
    few || slopes.iter().sum::<f64>().abs() > ONE_WAY * slopes.iter().map(|slope| slope * slope).sum::<f64>().sqrt()
}

fn beside_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

/// Evenly spaced values of mean zero less the straight line through them.
fn beside_line(values: &[f64]) -> Vec<f64> {
    let slope = slope(values);
    values.iter().enumerate().map(|(place, value)| value - slope * from_middle(values, place)).collect()
}

/// Of the straight line through evenly spaced values of mean zero, for each of them.
fn slope(values: &[f64]) -> f64 {
    let places = || (0..values.len()).map(|place| from_middle(values, place));
    let along: f64 = values.iter().zip(places()).map(|(value, place)| place * value).sum();
    along / places().map(|place| place * place).sum::<f64>()
}

fn from_middle(values: &[f64], place: usize) -> f64 {
    place as f64 - 0.5 * (values.len() - 1) as f64
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
        let order = noise.last().coefficients.len();
        let pulse = coloured(30, 5);
        for (before, after) in [(order, order), (2, 50), (50, 2), (0, 0), (70, 70)] {
            let silence = |samples: usize| vec![0.0; samples];
            let column = [silence(before), pulse.clone(), silence(after)].concat();
            let mut whitened = column.clone();
            noise.whiten(&mut whitened);
            for (place, value) in whitened.iter().enumerate() {
                let past = noise.last().coefficients.iter().zip(column[..place].iter().rev());
                let expected = match place < order {
                    true => column[place] / noise.rms,
                    false => (column[place] - past.map(|(a, b)| a * b).sum::<f64>()) / noise.last().innovation,
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
            let gain = noise.last().innovation / (1.0 - noise.last().coefficients.iter().sum::<f64>());
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
        let slow = |noise: &Noise| noise.last().innovation / (1.0 - noise.last().coefficients.iter().sum::<f64>());
        let long = slow(&Noise::of_quiet(&[coloured(100_000, 7)], true).unwrap());
        let stretches: Vec<Vec<f64>> = (0..200).map(|seed| coloured(30, 100 + seed)).collect();
        let short = slow(&Noise::of_quiet(&stretches, true).unwrap());
        assert!((short / long - 1.0).abs() < 0.06, "{short} {long}");
    }

    /// White noise on a slow one of a tenth of its variance that goes together over fifty samples: the sum over a contact of 60 samples scatters as it is said to.
    #[test]
    fn slow_noise_under_white_noise_is_known() {
        let stretch = |seed: u64| {
            let mut chance = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = || -> f64 { StandardNormal.sample(&mut chance) };
            let mut slow = 0.1_f64.sqrt() * draw();
            let next = |_| {
                slow = slow * (1.0 - 1.0 / 50.0) + draw() * (0.1 * (1.0 - (1.0_f64 - 1.0 / 50.0).powi(2))).sqrt();
                slow + draw()
            };
            (0..400).map(next).collect::<Vec<f64>>()
        };
        let noise = Noise::of_quiet(&(0..12).map(stretch).collect::<Vec<_>>(), true).unwrap();
        assert!(noise.last().coefficients.len() > ORDER, "{:?}", noise.last());
        let scores = (100..1100).map(|seed| {
            let mut pulse: Vec<f64> = (0..400).map(|place| f64::from((200..260).contains(&place))).collect();
            let mut values = stretch(seed);
            [&mut pulse, &mut values].into_iter().for_each(|series| noise.whiten(series));
            let along: f64 = pulse.iter().zip(&values).map(|(a, b)| a * b).sum();
            along * along / pulse.iter().map(|value| value * value).sum::<f64>()
        });
        let mean = scores.sum::<f64>() / 1000.0;
        assert!((0.8..1.25).contains(&mean), "{mean}");
    }

    #[test]
    fn a_drifting_zero_is_no_noise() {
        let steady = coloured(2000, 3);
        let drifting = steady.iter().enumerate().map(|(place, value)| value + 1e-3 * place as f64).collect::<Vec<_>>();
        let [steady, drifting] = [steady, drifting].map(|values| Noise::of_quiet(&[values], true).unwrap());
        assert!((drifting.rms() / steady.rms() - 1.0).abs() < 1e-2, "{} {}", drifting.rms(), steady.rms());
        for (with, without) in drifting.last().coefficients.iter().zip(&steady.last().coefficients) {
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
        assert_eq!(Noise::unseen(0.2, 0.0).last().coefficients, [MOST_ALIKE]);
    }

    #[test]
    fn few_quiet_samples_make_little_colour() {
        let values = coloured(100, 1);
        let orders =
            [20, 40, 100].map(|few| Noise::of_quiet(&[&values[..few]], true).unwrap().last().coefficients.len());
        assert_eq!(orders, [0, 1, 3]);
        assert_eq!(Noise::of_quiet(&[&values[..8]], true), None);
    }
}
