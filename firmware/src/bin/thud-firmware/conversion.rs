//! How long a sample takes, and which sample a block begins with after a gap.
//!
//! ```text
//! TIM6   │ trigger                                  │ trigger             50 µs
//! ADC1   └┬┬┬┬┬┬┬┬┬┬┬┬┬┬┬┐ 16 conversions, 42 µs ──▶ one sum of 16 bits ──▶ DMA
//! ```
//!
//! The sum is the sample: hardware oversampling by 16 without a shift, 12 + 4 bits. Averaging over 42 of 50 µs is the last
//! stage of the anti-alias filter; the middle of a sample lies 21 µs after its trigger, for all samples alike.

use thud_firmware::board::BLOCK;

/// Samples per second.
pub const SAMPLE_RATE_HZ: u32 = 20_000;
/// Conversions in one sample.
pub const OVERSAMPLING: u32 = 16;
/// Clock of the ADCs, Hz: SYSCLK divided by 4, which is what `embassy-stm32` chooses for at most 60 MHz.
pub const ADC_HZ: u32 = 40_000_000;
/// Tenths of ADC clocks for one conversion: sampling for 92.5, successive approximation of 12 bits for 12.5.
const CONVERSION_DECI_CLOCKS: u32 = 925 + 125;

const _: () = assert!(
    (OVERSAMPLING * CONVERSION_DECI_CLOCKS) as u64 * (SAMPLE_RATE_HZ as u64) < ADC_HZ as u64 * 10,
    "a sample must be done before the next is triggered"
);

/// Microseconds in a block.
const BLOCK_US: u64 = BLOCK as u64 * 1_000_000 / SAMPLE_RATE_HZ as u64;
const _: () = assert!(BLOCK as u64 * 1_000_000 == BLOCK_US * SAMPLE_RATE_HZ as u64, "whole microseconds");

/// Number of the first sample of the block that has just been completed, from the time since the timer was started.
///
/// Samples are counted, not timed; only after an overrun nobody knows how many there were. The clock and the sample timer run
/// from the same oscillator and do not drift, and the reader is woken at the end of a block, so time names the block without
/// doubt as long as the reader is late by less than a block. That it was not is what "no overrun this time" means.
pub const fn block_completed_at(elapsed_us: u64) -> u64 {
    (elapsed_us / BLOCK_US).saturating_sub(1) * BLOCK as u64
}

/// What divides the bias of the IEPE cell before the pin: 24 V of an open cable must stay below the reference.
pub const BIAS_DIVIDER: f32 = 8.0;
/// Reference of the ADCs, V; VREF+ is tied to VDDA on the board.
pub const REFERENCE_V: f32 = 3.3;
const _: () = assert!(24.0 / BIAS_DIVIDER < REFERENCE_V);

/// The bias voltage from a code of 12 bits, V.
pub fn bias_volt(code: u16) -> f32 {
    f32::from(code) * (REFERENCE_V / 4096.0 * BIAS_DIVIDER)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// When the last sample of a block is in memory, µs.
    fn completed_us(block: u64) -> u64 {
        (block + 1) * BLOCK_US + 42
    }

    #[test]
    fn a_block_is_named_however_late_its_reader_is() {
        for block in [0, 1, 2, 1_000, 10_u64.pow(12)] {
            for late_us in [0, 1, 100, BLOCK_US - 43] {
                assert_eq!(
                    block_completed_at(completed_us(block) + late_us),
                    block * BLOCK as u64,
                    "{late_us} µs late"
                );
            }
        }
        assert_eq!(block_completed_at(0), 0);
    }

    #[test]
    fn the_bias_spans_the_supply() {
        assert_eq!(bias_volt(0), 0.0);
        assert!((bias_volt(4095) - 26.4).abs() < 0.01);
        // 11 V, a healthy cell, is 1.375 V at the pin.
        assert!((bias_volt(1707) - 11.0).abs() < 0.01);
    }
}
