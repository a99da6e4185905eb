//! Which interrupt may interrupt which.
//!
//! | priority | interrupt | does |
//! |---|---|---|
//! | 0 | TIM15 | time: wakes tasks |
//! | 1 | DMA1 channel 1 | half a ring of samples is there: wakes the sampler |
//! | 2 | FDCAN1 lines 0 and 1 | a frame came or has gone: wakes transmitter and reception |
//! | 4 | CORDIC, which is used for nothing else | the executor of sampler, transmitter and reception |
//! | thread | – | the executor of everything else, and waiting |
//!
//! Handlers only wake, for a microsecond or less; what they wake runs at priority 4 and is delayed by nothing but them and by
//! critical sections, which copy a few bytes.

use embassy_stm32::interrupt::Priority;

/// The DMA of the samples.
pub const SAMPLES: Priority = Priority::P1;
/// The CAN controller.
pub const CAN: Priority = Priority::P2;
/// The executor of what must not wait.
pub const URGENT_TASKS: Priority = Priority::P4;
