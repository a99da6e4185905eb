//! The CAN controller FDCAN1 in its three roles.
//!
//! `embassy-stm32` sets it up and reads frames. Beside it, through the registers: loading transmit buffers
//! (see [`crate::transmit_buffers`]), the news that one is free again, the flag of lost frames, recovery from bus-off.

use core::num::{NonZeroU8, NonZeroU16};

use embassy_stm32::can::config::{FdCanConfig, GlobalFilter, NominalBitTiming, NonMatchingFilter, TxBufferMode};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::interrupt::{InterruptExt, typelevel};
use embassy_stm32::peripherals::{FDCAN1, PA11, PA12};
use embassy_stm32::{Peri, bind_interrupts, interrupt};

use super::priorities;
use crate::bit_timing::{JUMP_WIDTH, PRESCALER, SEGMENT_1, SEGMENT_2};

mod reception;
mod supervision;
mod transmission;

pub use reception::{Mailbox, reception};
pub use supervision::Supervision;
pub use transmission::Transmission;

bind_interrupts!(struct Interrupts {
    // In this order: the driver's handler clears the flag that ours looks at.
    FDCAN1_IT0 => transmission::Freed, IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

const fn eight(value: u8) -> NonZeroU8 {
    NonZeroU8::new(value).unwrap()
}

const TIMING: NominalBitTiming = NominalBitTiming {
    prescaler: NonZeroU16::new(PRESCALER).unwrap(),
    seg1: eight(SEGMENT_1),
    seg2: eight(SEGMENT_2),
    sync_jump_width: eight(JUMP_WIDTH),
};

/// Starts the controller and parts it.
pub fn start(
    controller: Peri<'static, FDCAN1>,
    receive: Peri<'static, PA11>,
    transmit: Peri<'static, PA12>,
) -> (Transmission, reception::Driver, Supervision) {
    let mut can = CanConfigurator::new(controller, receive, transmit, Interrupts);
    can.set_config(FdCanConfig {
        nbtr: TIMING,
        tx_buffer_mode: TxBufferMode::Priority,
        // The supervisor does it, more and more slowly.
        automatic_bus_off_recovery: false,
        // CANopen: 11-bit identifiers, no remote frames. Which identifiers, the node says: `Mailbox::listen_to`.
        global_filter: GlobalFilter {
            handle_standard_frames: NonMatchingFilter::Reject,
            handle_extended_frames: NonMatchingFilter::Reject,
            reject_remote_standard_frames: true,
            reject_remote_extended_frames: true,
        },
        ..can.config()
    });
    interrupt::FDCAN1_IT0.set_priority(priorities::CAN);
    interrupt::FDCAN1_IT1.set_priority(priorities::CAN);
    let (transmit, receive, properties) = can.into_normal_mode().split();
    (Transmission::new(transmit), receive, Supervision::new(properties))
}

/// The line of the news that a buffer is free, spelled once.
type TransmitInterrupt = typelevel::FDCAN1_IT0;
