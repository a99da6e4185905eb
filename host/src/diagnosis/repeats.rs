//! Where a log repeats a value: what was lost there may have been filled with the last one.
//!
//! A converter's samples of a force that changes are seldom equal, and hardly ever four in a row. Which runs mean something the score
//! says (`screen.rs`); here they are only found, since a gap of some samples lies between the instants that are tried otherwise.

use super::problem::{Prepared, Problem};

/// So many equal values are a run.
const LEAST: usize = 4;
/// The most runs of a recording, the longest ones.
const MOST: usize = 3;

/// A run of equal values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeat {
    /// The instant of the value that is repeated, in the recording's own time, s.
    pub from_s: f64,
    /// How long there is nothing else, s: to the last of them, and half of the way to what follows.
    pub lasts_s: f64,
}

/// The runs of each recording from the contact on, as far as it is compared; the longest first.
#[must_use]
pub fn repeats(problem: &Problem) -> Vec<Vec<Repeat>> {
    problem.recordings.iter().map(of_recording).collect()
}

fn of_recording(recording: &Prepared) -> Vec<Repeat> {
    let (times_s, values) = (&recording.raw.times_s, &recording.raw.values);
    let first = times_s.partition_point(|time_s| *time_s < recording.contact_guess_s);
    let compared_s = recording.times_s.last().copied().unwrap_or(0.0);
    let end = times_s.partition_point(|time_s| *time_s < compared_s).max(first);
    let mut runs: Vec<Repeat> = values[first..end]
        .chunk_by(|a, b| a.to_bits() == b.to_bits())
        .scan(first, |place, run| {
            let begins = *place;
            *place += run.len();
            Some((begins, run.len()))
        })
        .filter(|(_, length)| *length >= LEAST)
        .map(|(begins, length)| {
            let last_s = times_s[begins + length - 1];
            let half_s = times_s.get(begins + length).map_or(0.0, |next_s| 0.5 * (next_s - last_s));
            Repeat { from_s: times_s[begins], lasts_s: last_s + half_s - times_s[begins] }
        })
        .collect();
    runs.sort_by(|a, b| b.lasts_s.total_cmp(&a.lasts_s));
    runs.truncate(MOST);
    runs
}
