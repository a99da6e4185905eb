//! Ctrl-C ends a command cleanly: what was gathered is still shown and written.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);
static CAUGHT: OnceLock<bool> = OnceLock::new();

/// Catches Ctrl-C from now on. A second one ends the program at once.
///
/// Where it cannot be caught (another handler is there already), Ctrl-C does what it always did.
pub fn catch() {
    CAUGHT.get_or_init(|| {
        ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::SeqCst) {
                // 128 + SIGINT, as shells report it.
                std::process::exit(130);
            }
        })
        .is_ok()
    });
}

/// Ends a command as Ctrl-C does.
pub fn ask() {
    ASKED.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed, or something else asked for the end.
#[must_use]
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// A `--duration` in seconds.
///
/// # Errors
/// When it is not a time.
pub fn span(seconds: Option<f64>) -> miette::Result<Option<std::time::Duration>> {
    seconds
        .map(|seconds| {
            std::time::Duration::try_from_secs_f64(seconds)
                .map_err(|error| miette::miette!("--duration {seconds} is no time in seconds: {error}"))
        })
        .transpose()
}
