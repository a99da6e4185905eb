//! The STM32G474RE and what hangs on it. A NUCLEO-G474RE with an IEPE front end and a CAN transceiver is the reference board:
//!
//! | pin | is | on the Nucleo |
//! |---|---|---|
//! | PA0 | force, ADC1 channel 1, middle of the supply at no force | A0 |
//! | PA1 | bias of the IEPE cell through the divider, ADC2 channel 2 | A1 |
//! | PA11, PA12 | FDCAN1 receive, transmit | CN10-14, CN10-12 |
//! | PF0, PF1 | crystal, 24 MHz | X3 |

mod can;
mod clocks;
#[expect(unsafe_code, reason = "exception handlers of cortex-m-rt are unsafe functions")]
mod fatal;
mod flash;
mod identity;
mod log;
mod memory;
mod priorities;
mod samples;
mod start;
#[expect(unsafe_code, reason = "an interrupt handler of cortex-m-rt is an unsafe function")]
mod urgent;
mod watchdog;
