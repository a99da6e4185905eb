//! The independent watchdog, from its own oscillator of 32 kHz.

use embassy_stm32::pac::DBGMCU;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use thud_firmware::board::Watchdog;
use thud_firmware::tasks::PULSE;

/// Evaluating an impact takes thread mode for 0.6 s at most (`thud_firmware::impact`); the LSI may be 10 % fast.
const PATIENCE_US: u32 = 1_000_000;
const _: () =
    assert!(PATIENCE_US as u64 * 9 / 10 > 2 * PULSE.as_micros() + 4 * 22_000, "see thud_firmware::tasks::PULSE");

/// The watchdog, awake.
pub struct BoardWatchdog(IndependentWatchdog<'static, IWDG>);

impl BoardWatchdog {
    /// Wakes it. To be called before the clocks are set up: a crystal that does not start must not be waited for in silence.
    #[expect(unsafe_code, reason = "before `init` there are no peripherals to take it from; nothing else uses it")]
    pub fn unleash() -> Self {
        // A debugger that halts the core must not be bitten.
        DBGMCU.apb1lfzr().modify(|freeze| freeze.set_iwdg(true));
        let mut watchdog = IndependentWatchdog::new(unsafe { IWDG::steal() }, PATIENCE_US);
        watchdog.unleash();
        Self(watchdog)
    }
}

impl Watchdog for BoardWatchdog {
    fn pet(&mut self) {
        self.0.pet();
    }
}
