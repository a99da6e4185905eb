//! The stream of force samples on the bus: switched on by an object, and the first to give way.
//!
//! ```text
//! byte   0        1        2        3        4        5        6        7
//!        number of the     force 0.1 N       force 0.1 N       force 0.1 N
//!        first value       (means of `decimation` samples each)
//! ```
//!
//! Little-endian. Values are numbered: value n is the mean of the samples n·decimation to (n + 1)·decimation − 1 since power-up,
//! and frames carry the low 16 bits of their first value's number, which grows by three from frame to frame; any other
//! step is a loss. A force beyond ±3276.6 N is sent as 32767 or −32768, which no other force is.
//!
//! At 20 kS/s without decimation that is 6 667 frames, about 0.8 Mbit, a second. Alarm, faults and events have lower
//! identifiers and go first; a frame that would wait behind more than [`WAITING`] others of its kind, or take an event's
//! room in the outbox, is dropped and counted (0x2400:13).

use crate::board::AdcCode;
use crate::units::Newton;

/// Values in a frame.
pub const VALUES: usize = 3;
/// Default COB-ID without the node id: after events, before SDO. It is that of RPDO 4, which this device does not have.
pub const STREAM_BASE: u16 = 0x500;
/// Frames of the stream that may wait in the outbox.
pub const WAITING: usize = 3;
/// Most samples in a value.
pub const MOST: u16 = 10_000;

/// Steps in a newton.
const PER_NEWTON: f32 = 10.0;

/// A force as the stream carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Force {
    /// Within the range of the field.
    Is(Newton),
    /// More than 3276.6 N, or not a number, which only a fault can make.
    Above,
    /// Less than −3276.7 N.
    Below,
}

impl Force {
    fn encode(force: f32) -> i16 {
        let steps = libm::roundf(force * PER_NEWTON);
        if steps.is_nan() { i16::MAX } else { steps as i16 }
    }

    fn decode(steps: i16) -> Self {
        match steps {
            i16::MAX => Self::Above,
            i16::MIN => Self::Below,
            steps => Self::Is(Newton(f32::from(steps) / PER_NEWTON)),
        }
    }
}

/// A frame of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples {
    /// Low 16 bits of the first value's number.
    pub number: u16,
    /// The forces.
    pub forces: [Force; VALUES],
}

impl Samples {
    /// Bytes of a frame.
    #[must_use]
    pub fn encode(number: u16, forces: &[f32; VALUES]) -> [u8; 8] {
        let mut data = [0; 8];
        data[..2].copy_from_slice(&number.to_le_bytes());
        for (field, force) in data[2..].chunks_exact_mut(2).zip(forces) {
            field.copy_from_slice(&Force::encode(*force).to_le_bytes());
        }
        data
    }

    /// Reads a frame; `None` when it does not have eight bytes.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let [a, b, c, d, e, f, g, h] = *bytes else { return None };
        let force = |low, high| Force::decode(i16::from_le_bytes([low, high]));
        Some(Self { number: u16::from_le_bytes([a, b]), forces: [force(c, d), force(e, f), force(g, h)] })
    }
}

/// How codes become newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Code at no force.
    pub zero: f32,
    /// Newtons in a code.
    pub newton_per_code: f32,
}

/// Samples into frames.
#[derive(Clone, Debug)]
pub struct Stream {
    decimation: u16,
    sum: f32,
    summed: u16,
    forces: [f32; VALUES],
    filled: usize,
    /// Number of the value that is being summed.
    number: u64,
    /// Sample that must come next; another one is a gap.
    next_index: u64,
    /// The rest of a value after a gap, or of the one that was running when the stream was switched on.
    skip: u16,
}

impl Stream {
    /// Switched off.
    #[must_use]
    pub const fn new() -> Self {
        Self { decimation: 0, sum: 0.0, summed: 0, forces: [0.0; VALUES], filled: 0, number: 0, next_index: 0, skip: 0 }
    }

    fn begin(&mut self, decimation: u16, first_index: u64) {
        let samples = u64::from(decimation);
        self.decimation = decimation;
        self.number = first_index.div_ceil(samples);
        self.skip = (self.number * samples - first_index) as u16;
        (self.sum, self.summed, self.filled) = (0.0, 0, 0);
        self.next_index = first_index;
    }

    /// Takes a block; gives each frame that it completes to `send`. `decimation` 0 is off.
    pub fn push(
        &mut self,
        codes: &[AdcCode],
        first_index: u64,
        decimation: u16,
        scale: Scale,
        mut send: impl FnMut([u8; 8]),
    ) {
        if decimation == 0 {
            self.decimation = 0;
            return;
        }
        if decimation != self.decimation || first_index != self.next_index {
            self.begin(decimation, first_index);
        }
        self.next_index += codes.len() as u64;
        for code in codes {
            if self.skip > 0 {
                self.skip -= 1;
                continue;
            }
            self.sum += f32::from(*code) - scale.zero;
            self.summed += 1;
            if self.summed < decimation {
                continue;
            }
            self.forces[self.filled] = self.sum / f32::from(decimation) * scale.newton_per_code;
            self.filled += 1;
            self.number += 1;
            (self.sum, self.summed) = (0.0, 0);
            if self.filled == VALUES {
                self.filled = 0;
                send(Samples::encode((self.number - VALUES as u64) as u16, &self.forces));
            }
        }
    }
}

impl Default for Stream {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    const SCALE: Scale = Scale { zero: 1000.0, newton_per_code: 0.1 };

    fn streamed(blocks: &[(u64, Vec<AdcCode>)], decimation: u16) -> Vec<Samples> {
        let mut stream = Stream::new();
        let mut frames = Vec::new();
        for (first, codes) in blocks {
            stream.push(codes, *first, decimation, SCALE, |data| frames.extend(Samples::decode(&data)));
        }
        frames
    }

    fn blocks(range: core::ops::Range<u64>) -> Vec<(u64, Vec<AdcCode>)> {
        range.step_by(8).map(|first| (first, (first..first + 8).map(|at| 1000 + at as u16).collect())).collect()
    }

    #[test]
    fn every_sample_comes_once_and_in_order() {
        let frames = streamed(&blocks(0..72), 1);
        assert_eq!(frames.len(), 24);
        for (frame, number) in frames.iter().zip((0..).step_by(VALUES)) {
            assert_eq!(frame.number, number);
            for (force, at) in frame.forces.iter().zip(number..) {
                assert_eq!(*force, Force::Is(Newton(f32::from(at) / 10.0)));
            }
        }
    }

    #[test]
    fn values_are_means_of_whole_groups_wherever_it_begins_and_after_a_gap() {
        let mut parts = blocks(8..48);
        parts.extend(blocks(104..160));
        let frames = streamed(&parts, 5);
        // Of samples 8 to 47 the values 2 to 8, of 104 to 159 the values 21 to 31; three a frame, what does not fill one is dropped.
        let numbers: Vec<u16> = frames.iter().map(|frame| frame.number).collect();
        assert_eq!(numbers, [2, 5, 21, 24, 27]);
        assert_eq!(frames[0].forces[0], Force::Is(Newton(1.2)), "mean of the samples 10 to 14, 0.1 N each");
        assert_eq!(frames[2].forces[0], Force::Is(Newton(10.7)), "105 to 109");
    }

    #[test]
    fn what_is_out_of_range_says_so() {
        let data = Samples::encode(0, &[4000.0, -4000.0, f32::NAN]);
        assert_eq!(Samples::decode(&data).unwrap().forces, [Force::Above, Force::Below, Force::Above]);
        assert_eq!(Samples::decode(&data[..7]), None);
    }

    proptest! {
        #[test]
        fn a_force_comes_back_within_half_a_step(forces in prop::array::uniform3(-3500.0f32..3500.0), number in any::<u16>()) {
            let samples = Samples::decode(&Samples::encode(number, &forces)).unwrap();
            prop_assert_eq!(samples.number, number);
            for (sent, got) in forces.into_iter().zip(samples.forces) {
                match got {
                    Force::Is(got) => prop_assert!((got.0 - sent).abs() <= 0.0501, "{sent} became {}", got.0),
                    Force::Above => prop_assert!(sent > 3276.6),
                    Force::Below => prop_assert!(sent < -3276.7),
                }
            }
        }
    }
}
