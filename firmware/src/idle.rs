//! What the signal is while nothing touches: zero, its drift, mains hum, and the noise that is left.
//!
//! ```text
//! idle(t) = zero + slope·t + Σ aₖ·cos φₖ(t) + bₖ·sin φₖ(t)        50, 100, 150, 60, 120, 180 Hz
//! ```
//!
//! Samples are averaged in groups (0.4 ms) and groups gathered in blocks of 0.1 s. In 0.1 s 50 Hz and 60 Hz and their
//! harmonics make whole periods, so that constant and tones are orthogonal and a sum of products is their
//! least-squares fit. Once a block, zero and tones are corrected from what was left of the signal, and so are the
//! rates at which they move: the drift of the zero and the mains frequency's distance from its nominal value. Both are
//! second-order loops, so neither a linear drift nor a steady frequency error leaves a lag.
//! The gains are those of a growing least-squares line over the blocks seen so far (αₙ = 2(2n−1)/(n(n+1)),
//! βₙ = 6/(n(n+1))) and stay at those of twenty blocks, two seconds.
//!
//! Settled after five blocks, 0.5 s from power-up; after an impact the zero alone is learned anew, for 0.2 s.
//!
//! **Limits.** Once settled, a block moves the zero by at most [`ZERO_RATE_LIMIT`] · 0.1 s and the slope stays within
//! ±[`ZERO_RATE_LIMIT`]. A charge amplifier drifts by 14 mN/s; a cell that is warmed by a hand or a lamp by some tenths of a
//! newton a second for a while. A push that grows faster than twice the limit cannot be tracked away and becomes an onset:
//! that is 0.1 mm/s on the softest spring (10 N/mm), far below any speed that a robot is tested at. Nobody can pull: when a block's mean
//! lies below zero by more than the onset threshold, the zero itself has jumped, and it is learned anew at once.
//!
//! **Rest.** After a blow friction may hold some newtons ([`crate::rest`]). The zero that is tracked then jumps to that rest, and the
//! rest is remembered, so that the true zero is known: forces count from there. What the tracked zero does later is the zero's
//! own drift, except where it moves as no drift does; that takes from the rest, until less than half the threshold is left.
//! So it is while the zero is free to move, for 0.2 s after the blow or after a block's mean that has gone back towards the true
//! zero by more than a quarter of the threshold, and while the zero follows the rest at the limit of its slope.
//!
//! **Spikes.** Every sample is limited to three onset levels before it is averaged (see [`crate::onset`]), so a spike
//! of any height moves a block's mean by some 2 mN.

use core::f32::consts::TAU;

use crate::trigonometry::sin_cos;
use crate::units::Hertz;

pub use self::baseline::{Baseline, BaselineTone};

mod baseline;

/// Fastest zero that is followed once settled, N/s, as slope and again as correction.
pub const ZERO_RATE_LIMIT: f32 = 0.5;
/// Blocks of 0.1 s until everything is settled after power-up.
pub const SETTLE_BLOCKS: u32 = 5;
/// Blocks until the zero is settled again after an impact.
pub const RESETTLE_BLOCKS: u32 = 2;
/// Mains tones that are tracked.
pub const TONES: usize = 6;

/// Groups a second, as near as whole samples allow: 180 Hz has 14 groups in a period.
const GROUP_RATE: f32 = 2_500.0;
/// Length of a block, s.
const BLOCK: f32 = 0.1;
/// Blocks that the loops remember.
const MEMORY_BLOCKS: u32 = 20;
/// Mains never leaves its nominal frequency by more; public grids stay within 0.2 Hz, islands within 1 Hz.
const MAINS_DEVIATION: Hertz = Hertz(1.0);
/// A tone below this many deviations of its own estimate does not move the mains frequency.
const TONE_SIGNIFICANCE: f32 = 6.0;
/// A rest leaves when a block's mean is this share of the threshold nearer to the true zero: 0.45 N at 0.3 N of noise, which
/// no drift does and sixty deviations of such a mean.
const LEAVING: f32 = 0.25;
/// Limit of a sample's distance from the first one seen while nothing is known yet, N: any hum, no spike.
const FIRST_LIMIT: f32 = 50.0;

/// One tone, as an oscillator and its amplitude.
#[derive(Clone, Copy, Debug)]
struct Tone {
    /// cos and sin of the phase at the centre of the present group.
    cosine: f32,
    sine: f32,
    /// Rotation from group to group.
    turn_cosine: f32,
    turn_sine: f32,
    /// Its angle, radians.
    turn: f32,
    /// Amplitudes, N.
    in_phase: f32,
    quadrature: f32,
    /// Products gathered in this block.
    gathered_cosine: f32,
    gathered_sine: f32,
}

impl Tone {
    const STILL: Self = Self {
        cosine: 1.0,
        sine: 0.0,
        turn_cosine: 1.0,
        turn_sine: 0.0,
        turn: 0.0,
        in_phase: 0.0,
        quadrature: 0.0,
        gathered_cosine: 0.0,
        gathered_sine: 0.0,
    };

    fn value(&self) -> f32 {
        self.in_phase * self.cosine + self.quadrature * self.sine
    }

    fn turn(&mut self) {
        let cosine = self.cosine * self.turn_cosine - self.sine * self.turn_sine;
        self.sine = self.sine * self.turn_cosine + self.cosine * self.turn_sine;
        self.cosine = cosine;
    }

    /// Brings the oscillator back to length one; it leaves it by rounding only.
    fn normalise(&mut self) {
        let correction = 1.5 - 0.5 * (self.cosine * self.cosine + self.sine * self.sine);
        self.cosine *= correction;
        self.sine *= correction;
    }
}

/// The part of the tracker that moves with every sample.
#[derive(Clone, Copy, Debug)]
pub struct Gathering {
    prediction: f32,
    step: f32,
    sum: f32,
    squares: f32,
}

impl Gathering {
    /// See [`Idle::remove`].
    #[inline]
    pub fn remove(&mut self, force: f32) -> f32 {
        let rest = force - self.prediction;
        self.prediction += self.step;
        rest
    }

    /// See [`Idle::learn`].
    #[inline]
    pub fn learn(&mut self, rest: f32) {
        self.sum += rest;
        self.squares += rest * rest;
    }
}

/// The tracker.
#[derive(Clone, Debug)]
pub struct Idle {
    group_length: u32,
    groups_per_block: u32,
    /// Nominal angle of 50 and 60 Hz from group to group, and the learned distance from it, radians.
    mains_turn: [f32; 2],
    mains_offset: [f32; 2],
    mains_offset_limit: f32,
    quantisation_variance: f32,

    /// Zero at the centre of the present group, N, and its change from group to group.
    zero: f32,
    slope: f32,
    tones: [Tone; TONES],
    /// How much of the zero is a rest, N: the true zero lies lower by so much.
    rest: f32,
    variance: f32,
    /// Variance of a group's mean; an eighth of the other when the noise is white.
    mean_variance: f32,
    zero_blocks: u32,
    tone_blocks: u32,
    /// Blocks since the last restart of the zero, and how many of them make it settled.
    settle_left: u32,

    /// Prediction for the next sample and its change from sample to sample.
    prediction: f32,
    step: f32,

    in_group: u32,
    in_block: u32,
    group_sum: f32,
    block_sum: f32,
    squares: f32,
    mean_squares: f32,
}

impl Idle {
    /// A tracker that knows nothing; call [`Self::start`] before the first sample.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            group_length: 8,
            groups_per_block: 250,
            mains_turn: [0.0; 2],
            mains_offset: [0.0; 2],
            mains_offset_limit: 0.0,
            quantisation_variance: 0.0,
            zero: 0.0,
            slope: 0.0,
            tones: [Tone::STILL; TONES],
            rest: 0.0,
            variance: 0.0,
            mean_variance: 0.0,
            zero_blocks: 0,
            tone_blocks: 0,
            settle_left: SETTLE_BLOCKS,
            prediction: 0.0,
            step: 0.0,
            in_group: 0,
            in_block: 0,
            group_sum: 0.0,
            block_sum: 0.0,
            squares: 0.0,
            mean_squares: 0.0,
        }
    }

    /// Starts over, with `first` as the first guess of the zero. `quantisation` is the least noise that can be, N rms.
    pub fn start(&mut self, sample_rate: Hertz, quantisation: f32, first: f32) {
        *self = Self::new();
        let rate = sample_rate.0.max(1.0);
        self.group_length = (libm::roundf(rate / GROUP_RATE) as u32).max(1);
        let group_rate = rate / self.group_length as f32;
        self.groups_per_block = (libm::roundf(group_rate * BLOCK) as u32).max(1);
        self.mains_turn = [50.0, 60.0].map(|mains| TAU * mains / group_rate);
        self.mains_offset_limit = TAU * MAINS_DEVIATION.0 / group_rate;
        self.quantisation_variance = quantisation * quantisation;
        self.zero = first;
        self.retune();
        self.predict::<false>();
    }

    /// Samples in a group.
    #[must_use]
    pub const fn group_length(&self) -> u32 {
        self.group_length
    }

    /// Samples in a block of 0.1 s.
    #[must_use]
    pub const fn block_length(&self) -> u32 {
        self.group_length * self.groups_per_block
    }

    /// Whether zero, hum and noise are known well enough to notice an onset: one block has been seen.
    #[must_use]
    pub const fn armed(&self) -> bool {
        self.tone_blocks > 0
    }

    /// Whether they are known well enough to judge by.
    #[must_use]
    pub const fn settled(&self) -> bool {
        self.settle_left == 0
    }

    /// Noise, N rms, never below the quantiser's own.
    #[must_use]
    pub fn noise(&self) -> f32 {
        libm::sqrtf(self.variance.max(self.quantisation_variance))
    }

    /// Noise of the mean of eight samples, N rms: at least that of white noise, more where the noise is slow.
    #[must_use]
    pub fn noise_of_mean(&self) -> f32 {
        let white = self.variance.max(self.quantisation_variance) / crate::onset::WINDOW as f32;
        libm::sqrtf(self.mean_variance.max(white))
    }

    /// The most that a sample may count before a threshold is known, N; no limit of its own afterwards.
    #[inline]
    #[must_use]
    pub fn first_limit_until_armed(&self) -> f32 {
        if self.armed() { f32::INFINITY } else { FIRST_LIMIT }
    }

    /// Removes the predicted idle signal from a sample. Each sample must pass here once, followed by
    /// [`Self::learn`] or [`Self::hold`].
    #[inline]
    pub fn remove(&mut self, force: f32) -> f32 {
        let rest = force - self.prediction;
        self.prediction += self.step;
        rest
    }

    /// Learns from a sample, already limited. True at the end of a block, when zero and noise have moved.
    #[inline]
    pub fn learn(&mut self, rest: f32, threshold: f32) -> bool {
        let mut gathering = self.gathering();
        gathering.learn(rest);
        self.gather(&gathering, 1, threshold)
    }

    /// Samples until the present group ends, at least one.
    #[inline]
    #[must_use]
    pub fn until_group_ends(&self) -> usize {
        self.group_length.saturating_sub(self.in_group).max(1) as usize
    }

    /// What changes from sample to sample within a group.
    #[inline]
    #[must_use]
    pub fn gathering(&self) -> Gathering {
        Gathering { prediction: self.prediction, step: self.step, sum: self.group_sum, squares: self.squares }
    }

    /// Takes back what has gathered over some samples, not beyond the end of the group. True at the end of a block, when zero and
    /// noise have moved.
    pub fn gather(&mut self, gathering: &Gathering, samples: usize, threshold: f32) -> bool {
        self.prediction = gathering.prediction;
        self.group_sum = gathering.sum;
        self.squares = gathering.squares;
        self.in_group += samples as u32;
        self.in_group >= self.group_length && self.end_group(threshold)
    }

    /// Lets time pass without learning: something touches. True at the end of a group.
    #[inline]
    pub fn hold(&mut self) -> bool {
        self.in_group += 1;
        if self.in_group < self.group_length {
            return false;
        }
        self.next_group();
        true
    }

    /// Discards what this block has gathered: an impact opens.
    pub fn freeze(&mut self) {
        self.in_block = 0;
        self.block_sum = 0.0;
        self.squares = 0.0;
        self.mean_squares = 0.0;
        self.group_sum = 0.0;
        for tone in &mut self.tones {
            tone.gathered_cosine = 0.0;
            tone.gathered_sine = 0.0;
        }
    }

    /// The impact is over and the force has gone, a rest with it: the zero is learned anew, the hum goes on.
    pub fn resume(&mut self) {
        self.relearn();
        self.shift(-self.rest);
        self.rest = 0.0;
    }

    /// The impact is over and the force stands still at `level` above the true zero. That is the rest; below `release` it is
    /// the zero. It has been seen for a block's time already, so that what was settled stays so.
    pub fn stand(&mut self, level: f32, release: f32) {
        self.freeze();
        self.zero_blocks = 0;
        self.shift(level - self.rest);
        self.rest = if level.abs() > release { level } else { 0.0 };
    }

    /// A force that stands still at `level` above the true zero is the zero from now on.
    pub fn take_for_zero(&mut self, level: f32) {
        self.jump(level - self.rest);
        self.rest = 0.0;
    }

    /// How much of what is removed is a rest and not zero, N.
    #[inline]
    #[must_use]
    pub const fn rest(&self) -> f32 {
        self.rest
    }

    /// Forgets the zero, because the signal has jumped by so much.
    fn jump(&mut self, by: f32) {
        self.relearn();
        self.shift(by);
        self.slope = 0.0;
    }

    fn shift(&mut self, by: f32) {
        self.zero += by;
        self.prediction += by;
    }

    fn relearn(&mut self) {
        self.freeze();
        self.zero_blocks = 0;
        self.settle_left = self.settle_left.max(RESETTLE_BLOCKS);
    }

    /// `lost` samples never came: time went on without them.
    pub fn skip(&mut self, lost: u64) {
        self.freeze();
        let groups = (lost as f64 + f64::from(self.in_group)) / f64::from(self.group_length);
        self.in_group = 0;
        // A drift is not followed blindly for more than ten seconds.
        self.zero += self.slope * (groups.min(25_000.0) as f32);
        for (index, tone) in self.tones.iter_mut().enumerate() {
            let turn = f64::from(angle(&self.mains_turn, &self.mains_offset, index));
            let turns = turn * groups / core::f64::consts::TAU;
            let phase = (turns - libm::floor(turns)) as f32 * TAU;
            let (sine, cosine) = sin_cos(phase);
            (tone.cosine, tone.sine) =
                (tone.cosine * cosine - tone.sine * sine, tone.sine * cosine + tone.cosine * sine);
        }
        self.predict::<false>();
    }

    /// The idle signal around now, without the rest. `next_index` is the number of the sample that comes next.
    #[must_use]
    pub fn baseline(&self, next_index: u64) -> Baseline {
        let origin = next_index.saturating_sub(u64::from(self.in_group));
        // The oscillators stand at the group's centre, the origin is its first sample.
        let back = -(self.group_length as f32 - 1.0) / 2.0;
        let per_sample = 1.0 / self.group_length as f32;
        let mut tones = [BaselineTone::default(); TONES];
        for (index, (tone, known)) in self.tones.iter().zip(&mut tones).enumerate() {
            let radians_per_sample = angle(&self.mains_turn, &self.mains_offset, index) * per_sample;
            // Phase at the origin: (cosine, sine) turned back; in_phase·cos(φ₀+ωn) + quadrature·sin(φ₀+ωn).
            let (s, c) = sin_cos(radians_per_sample * back);
            let (cosine, sine) = (tone.cosine * c - tone.sine * s, tone.sine * c + tone.cosine * s);
            *known = BaselineTone {
                in_phase: tone.in_phase * cosine + tone.quadrature * sine,
                quadrature: tone.quadrature * cosine - tone.in_phase * sine,
                radians_per_sample,
            };
        }
        let zero = self.zero - self.rest + self.slope * per_sample * back;
        Baseline { origin, zero, slope: self.slope * per_sample, tones }
    }

    fn end_group(&mut self, threshold: f32) -> bool {
        let mean = self.group_sum / self.group_length as f32;
        self.group_sum = 0.0;
        self.block_sum += mean;
        self.mean_squares += mean * mean;
        for tone in &mut self.tones {
            tone.gathered_cosine += mean * tone.cosine;
            tone.gathered_sine += mean * tone.sine;
        }
        self.in_block += 1;
        let block_ends = self.in_block == self.groups_per_block;
        if block_ends {
            self.end_block(threshold);
        }
        self.next_group();
        block_ends
    }

    fn next_group(&mut self) {
        self.in_group = 0;
        self.zero += self.slope;
        self.predict::<true>();
    }

    /// Sets the prediction for the group whose centre the oscillators stand at: value and slope at its centre. With `TURN` they
    /// are first turned by a group.
    fn predict<const TURN: bool>(&mut self) {
        let mut centre = self.zero;
        let mut rise = self.slope;
        for tone in &mut self.tones {
            if TURN {
                tone.turn();
            }
            centre += tone.value();
            rise += (tone.quadrature * tone.cosine - tone.in_phase * tone.sine) * tone.turn;
        }
        self.step = rise / self.group_length as f32;
        self.prediction = centre - self.step * (self.group_length as f32 - 1.0) / 2.0;
    }

    fn end_block(&mut self, threshold: f32) {
        let groups = self.groups_per_block as f32;
        let mean = self.block_sum / groups;
        let mut explained = mean * mean;
        for tone in &mut self.tones {
            tone.gathered_cosine *= 2.0 / groups;
            tone.gathered_sine *= 2.0 / groups;
            explained += 0.5 * (tone.gathered_cosine * tone.gathered_cosine + tone.gathered_sine * tone.gathered_sine);
        }
        self.learn_noise(self.squares / self.block_length() as f32 - explained, self.mean_squares / groups - explained);
        self.learn_tones();
        self.learn_zero(mean, threshold);
        self.settle_left = self.settle_left.saturating_sub(1);
        self.freeze();
    }

    fn learn_noise(&mut self, variance: f32, mean_variance: f32) {
        let gain = 1.0 / (self.tone_blocks + 1).min(MEMORY_BLOCKS) as f32;
        let floor = self.quantisation_variance;
        for (known, seen) in [(&mut self.variance, variance), (&mut self.mean_variance, mean_variance)] {
            // A burst may at most double the noise from block to block.
            let limit = if self.tone_blocks == 0 { f32::INFINITY } else { 4.0 * known.max(floor) };
            *known += gain * (seen.max(0.0).min(limit) - *known);
        }
    }

    fn learn_tones(&mut self) {
        self.tone_blocks = self.tone_blocks.saturating_add(1).min(MEMORY_BLOCKS);
        let (gain, rate_gain) = line_gains(self.tone_blocks);
        let groups = self.groups_per_block as f32;
        // Variance of an amplitude estimated over one block.
        let estimate = 2.0 * self.variance.max(self.quantisation_variance) / self.block_length() as f32;
        let significant = TONE_SIGNIFICANCE * TONE_SIGNIFICANCE * estimate;
        for family in 0..2 {
            let tone = &self.tones[family * 3];
            let power = tone.in_phase * tone.in_phase + tone.quadrature * tone.quadrature;
            if self.tone_blocks > 1 && power > significant {
                let ahead = (tone.gathered_cosine * tone.quadrature - tone.gathered_sine * tone.in_phase) / power;
                let moved = self.mains_offset[family] + rate_gain * ahead.clamp(-0.7, 0.7) / groups;
                self.mains_offset[family] = moved.max(-self.mains_offset_limit).min(self.mains_offset_limit);
            }
        }
        for tone in &mut self.tones {
            tone.in_phase += gain * tone.gathered_cosine;
            tone.quadrature += gain * tone.gathered_sine;
        }
        self.retune();
    }

    fn learn_zero(&mut self, mean: f32, threshold: f32) {
        let groups = self.groups_per_block as f32;
        let free = !self.settled() || self.zero_blocks < RESETTLE_BLOCKS;
        let leaving = self.leaves(mean, threshold);
        if leaving || (!free && mean < -threshold) {
            self.jump(mean);
            if leaving {
                self.rest += mean;
            }
            return;
        }
        self.zero_blocks = self.zero_blocks.saturating_add(1).min(MEMORY_BLOCKS);
        let (gain, rate_gain) = line_gains(self.zero_blocks);
        // What a rest moves by in these first blocks is no drift that would go on.
        let rest_moves = free && self.rest != 0.0;
        let rate_gain = if self.zero_blocks == 1 || rest_moves { 0.0 } else { rate_gain };
        let slope_limit = ZERO_RATE_LIMIT * BLOCK / groups;
        let mut move_by = gain * mean;
        if !free {
            move_by = move_by.clamp(-ZERO_RATE_LIMIT * BLOCK, ZERO_RATE_LIMIT * BLOCK);
        }
        let back = if self.rest > 0.0 { -self.slope } else { self.slope };
        if self.rest != 0.0 && free {
            // The slope is the drift that was known before.
            self.move_rest(move_by, threshold);
        } else if self.rest != 0.0 && back >= slope_limit {
            self.move_rest(self.slope * groups + move_by, threshold);
        }
        self.zero += move_by;
        let slope = self.slope + rate_gain * mean.max(-threshold).min(threshold) / groups;
        self.slope = if free { slope } else { slope.max(-slope_limit).min(slope_limit) };
    }

    /// Whether a block with this mean has gone back from the rest towards the true zero.
    fn leaves(&self, mean: f32, threshold: f32) -> bool {
        let least = LEAVING * threshold;
        self.settled() && ((self.rest > 0.0 && mean < -least) || (self.rest < 0.0 && mean > least))
    }

    /// The zero has moved by so much because the rest has. What is left of it below half the threshold, once the zero stands, is none.
    fn move_rest(&mut self, by: f32, threshold: f32) {
        let moved = self.rest + by;
        let stands = self.zero_blocks >= RESETTLE_BLOCKS && self.settle_left <= 1;
        let none = stands && (moved.abs() <= 0.5 * threshold || (moved > 0.0) != (self.rest > 0.0));
        self.rest = if none { 0.0 } else { moved };
    }

    /// Sets the oscillators' rotations from the mains frequencies.
    fn retune(&mut self) {
        for (index, tone) in self.tones.iter_mut().enumerate() {
            tone.turn = angle(&self.mains_turn, &self.mains_offset, index);
            (tone.turn_sine, tone.turn_cosine) = sin_cos(tone.turn);
            tone.normalise();
        }
    }
}

impl Default for Idle {
    fn default() -> Self {
        Self::new()
    }
}

/// Angle of a tone from group to group: fundamental, second and third harmonic of 50 Hz, then of 60 Hz.
fn angle(turn: &[f32; 2], offset: &[f32; 2], tone: usize) -> f32 {
    (turn[tone / 3] + offset[tone / 3]) * (tone % 3 + 1) as f32
}

/// Gains of position and rate of a least-squares line through `n` points a block apart.
fn line_gains(n: u32) -> (f32, f32) {
    let n = n.max(1) as f32;
    ((2.0 * (2.0 * n - 1.0) / (n * (n + 1.0))).min(1.0), (6.0 / (n * (n + 1.0))).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f32 = 20_000.0;

    /// Runs `seconds` of `signal` through a tracker and returns it with the largest rest of the last second.
    fn tracked(seconds: f32, signal: impl Fn(f64) -> f64) -> (Idle, f32) {
        let mut idle = Idle::new();
        idle.start(Hertz(RATE), 0.02, signal(0.0) as f32);
        let samples = (seconds * RATE) as u64;
        let mut worst = 0.0f32;
        for n in 0..samples {
            let rest = idle.remove(signal(n as f64 / f64::from(RATE)) as f32);
            if n + RATE as u64 > samples {
                worst = worst.max(rest.abs());
            }
            let limit = idle.first_limit_until_armed().min(5.0);
            idle.learn(rest.max(-limit).min(limit), 1.8);
        }
        (idle, worst)
    }

    #[test]
    fn hum_off_its_nominal_frequency_leaves_little() {
        for mains in [49.8f64, 50.0, 50.2, 59.8, 60.2] {
            let turn = core::f64::consts::TAU * mains;
            let (_, worst) = tracked(5.0, |t| {
                0.5 * libm::sin(turn * t + 1.0) + 0.1 * libm::sin(2.0 * turn * t) + 0.1 * libm::cos(3.0 * turn * t)
            });
            assert!(worst < 0.02, "{mains} Hz leaves {worst} N");
        }
    }

    #[test]
    fn a_linear_drift_leaves_no_lag() {
        let (idle, worst) = tracked(10.0, |t| 5.0 + 0.05 * t);
        assert!(worst < 2e-3, "{worst} N");
        assert!(idle.settled() && (idle.baseline(0).slope * RATE - 0.05).abs() < 5e-3);
    }

    /// The baseline that an impact takes along is what the tracker itself would have removed.
    #[test]
    fn the_baseline_extrapolates_hum_and_drift() {
        let turn = core::f64::consts::TAU * 50.1;
        let signal = |t: f64| 2.0 - 0.02 * t + 0.5 * libm::sin(turn * t) + 0.05 * libm::sin(3.0 * turn * t);
        let (idle, _) = tracked(5.0, signal);
        let now = (5.0 * RATE) as u64;
        let baseline = idle.baseline(now);
        for ahead in 0..2000 {
            let index = now + ahead;
            let error =
                f64::from(baseline.at((index - baseline.origin) as f32)) - signal(index as f64 / f64::from(RATE));
            assert!(error.abs() < 0.02, "{ahead} samples ahead: {error} N");
        }
    }

    #[test]
    fn time_goes_on_through_a_loss() {
        let turn = core::f64::consts::TAU * 50.0;
        let signal = |t: f64| 0.5 * libm::sin(turn * t);
        let (mut idle, _) = tracked(3.0, signal);
        let now = (3.0 * RATE) as u64;
        idle.skip(12_345);
        for n in now + 12_345..now + 12_845 {
            let rest = idle.remove(signal(n as f64 / f64::from(RATE)) as f32);
            idle.hold();
            assert!(rest.abs() < 0.02, "{rest} N");
        }
    }

    #[test]
    fn the_noise_is_what_is_left() {
        let mut state = 1u64;
        let mut noise = || {
            // Uniform on ±0.5: root mean square 1/√12.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5
        };
        let noise: std::vec::Vec<f64> = (0..60_000).map(|_| noise()).collect();
        let (idle, _) = tracked(3.0, |t| noise[(t * f64::from(RATE)).round() as usize] + 1.5 * libm::sin(314.16 * t));
        assert!((idle.noise() - 0.288_7).abs() < 0.01, "{} N", idle.noise());
        assert!((idle.noise_of_mean() - 0.102).abs() < 0.01, "{} N", idle.noise_of_mean());
    }
}
