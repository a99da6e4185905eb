//! The log that `probe-rs` shows: what happened, not how. Read from what the tasks share, so that nothing waits for a log.

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_time::Ticker;
use thud_firmware::shared::{Shared, Task};
use thud_firmware::tasks::PULSE;

/// Who started, and why.
pub fn start<const N: usize>(shared: &Shared<N>) {
    let identity = shared.identity;
    info!(
        "thud {=str} {=str}, build {=u64:016x}, serial {=u32:08x}, started by {}",
        env!("CARGO_PKG_VERSION"),
        env!("THUD_BUILD"),
        identity.build,
        identity.serial,
        identity.reset_cause,
    );
    let active = shared.active();
    info!("configuration revision {=u32}, hash {=u32:08x}", active.revision, active.hash);
}

/// Tells events, losses and the state of bus and detector when they change; for ever.
pub async fn run<const N: usize>(shared: &Shared<N>) -> ! {
    shared.watch(Task::Log);
    let mut ticker = Ticker::every(PULSE);
    let mut next_event = 1;
    let mut counters = shared.counters();
    let mut settled = false;
    loop {
        ticker.next().await;
        shared.lives(Task::Log);
        while let Some(event) = shared.event(next_event) {
            info!(
                "event {=u32}: impact {=u32}, peak {=f32} N ({=f32} N unfiltered), impulse {=f32} Ns, {=str}",
                event.number,
                event.impact,
                event.peak.0,
                event.raw_peak.0,
                event.impulse.0,
                event.severity.verdict.name(),
            );
            next_event += 1;
        }
        let detector = shared.detector();
        if detector.settled != settled {
            settled = detector.settled;
            info!(
                "settled: {=bool}, noise {=f32} N, threshold {=f32} N",
                settled, detector.noise.0, detector.threshold.0
            );
        }
        let now = shared.counters();
        if now != counters {
            warn!("losses: {}", now);
            counters = now;
        }
    }
}
