//! What all commands on a bus say in the same words.

use std::time::Duration;

use indicatif::ProgressBar;

use crate::bus::Counters;

/// A spinner while sensors are looked for; it shows on a terminal only.
#[must_use]
pub fn searching(bus: &str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(format!("looking for sensors on {bus}"));
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}

/// What the transport counted, losses last and only where there are some.
#[must_use]
pub fn traffic(bus: &str, counters: &Counters) -> String {
    let mut words = format!("{bus}: {} frames received, {} sent", counters.received, counters.sent);
    if counters.lost > 0 {
        words += &format!(", {} LOST before they could be read", counters.lost);
    }
    if counters.refused > 0 {
        words += &format!(", {} commands or frames refused by the adapter", counters.refused);
    }
    if counters.malformed > 0 {
        let last = counters.last_malformed.as_deref().unwrap_or("");
        words += &format!(", {} malformed ({last})", counters.malformed);
    }
    if counters.foreign > 0 {
        words += &format!(", {} frames that are not CANopen", counters.foreign);
    }
    words
}
