//! The spectrum of what a fit leaves.

use nalgebra::{DMatrix, DVector};
use realfft::RealFftPlanner;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::fit::Fit;
use super::problem::Problem;

/// Length of the transform: padded with zeros, so that a line's frequency is read finely.
const LENGTH: usize = 8192;

/// Frequencies of the mains, Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// Beside a line the quiet is looked at so many lines away, a line being what its length resolves.
const BESIDE: [f64; 8] = [-4.0, -3.0, -2.0, 2.0, 3.0, 4.0, 5.0, 6.0];
/// Periods of a line that a quiet stretch must hold for it.
const PERIODS: f64 = 1.0;

/// Rarer by chance than this the mains are there: in 50 ms of quiet hums of d = 16 and 33 were, one of 22 was not; of the frozen set's 300
/// campaigns with the traces that any chain has none was.
const UNLIKELY: f64 = 1e-6;

/// A line of the mains in the quiet before contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hum {
    /// Its frequency, Hz.
    pub hz: f64,
    /// From where to where the quiet resolves it, Hz.
    pub band_hz: [f64; 2],
    /// Sum of squares in that line beyond what is in those beside it.
    pub excess: f64,
    /// Probability of that much where there is none.
    pub p_value: f64,
}

impl Hum {
    /// Whether it is more than chance.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.p_value < UNLIKELY
    }
}

/// Frequencies, Hz, of the highest peaks of the residuals' pooled periodogram, strongest first. The observed channel only, from the
/// contact on, each recording freed of its mean and tapered (Hann).
#[must_use]
pub fn lines_hz(problem: &Problem, fit: &Fit) -> Vec<f64> {
    let (frequencies, power) = periodogram(problem, &fit.residuals);
    let mut peaks: Vec<usize> = (2..power.len().saturating_sub(1))
        .filter(|place| power[*place] > power[place - 1] && power[*place] >= power[place + 1])
        .collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    peaks.into_iter().take(4).map(|place| frequencies[place]).collect()
}

/// What a fit leaves of the mains in the quiet. A line has a phase of its own in each recording, so that no two agree, and a colour of the
/// noise that was taken from the same quiet holds some of it; but nothing else in a quiet stretch is so narrow. Under the right model the
/// power of the line is to that of its neighbours as F.
#[must_use]
pub fn hum(problem: &Problem, fit: &Fit) -> Hum {
    let stretches: Vec<(Vec<f64>, f64)> = problem
        .recordings
        .iter()
        .zip(&fit.residuals)
        .filter_map(|(recording, residual)| {
            let quiet = recording.times_s.partition_point(|time| *time < recording.contact_guess_s);
            let lasts_s = recording.times_s[quiet.checked_sub(1)?] - recording.times_s[0];
            Some((residual.get(..quiet)?.to_vec(), lasts_s))
        })
        .collect();
    of_quiet(&stretches)
}

/// Of whitened stretches, each with how long it lasts, s.
fn of_quiet(stretches: &[(Vec<f64>, f64)]) -> Hum {
    let resolved_hz = stretches.len() as f64 / stretches.iter().map(|(_, lasts_s)| lasts_s).sum::<f64>();
    let power = |hz: f64, beside: f64| -> (f64, usize) {
        let lines = stretches.iter().filter_map(|(quiet, lasts_s)| {
            let there = hz + beside / lasts_s;
            (hz * lasts_s >= PERIODS && there * lasts_s >= PERIODS).then(|| line(quiet, there * lasts_s))
        });
        lines.fold((0.0, 0), |(sum, forms), power| (sum + power, forms + 2))
    };
    let of_mains = MAINS_HZ.map(|hz| {
        let (line, forms) = power(hz, 0.0);
        let around = BESIDE.map(|beside| power(hz, beside));
        let (noise, of_noise) = around.into_iter().fold((0.0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let (level, p_value) = by_chance((line, forms), (noise, of_noise));
        Hum {
            hz,
            band_hz: [hz - resolved_hz, hz + resolved_hz],
            excess: line - forms as f64 * level,
            p_value: (p_value * MAINS_HZ.len() as f64).min(1.0),
        }
    });
    of_mains.into_iter().min_by(|a, b| a.p_value.total_cmp(&b.p_value)).expect("the mains have a frequency")
}

/// What each form beside a line has, and the probability that the line has as much by chance; of both the sum of squares and the number of forms.
fn by_chance((line, forms): (f64, usize), (noise, of_noise): (f64, usize)) -> (f64, f64) {
    let level = noise / of_noise.max(1) as f64;
    let distribution = FisherSnedecor::new(forms as f64, of_noise as f64).ok().filter(|_| level > 0.0);
    (level, distribution.map_or(1.0, |distribution| distribution.sf(line / forms as f64 / level)))
}

/// The sum of squares of a sine and a cosine of so many periods over a stretch, beside its mean and its slope.
fn line(values: &[f64], periods: f64) -> f64 {
    let lines = basis(values.len(), periods).tr_mul(&DVector::from_column_slice(values));
    lines.iter().skip(2).map(|line| line * line).sum()
}

/// A mean, a slope, and a sine and a cosine of so many periods over so many values, orthonormal.
fn basis(values: usize, periods: f64) -> DMatrix<f64> {
    let forms = DMatrix::from_fn(values, 4, |place, form| {
        let along = place as f64 / (values - 1) as f64;
        let angle = std::f64::consts::TAU * periods * along;
        [1.0, along, angle.cos(), angle.sin()][form]
    });
    forms.qr().q()
}

/// Values at so many a second without their strongest line of the mains or of its second and third harmonics, where one stands out of what is beside it:
/// what hums is no noise.
#[must_use]
pub fn without_mains(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let lasts_s = (values.len().max(2) - 1) as f64 / rate_hz;
    let near = |hz: f64| {
        // The mains keep to 0.2 Hz, and a line is as wide as its length resolves.
        let at = (-20..=20).map(|step| (hz * lasts_s + 0.05 * f64::from(step)).max(PERIODS));
        let tried = at.map(|periods| (periods, line(values, periods)));
        tried.max_by(|a, b| a.1.total_cmp(&b.1)).expect("many are tried")
    };
    let stands_out = |(periods, power): &(f64, f64)| {
        let beside: Vec<f64> =
            BESIDE.iter().filter(|by| periods + **by >= PERIODS).map(|by| line(values, periods + by)).collect();
        by_chance((*power, 2), (beside.iter().sum(), 2 * beside.len())).1 < UNLIKELY
    };
    let lines = MAINS_HZ.iter().flat_map(|hz| [1.0, 2.0, 3.0].map(|order| hz * order));
    let seen = lines.filter(|hz| *hz <= 0.5 * rate_hz && hz * lasts_s >= 4.0).map(near).filter(stands_out);
    let Some((periods, _)) = seen.max_by(|a, b| a.1.total_cmp(&b.1)) else { return values.to_vec() };
    let of_line = basis(values.len(), periods);
    let values = DVector::from_column_slice(values);
    let of_line = of_line.columns(2, 2);
    let hum = of_line * of_line.tr_mul(&values);
    (values - hum).iter().copied().collect()
}

/// Frequencies, Hz, and the power of whitened residuals of all recordings together, over that of noise.
#[must_use]
pub fn periodogram(problem: &Problem, residuals: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let mut planner = RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(LENGTH);
    let mut power = vec![0.0; LENGTH / 2 + 1];
    let (mut interval_s, mut of_noise) = (0.0, 0.0);
    for (recording, residual) in problem.recordings.iter().zip(residuals) {
        if residual.is_empty() {
            continue;
        }
        let samples = recording.times_s.len();
        let first = recording.times_s.partition_point(|time| *time < recording.contact_guess_s);
        // Whitened: a line stands out against the noise, not against its colour.
        let values = &residual[first..samples];
        let count = values.len().min(LENGTH);
        if count < 16 {
            continue;
        }
        interval_s = (recording.times_s[samples - 1] - recording.times_s[first]) / (samples - first - 1) as f64;
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let mut input = transform.make_input_vec();
        for (place, value) in values[..count].iter().enumerate() {
            let window = 0.5 - 0.5 * (std::f64::consts::TAU * (place as f64 + 0.5) / count as f64).cos();
            input[place] = (value - mean) * window;
            of_noise += window * window;
        }
        let mut output = transform.make_output_vec();
        // Lengths are the plan's own.
        if transform.process(&mut input, &mut output).is_ok() {
            for (sum, value) in power.iter_mut().zip(&output) {
                *sum += value.norm_sqr();
            }
        }
    }
    power.iter_mut().for_each(|power| *power /= of_noise.max(f64::MIN_POSITIVE));
    let step = if interval_s > 0.0 { 1.0 / (interval_s * LENGTH as f64) } else { 0.0 };
    ((0..power.len()).map(|place| place as f64 * step).collect(), power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::noise::Noise;
    use crate::diagnosis::noise::tests::coloured;

    /// Twelve stretches of 50 ms at 5 kHz, whitened by what they are themselves, with a line of this amplitude, each in a phase of its own.
    fn of_line(amplitude: f64, hz: f64) -> Hum {
        let quiet: Vec<Vec<f64>> = (0..12)
            .map(|number| {
                let line = |place: usize| std::f64::consts::TAU * hz * place as f64 / 5e3 + 2.4 * number as f64;
                let noise = coloured(250, number);
                noise.iter().enumerate().map(|(place, noise)| noise + amplitude * line(place).sin()).collect()
            })
            .collect();
        let noise = Noise::of_quiet(&quiet, true).expect("enough");
        let whitened = quiet.into_iter().map(|mut stretch| {
            noise.whiten(&mut stretch);
            (stretch, 0.05)
        });
        of_quiet(&whitened.collect::<Vec<_>>())
    }

    #[test]
    fn a_line_of_the_mains_is_no_noise_though_the_noise_was_told_with_it() {
        for hz in MAINS_HZ {
            let hum = of_line(0.6, hz);
            assert!(hum.is_there() && hum.excess > 20.0, "{hum:?}");
            assert!((hum.hz - hz).abs() < 11.0 && hum.band_hz[0] < hz && hum.band_hz[1] > hz, "{hum:?}");
        }
    }

    #[test]
    fn neither_coloured_noise_nor_another_line_is_of_the_mains() {
        for hum in [of_line(0.0, 50.0), of_line(0.6, 170.0)] {
            assert!(hum.p_value > 1e-3, "{hum:?}");
        }
        assert!(!of_quiet(&[]).is_there() && !of_quiet(&[(vec![1.0; 10], 0.002)]).is_there());
    }

    /// 0.8 s at 500 Hz.
    #[test]
    fn what_hums_beside_noise_is_taken_out_and_nothing_else() {
        let noise = coloured(400, 5);
        let with = |amplitude: f64, hz: f64| {
            let line = |place: usize| (std::f64::consts::TAU * hz * place as f64 / 500.0 + 0.7).sin();
            noise.iter().enumerate().map(|(place, noise)| noise + amplitude * line(place)).collect::<Vec<_>>()
        };
        let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        for hz in [49.9, 60.1, 150.0] {
            let left = square(&without_mains(&with(2.0, hz), 500.0)) / square(&noise);
            assert!((left - 1.0).abs() < 0.05, "{hz} Hz: {left}");
        }
        for other in [with(0.0, 50.0), with(2.0, 83.0)] {
            assert_eq!(without_mains(&other, 500.0), other);
        }
    }
}
