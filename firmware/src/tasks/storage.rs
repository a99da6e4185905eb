//! An applied configuration into flash, between impacts.

use embassy_time::{Duration, Timer, with_timeout};
use embedded_storage_async::nor_flash::NorFlash;

use super::PULSE;
use crate::emergency::Fault;
use crate::shared::{Report, Shared, Task};
use crate::storage::Store;

/// How often it is looked whether the impact is over.
const IMPACT_POLL: Duration = Duration::from_millis(10);

/// Runs for ever.
pub async fn run<F: NorFlash, const N: usize>(mut store: Store<F>, shared: &Shared<N>) -> ! {
    loop {
        let wanted = with_timeout(PULSE, shared.store.wait()).await;
        shared.lives(Task::Storage);
        if wanted.is_err() {
            continue;
        }
        while shared.detector().impact_open {
            shared.lives(Task::Storage);
            Timer::after(IMPACT_POLL).await;
        }
        let active = shared.active();
        match store.save(&active).await {
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
