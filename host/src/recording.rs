//! A recording: what one or more channels read over time, as a CSV file that people and spreadsheets can read.
//!
//! ```text
//! # thud recording                    lines that begin with # are comments
//! time_s,force_N,displacement_m       columns are named with their unit, time first
//! -0.1,0.07,0                         time rises strictly; the sampling may be uneven
//! -0.09995,0,0
//! ```
//!
//! [`read`] accepts this and nothing else: a wrong header, a missing unit, a cell that is not a finite number, a time
//! that does not rise are refused with line and column. [`Recording::to_csv`] writes the same format with the shortest
//! digits that read back as the same number, so that writing is lossless and the same bytes every time.

use std::fmt::Write as _;
use std::path::Path;

mod gap;
mod read;
mod unit;

pub use gap::Gap;
pub use read::{parse, read};
pub use unit::unit_of;

/// Name of the column that every recording begins with.
pub const TIME: &str = "time_s";
/// Name of the force channel.
pub const FORCE: &str = "force_N";

/// One channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name with unit, as the header has it: `force_N`.
    pub name: String,
    /// One finite value for each instant.
    pub values: Vec<f64>,
}

/// Channels over time.
///
/// Always at least two instants and one channel; every channel as long as the time; time rising strictly; every
/// number finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    comments: Vec<String>,
    times_s: Vec<f64>,
    channels: Vec<Channel>,
}

/// Why values do not make a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Malformed {
    /// Fewer than two instants.
    #[error("a recording has at least two samples, not {0}")]
    TooShort(usize),
    /// No channel.
    #[error("a recording has at least one channel beside the time")]
    NoChannel,
    /// A channel's name has no unit, or is taken.
    #[error("`{0}` does not name a channel with its unit, once, as `force_N` does")]
    Name(String),
    /// A channel has another length than the time.
    #[error("channel `{name}` has {values} values for {times} instants")]
    Length {
        /// The channel.
        name: String,
        /// Its length.
        values: usize,
        /// Length of the time.
        times: usize,
    },
    /// A number is not finite.
    #[error("`{name}` is not finite at sample {sample}")]
    NotFinite {
        /// The channel or the time.
        name: String,
        /// Index from 0.
        sample: usize,
    },
    /// Time does not rise.
    #[error("time does not rise at sample {0}")]
    NotRising(usize),
}

impl Recording {
    /// A recording from its parts; times in seconds.
    ///
    /// # Errors
    /// The first thing that breaks what a [`Recording`] promises.
    pub fn new(times_s: Vec<f64>, channels: Vec<Channel>) -> Result<Self, Malformed> {
        if times_s.len() < 2 {
            return Err(Malformed::TooShort(times_s.len()));
        }
        if channels.is_empty() {
            return Err(Malformed::NoChannel);
        }
        let finite = |name: &str, values: &[f64]| match values.iter().position(|value| !value.is_finite()) {
            Some(sample) => Err(Malformed::NotFinite { name: name.to_owned(), sample }),
            None => Ok(()),
        };
        finite(TIME, &times_s)?;
        if let Some(index) = times_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(Malformed::NotRising(index + 1));
        }
        for (index, channel) in channels.iter().enumerate() {
            let taken = channel.name == TIME || channels[..index].iter().any(|other| other.name == channel.name);
            let writable = !channel.name.contains([',', '\n', '\r', '"', '#']) && channel.name.trim() == channel.name;
            if taken || !writable || unit_of(&channel.name).is_none() {
                return Err(Malformed::Name(channel.name.clone()));
            }
            if channel.values.len() != times_s.len() {
                return Err(Malformed::Length {
                    name: channel.name.clone(),
                    values: channel.values.len(),
                    times: times_s.len(),
                });
            }
            finite(&channel.name, &channel.values)?;
        }
        Ok(Self { comments: Vec::new(), times_s, channels })
    }

    /// The same with these comments, one for each line; line breaks inside one make several.
    #[must_use]
    pub fn with_comments(mut self, comments: impl IntoIterator<Item = String>) -> Self {
        self.comments = comments
            .into_iter()
            .flat_map(|comment| comment.lines().map(|line| line.trim().to_owned()).collect::<Vec<_>>())
            .collect();
        self
    }

    /// Comment lines without their `#`, wherever they stood.
    #[must_use]
    pub fn comments(&self) -> &[String] {
        &self.comments
    }

    /// Instants, s.
    #[must_use]
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// All channels in the order of the file.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The values of the channel with this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f64]> {
        self.channels.iter().find(|channel| channel.name == name).map(|channel| channel.values.as_slice())
    }

    /// Median time between two samples, s.
    #[must_use]
    pub fn median_interval_s(&self) -> f64 {
        let mut intervals: Vec<f64> = self.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = intervals.len() / 2;
        let (_, median, _) = intervals.select_nth_unstable_by(middle, f64::total_cmp);
        *median
    }

    /// The file's text.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut text = String::with_capacity(self.times_s.len() * 12 * (self.channels.len() + 1));
        for comment in &self.comments {
            text.push_str(if comment.is_empty() { "#" } else { "# " });
            text.push_str(comment);
            text.push('\n');
        }
        text.push_str(TIME);
        for channel in &self.channels {
            text.push(',');
            text.push_str(&channel.name);
        }
        text.push('\n');
        for (index, time) in self.times_s.iter().enumerate() {
            push_number(&mut text, *time);
            for channel in &self.channels {
                text.push(',');
                push_number(&mut text, channel.values[index]);
            }
            text.push('\n');
        }
        text
    }

    /// Writes the file, and the folder it is in if that does not exist.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(path, self.to_csv())
    }
}

/// The shortest digits that read back as the same number; zero has no sign; far magnitudes get an exponent.
fn push_number(text: &mut String, value: f64) {
    let value = if value == 0.0 { 0.0 } else { value };
    let magnitude = value.abs();
    // Writing to a string cannot fail.
    let _ = if value == 0.0 || (1e-9..1e15).contains(&magnitude) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn channel(name: &str, values: &[f64]) -> Channel {
        Channel { name: name.to_owned(), values: values.to_vec() }
    }

    #[test]
    fn a_recording_promises_what_it_says() {
        let force = channel(FORCE, &[0.0, 1.0]);
        let new = |times: &[f64], channels: &[Channel]| Recording::new(times.to_vec(), channels.to_vec());
        assert!(new(&[0.0, 1.0], std::slice::from_ref(&force)).is_ok());
        assert_eq!(new(&[0.0], &[channel(FORCE, &[0.0])]), Err(Malformed::TooShort(1)));
        assert_eq!(new(&[0.0, 1.0], &[]), Err(Malformed::NoChannel));
        assert_eq!(new(&[0.0, 0.0], std::slice::from_ref(&force)), Err(Malformed::NotRising(1)));
        assert_eq!(new(&[0.0, 1.0], &[force.clone(), force.clone()]), Err(Malformed::Name(FORCE.to_owned())));
        assert_eq!(new(&[0.0, 1.0], &[channel("force", &[0.0, 1.0])]), Err(Malformed::Name("force".to_owned())));
        assert_eq!(new(&[0.0, f64::NAN], &[force]), Err(Malformed::NotFinite { name: TIME.to_owned(), sample: 1 }));
    }

    #[test]
    fn the_median_interval_is_not_moved_by_a_gap() {
        let times: Vec<f64> =
            (0..10).map(|index| f64::from(index) * 0.5 + if index > 6 { 100.0 } else { 0.0 }).collect();
        let values = vec![0.0; 10];
        let recording = Recording::new(times, vec![channel(FORCE, &values)]).unwrap();
        assert_eq!(recording.median_interval_s(), 0.5);
    }

    proptest! {
        /// Whatever can be a recording is written and read back as the same one, to the last bit.
        #[test]
        fn writing_loses_nothing(
            steps in prop::collection::vec(1e-7..1e3f64, 2..40),
            start in -1e3..1e3f64,
            seed in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL, 40),
            comments in prop::collection::vec("[ -~]{0,20}", 0..3),
        ) {
            let mut time = start;
            let times: Vec<f64> = steps.iter().map(|step| { time += step; time }).collect();
            let values: Vec<f64> = seed[..times.len()].iter().map(|value| value + 0.0).collect();
            let recording = Recording::new(times, vec![channel(FORCE, &values), channel("displacement_m", &values)])
                .unwrap()
                .with_comments(comments.iter().map(|comment| comment.trim_start_matches(['#', ' ']).to_owned()));
            let text = recording.to_csv();
            let again = parse("written.csv", text.as_bytes()).unwrap();
            prop_assert_eq!(again.to_csv(), text);
            prop_assert_eq!(again.times_s(), recording.times_s());
            prop_assert_eq!(again.channels(), recording.channels());
        }
    }
}
