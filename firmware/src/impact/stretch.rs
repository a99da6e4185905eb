//! The samples that a fit looks at, as means of equally many each.

use super::flank::Flank;
use super::force::{Force, PIECE};
use crate::capture::Curve;

/// Most points of a stretch.
pub const MOST_POINTS: usize = 128;
/// Points for each period of the ring; where a long stretch would have too many, they get coarser, down to the fewest.
/// What comes after the last point is then not looked at.
const POINTS_PER_PERIOD: f32 = 16.0;
const FEWEST_PER_PERIOD: f32 = 8.0;
/// How far before the begin a stretch begins, as angle of the ring: the samples there say that there is no force yet.
const LEAD_IN: f32 = 1.0;

/// A stretch: it stays the same while the unknowns move. Positions as [`Flank::read`] counts them.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    from: isize,
    to: isize,
    /// Samples in a point.
    width: usize,
}

impl Stretch {
    /// From a little before `begin` to `length` samples after it, for a ring of so many radians per sample.
    pub fn of(flank: &Flank, begin: f32, pulsation: f32, length: f32) -> Self {
        let before = (LEAD_IN / pulsation).min(begin + flank.reach as f32).max(0.0);
        let period = core::f32::consts::TAU / pulsation;
        let from = libm::ceilf(begin - before) as isize;
        let to = libm::floorf(begin + length) as isize;
        let fine = ((period / POINTS_PER_PERIOD) as usize).clamp(1, PIECE);
        let coarse = ((period / FEWEST_PER_PERIOD) as usize).clamp(1, PIECE);
        let samples = usize::try_from(to - from + 1).unwrap_or(0);
        Self { from, to, width: fine.max(samples.div_ceil(MOST_POINTS).min(coarse)) }
    }

    /// Reads the points once: every step of the fit sees the same ones.
    pub fn points<C: Curve>(&self, flank: &Flank, force: &Force<'_, C>) -> Points {
        let width = self.width;
        let first = self.from as f32 + (width - 1) as f32 / 2.0;
        let variance = flank.variance_of_mean(width);
        let mut points = Points { means: [0.0; MOST_POINTS], count: 0, first, width, variance };
        let chunk = PIECE / width * width;
        let share = 1.0 / width as f32;
        let mut piece = [0.0; PIECE];
        let mut at = self.from;
        while at + width as isize <= self.to + 1 && points.count < MOST_POINTS {
            let wanted = chunk.min((self.to + 1 - at) as usize / width * width);
            let count = flank.read(force, at, &mut piece[..wanted]);
            for (mean, values) in points.means[points.count..].iter_mut().zip(piece[..count].chunks_exact(width)) {
                *mean = values.iter().sum::<f32>() * share;
            }
            points.count = (points.count + count / width).min(MOST_POINTS);
            if count < wanted {
                break;
            }
            at += wanted as isize;
        }
        points
    }
}

/// The means, one after the other.
pub struct Points {
    means: [f32; MOST_POINTS],
    /// How many there are.
    pub count: usize,
    /// Centre of the first one.
    first: f32,
    /// Samples in each, which is also the distance of the next.
    pub width: usize,
    /// Variance of each, N².
    pub variance: f32,
}

impl Points {
    /// Centre and mean of each, samples and N.
    pub fn each(&self) -> impl Iterator<Item = (f32, f32)> {
        let width = self.width as f32;
        let means = self.means[..self.count].iter();
        means.enumerate().map(move |(index, mean)| (self.first + width * index as f32, *mean))
    }

    /// Samples in all of them.
    pub fn samples(&self) -> usize {
        self.count * self.width
    }
}
