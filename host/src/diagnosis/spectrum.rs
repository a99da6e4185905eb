//! The spectrum of what a fit leaves.

use realfft::RealFftPlanner;

use super::fit::Fit;
use super::problem::Problem;

/// Length of the transform: padded with zeros, so that a line's frequency is read finely.
const LENGTH: usize = 8192;

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
