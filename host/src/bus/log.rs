//! A candump log as a bus: what was on it comes again, at its own times.
//!
//! The bus's clock is the log's: whoever waits on it waits no longer than reading takes, unless a pace is asked for. Nobody
//! is there who could answer, so nothing can be sent.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use thud_firmware::board::Frame;

use super::candump::{self, Entry, Malformed};
use super::{Bus, BusError, Counters, Heard, Stamped};

/// Bytes read at once.
const BUFFER: usize = 1 << 20;

/// Lines of a log, one after the other; a damaged one is named and skipped.
pub struct Lines<R> {
    from: R,
    line: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    /// From its beginning.
    pub fn new(from: R) -> Self {
        Self { from, line: Vec::with_capacity(candump::LONGEST), number: 0 }
    }

    /// Number of the last line read, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line that is not empty; `None` at the end. A line that goes on and on is skipped without being kept.
    ///
    /// # Errors
    /// The file's.
    pub fn read(&mut self) -> io::Result<Option<Result<Entry<'_>, Malformed>>> {
        loop {
            self.line.clear();
            let most = candump::LONGEST as u64 + 2;
            if (&mut self.from).take(most).read_until(b'\n', &mut self.line)? == 0 {
                return Ok(None);
            }
            self.number += 1;
            if self.line.last() != Some(&b'\n') && self.line.len() as u64 == most {
                self.skip_line()?;
                return Ok(Some(Err(Malformed::TooLong)));
            }
            if !self.line.trim_ascii().is_empty() {
                break;
            }
        }
        Ok(Some(candump::read(self.line.trim_ascii_end())))
    }

    fn skip_line(&mut self) -> io::Result<()> {
        loop {
            let some = self.from.fill_buf()?;
            if some.is_empty() {
                return Ok(());
            }
            let end = some.iter().position(|byte| *byte == b'\n');
            let used = end.map_or(some.len(), |end| end + 1);
            self.from.consume(used);
            if end.is_some() {
                return Ok(());
            }
        }
    }
}

/// A log that is played back.
pub struct LogBus {
    lines: Lines<BufReader<File>>,
    path: PathBuf,
    /// The first line's time, which is the bus's zero.
    begin: Option<Duration>,
    now: Duration,
    /// Read, and not yet due.
    next: Option<Stamped>,
    ended: bool,
    counters: Counters,
    /// The log's seconds in a second of this computer, and when it was opened; `None` as fast as it can be read.
    pace: Option<(f64, Instant)>,
}

impl LogBus {
    /// Opens a log; `pace` 1 plays it in its own time, 2 twice as fast, `None` as fast as it can be read.
    ///
    /// # Errors
    /// [`BusError::Open`].
    pub fn open(path: &Path, pace: Option<f64>) -> Result<Self, BusError> {
        let file = File::open(path).map_err(|source| BusError::Open {
            bus: describe(path),
            step: "opening the file",
            source,
            help: Some(
                "a candump log is wanted, as `candump -l`, python-can or `thud log --out FILE` write it".to_owned(),
            ),
        })?;
        Ok(Self {
            lines: Lines::new(BufReader::with_capacity(BUFFER, file)),
            path: path.to_owned(),
            begin: None,
            now: Duration::ZERO,
            next: None,
            ended: false,
            counters: Counters::default(),
            pace: pace.map(|pace| (pace, Instant::now())),
        })
    }

    /// The next frame of the log, whenever it is due.
    fn read(&mut self) -> Result<Option<Stamped>, BusError> {
        loop {
            let entry = match self.lines.read() {
                Ok(Some(Ok(entry))) => entry,
                Ok(Some(Err(malformed))) => {
                    self.counters.malformed += 1;
                    self.counters.last_malformed = Some(format!("line {}: {malformed}", self.lines.number()));
                    continue;
                }
                Ok(None) => return Ok(None),
                Err(source) => return Err(BusError::Receive { bus: describe(&self.path), source }),
            };
            let begin = *self.begin.get_or_insert(entry.at);
            match entry.heard {
                // A clock that was set back does not turn the time round.
                Heard::Frame(frame) => {
                    return Ok(Some(Stamped { frame, at: entry.at.saturating_sub(begin).max(self.now) }));
                }
                Heard::Foreign(_) => self.counters.foreign += 1,
            }
        }
    }

    /// Lets this computer's time catch up with the log's.
    fn keep_pace(&self, until: Duration) {
        if let Some((pace, opened)) = self.pace {
            let due = opened + Duration::try_from_secs_f64(until.as_secs_f64() / pace).unwrap_or(Duration::ZERO);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    }
}

impl Bus for LogBus {
    fn send(&mut self, _: &Frame) -> Result<(), BusError> {
        Err(BusError::Send {
            bus: self.describe(),
            source: io::Error::new(io::ErrorKind::Unsupported, "a log only plays back, nobody is there to hear"),
            help: Some("`thud monitor` follows a log; everything else needs a bus with a sensor on it".to_owned()),
        })
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let deadline = self.now + timeout;
        let next = match self.next.take() {
            Some(next) => Some(next),
            None => self.read()?,
        };
        match next {
            Some(next) if next.at <= deadline => {
                self.keep_pace(next.at);
                self.now = next.at;
                self.counters.received += 1;
                Ok(Some(next))
            }
            other => {
                self.ended = other.is_none();
                self.next = other;
                self.keep_pace(deadline);
                self.now = deadline;
                Ok(None)
            }
        }
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn describe(&self) -> String {
        describe(&self.path)
    }

    fn counters(&self) -> Counters {
        self.counters.clone()
    }

    fn ended(&self) -> bool {
        self.ended
    }

    fn is_playback(&self) -> bool {
        true
    }
}

fn describe(path: &Path) -> String {
    format!("log {}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(text: &[u8]) -> (LogBus, tempfile::TempPath) {
        let path = tempfile::NamedTempFile::new().unwrap().into_temp_path();
        std::fs::write(&path, text).unwrap();
        (LogBus::open(&path, None).unwrap(), path)
    }

    #[test]
    fn frames_come_when_they_are_due_by_the_logs_clock() {
        let (mut bus, _file) = log(b"(100.0) can0 001#\n\n(100.5) can0 002#01\r\n(99.0) can0 003#\n");
        let second = Duration::from_secs(1);
        assert_eq!(bus.receive(second).unwrap().unwrap().at, Duration::ZERO);
        assert_eq!(bus.receive(Duration::from_millis(300)).unwrap(), None, "not due yet");
        assert_eq!(bus.now(), Duration::from_millis(300));
        let next = bus.receive(second).unwrap().unwrap();
        assert_eq!((next.frame.id, next.at), (2, Duration::from_millis(500)));
        let back = bus.receive(second).unwrap().unwrap();
        assert_eq!((back.frame.id, back.at), (3, Duration::from_millis(500)), "time does not run backwards");
        assert!(!bus.ended());
        assert_eq!(bus.receive(second).unwrap(), None);
        assert!(bus.ended());
        assert!(bus.send(&Frame::new(1, &[]).unwrap()).is_err());
    }

    #[test]
    fn damaged_lines_are_counted_with_their_number_and_the_next_is_read() {
        let mut text = b"(1.0) can0 001#\nrubbish\n(1.0) can0 1A0#R\n".to_vec();
        text.extend(std::iter::repeat_n(b'x', 3_000_000));
        text.extend_from_slice(b"\n(1.0) can0 002#");
        let (mut bus, _file) = log(&text);
        let ids: Vec<u16> =
            std::iter::from_fn(|| bus.receive(Duration::from_secs(1)).unwrap().map(|stamped| stamped.frame.id))
                .collect();
        assert_eq!(ids, [1, 2]);
        let counters = bus.counters();
        assert_eq!((counters.malformed, counters.foreign), (2, 1));
        assert_eq!(counters.last_malformed.unwrap(), "line 4: more than 256 bytes");
    }
}
