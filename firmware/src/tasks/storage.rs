//! An applied configuration into flash, between impacts.

use core::task::{Context, Poll};

use embassy_time::with_timeout;

use super::PULSE;
use crate::board::AskedFlash;
use crate::configuration_lock::ConfigurationLock;
use crate::emergency::Fault;
use crate::shared::{Report, Shared, Task};
use crate::storage::{ImpactWatch, NotStored, Store, closed};

/// Runs for ever.
pub async fn run<F: AskedFlash, const N: usize>(mut store: Store<F>, shared: &'static Shared<N>) -> ! {
    store.wait_for_impacts(shared);
    let (mut locked, start) = store.start().await;
    shared.with_lock(|lock| *lock = locked);
    shared.set_start(start);
    if locked.is_none() {
        // Nobody may change the configuration: better so than that damage opens the lock.
        shared.report(Report::Raised(Fault::Storage, 0));
    }
    loop {
        let wanted = with_timeout(PULSE, shared.store.wait()).await;
        shared.lives(Task::Storage);
        if wanted.is_err() {
            continue;
        }
        // What is stored is what holds when the impact is over.
        closed(shared).await;
        let active = shared.active();
        // The lock first: a change whose counter were not kept could be replayed after a power cut.
        let wanted = shared.lock();
        let mut saved = keep(&mut store, wanted, &mut locked).await;
        if saved.is_ok() {
            saved = store.save(&active).await;
        }
        // Where the log was beyond repair it was erased, and the lock with it.
        if saved.is_ok() && store.load_lock().await != locked {
            locked = None;
            saved = keep(&mut store, wanted, &mut locked).await;
        }
        match saved {
            Ok(()) => {
                shared.settings.lock(|settings| settings.borrow_mut().mark_stored(active.revision));
                shared.report(Report::Cleared(Fault::Configuration));
                shared.report(Report::Cleared(Fault::Storage));
            }
            Err(_) => {
                shared.count(|counters| counters.storage_failures = counters.storage_failures.saturating_add(1));
                // It lasts until a later "save" succeeds; trying again by itself would wear out a failing page.
                shared.report(Report::Raised(Fault::Storage, active.revision));
            }
        }
    }
}

impl<const N: usize> ImpactWatch for Shared<N> {
    fn is_open(&self) -> bool {
        self.detector().impact_open
    }

    fn poll_closed(&self, context: &mut Context<'_>) -> Poll<()> {
        self.lives(Task::Storage);
        self.impact_over.register(context.waker());
        if self.is_open() { Poll::Pending } else { Poll::Ready(()) }
    }
}

/// Writes the lock if it is not the one that is stored, and a closed one every time: after an erase that a power cut has interrupted,
/// the map may drop what was not written since.
async fn keep<F: AskedFlash>(
    store: &mut Store<F>,
    wanted: Option<ConfigurationLock>,
    stored: &mut Option<ConfigurationLock>,
) -> Result<(), NotStored> {
    if let Some(lock) = wanted.filter(|lock| lock.is_locked() || wanted != *stored) {
        store.save_lock(&lock).await?;
        *stored = wanted;
    }
    Ok(())
}
