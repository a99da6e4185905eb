//! The board without the board: the very ELF file that is flashed, on an emulated STM32G474.
//!
//! ```text
//! force ─N─▶ chain ─codes─▶ ADC ─▶ DMA ─▶ RAM                        thud_sim's rig, chain and CAN bus
//!                            ▲             │
//!                     TIM6 ──┘     Cortex-M4F (unicorn) ─▶ FDCAN ─▶ bus ─▶ host port, udp_multicast, other nodes
//!                                          │
//!                     clocks, reset, NVIC, time, flash, watchdog         chip
//! ```
//!
//! `machine` is the processor: instructions by the unicorn library, exceptions by ourselves, because unicorn has no NVIC.
//! `chip` is everything around it that the firmware touches. `emulator` couples both to a force and to a bus.
//!
//! Guest time is counted, never measured: each instruction takes `machine::CLOCKS_PER_INSTRUCTION` clocks of the
//! processor, and a sleeping processor jumps to the next event. The same inputs give the same frames at the same microsecond.
//!
//! The model is strict. A register that is not modelled, a peripheral whose clock is off, a flash latency too short for the
//! clock: each is a line in `chip::Chip::violations`, and the tests want that list empty.
//!
//! Not modelled: the analogue world beyond the codes, wait states one by one, the transceiver, the edges of a CAN bit.
#![cfg(feature = "unicorn")]

pub mod analog;
pub mod bridge;
pub mod chip;
pub mod emulator;
pub mod guest_bus;
pub mod image;
pub mod log;
pub mod machine;
pub mod moment;
pub mod stack_depth;
