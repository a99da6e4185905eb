//! The clock of a world and the `embassy-time` driver that shows it to the firmware.
//!
//! The driver is one static for the whole process, as `embassy-time` wants it; the clock behind it is that of
//! the world which runs on the calling thread. So worlds on different threads, and worlds that take turns on
//! one thread, each have their own time.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::task::Waker;

use embassy_time::Instant;
use embassy_time_driver::Driver;
use embassy_time_queue_utils::queue_generic::ConstGenericQueue;

/// Alarms that can be pending at once: one for each task that waits for time. When it overflows, the queue wakes a
/// task early, which asks again: with too few places tasks would push each other out for ever.
const ALARMS: usize = 512;

thread_local! {
    static RUNNING: RefCell<Option<Rc<Clock>>> = const { RefCell::new(None) };
}

/// The time of one world.
pub struct Clock {
    now: Cell<u64>,
    alarms: RefCell<ConstGenericQueue<ALARMS>>,
}

impl Clock {
    /// A clock that stands at zero.
    #[must_use]
    pub fn new() -> Rc<Self> {
        Rc::new(Self { now: Cell::new(0), alarms: RefCell::new(ConstGenericQueue::new()) })
    }

    /// What time it is.
    #[must_use]
    pub fn now(&self) -> Instant {
        Instant::from_ticks(self.now.get())
    }

    /// Jumps to `instant` and wakes whoever waited for it or for an earlier one.
    ///
    /// # Panics
    /// If that would be backwards: a fault of the simulation.
    pub fn jump_to(&self, instant: Instant) {
        let ticks = instant.as_ticks();
        assert!(ticks >= self.now.get(), "time would run backwards: from {} µs to {ticks} µs", self.now.get());
        self.now.set(ticks);
        self.alarms.borrow_mut().next_expiration(ticks);
    }

    /// When the next alarm is due; `None` if nobody waits for time.
    #[must_use]
    pub fn next_alarm(&self) -> Option<Instant> {
        let next = self.alarms.borrow_mut().next_expiration(self.now.get());
        (next != u64::MAX).then(|| Instant::from_ticks(next))
    }

    /// Makes this the clock that `embassy_time` shows on this thread, until the guard is dropped.
    #[must_use]
    pub fn enter(self: &Rc<Self>) -> Entered {
        Entered { outer: RUNNING.replace(Some(self.clone())) }
    }
}

/// While this lives, a certain clock is the thread's.
pub struct Entered {
    outer: Option<Rc<Clock>>,
}

impl Drop for Entered {
    fn drop(&mut self) {
        RUNNING.set(self.outer.take());
    }
}

struct RunningClock;

impl Driver for RunningClock {
    /// Zero where no world runs: the driver may not fail.
    fn now(&self) -> u64 {
        RUNNING.with_borrow(|clock| clock.as_ref().map_or(0, |clock| clock.now.get()))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        RUNNING.with_borrow(|clock| {
            let clock = clock.as_ref().expect("a timer was polled outside of a running world: nothing would wake it");
            clock.alarms.borrow_mut().schedule_wake(at, waker);
        });
    }
}

embassy_time_driver::time_driver_impl!(static DRIVER: RunningClock = RunningClock);
