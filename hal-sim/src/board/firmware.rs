//! The sensor's firmware as a program of the simulated board: the wiring that `main` is on the chip.

use std::pin::pin;

use thud_firmware::board::ResetCause;
use thud_firmware::capture::{CAPTURE, Captures};
use thud_firmware::node::NodeMemory;
use thud_firmware::shared::Shared;
use thud_firmware::storage::Store;
use thud_firmware::tasks::{evaluator, node, sampler, storage, supervisor, transmit};

use embedded_storage_async::nor_flash::ReadNorFlash as _;

use super::{Life, Parts};
use crate::time::by_priority;

/// The firmware's tasks on these parts.
///
/// The order is that of the board: sampler and transmitter at interrupt priority, the others below. What the board
/// keeps in statics is leaked here at every start, about 80 KiB, because the CANopen stack wants it for ever.
#[must_use]
pub fn firmware(parts: Parts) -> Life {
    Box::pin(run(parts))
}

async fn run(parts: Parts) -> ResetCause {
    let Parts { samples, can, flash, watchdog, identity } = parts;
    let range = 0..flash.capacity() as u32;
    let mut store = Store::new(flash, range);
    let loaded = store.load().await;
    let captures: &'static Captures<CAPTURE> = Box::leak(Box::new(Captures::new()));
    let shared: &'static Shared<CAPTURE> = Box::leak(Box::new(Shared::new(identity, loaded, captures)));
    let memory: &'static NodeMemory = Box::leak(Box::new(NodeMemory::new()));
    by_priority([
        ("sampler", pin!(async { sampler::run(samples, shared).await })),
        ("transmit", pin!(async { transmit::run(can.clone(), shared).await })),
        ("node", pin!(async { node::run(can.clone(), shared, memory).await })),
        ("evaluator", pin!(async { evaluator::run(shared).await })),
        ("storage", pin!(async { storage::run(store, shared).await })),
        ("supervisor", pin!(async { supervisor::run(can.clone(), watchdog, shared).await })),
    ])
    .await;
    ResetCause::Software
}
