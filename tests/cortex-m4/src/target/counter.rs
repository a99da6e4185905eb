//! Instructions by the system timer. Under `-icount shift=6` QEMU lets 64 ns pass with every instruction, so the timer's ticks
//! count them, and the same program counts the same every time. They are instructions, not cycles.

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// As long as an instruction takes under `-icount shift=6`, ns.
const INSTRUCTION_NS: f64 = 64.0;
/// Tick of the system timer of mps2-an386 (25 MHz), ns.
const TICK_NS: f64 = 40.0;
/// The timer counts down from here and begins anew: what is counted at once must take less than ten million instructions.
const RELOAD: u32 = 0x00FF_FFFF;

/// Counts.
pub struct Counter {
    /// What counting itself takes, ticks.
    own: u32,
}

impl Counter {
    /// Starts the timer.
    pub fn start() -> Self {
        if let Some(mut chip) = Peripherals::take() {
            chip.SYST.set_clock_source(SystClkSource::Core);
            chip.SYST.set_reload(RELOAD);
            chip.SYST.clear_current();
            chip.SYST.enable_counter();
        }
        let mut counter = Self { own: 0 };
        // The first time round differs.
        for _ in 0..3 {
            counter.own = counter.ticks(|| ()).1;
        }
        counter
    }

    /// Does the work and tells how many instructions it took.
    #[inline(never)]
    pub fn count<R>(&self, work: impl FnOnce() -> R) -> (R, f64) {
        let (result, ticks) = self.ticks(work);
        (result, f64::from(ticks.saturating_sub(self.own)) * (TICK_NS / INSTRUCTION_NS))
    }

    #[inline(always)]
    fn ticks<R>(&self, work: impl FnOnce() -> R) -> (R, u32) {
        let before = SYST::get_current();
        let result = work();
        let after = SYST::get_current();
        (result, before.wrapping_sub(after) & RELOAD)
    }
}
