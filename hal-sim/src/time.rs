//! Virtual time: a clock that only the simulation moves, and tasks that run on it in order of priority.
//!
//! ```text
//! poll what was woken, the most urgent first ─▶ quiet? ─▶ jump to the next alarm or event of the world ─▶ …
//! ```
//!
//! The clock is the [`embassy_time`] driver of the thread that runs the world, so the firmware's `Timer` and
//! `Instant` are the simulated ones. One tick is 1 µs ([`TICK_HZ`]); a bit on a 1 Mbit/s bus and the sample
//! period at 20 kS/s (50 µs) are whole ticks.
//!
//! Computation takes no virtual time: a task that has been woken at an instant has finished its work at the same
//! instant. What the chip needs for it is measured on the chip, not here.

mod clock;
mod priority;
mod scheduler;

pub use clock::Clock;
pub use priority::{Task, by_priority};
pub use scheduler::{Scheduler, SlotId, Stuck};

/// Ticks per second of virtual time.
pub const TICK_HZ: u64 = embassy_time::TICK_HZ;

const _: () = assert!(TICK_HZ == 1_000_000, "the simulation counts microseconds: set embassy-time's tick-hz-1_000_000");
