//! How well an effect is hidden: d, the norm of the whitened residual that the best re-tuned baseline leaves of the
//! noise-free recordings, all together, with what the re-tuning had to pay against the stated uncertainties.
//!
//! Minimised by damped Gauss–Newton over ln k (all recordings), ln m (one for each configuration) and, for each
//! recording, the contact instant, zero offset (both free), speed and spring repeatability. The normal matrix is small
//! (five globals, four locals a recording) and solved whole.

use crate::baseline::{Baseline, Tangent};
use crate::noise::Colour;

/// One recording as the fit sees it.
#[derive(Debug, Clone)]
pub struct Observation<'a> {
    /// Readings without noise.
    pub readings: &'a [f64],
    /// First guess of the contact instant, s.
    pub contact_s: f64,
    /// The baseline that the priors are centred on.
    pub baseline: Baseline,
    /// Index of the configuration.
    pub configuration: usize,
    /// Standard deviation of the speed, m/s.
    pub speed_sd: f64,
    /// Relative standard deviation of the configuration's mass.
    pub mass_sd: f64,
}

/// What is believed about all recordings.
#[derive(Debug, Clone, Copy)]
pub struct Belief {
    /// Relative standard deviation of springs and pad in series.
    pub stiffness_sd: f64,
    /// Relative repeatability of the springs.
    pub repeatability: f64,
    /// Samples a second.
    pub rate_hz: f64,
}

/// The best re-tuned baseline.
#[derive(Debug, Clone)]
pub struct Retuned {
    /// Strength: the root of data misfit and price together.
    pub d: f64,
    /// The data's part of d² alone.
    pub misfit: f64,
    /// ln k over the centre.
    pub ln_k: f64,
    /// ln m over the centre, for each configuration.
    pub ln_m: Vec<f64>,
    /// Contact instant, s, offset, change of speed, m/s, and of ln k, for each recording.
    pub locals: Vec<[f64; 4]>,
    /// Whitened residual of each recording.
    pub residuals: Vec<Vec<f64>>,
}

impl Retuned {
    /// The re-tuned baseline of recording `index`.
    #[must_use]
    pub fn baseline(&self, observation: &Observation<'_>, index: usize) -> Baseline {
        let centre = observation.baseline;
        let [_, _, speed, spring] = self.locals[index];
        Baseline {
            speed_m_per_s: centre.speed_m_per_s + speed,
            mass_kg: centre.mass_kg * self.ln_m[observation.configuration].exp(),
            stiffness_n_per_m: centre.stiffness_n_per_m * (self.ln_k + spring).exp(),
            ..centre
        }
    }
}

const ROUNDS: usize = 25;

/// Re-tunes the baseline to `observations`.
///
/// # Panics
/// When there is no observation.
#[must_use]
pub fn retune(observations: &[Observation<'_>], belief: &Belief, colour: &Colour) -> Retuned {
    let configurations = 1 + observations.iter().map(|o| o.configuration).max().expect("an observation");
    let globals = 1 + configurations;
    let mut masses = vec![0.0; configurations];
    for o in observations {
        masses[o.configuration] = o.mass_sd;
    }
    let mut now = Retuned {
        d: f64::INFINITY,
        misfit: f64::INFINITY,
        ln_k: 0.0,
        ln_m: vec![0.0; configurations],
        locals: observations.iter().map(|o| [o.contact_s, first(o.readings), 0.0, 0.0]).collect(),
        residuals: Vec::new(),
    };
    let mut normal = Normal::new(globals + 4 * observations.len());
    evaluate(observations, belief, colour, &masses, &mut now, Some(&mut normal));
    let mut damping = 1e-6;
    for _ in 0..ROUNDS {
        let Some(step) = normal.solve(damping) else { break };
        let mut next = now.clone();
        next.ln_k += step[0];
        for (ln_m, s) in next.ln_m.iter_mut().zip(&step[1..]) {
            *ln_m += s;
        }
        for (local, s) in next.locals.iter_mut().zip(step[globals..].chunks(4)) {
            for (value, s) in local.iter_mut().zip(s) {
                *value += s;
            }
        }
        let mut next_normal = Normal::new(globals + 4 * observations.len());
        evaluate(observations, belief, colour, &masses, &mut next, Some(&mut next_normal));
        if next.d < now.d {
            let gained = now.d - next.d;
            (now, normal) = (next, next_normal);
            damping = (damping * 0.2).max(1e-12);
            if gained < 1e-4 * now.d + 1e-5 {
                break;
            }
        } else {
            damping *= 30.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    now
}

/// The reading before contact.
fn first(readings: &[f64]) -> f64 {
    readings.first().copied().unwrap_or(0.0)
}

/// Residuals, cost and (where asked) the normal equations at `point`.
fn evaluate(
    observations: &[Observation<'_>],
    belief: &Belief,
    colour: &Colour,
    masses: &[f64],
    point: &mut Retuned,
    mut normal: Option<&mut Normal>,
) {
    let globals = 1 + masses.len();
    let mut misfit = 0.0;
    let mut price = 0.0;
    let mut residuals = Vec::with_capacity(observations.len());
    for (index, o) in observations.iter().enumerate() {
        let [contact, offset, speed, spring] = point.locals[index];
        let sampler = point.baseline(o, index).sampler();
        let count = o.readings.len();
        let mut residual = Vec::with_capacity(count);
        let mut columns: [Vec<f64>; 5] = std::array::from_fn(|_| Vec::with_capacity(count));
        for (i, reading) in o.readings.iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let t = i as f64 / belief.rate_hz;
            let Tangent { value, by_time, by_speed, by_ln_k, by_ln_m } = sampler(t - contact);
            residual.push(reading - value - offset);
            for (column, value) in columns.iter_mut().zip([by_ln_k, by_ln_m, -by_time, 1.0, by_speed]) {
                column.push(value);
            }
        }
        colour.whiten(&mut residual);
        misfit += residual.iter().map(|r| r * r).sum::<f64>();
        price += (speed / o.speed_sd).powi(2) + (spring / belief.repeatability).powi(2);
        if let Some(normal) = normal.as_deref_mut() {
            for column in &mut columns {
                colour.whiten(column);
            }
            let base = globals + 4 * index;
            // The springs' repeatability moves the reading as ln k does.
            let places = [(0, 0), (1 + o.configuration, 1), (base, 2), (base + 1, 3), (base + 2, 4), (base + 3, 0)];
            let products: [[f64; 5]; 5] = std::array::from_fn(|a| {
                std::array::from_fn(|b| if b <= a { dot(&columns[a], &columns[b]) } else { 0.0 })
            });
            let right: [f64; 5] = std::array::from_fn(|a| dot(&columns[a], &residual));
            for &(row, a) in &places {
                normal.right[row] += right[a];
                for &(column, b) in &places {
                    *normal.at(row, column) += products[a.max(b)][a.min(b)];
                }
            }
            normal.prior(base + 2, speed, o.speed_sd);
            normal.prior(base + 3, spring, belief.repeatability);
        }
        residuals.push(residual);
    }
    price += (point.ln_k / belief.stiffness_sd).powi(2);
    for (ln_m, sd) in point.ln_m.iter().zip(masses) {
        price += (ln_m / sd).powi(2);
    }
    if let Some(normal) = normal {
        normal.prior(0, point.ln_k, belief.stiffness_sd);
        for (index, (ln_m, sd)) in point.ln_m.iter().zip(masses).enumerate() {
            normal.prior(1 + index, *ln_m, *sd);
        }
    }
    point.misfit = misfit;
    point.d = (misfit + price).sqrt();
    point.residuals = residuals;
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Normal equations.
struct Normal {
    size: usize,
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    fn new(size: usize) -> Self {
        Self { size, matrix: vec![0.0; size * size], right: vec![0.0; size] }
    }

    fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.matrix[row * self.size + column]
    }

    fn prior(&mut self, row: usize, value: f64, sd: f64) {
        let weight = 1.0 / (sd * sd);
        *self.at(row, row) += weight;
        self.right[row] -= weight * value;
    }

    /// Cholesky, the diagonal raised by `damping` of itself.
    fn solve(&self, damping: f64) -> Option<Vec<f64>> {
        let n = self.size;
        let mut l = self.matrix.clone();
        for i in 0..n {
            // A column without any information (a configuration without recordings) stays where it is.
            l[i * n + i] = l[i * n + i] * (1.0 + damping) + 1e-300;
            if self.matrix[i * n + i] == 0.0 {
                l[i * n + i] = 1.0;
            }
        }
        for j in 0..n {
            for k in 0..j {
                let f = l[j * n + k];
                if f != 0.0 {
                    for i in j..n {
                        l[i * n + j] -= l[i * n + k] * f;
                    }
                }
            }
            let pivot = l[j * n + j];
            if pivot <= 0.0 || !pivot.is_finite() {
                return None;
            }
            let root = pivot.sqrt();
            for i in j..n {
                l[i * n + j] /= root;
            }
        }
        let mut x = self.right.clone();
        for i in 0..n {
            for k in 0..i {
                x[i] -= l[i * n + k] * x[k];
            }
            x[i] /= l[i * n + i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] -= l[k * n + i] * x[k];
            }
            x[i] /= l[i * n + i];
        }
        Some(x)
    }
}
