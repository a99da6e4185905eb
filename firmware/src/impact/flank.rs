//! The instant at which a force begins or ends, below one sample and below the threshold.
//!
//! Every contact without an impact on something harder begins as an arc from zero. Fitted, by Gauss–Newton, to the
//! samples of the flank is
//!
//! ```text
//! F(u) = s·u·(1 − z/6 + z²/120 − …) = s·sin(√q·u)/√q,   z = q·u²,   u = t − t₀ ≥ 0
//! ```
//!
//! slope s, curvature q (negative for a pad that stiffens: the series then is sinh), instant t₀. q has a loose prior from the
//! time to the peak, q = (π/2τ)² ± itself, so that a short stretch is fitted by a line in effect and a long one by
//! the arc it is.
//!
//! The stretch grows by half its length, from five samples on, until the predicted deviation of t₀ is below 15 µs. A
//! hard blow needs five samples; a soft slow hit, whose instant noise hides, the whole pulse. It stops growing when the
//! residual no longer looks like the tracked noise (a moving piece rings, a damper bends the arc): then the longest
//! stretch that did is taken. So the model is trusted no further than noise demands and the data allow.
//!
//! The end of a contact is the same flank, read backward.
//!
//! **A moving piece.** The instant is that of the first touch. A piece of mass m between the robot and the springs passes the
//! force on as s·(u − sin(Ωu)/Ω), Ω² = (k_pad + k)/m, so that an arc on a short stretch reads about 1/Ω too late (0.2 ms for 0.05 to
//! 0.1 kg behind a hard pad, 0.5 to 2 ms for more behind a softer one). So [`ring`] is tried at each begin that is no arc up to the
//! peak, and where robot and piece explain the force better, their instant is taken.
//!
//! **What it cannot know.** Where the guide holds the piece, the cell feels nothing until the friction is overcome.

use super::arc::Shape;
use super::force::{Force, PIECE};
use super::least_squares::Normal;
use super::ring;
use crate::capture::Curve;

/// The deviation at which growing stops, s.
const ENOUGH: f32 = 15e-6;
/// Shortest stretch, samples.
const SHORTEST: usize = 5;
/// Longest stretch, samples: every bin fits into one piece.
const LONGEST: usize = POINTS * (PIECE - 1);
/// A stretch longer than this many points is averaged in bins.
const POINTS: usize = 64;
/// Gauss–Newton steps for each stretch.
const STEPS: usize = 6;
/// The residual's mean square over the noise's may reach 1 + this/√points: three deviations of χ².
const MISFIT: f32 = 4.24;
/// A rise by this many deviations is more than noise for the first guess.
const CLEAR_RISE: f32 = 8.0;
/// A sample below this many deviations shows no force.
const NO_FORCE: f32 = 2.0;
/// The force may be this many deviations where such a sample stands.
const HIDDEN: f32 = 8.0;
/// Relative error of the arc that is not worth resolving.
const MODEL_ERROR: f32 = 2e-4;

/// Places of two of the arc's unknowns.
const CURVATURE: usize = 1;
const BEGIN: usize = 2;

/// Which way a flank is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The force begins.
    Begin,
    /// The force ends: read backward.
    End,
}

/// What is known of a flank before it is fitted. Positions are samples from the curve's first one.
#[derive(Clone, Copy, Debug)]
pub struct Flank {
    /// Which end of the contact.
    pub direction: Direction,
    /// First sample (in reading direction) that is certainly part of the contact.
    pub inside: usize,
    /// Samples from there to the peak, and to the other end.
    pub to_peak: f32,
    /// Samples from there to the other end of the contact.
    pub to_end: usize,
    /// How far outside the instant may lie, samples.
    pub reach: usize,
    /// Peak force, N.
    pub peak: f32,
    /// Noise, N rms.
    pub noise: f32,
    /// Samples per second.
    pub rate: f32,
}

/// The instant found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Position, samples from the curve's first one.
    pub position: f32,
    /// Predicted deviation, samples.
    pub deviation: f32,
}

/// One fitted stretch. Unit of length is the stretch itself.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// t₀, samples inward from [`Flank::inside`] (usually negative).
    pub begin: f32,
    /// Slope, N per sample.
    pub slope: f32,
    /// Curvature q, 1/sample².
    pub curvature: f32,
}

struct Fitted {
    arc: Arc,
    deviation: f32,
    /// Mean square of the residual over that of the noise.
    misfit: f32,
    points: usize,
}

impl Flank {
    /// Fits the flank.
    pub fn instant<C: Curve>(&self, force: &Force<'_, C>) -> Instant {
        let Some(first) = self.first_guess(force) else {
            let still = Arc { begin: 0.0, slope: 0.0, curvature: 0.0 };
            return self.place(force, &still, 1.0);
        };
        let curvature = self.prior_curvature();
        let mut arc = Arc { curvature, ..first };
        let whole = (self.to_end as f32 - first.begin).clamp(SHORTEST as f32, LONGEST as f32);
        let mut length = (SHORTEST as f32).max(2.0 - first.begin).min(whole);
        let mut best: Option<Fitted> = None;
        let enough = ENOUGH * self.rate;
        while let Some(fitted) = self.fit(force, arc, length) {
            let fits = fitted.misfit <= Self::allowed_misfit(fitted.points);
            if best.is_some() && !fits {
                break;
            }
            arc = fitted.arc;
            let done = fitted.deviation <= enough || !fits || length >= whole;
            best = Some(fitted);
            if done {
                break;
            }
            length = (length * 1.5).min(whole);
        }
        // An arc that fits all the way to the peak leaves nothing to explain.
        let plain = self.fit(force, arc, self.to_peak.max(SHORTEST as f32).min(whole));
        let plain = plain.is_some_and(|fitted| fitted.misfit <= Self::allowed_misfit(fitted.points));
        // A force that begins slowly misleads either one outward, into the quiet, where nothing leads back.
        let later = if first.begin > arc.begin { Arc { curvature, ..first } } else { arc };
        if self.direction == Direction::Begin
            && !plain
            && let Some(fitted) = ring::find(self, force, later)
        {
            let position = self.inside as f32 + fitted.touch.begin;
            return Instant { position, deviation: fitted.deviation };
        }
        match best {
            Some(fitted) => self.place(force, &fitted.arc, fitted.deviation * libm::sqrtf(fitted.misfit.max(1.0))),
            None => self.place(force, &first, 1.0),
        }
    }

    /// The residual's mean square over the noise's that so many points may reach.
    pub fn allowed_misfit(points: usize) -> f32 {
        1.0 + MISFIT / libm::sqrtf(points as f32)
    }

    /// Variance of the mean of `samples` samples, with what no arc follows, N².
    pub fn variance_of_mean(&self, samples: usize) -> f32 {
        let floor = MODEL_ERROR * self.peak;
        self.noise * self.noise / samples as f32 + floor * floor
    }

    /// The arc fitted to a stretch of `length` samples.
    pub fn arc_over<C: Curve>(&self, force: &Force<'_, C>, start: Arc, length: f32) -> Option<Arc> {
        self.fit(force, start, length).map(|fitted| fitted.arc)
    }

    /// (π/2τ)², τ the time to the peak.
    pub fn prior_curvature(&self) -> f32 {
        let quarter = core::f32::consts::FRAC_PI_2 / self.to_peak.max(2.0);
        quarter * quarter
    }

    /// How far outside the instant can lie on a flank of this slope: there is a last sample that shows no force, and by
    /// then the flank cannot have risen by more than what noise can hide.
    fn earliest<C: Curve>(&self, force: &Force<'_, C>, slope: f32) -> f32 {
        let mut outward = [0.0; PIECE];
        let wanted = PIECE.min(self.reach);
        let count = self.read(force, -(wanted as isize), &mut outward[..wanted]);
        let last_without = outward[..count].iter().rposition(|x| *x <= NO_FORCE * self.noise);
        let reach = -(self.reach as f32);
        match last_without {
            Some(at) if count == wanted && slope > 0.0 => {
                let at = at as f32 - wanted as f32;
                reach.max(at - HIDDEN * self.noise / slope - 0.5)
            }
            _ => reach,
        }
    }

    fn place<C: Curve>(&self, force: &Force<'_, C>, arc: &Arc, deviation: f32) -> Instant {
        let begin = if arc.begin.is_finite() {
            arc.begin.max(self.earliest(force, arc.slope)).min(self.to_peak.max(1.0))
        } else {
            0.0
        };
        let inside = self.inside as f32;
        let position = match self.direction {
            Direction::Begin => inside + begin,
            Direction::End => inside - begin,
        };
        Instant { position, deviation }
    }

    /// A straight line through the beginning of the flank, extended to zero: through as few samples as rise clearly out of the
    /// noise, and through a third of the way to the peak. A flank that rings misleads one or the other, always outward: the
    /// later begin is taken.
    fn first_guess<C: Curve>(&self, force: &Force<'_, C>) -> Option<Arc> {
        let most = ((self.to_peak * 0.3) as usize).clamp(2, PIECE);
        let mut piece = [0.0; PIECE];
        let read = self.read(force, 0, &mut piece[..most]);
        let clear = piece[0] + CLEAR_RISE * self.noise;
        let few = piece[..read].iter().position(|x| *x > clear).map_or(read, |at| (at + 1).max(2).min(read));
        match (self.line(&piece[..few]), self.line(&piece[..read])) {
            (Some(one), Some(other)) => Some(if one.begin > other.begin { one } else { other }),
            (one, other) => one.or(other),
        }
    }

    fn line(&self, samples: &[f32]) -> Option<Arc> {
        if samples.len() < 2 {
            return None;
        }
        let centre = (samples.len() - 1) as f32 / 2.0;
        let mean = samples.iter().sum::<f32>() / samples.len() as f32;
        let (mut rise, mut spread) = (0.0, 0.0);
        for (index, x) in samples.iter().enumerate() {
            let from_centre = index as f32 - centre;
            rise += x * from_centre;
            spread += from_centre * from_centre;
        }
        let slope = rise / spread;
        if slope <= 0.0 || slope.is_nan() {
            return None;
        }
        let begin = (centre - mean / slope).max(-(self.reach as f32)).min(0.5);
        Some(Arc { begin, slope, curvature: 0.0 })
    }

    /// Forces at `inward` samples from [`Self::inside`] on, in reading direction.
    pub fn read<C: Curve>(&self, force: &Force<'_, C>, inward: isize, into: &mut [f32]) -> usize {
        match self.direction {
            Direction::Begin => match self.inside.checked_add_signed(inward) {
                Some(from) => force.read(from, into),
                None => 0,
            },
            Direction::End => match self.inside.checked_add_signed(-inward) {
                Some(from) if from < force.len() => force.read_backward(from, into),
                _ => 0,
            },
        }
    }

    /// Gauss–Newton on a stretch of `length` samples from t₀ on.
    fn fit<C: Curve>(&self, force: &Force<'_, C>, start: Arc, length: f32) -> Option<Fitted> {
        let mut arc = start;
        let mut last = None;
        for step in 0..=STEPS {
            let normal = self.linearise(force, &arc, length)?;
            last = Some(Fitted {
                arc,
                deviation: libm::sqrtf(normal.variance(BEGIN)?) * length,
                misfit: normal.squares / normal.points.max(1) as f32,
                points: normal.points,
            });
            if step == STEPS {
                break;
            }
            let [by_slope, by_curvature, by_begin] = normal.solve()?;
            // Steps are held within what the linearisation can mean.
            let scale = arc.slope.abs() * length;
            arc.slope = (arc.slope + by_slope.max(-scale).min(scale) / length).max(0.1 * start.slope);
            arc.curvature += by_curvature.clamp(-3.0, 3.0) / (length * length);
            let moved = by_begin.clamp(-0.5, 0.5) * length;
            arc.begin = (arc.begin + moved).max(-(self.reach as f32)).min(self.to_peak.max(1.0));
            if moved.abs() < 1e-3 && step > 0 {
                break;
            }
        }
        last
    }

    /// Gathers the normal equations around an arc, in units of the stretch's length and weighted by the noise.
    fn linearise<C: Curve>(&self, force: &Force<'_, C>, arc: &Arc, length: f32) -> Option<Normal<3>> {
        let first = libm::ceilf(arc.begin) as isize;
        let last = libm::floorf(arc.begin + length) as isize;
        let samples = usize::try_from(last - first + 1).ok().filter(|samples| *samples >= 3)?;
        let per_bin = samples.div_ceil(POINTS);
        let variance = self.variance_of_mean(per_bin);
        let curvature = (arc.curvature * length * length).clamp(-4.0, 11.0);
        let prior = self.prior_curvature() * length * length;
        let mut normal = Normal::new();
        normal.expect(CURVATURE, prior - curvature, prior.max(1e-3));
        let amplitude = arc.slope * length;
        let mut piece = [0.0; PIECE];
        let chunk = (PIECE / per_bin).max(1) * per_bin.min(PIECE);
        let mut at = 0;
        while at + per_bin <= samples {
            let wanted = chunk.min((samples - at) / per_bin * per_bin);
            let count = self.read(force, first + at as isize, &mut piece[..wanted]);
            for (bin, values) in piece[..count].chunks_exact(per_bin).enumerate() {
                let centre = (first + (at + bin * per_bin) as isize) as f32 + (per_bin - 1) as f32 / 2.0;
                let x = (centre - arc.begin) / length;
                let mean = values.iter().sum::<f32>() / per_bin as f32;
                let shape = Shape::at(x, curvature);
                let gradient = [shape.value, amplitude * shape.by_curvature, -amplitude * shape.by_x];
                normal.add(gradient, mean - amplitude * shape.value, variance);
            }
            if count < wanted {
                break;
            }
            at += wanted;
        }
        (normal.points >= 3).then_some(normal)
    }
}
