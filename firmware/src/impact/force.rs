//! The captured counts as force: calibrated, with zero, drift and hum removed, read in pieces.

use core::cell::Cell;

use crate::board::AdcCode;
use crate::calibration::Calibration;
use crate::capture::Curve;
use crate::detector::ImpactContext;
use crate::idle::{Baseline, TONES};
use crate::trigonometry::sin_cos;

/// Samples that are held at once.
pub const PIECE: usize = 128;

/// Hum is computed at every so many samples and drawn straight in between: 180 Hz is off by (ωh)²/8 = 0.03 % of its
/// amplitude at 20 kS/s.
const STRIDE: usize = 8;

/// The force of an impact. Positions are samples from the curve's first one.
pub struct Force<'a, C> {
    curve: &'a C,
    calibration: Calibration,
    baseline: &'a Baseline,
    /// What the force is counted from, above the true zero, N.
    base: f32,
    /// Samples from the baseline's origin to the curve's first sample.
    shift: f32,
    /// Cosine and sine of each tone's turn over a stride.
    turns: [(f32, f32); TONES],
    len: usize,
    /// What the search for moving pieces has spent on all contacts of the impact, see [`super::ring`].
    pub work: &'a Cell<usize>,
}

impl<'a, C: Curve> Force<'a, C> {
    /// The force in a curve; `work` is zero.
    pub fn new(curve: &'a C, context: &'a ImpactContext, work: &'a Cell<usize>) -> Self {
        let shift = curve.first_index().wrapping_sub(context.baseline.origin) as i64 as f32;
        let wanted = context.end.saturating_sub(curve.first_index());
        Self {
            curve,
            calibration: Calibration::new(&context.configuration.configuration.chain),
            baseline: &context.baseline,
            base: 0.0,
            shift,
            turns: context.baseline.tones.map(|tone| {
                let stride = tone.radians_per_sample * STRIDE as f32;
                let (sine, cosine) = sin_cos(stride);
                (cosine, sine)
            }),
            len: curve.len().min(usize::try_from(wanted).unwrap_or(usize::MAX)),
            work,
        }
    }

    /// The force in a curve of the default chain, with this taken off.
    #[cfg(test)]
    pub fn bare(curve: &'a C, baseline: &'a Baseline) -> Self {
        let calibration = Calibration::new(&crate::configuration::Configuration::DEFAULT.chain);
        let work = std::boxed::Box::leak(std::boxed::Box::new(Cell::new(0)));
        let turns = [(1.0, 0.0); TONES];
        Self { curve, calibration, baseline, shift: 0.0, base: 0.0, turns, len: curve.len(), work }
    }

    /// The same force, counted from a rest, N.
    pub fn above(&self, base: f32) -> Self {
        Self { base, ..*self }
    }

    /// Sample number, since power-up, of position 0.
    pub fn first_index(&self) -> u64 {
        self.curve.first_index()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Reads the forces from position `from` on, N; returns how many. Not more than [`PIECE`].
    pub fn read(&self, from: usize, into: &mut [f32]) -> usize {
        let mut codes: [AdcCode; PIECE] = [0; PIECE];
        let wanted = into.len().min(PIECE).min(self.len.saturating_sub(from));
        let count = self.curve.read(from, &mut codes[..wanted]).min(wanted);
        let into = &mut into[..count];
        let n = self.shift + from as f32;
        let zero = self.baseline.zero + self.base;
        for (index, (force, code)) in into.iter_mut().zip(&codes).enumerate() {
            *force = self.calibration.force(*code) - (zero + self.baseline.slope * (n + index as f32));
        }
        for tone in 0..TONES {
            self.remove_tone(tone, n, into);
        }
        count
    }

    /// Reads forces backward: the first is at position `from`, the next one sample earlier.
    pub fn read_backward(&self, from: usize, into: &mut [f32]) -> usize {
        let count = into.len().min(PIECE).min(from + 1);
        let into = &mut into[..count];
        let count = self.read(from + 1 - count, into);
        if count == into.len() {
            into.reverse();
            count
        } else {
            0
        }
    }

    /// Calls `take(position, force)` for every sample in `from..to`; stops where the curve does.
    pub fn for_each(&self, from: usize, to: usize, mut take: impl FnMut(usize, f32)) {
        let mut piece = [0.0; PIECE];
        let mut at = from;
        while at < to {
            let wanted = PIECE.min(to - at);
            let count = self.read(at, &mut piece[..wanted]);
            if count == 0 {
                return;
            }
            for (index, force) in piece[..count].iter().enumerate() {
                take(at + index, *force);
            }
            at += count;
        }
    }

    fn remove_tone(&self, tone: usize, n: f32, forces: &mut [f32]) {
        let (turn_cosine, turn_sine) = self.turns[tone];
        let tone = &self.baseline.tones[tone];
        if tone.in_phase == 0.0 && tone.quadrature == 0.0 {
            return;
        }
        let phase = tone.radians_per_sample * n;
        let (mut sine, mut cosine) = sin_cos(phase);
        let mut value = tone.in_phase * cosine + tone.quadrature * sine;
        for run in forces.chunks_mut(STRIDE) {
            (cosine, sine) = (cosine * turn_cosine - sine * turn_sine, sine * turn_cosine + cosine * turn_sine);
            let next = tone.in_phase * cosine + tone.quadrature * sine;
            let step = (next - value) / STRIDE as f32;
            for (index, force) in run.iter_mut().enumerate() {
                *force -= value + step * index as f32;
            }
            value = next;
        }
    }
}
