//! The sensor's firmware as a program of the simulated board: the wiring that `main` is on the chip.

use std::cell::Cell;
use std::pin::pin;
use std::rc::Rc;

use embedded_storage_async::nor_flash::ReadNorFlash as _;
use thud_firmware::board::ResetCause;
use thud_firmware::capture::{CAPTURE, Captures};
use thud_firmware::configuration::Configuration;
use thud_firmware::shared::Shared;
use thud_firmware::storage::{NotStored, Store, stamp};
use thud_firmware::tasks::{evaluator, node, sampler, storage, supervisor, transmit};

use super::{Life, Parts};
use crate::flash::Flash;
use crate::time::{Scheduler, by_priority};

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
    let mut store = store_in(flash);
    let loaded = store.load().await;
    let captures: &'static Captures<CAPTURE> = Box::leak(Box::new(Captures::new()));
    let shared: &'static Shared<CAPTURE> = Box::leak(Box::new(Shared::new(identity, loaded, captures)));
    by_priority([
        ("sampler", pin!(async { sampler::run(samples, shared).await })),
        ("transmit", pin!(async { transmit::run(can.clone(), shared).await })),
        ("node", pin!(async { node::run(can.clone(), shared).await })),
        ("evaluator", pin!(async { evaluator::run(shared).await })),
        ("storage", pin!(async { storage::run(store, shared).await })),
        ("supervisor", pin!(async { supervisor::run(can.clone(), watchdog, shared).await })),
    ])
    .await;
    ResetCause::Software
}

fn store_in(flash: Flash) -> Store<Flash> {
    let range = 0..flash.capacity() as u32;
    Store::new(flash, range)
}

/// Stores a configuration in a flash before its board runs for the first time, as the factory does: its revision is 1.
///
/// # Errors
/// [`NotStored`], as from the firmware's own storage.
///
/// # Panics
/// If the flash loses its power meanwhile.
pub fn commission(flash: &Flash, configuration: Configuration) -> Result<(), NotStored> {
    let mut scheduler = Scheduler::new();
    let slot = scheduler.add("factory");
    let outcome = Rc::new(Cell::new(None));
    let (told, flash) = (outcome.clone(), flash.clone());
    scheduler.start(slot, async move {
        told.set(Some(store_in(flash).save(&stamp(configuration, 1)).await));
    });
    // Writing flash waits for nothing but time.
    while let Ok(Some(next)) = scheduler.settle() {
        scheduler.clock().jump_to(next);
    }
    outcome.get().expect("the power goes while the factory writes")
}
