//! The board, the bus and the rig, in virtual time.
//!
//! ```text
//! force ─N─▶ chain (cell, front end, ADC) ─codes─▶ board ─▶ thud_firmware::tasks ─▶ bus ─▶ host port
//!                                                   │ flash, watchdog
//!                             time: one thread, one clock for all of it
//! ```
//!
//! A [`world::World`] holds one CAN bus and any number of boards on it. Nothing moves unless the world is told
//! to run, and then it jumps from event to event: the same seed gives the same frames at the same microsecond.

pub mod adc;
pub mod board;
pub mod bus;
pub mod chain;
pub mod flash;
pub mod force;
pub mod mechanism;
pub mod rig;
pub mod time;
pub mod watchdog;
pub mod world;
