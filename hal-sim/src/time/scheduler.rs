//! What runs in a world: one future for each board, polled when woken, until all is quiet.

use std::pin::Pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Wake, Waker};

use embassy_time::Instant;

use super::Clock;

/// More rounds than this at one instant are a loop in which futures wake each other.
const ROUNDS_AT_ONE_INSTANT: u32 = 100_000;

/// Why a world cannot go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stuck {
    /// Everything waits and nothing will come.
    #[error("deadlock at {at_us} µs: {} wait for something that nobody will do: no alarm is set and nothing moves on the bus", waiting.join(", "))]
    Deadlock {
        /// When, µs of virtual time.
        at_us: u64,
        /// Who waits.
        waiting: Vec<String>,
    },
    /// Time does not go on, because something is always awake.
    #[error("livelock at {at_us} µs: {} keep waking each other at one instant", awake.join(", "))]
    Livelock {
        /// When, µs of virtual time.
        at_us: u64,
        /// Who is awake.
        awake: Vec<String>,
    },
}

/// Names one of the scheduler's futures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotId(usize);

struct Slot {
    name: String,
    future: Option<Pin<Box<dyn Future<Output = ()>>>>,
    woken: Arc<Woken>,
    waker: Waker,
}

struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The futures of a world and their clock.
pub struct Scheduler {
    clock: Rc<Clock>,
    slots: Vec<Slot>,
}

impl Default for Scheduler {
    fn default() -> Self {
        Self::new()
    }
}

impl Scheduler {
    /// Nothing runs, and it is zero o'clock.
    #[must_use]
    pub fn new() -> Self {
        Self { clock: Clock::new(), slots: Vec::new() }
    }

    /// The clock.
    #[must_use]
    pub fn clock(&self) -> &Rc<Clock> {
        &self.clock
    }

    /// Adds a place for a future.
    pub fn add(&mut self, name: impl Into<String>) -> SlotId {
        let woken = Arc::new(Woken(AtomicBool::new(false)));
        let waker = Waker::from(woken.clone());
        self.slots.push(Slot { name: name.into(), future: None, woken, waker });
        SlotId(self.slots.len() - 1)
    }

    /// Drops what ran in a place, and starts `future` there.
    pub fn start(&mut self, slot: SlotId, future: impl Future<Output = ()> + 'static) {
        self.stop(slot);
        let slot = &mut self.slots[slot.0];
        // A new waker, so that an alarm or a signal meant for what ran before does not wake this one.
        slot.woken = Arc::new(Woken(AtomicBool::new(true)));
        slot.waker = Waker::from(slot.woken.clone());
        slot.future = Some(Box::pin(future));
    }

    /// Drops what runs in a place.
    pub fn stop(&mut self, slot: SlotId) {
        // What is dropped may look at the time.
        let _entered = self.clock.enter();
        self.slots[slot.0].future = None;
    }

    /// Whether something runs in a place.
    #[must_use]
    pub fn runs(&self, slot: SlotId) -> bool {
        self.slots[slot.0].future.is_some()
    }

    /// Polls whatever was woken until nothing is, without moving time. Gives the instant of the next alarm, if somebody
    /// waits for time.
    ///
    /// # Errors
    /// [`Stuck::Livelock`].
    ///
    /// # Panics
    /// When a task panics.
    pub fn settle(&mut self) -> Result<Option<Instant>, Stuck> {
        let _entered = self.clock.enter();
        for _ in 0..ROUNDS_AT_ONE_INSTANT {
            let mut quiet = true;
            for slot in &mut self.slots {
                if let Some(future) = &mut slot.future
                    && slot.woken.0.swap(false, Ordering::Relaxed)
                {
                    quiet = false;
                    if future.as_mut().poll(&mut Context::from_waker(&slot.waker)).is_ready() {
                        slot.future = None;
                    }
                }
            }
            // Asking for the next alarm wakes whoever set one for this instant or before it.
            let next_alarm = self.clock.next_alarm();
            if quiet && !self.anyone_awake() {
                return Ok(next_alarm);
            }
        }
        let awake = self.slots.iter().filter(|slot| slot.woken.0.load(Ordering::Relaxed)).map(|slot| slot.name.clone());
        Err(Stuck::Livelock { at_us: self.clock.now().as_micros(), awake: awake.collect() })
    }

    fn anyone_awake(&self) -> bool {
        self.slots.iter().any(|slot| slot.future.is_some() && slot.woken.0.load(Ordering::Relaxed))
    }

    /// That nothing will ever happen again, if somebody still waits for it.
    ///
    /// # Errors
    /// [`Stuck::Deadlock`] with the names of those who wait.
    pub fn nothing_will_come(&self) -> Result<(), Stuck> {
        let waiting: Vec<_> =
            self.slots.iter().filter(|slot| slot.future.is_some()).map(|slot| slot.name.clone()).collect();
        if waiting.is_empty() {
            return Ok(());
        }
        Err(Stuck::Deadlock { at_us: self.clock.now().as_micros(), waiting })
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::pin::pin;

    use embassy_futures::yield_now;
    use embassy_time::{Duration, Timer};

    use super::*;
    use crate::time::by_priority;

    fn run(scheduler: &mut Scheduler) -> Result<(), Stuck> {
        while let Some(next) = scheduler.settle()? {
            scheduler.clock().jump_to(next);
        }
        scheduler.nothing_will_come()
    }

    #[test]
    fn a_timer_fires_at_its_very_microsecond() {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("sleeper");
        let seen = Rc::new(RefCell::new(Vec::new()));
        let log = seen.clone();
        scheduler.start(slot, async move {
            for pause in [1, 49, 50, 1_000_000] {
                Timer::after(Duration::from_micros(pause)).await;
                log.borrow_mut().push(Instant::now().as_micros());
            }
        });
        run(&mut scheduler).unwrap();
        assert_eq!(*seen.borrow(), [1, 50, 100, 1_000_100]);
    }

    #[test]
    fn who_waits_for_ever_is_named() {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("board 7");
        scheduler.start(slot, async {
            Timer::after(Duration::from_micros(3)).await;
            std::future::pending().await
        });
        let stuck = run(&mut scheduler).unwrap_err();
        assert_eq!(stuck, Stuck::Deadlock { at_us: 3, waiting: vec!["board 7".into()] });
        assert!(stuck.to_string().contains("board 7"));
    }

    #[test]
    fn who_never_sleeps_is_named() {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("spinner");
        scheduler.start(slot, async {
            loop {
                yield_now().await;
            }
        });
        assert_eq!(run(&mut scheduler), Err(Stuck::Livelock { at_us: 0, awake: vec!["spinner".into()] }));
    }

    #[test]
    fn worlds_on_one_thread_take_turns_with_their_own_time() {
        let make = |pause| {
            let mut scheduler = Scheduler::new();
            let slot = scheduler.add("sleeper");
            scheduler.start(slot, async move {
                Timer::after(Duration::from_micros(pause)).await;
                assert_eq!(Instant::now().as_micros(), pause);
            });
            scheduler.settle().unwrap();
            scheduler
        };
        let (mut early, mut late) = (make(10), make(500));
        run(&mut late).unwrap();
        run(&mut early).unwrap();
        assert_eq!(early.clock().now().as_micros(), 10);
        assert_eq!(late.clock().now().as_micros(), 500);
    }

    #[test]
    fn worlds_on_many_threads_have_their_own_time() {
        std::thread::scope(|scope| {
            for step in 1..=8 {
                scope.spawn(move || {
                    let mut scheduler = Scheduler::new();
                    let slot = scheduler.add("sleeper");
                    scheduler.start(slot, async move {
                        for count in 1..=10_000 {
                            Timer::after(Duration::from_micros(step)).await;
                            assert_eq!(Instant::now().as_micros(), count * step);
                        }
                    });
                    run(&mut scheduler).unwrap();
                });
            }
        });
    }

    #[test]
    fn of_tasks_woken_together_the_most_urgent_runs_first() {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("board");
        let order = Rc::new(RefCell::new(String::new()));
        let log = order.clone();
        scheduler.start(slot, async move {
            let step = |letter| {
                let log = log.clone();
                async move {
                    for _ in 0..3 {
                        Timer::after(Duration::from_micros(10)).await;
                        log.borrow_mut().push(letter);
                    }
                    std::future::pending().await
                }
            };
            by_priority([("a", pin!(step('a'))), ("b", pin!(step('b'))), ("c", pin!(step('c')))]).await;
        });
        let _ = run(&mut scheduler);
        assert_eq!(*order.borrow(), "abcabcabc");
    }

    /// `WakerRegistration` in embassy-sync wakes the old waker when a different one registers; if a clone were
    /// not recognised, every task would wake itself for ever.
    #[test]
    fn a_waker_knows_its_clones() {
        let waker = Waker::from(Arc::new(Woken(AtomicBool::new(false))));
        assert!(waker.will_wake(&waker.clone()));
    }

    #[test]
    fn what_ran_before_a_restart_does_not_come_back() {
        let mut scheduler = Scheduler::new();
        let slot = scheduler.add("board");
        let starts = Rc::new(RefCell::new(Vec::new()));
        for life in 1..=2 {
            let starts = starts.clone();
            scheduler.start(slot, async move {
                Timer::after(Duration::from_micros(100)).await;
                starts.borrow_mut().push((life, Instant::now().as_micros()));
            });
            scheduler.settle().unwrap();
            if life == 1 {
                scheduler.clock().jump_to(Instant::from_micros(40));
            }
        }
        run(&mut scheduler).unwrap();
        assert_eq!(*starts.borrow(), [(2, 140)]);
    }
}
