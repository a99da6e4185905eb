//! The thud impact sensor, without a chip.
//!
//! A force becomes a verdict in one direction, and the modules read in that order:
//!
//! ```text
//! counts ─▶ calibration ─N─▶ idle (zero, hum, noise) ─▶ onset ─▶ detector ─▶ capture
//!                                                                   │
//!                              impact (instant, peaks, impulse) ◀───┘
//!                                 └─▶ severity (limits, S, verdict) ─▶ event ─▶ dictionary ─▶ node ─▶ CAN
//! ```
//!
//! [`sensor::Sensor`] is a state machine without I/O: blocks of counts in, events out. The board, the
//! simulation and the replay of a real recording all push blocks into that very type. Everything that waits
//! (blocks, timers, CAN, flash) is in [`tasks`], generic over the traits in [`board`].
//!
//! No allocation, no `std`, no chip type in any signature.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod board;
pub mod calibration;
pub mod capture;
pub mod configuration;
pub mod configuration_lock;
pub mod detector;
pub mod dictionary;
pub mod emergency;
pub mod event;
pub mod event_log;
pub mod filter;
pub mod forecast;
pub mod idle;
pub mod impact;
pub mod limits;
pub mod lss;
pub mod node;
pub mod onset;
pub mod outbox;
pub mod rest;
pub mod sdo;
pub mod sensor;
pub mod severity;
pub mod shared;
pub mod storage;
pub mod stream;
pub mod tasks;
pub mod trigonometry;
pub mod units;
