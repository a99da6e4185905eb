//! Clocks.
//!
//! ```text
//! crystal 24 MHz ÷ 6 = 4 MHz × 80 = 320 MHz ─┬ ÷ 2 ▶ SYSCLK 160 MHz ─┬ ▶ buses, timers
//!                                            │                       └ ÷ 4 ▶ ADC 40 MHz
//!                                            └ ÷ 4 ▶ FDCAN 80 MHz
//! ```
//!
//! From the crystal, because neither a bit at 1 Mbit/s nor an impulse in newton-seconds can live with the 1 % of the internal
//! oscillator. 160 and not 170 MHz, because 80 MHz divides into CAN bits and 42.5 MHz does not.

use embassy_stm32::Config;
use embassy_stm32::pac::{PWR, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllQDiv, PllRDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;

use crate::bit_timing::KERNEL_HZ;
use crate::conversion::{ADC_HZ, SAMPLE_RATE_HZ};

const CRYSTAL_HZ: u32 = 24_000_000;
const PLL_HZ: u32 = CRYSTAL_HZ / 6 * 80;
/// Clock of the core and the buses, Hz.
pub const SYSCLK_HZ: u32 = PLL_HZ / 2;

const _: () = assert!(SYSCLK_HZ == 160_000_000 && PLL_HZ >= 96_000_000 && PLL_HZ <= 344_000_000, "RM0440, 7.2.4");
const _: () = assert!(PLL_HZ / 4 == KERNEL_HZ, "the bit timing was worked out for this clock");
const _: () = assert!(SYSCLK_HZ / 4 == ADC_HZ, "the sampling times were worked out for this clock");
const _: () = assert!(SYSCLK_HZ.is_multiple_of(SAMPLE_RATE_HZ), "the sample rate must come out exactly");

/// Lets the core voltage be that of range 1 boost, which is required above 150 MHz (RM0440, 6.1.5); before the clocks.
///
/// `config.rcc.boost` of `embassy-stm32` 0.6.0 means to, but its register description has R1MODE at bit 0 of PWR_CR5. It is bit 8
/// (RM0440, 6.4.22), and 1 after a reset.
pub fn boost_core_voltage() {
    const R1MODE: u32 = 1 << 8;
    RCC.apb1enr1().modify(|enable| enable.set_pwren(true));
    PWR.cr5().modify(|cr5| cr5.0 &= !R1MODE);
}

/// What `embassy_stm32::init` sets up, with the priority of the DMA's interrupts.
pub fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(CRYSTAL_HZ), mode: HseMode::Oscillator });
    config.rcc.hsi48 = None;
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL80,
        divp: None,
        divq: Some(PllQDiv::DIV4),
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV1;
    config.rcc.apb2_pre = APBPrescaler::DIV1;
    // For the wait states of the flash; the voltage itself: `boost_core_voltage`.
    config.rcc.boost = true;
    config.rcc.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    config.rcc.mux.adc12sel = mux::Adcsel::SYS;
    // Otherwise probe-rs cannot attach to a sleeping core.
    config.enable_debug_during_sleep = true;
    config.bdma_interrupt_priority = super::priorities::SAMPLES;
    config
}
