//! The independent watchdog: it bites when nobody has petted it for a while.

use std::cell::Cell;
use std::rc::Rc;

use embassy_time::{Duration, Instant};
use thud_firmware::board::Watchdog;

/// The independent watchdog; clones are the same one.
#[derive(Clone)]
pub struct IndependentWatchdog {
    patience: Duration,
    bites_at: Rc<Cell<Instant>>,
}

impl IndependentWatchdog {
    /// A watchdog that is asleep.
    #[must_use]
    pub fn new(patience: Duration) -> Self {
        Self { patience, bites_at: Rc::new(Cell::new(Instant::MAX)) }
    }

    /// Wakes it at `now`, as the option bytes of the chip do at every start.
    pub fn start(&self, now: Instant) {
        self.bites_at.set(now + self.patience);
    }

    /// Puts it to sleep, because the power is gone.
    pub fn stop(&self) {
        self.bites_at.set(Instant::MAX);
    }

    /// When it will bite; `None` while it sleeps.
    #[must_use]
    pub fn bites_at(&self) -> Option<Instant> {
        let at = self.bites_at.get();
        (at != Instant::MAX).then_some(at)
    }
}

impl Watchdog for IndependentWatchdog {
    fn pet(&mut self) {
        self.start(Instant::now());
    }
}
