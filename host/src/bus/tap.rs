//! A bus with a log beside it: every frame that comes or goes is written down, in candump's format.

use std::io::Write;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use thud_firmware::board::Frame;

use super::{Bus, BusError, Counters, Stamped, candump};

/// A bus that is logged. A log that cannot be written any more is a failure of the bus, so that no frame is missing from
/// it in silence.
pub struct Tap {
    bus: Box<dyn Bus>,
    log: Box<dyn Write>,
    interface: String,
    /// Time of day when the bus's clock was 0.
    epoch: Duration,
    line: Vec<u8>,
}

impl Tap {
    /// Writes what is on `bus` to `log`, as heard on an interface of this name.
    #[must_use]
    pub fn new(bus: Box<dyn Bus>, log: Box<dyn Write>, interface: &str) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let epoch = now.saturating_sub(bus.now());
        Self { bus, log, interface: interface.to_owned(), epoch, line: Vec::new() }
    }

    fn write(&mut self, frame: &Frame, at: Duration, sent: bool) -> Result<(), BusError> {
        self.line.clear();
        candump::write(&mut self.line, self.epoch + at, &self.interface, frame, sent);
        self.log.write_all(&self.line).map_err(|source| self.unwritable(source))
    }

    fn unwritable(&self, source: std::io::Error) -> BusError {
        BusError::Receive { bus: format!("{}, because its log cannot be written", self.bus.describe()), source }
    }
}

impl Bus for Tap {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)?;
        self.write(frame, self.bus.now(), true)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let received = self.bus.receive(timeout)?;
        match &received {
            Some(stamped) => self.write(&stamped.frame, stamped.at, false)?,
            // A quiet moment: what was written reaches the file, so that a reader sees it.
            None => self.log.flush().map_err(|source| self.unwritable(source))?,
        }
        Ok(received)
    }

    fn now(&self) -> Duration {
        self.bus.now()
    }

    fn describe(&self) -> String {
        self.bus.describe()
    }

    fn counters(&self) -> Counters {
        self.bus.counters()
    }

    fn ended(&self) -> bool {
        self.bus.ended()
    }

    fn is_playback(&self) -> bool {
        self.bus.is_playback()
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        // Too late to tell anybody; `receive` flushes at every quiet moment.
        let _ = self.log.flush();
    }
}
