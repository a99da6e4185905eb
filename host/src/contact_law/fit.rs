//! Fits a law to many blows at once: the law's parameters and each configuration's mass, with every blow's own instant, zero, speed
//! and springs within their stated uncertainty. Levenberg and Marquardt's method on the normal equations, whose blocks are
//! filled blow by blow.
//!
//! ```text
//!   reconstructed:  r = F − F₀ − F_law(t − t₀; m·δ̈ = m·g − F_law)      the depth is the force's own second integral
//!   measured:       r = F − F₀ − F_law(δ − δ₀, δ̇)                       paper 1, eq. 25
//! ```
//!
//! In the first form the force is integrated as the law has it, not as it was recorded: at the solution the two are the same, and
//! the recording's noise is not integrated twice.
//!
//! Model error counts as noise: where what is left is more than the noise before contact, it is weighed with what is left, so that
//! it does not overrule what is stated about mass and speed.
//!
//! Source: D. W. Marquardt, SIAM J. Appl. Math. 11 (1963) 431.

use nalgebra::{DMatrix, DVector};

use super::blow::{Blow, Series};
use super::depth::Source;
use super::law::{Damping, Law, Values};

/// What each blow has for itself: instant or zero of depth, zero of force, speed, springs.
const OWN: usize = 4;
/// Most iterations.
const MOST: usize = 40;
/// An iteration that gains less than this in χ² is the last.
const SMALL_GAIN: f64 = 1e-3;
/// Most rounds of a fit, each with another weight.
const ROUNDS: usize = 12;
/// Samples on either side of a law's step that are not fitted.
const NEAR_STEP: f64 = 2.5;
/// Step of the differences that stand for derivatives, in scaled coordinates.
const STEP: f64 = 1e-4;
/// How far a measured depth's zero may be off, as a part of the reference depth.
const ZERO_OF_DEPTH: f64 = 0.05;
/// Ranges of exponent and of damping in scaled coordinates.
const EXPONENTS: (f64, f64) = (0.3, 6.0);
const DAMPINGS: (f64, f64) = (-0.6, 12.0);

/// What a fit is about.
#[derive(Clone, Debug)]
pub(super) struct Setting<'a> {
    pub(super) blows: &'a [Blow],
    pub(super) source: Source,
    pub(super) gravity_m_per_s2: f64,
    pub(super) spring_repeatability: f64,
    /// Number of configurations.
    pub(super) configurations: usize,
    /// Depth, force and speed in the middle of the recordings: units of the coordinates.
    pub(super) reference_m: f64,
    pub(super) reference_n: f64,
    pub(super) reference_m_per_s: f64,
    /// An exponent that is held.
    pub(super) held_exponent: Option<f64>,
}

/// Where a fit stands: the law's coordinates, the configurations' masses (deviation from stated, relative), and what each blow
/// has for itself.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) law: Vec<f64>,
    pub(super) masses: Vec<f64>,
    pub(super) own: Vec<[f64; OWN]>,
}

/// A law's fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) law: &'static Law,
    pub(super) point: Point,
    /// Noise of the fit over that before contact, at least 1.
    pub(super) inflation: f64,
    /// Covariance of the law's coordinates, what is stated taken for known as it is stated.
    pub(super) covariance: DMatrix<f64>,
}

impl Setting<'_> {
    /// The law's values at these coordinates: ln(F_r/reference), exponent, damping in units of the middle of the recordings.
    pub(super) fn values(&self, law: &Law, coordinates: &[f64]) -> Values {
        let free = law.exponent && self.held_exponent.is_none();
        let exponent = if free {
            coordinates[1]
        } else if law.exponent {
            self.held_exponent.unwrap_or(1.0)
        } else {
            1.0
        };
        let damping = coordinates.get(1 + usize::from(free)).copied().unwrap_or(0.0);
        Values {
            reference_m: self.reference_m,
            reference_n: self.reference_n * coordinates[0].exp(),
            exponent,
            damping: damping * self.damping_unit(law),
        }
    }

    /// What a damping of 1 in scaled coordinates is.
    pub(super) fn damping_unit(&self, law: &Law) -> f64 {
        match law.damping {
            Damping::None | Damping::OverSpeed { .. } => 1.0,
            Damping::Material => 1.0 / self.reference_m_per_s,
            Damping::Dashpot => self.reference_n / self.reference_m_per_s,
        }
    }

    fn start(&self, law: &Law) -> Point {
        let mut coordinates = vec![0.0];
        if law.exponent && self.held_exponent.is_none() {
            coordinates.push(self.exponent_by_peaks());
        }
        if !matches!(law.damping, Damping::None) {
            coordinates.push(0.05);
        }
        Point { law: coordinates, masses: vec![0.0; self.configurations], own: vec![[0.0; OWN]; self.blows.len()] }
    }

    /// The slope of peaks over ½mv² in logarithms: F ∝ E^(n/(n+1)).
    fn exponent_by_peaks(&self) -> f64 {
        let energy = |blow: &Blow| 0.5 * blow.mass.value * blow.speed.value * blow.speed.value;
        let points: Vec<(f64, f64)> = self.blows.iter().map(|blow| (energy(blow).ln(), blow.peak_n.ln())).collect();
        let count = points.len() as f64;
        let mean = points.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / count, sum.1 + point.1 / count));
        let square: f64 = points.iter().map(|point| (point.0 - mean.0).powi(2)).sum();
        let product: f64 = points.iter().map(|point| (point.0 - mean.0) * (point.1 - mean.1)).sum();
        let slope = if square > 1e-6 { product / square } else { 0.5 };
        let slope = slope.clamp(0.35, 0.72);
        slope / (1.0 - slope)
    }

    pub(super) fn mass_kg(&self, point: &Point, number: usize) -> f64 {
        let blow = &self.blows[number];
        blow.mass.value * (1.0 + point.masses[blow.configuration])
    }

    pub(super) fn speed_m_per_s(&self, point: &Point, number: usize) -> f64 {
        self.blows[number].speed.value * (1.0 + point.own[number][2])
    }

    /// Instant of contact of a blow, s in its recording.
    pub(super) fn contact_s(&self, point: &Point, number: usize) -> f64 {
        let blow = &self.blows[number];
        match self.source {
            Source::Reconstructed => blow.contact_s + point.own[number][0] * blow.duration_s(),
            Source::Measured => blow.contact_s,
        }
    }

    /// The force that the law gives at each sample, N, the blow's own zero included.
    pub(super) fn predicted(&self, law: &Law, point: &Point, number: usize, series: &Series) -> Option<Vec<f64>> {
        let blow = &self.blows[number];
        let own = point.own[number];
        let mut values = self.values(law, &point.law);
        if !(EXPONENTS.0..=EXPONENTS.1).contains(&values.exponent)
            || !(DAMPINGS.0..=DAMPINGS.1).contains(&(values.damping / self.damping_unit(law)))
            || point.masses[blow.configuration] <= -0.8
            || own[2] <= -0.8
        {
            return None;
        }
        values.reference_n *= own[3].exp();
        let speed = self.speed_m_per_s(point, number);
        let zero = own[1] * blow.noise_n;
        let predicted: Vec<f64> = match self.source {
            Source::Reconstructed => {
                let motion = law.motion(&values, self.mass_kg(point, number), speed, self.gravity_m_per_s2);
                let contact = self.contact_s(point, number);
                series.times_s.iter().map(|time| zero + motion.force_at(time - contact)).collect()
            }
            Source::Measured => {
                let force = law.force(&values, speed);
                let shift = own[0] * self.reference_m;
                series.depth.iter().map(|(depth, rate)| zero + force.at(depth - shift, *rate)).collect()
            }
        };
        predicted.iter().all(|force| force.is_finite()).then_some(predicted)
    }

    /// Residuals of a blow, in its noise.
    fn residual(&self, law: &Law, point: &Point, number: usize, inflation: f64) -> Option<DVector<f64>> {
        let blow = &self.blows[number];
        let series = &blow.fitted;
        let scale = series.group.sqrt() / (blow.noise_n * inflation);
        let predicted = self.predicted(law, point, number, series)?;
        // A law that begins with a step has a least square in every gap between two samples, out of which no derivative leads. So the
        // samples next to the step, which filters of the chain smear in any case, are not fitted; they are judged.
        let (from, to) = self.step(law, point, number);
        Some(DVector::from_iterator(
            predicted.len(),
            predicted.iter().zip(&series.force_n).zip(&series.times_s).map(|((predicted, force), time)| {
                if from < *time && *time < to { 0.0 } else { (force - predicted) * scale }
            }),
        ))
    }

    /// From when to when a law's step is near, s; an empty stretch where it has none.
    fn step(&self, law: &Law, point: &Point, number: usize) -> (f64, f64) {
        if self.source == Source::Measured || !matches!(law.damping, Damping::Dashpot) {
            return (0.0, 0.0);
        }
        let times = &self.blows[number].fitted.times_s;
        let sample_s = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        let contact_s = self.contact_s(point, number);
        (contact_s - NEAR_STEP * sample_s, contact_s + NEAR_STEP * sample_s)
    }

    /// Standard deviations of what each blow has for itself, in the coordinates' units.
    fn own_sd(&self, number: usize) -> [f64; OWN] {
        let blow = &self.blows[number];
        let first = match self.source {
            Source::Reconstructed => 1.0,
            Source::Measured => ZERO_OF_DEPTH,
        };
        let tight = |sd: f64| sd.max(1e-7);
        [
            first,
            tight(blow.zero_n / blow.noise_n),
            tight(blow.speed.sd / blow.speed.value),
            tight(self.spring_repeatability),
        ]
    }

    fn mass_sd(&self, configuration: usize) -> f64 {
        let of = self.blows.iter().filter(|blow| blow.configuration == configuration);
        of.map(|blow| blow.mass.sd / blow.mass.value).fold(0.0, f64::max).max(1e-7)
    }

    fn cost(&self, law: &Law, point: &Point, part: &[usize], inflation: f64) -> Option<f64> {
        let mut cost: f64 =
            (0..self.configurations).map(|place| (point.masses[place] / self.mass_sd(place)).powi(2)).sum();
        for &number in part {
            cost += self.residual(law, point, number, inflation)?.norm_squared();
            let sd = self.own_sd(number);
            cost += point.own[number].iter().zip(sd).map(|(value, sd)| (value / sd).powi(2)).sum::<f64>();
        }
        Some(cost)
    }

    /// The normal equations: matrix and gradient over law, masses and what each blow of the part has for itself.
    fn normal(
        &self,
        law: &Law,
        point: &Point,
        part: &[usize],
        inflation: f64,
        shared: bool,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let globals = point.law.len() + self.configurations;
        let size = globals + OWN * part.len();
        let mut matrix = DMatrix::zeros(size, size);
        let mut gradient = DVector::zeros(size);
        for place in 0..self.configurations {
            let column = point.law.len() + place;
            let weight = self.mass_sd(place).powi(-2);
            matrix[(column, column)] += weight;
            gradient[column] -= weight * point.masses[place];
        }
        for (turn, &number) in part.iter().enumerate() {
            let here = self.residual(law, point, number, inflation)?;
            let configuration = self.blows[number].configuration;
            let first_own = globals + OWN * turn;
            let mut places: Vec<usize> = (0..point.law.len()).collect();
            places.push(point.law.len() + configuration);
            places.extend(first_own..first_own + OWN);
            let mut columns: Vec<DVector<f64>> = Vec::with_capacity(places.len());
            for &place in &places {
                let moved = |step: f64| {
                    let mut moved = point.clone();
                    if place < point.law.len() {
                        moved.law[place] += step;
                    } else if place < globals {
                        moved.masses[configuration] += step;
                    } else {
                        moved.own[number][place - first_own] += step;
                    }
                    self.residual(law, &moved, number, inflation)
                };
                let column = if place == first_own + 3 {
                    // The springs' own factor does what the force at the reference depth does.
                    columns[0].clone()
                } else if place == first_own {
                    // Across the kink of the contact both sides count.
                    (moved(STEP)? - moved(-STEP)?) / (2.0 * STEP)
                } else {
                    match moved(STEP) {
                        Some(there) => (there - &here) / STEP,
                        None => (&here - moved(-STEP)?) / STEP,
                    }
                };
                columns.push(column);
            }
            for (own, sd) in self.own_sd(number).into_iter().enumerate() {
                let place = first_own + own;
                matrix[(place, place)] += sd.powi(-2);
                gradient[place] -= point.own[number][own] * sd.powi(-2);
            }
            for (left, &row) in places.iter().enumerate() {
                gradient[row] -= columns[left].dot(&here);
                for (right, &column) in places.iter().enumerate().take(left + 1) {
                    let product = columns[left].dot(&columns[right]);
                    matrix[(row, column)] += product;
                    if row != column {
                        matrix[(column, row)] += product;
                    }
                }
            }
        }
        if !shared {
            // What is shared stays where it is.
            for place in 0..globals {
                matrix.row_mut(place).fill(0.0);
                matrix.column_mut(place).fill(0.0);
                matrix[(place, place)] = 1.0;
                gradient[place] = 0.0;
            }
        }
        Some((matrix, gradient))
    }

    /// Moves a point to where it fits best; `shared`: law and masses move, too.
    fn settle(&self, law: &Law, start: Point, part: &[usize], inflation: f64, shared: bool) -> Option<(Point, f64)> {
        let mut point = start;
        let mut cost = self.cost(law, &point, part, inflation)?;
        let mut damping = 1e-3;
        for _ in 0..MOST {
            let (matrix, gradient) = self.normal(law, &point, part, inflation, shared)?;
            let mut gain = 0.0;
            for _ in 0..10 {
                let mut damped = matrix.clone();
                for place in 0..damped.nrows() {
                    damped[(place, place)] *= 1.0 + damping;
                }
                let step = damped.cholesky().map(|factor| factor.solve(&gradient));
                let tried = step.and_then(|step| {
                    let mut tried = point.clone();
                    self.move_by(&mut tried, &step, part);
                    self.cost(law, &tried, part, inflation).map(|cost| (tried, cost))
                });
                match tried {
                    Some((tried, lower)) if lower < cost => {
                        gain = cost - lower;
                        (point, cost) = (tried, lower);
                        damping = (damping / 8.0).max(1e-10);
                        break;
                    }
                    _ => damping *= 8.0,
                }
            }
            if gain < SMALL_GAIN.max(1e-7 * cost) {
                break;
            }
        }
        Some((point, cost))
    }

    fn move_by(&self, point: &mut Point, step: &DVector<f64>, part: &[usize]) {
        let law = point.law.len();
        for (place, value) in point.law.iter_mut().enumerate() {
            *value += step[place];
        }
        for (place, value) in point.masses.iter_mut().enumerate() {
            *value += step[law + place];
        }
        let first = law + self.configurations;
        for (turn, &number) in part.iter().enumerate() {
            for own in 0..OWN {
                point.own[number][own] += step[first + OWN * turn + own];
            }
        }
    }

    /// What is left over the noise, of a part.
    fn left(&self, law: &Law, point: &Point, part: &[usize]) -> Option<f64> {
        let (mut squares, mut count) = (0.0, 0.0);
        for &number in part {
            let residual = self.residual(law, point, number, 1.0)?;
            squares += residual.norm_squared();
            count += residual.len() as f64;
        }
        Some((squares / count).sqrt())
    }

    /// Fits a law to the blows of a part, from a start or from scratch. `None`: it cannot be simulated or solved.
    pub(super) fn fit(&self, law: &'static Law, part: &[usize], start: Option<&Fit>) -> Option<Fit> {
        let mut point = start.map_or_else(|| self.start(law), |fit| fit.point.clone());
        let mut inflation = start.map_or(1.0, |fit| fit.inflation);
        if start.is_none() {
            // As what is left tells how far the law can be believed, it is weighed by it from the next round on.
            inflation = self.left(law, &point, part)?.max(1.0);
            for _ in 0..ROUNDS {
                (point, _) = self.settle(law, point, part, inflation, true)?;
                let left = self.left(law, &point, part)?.max(1.0);
                let settled = (left / inflation - 1.0).abs() < 0.02;
                inflation = left;
                if settled {
                    break;
                }
            }
        } else {
            (point, _) = self.settle(law, point, part, inflation, true)?;
        }
        let (matrix, _) = self.normal(law, &point, part, inflation, true)?;
        let covariance = matrix.cholesky()?.inverse();
        let size = point.law.len();
        Some(Fit { law, point, inflation, covariance: covariance.view((0, 0), (size, size)).into_owned() })
    }

    /// What a fit leaves of a blow that took no part in it, once that one's own instant, zero, speed and springs have moved within
    /// their uncertainty: mean square, N².
    pub(super) fn left_out(&self, fit: &Fit, number: usize) -> Option<f64> {
        let mut start = fit.point.clone();
        start.own[number] = [0.0; OWN];
        let (point, _) = self.settle(fit.law, start, &[number], fit.inflation, false)?;
        self.mean_square(fit.law, &point, number)
    }

    /// What is left of a blow, sample by sample, mean square, N².
    pub(super) fn mean_square(&self, law: &Law, point: &Point, number: usize) -> Option<f64> {
        let series = &self.blows[number].full;
        let predicted = self.predicted(law, point, number, series)?;
        let squares: f64 =
            series.force_n.iter().zip(&predicted).map(|(force, predicted)| (force - predicted).powi(2)).sum();
        Some(squares / predicted.len() as f64)
    }
}
