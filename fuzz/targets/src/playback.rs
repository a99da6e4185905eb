//! A bus that plays given bytes as frames, in virtual time.

use std::time::Duration;

use thud::bus::{Bus, BusError, Counters, Stamped};
use thud_firmware::board::Frame;

/// Bytes of a frame: two of identifier, one of length, one of pause, eight of data.
const STEP: usize = 12;

/// Frames out of bytes.
pub struct Playback {
    data: Vec<u8>,
    at: usize,
    now: Duration,
    /// Nobody can be asked; otherwise every request is answered with the next frame, as node 1's.
    listens: bool,
    asked: bool,
}

impl Playback {
    pub fn new(data: &[u8], listens: bool) -> Self {
        Self { data: data.to_vec(), at: 0, now: Duration::ZERO, listens, asked: false }
    }
}

impl Bus for Playback {
    fn send(&mut self, _: &Frame) -> Result<(), BusError> {
        self.asked = true;
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Stamped>, BusError> {
        let step = self.data.get(self.at..self.at + STEP);
        let (Some(&[low, high, length, pause, ref data @ ..]), true) = (step, self.listens || self.asked) else {
            self.now += timeout.max(Duration::from_micros(1));
            return Ok(None);
        };
        self.at += STEP;
        let due = Duration::from_millis(u64::from(pause));
        let foreign = u16::from_le_bytes([low, high]) & 0x7FF;
        let id = if self.listens || high & 0x80 != 0 { foreign } else { 0x581 };
        if due > timeout && pause > 200 {
            self.now += timeout;
            return Ok(None);
        }
        self.now += due.min(timeout);
        let length = if self.listens { usize::from(length % 9) } else { 8 };
        Ok(Frame::new(id, &data[..length]).map(|frame| Stamped { frame, at: self.now }))
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn describe(&self) -> String {
        "given bytes".to_owned()
    }

    fn counters(&self) -> Counters {
        Counters::default()
    }

    fn ended(&self) -> bool {
        self.at + STEP > self.data.len()
    }

    fn is_playback(&self) -> bool {
        self.listens
    }
}
