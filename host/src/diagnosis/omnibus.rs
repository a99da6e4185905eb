//! Is there a rest at all? A test against anything smooth, whatever its cause.
//!
//! The residual is compared with sines over the contact time, each also times speed and times mass, and with slow curves after the
//! contact, all freed of what the fit's coordinates can imitate. Under the right model the sum of squares over q independent forms
//! is χ² with q degrees of freedom, as exactly as the noise is known: of a short quiet stretch its strength at slow frequencies is told with
//! a relative variance ε², and the sum's own variance is 2q + q²·ε².

use nalgebra::DVector;

use super::conditions::weights;
use super::fit::{Fit, Tangent};
use super::problem::Problem;

/// Sines over the contact time.
const SINES: usize = 12;
/// Cosines over the time after it.
const TAIL_FORMS: usize = 4;

/// A rest that only further channels show is one of the usual imperfections below so many squares of their noise: a gauge of 10 µm beside a long free
/// flight tells a trace of damping, which the force does not, by fifteen deviations.
const TRACE_BESIDE: f64 = 400.0;

/// What the test found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Omnibus {
    /// Sum of squares over the independent forms, less their number.
    pub excess: f64,
    /// How many independent forms.
    pub forms: usize,
    /// Relative variance of the noise's strength where these forms are.
    pub noise_variance: f64,
}

impl Omnibus {
    /// The excess in its own standard deviations, √(2q + q²·ε²).
    #[must_use]
    pub fn z(&self) -> f64 {
        let forms = self.forms as f64;
        if self.forms == 0 { 0.0 } else { self.excess / (2.0 * forms + forms * forms * self.noise_variance).sqrt() }
    }
}

/// Tests a fit: all channels together, or what is observed alone where further ones add no more than a trace.
#[must_use]
pub fn omnibus(problem: &Problem, fit: &Fit, tangent: &Tangent) -> Omnibus {
    let all = of_channels(problem, fit, tangent, problem.channels.len());
    if problem.channels.len() == 1 || all.excess > TRACE_BESIDE { all } else { observed_omnibus(problem, fit, tangent) }
}

/// Tests what a fit leaves of what is observed alone.
#[must_use]
pub fn observed_omnibus(problem: &Problem, fit: &Fit, tangent: &Tangent) -> Omnibus {
    of_channels(problem, fit, tangent, 1)
}

/// Tests the first channels of a fit.
fn of_channels(problem: &Problem, fit: &Fit, tangent: &Tangent, channels: usize) -> Omnibus {
    let Some(normal) = tangent.normal(0.0) else {
        return Omnibus { excess: 0.0, forms: 0, noise_variance: 0.0 };
    };
    let forms = forms(problem, fit, channels);
    let projected: Vec<(DVector<f64>, f64)> = forms
        .iter()
        .map(|form| {
            let (global, locals) = tangent.transposed(form);
            let imitation = normal.solve(&global, &locals);
            let imitated = tangent.times(&imitation);
            let flat: Vec<f64> = form
                .iter()
                .zip(&imitated)
                .flat_map(|(values, imitated)| {
                    let values: Vec<f64> = if values.is_empty() { vec![0.0; imitated.len()] } else { values.clone() };
                    values.into_iter().zip(imitated).map(|(v, i)| v - i).collect::<Vec<_>>()
                })
                .collect();
            let whole: f64 = form.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
            (DVector::from_vec(flat), whole)
        })
        .collect();
    // By Gram and Schmidt's rule, forms that the others or the coordinates already hold left out.
    let residual =
        DVector::from_iterator(fit.residuals.iter().map(Vec::len).sum(), fit.residuals.iter().flatten().copied());
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut sum = 0.0;
    for (mut form, whole) in projected {
        for _ in 0..2 {
            for other in &basis {
                let part = other.dot(&form);
                form.axpy(-part, other, 1.0);
            }
        }
        let norm = form.norm();
        if norm > 0.02 * whole && norm > 0.0 {
            form /= norm;
            sum += form.dot(&residual).powi(2);
            basis.push(form);
        }
    }
    let noise_variance =
        problem.recordings.iter().map(|recording| recording.noise[0].slow_variance()).fold(0.0, f64::max);
    Omnibus { excess: sum - basis.len() as f64, forms: basis.len(), noise_variance }
}

/// Begin and end of the contact that the fit has, s in the recording's time.
fn contact_of(problem: &Problem, fit: &Fit, recording: usize) -> (f64, f64) {
    let from_s = fit.layout.contact_s(problem, &fit.point, recording);
    (from_s, from_s + problem.recordings[recording].contact_time_s)
}

fn forms(problem: &Problem, fit: &Fit, channels: usize) -> Vec<Vec<Vec<f64>>> {
    let mut all = Vec::new();
    for weights in &weights(problem) {
        if weights.iter().all(|weight| *weight == 0.0) {
            continue;
        }
        for number in 1..=SINES {
            all.push(form(problem, fit, weights, channels, |along, _| {
                if (0.0..=1.0).contains(&along) { (std::f64::consts::PI * number as f64 * along).sin() } else { 0.0 }
            }));
        }
        for number in 0..TAIL_FORMS {
            all.push(form(problem, fit, weights, channels, |along, tail| {
                if along > 1.0 { (std::f64::consts::PI * number as f64 * tail).cos() } else { 0.0 }
            }));
        }
    }
    all
}

/// A form in every recording, whitened, and nothing beyond the first channels: a function of the time along the contact (0 to 1) and along what
/// follows it.
fn form(
    problem: &Problem,
    fit: &Fit,
    weights: &[f64],
    channels: usize,
    shape: impl Fn(f64, f64) -> f64,
) -> Vec<Vec<f64>> {
    problem
        .recordings
        .iter()
        .enumerate()
        .map(|(number, recording)| {
            let (from_s, to_s) = contact_of(problem, fit, number);
            let last_s = recording.times_s[recording.times_s.len() - 1];
            let mut values: Vec<f64> = Vec::with_capacity(recording.rows());
            for channel in 0..problem.channels.len() {
                let size = match channel {
                    0 => 1.0,
                    _ if channel < channels => recording.noise[channel].rms() / recording.noise[0].rms(),
                    _ => 0.0,
                };
                values.extend(recording.times_s.iter().map(|time| {
                    let along = (time - from_s) / (to_s - from_s);
                    let tail = ((time - to_s) / (last_s - to_s).max(1e-9)).clamp(0.0, 1.0);
                    size * weights[number] * shape(along, tail)
                }));
            }
            recording.whiten(&mut values);
            values
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_short_quiet_stretch_leaves_open_is_no_rest() {
        let known = Omnibus { excess: 75.0, forms: 48, noise_variance: 0.0 };
        assert!((known.z() - 75.0 / 96.0_f64.sqrt()).abs() < 1e-12);
        // A third of the noise's strength is open: so is a third of 48.
        let hardly = Omnibus { noise_variance: 1.0 / 9.0, ..known };
        assert!((hardly.z() - 75.0 / 352.0_f64.sqrt()).abs() < 1e-12);
    }
}
