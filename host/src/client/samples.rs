//! A sensor's stream of samples, put together from its frames: which value is which, and what is missing.

use serde::Serialize;
use thud_firmware::stream::{Force, Samples, VALUES};

/// What came of a stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Streamed {
    /// Values that came.
    pub values: u64,
    /// Values between them that did not.
    pub lost: u64,
    /// Values beyond the range of their field.
    pub out_of_range: u64,
    /// The highest force, of those within the range.
    #[serde(rename = "highest_N")]
    pub highest_n: Option<f32>,
}

/// The stream of one sensor.
#[derive(Clone, Debug, Default)]
pub struct SampleStream {
    streamed: Streamed,
    /// Number of the value that must come next, over its wraps; `None` before the first.
    next: Option<u64>,
}

impl SampleStream {
    /// Takes a frame; the number of its first value, counted on over the wraps of its 16 bits. A gap of more than 65 535 values
    /// (3.3 s without decimation) is counted without its whole wraps: frames do not tell more.
    pub fn push(&mut self, samples: &Samples) -> u64 {
        let next = self.next.unwrap_or_else(|| samples.number.into());
        let skipped = samples.number.wrapping_sub(next as u16);
        let first = next + u64::from(skipped);
        self.next = Some(first + VALUES as u64);
        self.streamed.lost += u64::from(skipped);
        self.streamed.values += VALUES as u64;
        for force in samples.forces {
            match force {
                Force::Is(force) => {
                    let highest = self.streamed.highest_n.get_or_insert(force.0);
                    *highest = highest.max(force.0);
                }
                Force::Above | Force::Below => self.streamed.out_of_range += 1,
            }
        }
        first
    }

    /// What came so far.
    #[must_use]
    pub fn streamed(&self) -> Streamed {
        self.streamed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(number: u16, force: f32) -> Samples {
        Samples::decode(&Samples::encode(number, &[force, 0.0, -1.0])).unwrap()
    }

    #[test]
    fn a_gap_is_counted_and_numbers_go_on_over_their_wrap() {
        let mut stream = SampleStream::default();
        assert_eq!(stream.push(&samples(65_530, 1.0)), 65_530);
        assert_eq!(stream.push(&samples(65_533, 7.5)), 65_533);
        assert_eq!(stream.push(&samples(3, 1e9)), 65_539);
        let streamed = stream.streamed();
        assert_eq!((streamed.values, streamed.lost, streamed.out_of_range), (9, 3, 1));
        assert_eq!(streamed.highest_n, Some(7.5));
    }
}
