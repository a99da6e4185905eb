//! Timers as far as the firmware uses them: counting up, update, compare, trigger output. RM0440 chapters 30 and 32.
//!
//! ```text
//! timer clock ─ ÷ (PSC + 1) ─▶ CNT: 0 … ARR, 0 … ─▶ update (UIF, TRGO)
//!                                 │ = CCRx        ─▶ compare (CCxIF)
//! ```

use crate::moment::Picoseconds;

const CEN: u32 = 1;
const MMS: u32 = 7 << 4;
const MMS_UPDATE: u32 = 2 << 4;
const UIF: u32 = 1;

/// A timer.
#[derive(Clone, Debug)]
pub struct Timer {
    clock: Picoseconds,
    cr1: u32,
    cr2: u32,
    dier: u32,
    sr: u32,
    prescaler: u32,
    /// Written, but not taken over before the next update.
    next_prescaler: u32,
    arr: u32,
    ccr: [u32; 2],
    /// Count at `since`.
    count: u64,
    since: Picoseconds,
    /// Ticks since `since` whose events have happened.
    done: u64,
}

impl Default for Timer {
    fn default() -> Self {
        Self {
            clock: 1,
            cr1: 0,
            cr2: 0,
            dier: 0,
            sr: 0,
            prescaler: 0,
            next_prescaler: 0,
            arr: 0xFFFF,
            ccr: [0; 2],
            count: 0,
            since: 0,
            done: 0,
        }
    }
}

impl Timer {
    fn runs(&self) -> bool {
        self.cr1 & CEN != 0
    }

    fn tick(&self) -> Picoseconds {
        self.clock * u64::from(self.prescaler + 1)
    }

    fn span(&self) -> u64 {
        u64::from(self.arr) + 1
    }

    fn ticks(&self, now: Picoseconds) -> u64 {
        if self.runs() { (now - self.since) / self.tick() } else { 0 }
    }

    fn counted(&self, now: Picoseconds) -> u32 {
        ((self.count + self.ticks(now)) % self.span()) as u32
    }

    /// Begins to count anew from where it is; everything until now must have happened.
    fn rebase(&mut self, now: Picoseconds) {
        let ticks = self.ticks(now);
        self.count = u64::from(self.counted(now));
        self.since = if self.runs() { self.since + ticks * self.tick() } else { now };
        self.done = 0;
    }

    /// Its clock has another period.
    pub fn set_clock(&mut self, now: Picoseconds, clock: Picoseconds) {
        if self.clock != clock {
            self.advance(now);
            self.rebase(now);
            self.clock = clock;
        }
    }

    /// The first tick after `done` at which the counter becomes `value`.
    fn next_tick(&self, value: u32) -> Option<u64> {
        if u64::from(value) >= self.span() {
            return None;
        }
        let at_done = (self.count + self.done) % self.span();
        let ahead = (u64::from(value) + self.span() - at_done) % self.span();
        Some(self.done + if ahead == 0 { self.span() } else { ahead })
    }

    /// Whether an update triggers something.
    fn triggers(&self) -> bool {
        self.cr2 & MMS == MMS_UPDATE
    }

    /// When something will happen that anybody notices.
    #[must_use]
    pub fn next_event(&self) -> Option<Picoseconds> {
        if !self.runs() {
            return None;
        }
        let update = (self.triggers() || self.dier & UIF != 0).then_some(0);
        let compare = (0..2).filter(|index| self.dier & 2 << index != 0).map(|index| self.ccr[index]);
        update
            .into_iter()
            .chain(compare)
            .filter_map(|value| self.next_tick(value))
            .min()
            .map(|tick| self.since + tick * self.tick())
    }

    /// Lets happen what has happened by `now`; the last update among it, if there was one.
    pub fn advance(&mut self, now: Picoseconds) -> Option<Picoseconds> {
        if !self.runs() {
            return None;
        }
        let ticks = self.ticks(now);
        let mut updated = None;
        if let Some(first) = self.next_tick(0).filter(|tick| *tick <= ticks) {
            self.sr |= UIF;
            let last = first + (ticks - first) / self.span() * self.span();
            updated = Some(self.since + last * self.tick());
        }
        for index in 0..2 {
            if self.next_tick(self.ccr[index]).is_some_and(|tick| tick <= ticks) {
                self.sr |= 2 << index;
            }
        }
        self.done = ticks;
        if updated.is_some() && self.prescaler != self.next_prescaler {
            self.rebase(now);
            self.prescaler = self.next_prescaler;
        }
        updated.filter(|_| self.triggers())
    }

    /// Level of its interrupt.
    #[must_use]
    pub fn interrupts(&self) -> bool {
        self.sr & self.dier & 7 != 0
    }

    /// Time between two updates.
    #[must_use]
    pub fn update_period(&self) -> Picoseconds {
        self.tick() * self.span()
    }

    pub(super) fn read(&mut self, offset: u32, now: Picoseconds) -> Option<u32> {
        self.advance(now);
        Some(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x0C => self.dier,
            0x10 => self.sr,
            0x24 => self.counted(now),
            0x28 => self.next_prescaler,
            0x2C => self.arr,
            0x34 => self.ccr[0],
            0x38 => self.ccr[1],
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, value: u32, now: Picoseconds) -> bool {
        self.advance(now);
        match offset {
            0x00 => {
                if (self.cr1 ^ value) & CEN != 0 {
                    self.rebase(now);
                    self.since = now;
                }
                self.cr1 = value;
            }
            0x04 => self.cr2 = value,
            0x0C => self.dier = value,
            // Cleared by writing zeros.
            0x10 => self.sr &= value,
            0x14 => {
                if value & 1 != 0 {
                    self.prescaler = self.next_prescaler;
                    self.count = 0;
                    self.since = now;
                    self.done = 0;
                    // URS: then UG sets no flag.
                    if self.cr1 & 4 == 0 {
                        self.sr |= UIF;
                    }
                }
            }
            0x24 => {
                self.rebase(now);
                self.count = u64::from(value & 0xFFFF) % self.span();
            }
            0x28 => self.next_prescaler = value & 0xFFFF,
            0x2C => {
                self.rebase(now);
                self.arr = value & 0xFFFF;
            }
            0x34 => self.ccr[0] = value & 0xFFFF,
            0x38 => self.ccr[1] = value & 0xFFFF,
            _ => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running(prescaler: u32, arr: u32, dier: u32, cr2: u32) -> Timer {
        let mut timer = Timer { clock: 10, ..Timer::default() };
        timer.write(0x28, prescaler, 0);
        timer.write(0x2C, arr, 0);
        timer.write(0x14, 1, 0);
        timer.write(0x10, 0, 0);
        timer.write(0x0C, dier, 0);
        timer.write(0x04, cr2, 0);
        timer.write(0x00, 1, 1000);
        timer
    }

    #[test]
    fn updates_come_at_their_exact_time_and_trigger() {
        let mut timer = running(1, 99, 0, MMS_UPDATE);
        assert_eq!(timer.next_event(), Some(1000 + 100 * 20));
        assert_eq!(timer.advance(2999), None);
        assert_eq!(timer.advance(3000), Some(3000));
        assert_eq!(timer.next_event(), Some(5000));
        assert_eq!(timer.read(0x24, 3050), Some(2));
    }

    #[test]
    fn a_compare_sets_its_flag_once_a_round_and_interrupts_when_enabled() {
        let mut timer = running(0, 0xFFFF, 4, 0);
        timer.write(0x38, 50, 1000);
        assert_eq!(timer.next_event(), Some(1500));
        timer.advance(1500);
        assert!(timer.interrupts());
        timer.write(0x10, !4, 1500);
        assert!(!timer.interrupts());
        assert_eq!(timer.next_event(), Some(1500 + 65_536 * 10));
    }
}
