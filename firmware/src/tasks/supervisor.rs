//! Watchdog and bus-off.
//!
//! The watchdog is petted only when every task has lived since the last time. Bus-off does not end by itself: recovery is
//! started after a pause that doubles, from [`FIRST_PAUSE`] to [`LONGEST_PAUSE`], as long as the controller falls back within
//! [`CALM`]; a node that disturbs the bus thus leaves it alone more and more.

use embassy_time::{Duration, Instant, Timer};

use crate::board::{BusState, CanSupervise, Watchdog};
use crate::emergency::Fault;
use crate::shared::{Report, Shared};

/// How often it looks.
pub const PERIOD: Duration = Duration::from_millis(10);
/// Pause before the first attempt to recover.
pub const FIRST_PAUSE: Duration = Duration::from_millis(20);
/// Longest pause.
pub const LONGEST_PAUSE: Duration = Duration::from_millis(2_560);
/// Time on the bus after which the pause starts from the beginning.
pub const CALM: Duration = Duration::from_secs(2);

/// Runs for ever.
pub async fn run<const N: usize>(mut can: impl CanSupervise, mut watchdog: impl Watchdog, shared: &Shared<N>) -> ! {
    let mut before = BusState::ErrorActive;
    let mut pause = FIRST_PAUSE;
    let mut recover_at = None;
    let mut back_since = Instant::now();
    loop {
        let now = Instant::now();
        let status = can.status();
        shared.bus.lock(|bus| bus.set(status));
        if status.state != before {
            match (before, status.state) {
                (_, BusState::BusOff) => {
                    shared.count(|counters| counters.bus_off = counters.bus_off.saturating_add(1));
                    if now - back_since >= CALM {
                        pause = FIRST_PAUSE;
                    }
                    recover_at = Some(now + pause);
                    pause = (pause * 2).min(LONGEST_PAUSE);
                }
                (BusState::BusOff, _) => {
                    back_since = now;
                    shared.report(Report::Raised(Fault::BusOff, shared.counters().bus_off));
                }
                _ => {}
            }
            match status.state {
                BusState::ErrorPassive => shared.report(Report::Raised(Fault::BusPassive, 0)),
                BusState::ErrorActive => shared.report(Report::Cleared(Fault::BusPassive)),
                BusState::BusOff => {}
            }
            before = status.state;
        }
        if status.state == BusState::BusOff && recover_at.is_some_and(|at| now >= at) {
            can.recover();
            // Should it still be off after that long, once more.
            recover_at = Some(now + pause);
        }
        if shared.all_have_lived() {
            watchdog.pet();
        }
        Timer::after(PERIOD).await;
    }
}
