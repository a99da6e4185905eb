//! Independent watchdog, RM0440 chapter 42: its own oscillator, and once started nothing but a reset stops it.

use crate::moment::{Picoseconds, period};

/// LSI, DS12288: 32 kHz typically, 31.04 to 32.96 over temperature.
const LSI_HZ: u64 = 32_000;

/// The watchdog.
#[derive(Clone, Debug)]
pub struct Watchdog {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    /// When the counter was last reloaded; `None`: never started.
    reloaded: Option<Picoseconds>,
    feeds: u64,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self { prescaler: 0, reload: 0xFFF, unlocked: false, reloaded: None, feeds: 0 }
    }
}

impl Watchdog {
    /// How long it waits.
    #[must_use]
    pub fn patience(&self) -> Picoseconds {
        period(LSI_HZ) * (4 << self.prescaler.min(6)) * u64::from(self.reload + 1)
    }

    /// When it bites.
    #[must_use]
    pub fn bites_at(&self) -> Option<Picoseconds> {
        self.reloaded.map(|reloaded| reloaded + self.patience())
    }

    /// How often it was fed since the reset.
    #[must_use]
    pub fn feeds(&self) -> u64 {
        self.feeds
    }

    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x00 | 0x0C => Some(0),
            0x04 => Some(self.prescaler),
            0x08 => Some(self.reload),
            _ => None,
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, now: Picoseconds) -> Result<(), String> {
        match (offset, value & 0xFFFF) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, 0xAAAA) => {
                self.unlocked = false;
                if self.reloaded.is_some() {
                    self.reloaded = Some(now);
                }
                self.feeds += 1;
            }
            (0x00, 0xCCCC) => {
                self.unlocked = false;
                self.reloaded = Some(now);
            }
            (0x00, _) => self.unlocked = false,
            (0x04 | 0x08, _) if !self.unlocked => {
                return Err("a setting of the watchdog is written without its key".into());
            }
            (0x04, value) => self.prescaler = value & 7,
            (0x08, value) => self.reload = value & 0xFFF,
            _ => return Err(format!("IWDG has no register at offset 0x{offset:X}")),
        }
        Ok(())
    }
}
