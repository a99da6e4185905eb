//! The executor of what must not wait, in the interrupt of a peripheral that is used for nothing else.

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;

use super::priorities;

/// Static because its interrupt must find it.
static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
unsafe fn CORDIC() {
    // Its own interrupt, called from nowhere else.
    unsafe { EXECUTOR.on_interrupt() }
}

/// Starts it; once.
pub fn executor() -> SendSpawner {
    interrupt::CORDIC.set_priority(priorities::URGENT_TASKS);
    EXECUTOR.start(interrupt::CORDIC)
}
