//! The firmware of the sensor board, as wiring: which pin, which interrupt, which memory. It decides nothing; what the
//! sensor does is in the library, and the traits of `thud_firmware::board` are all that the two know of each other.
//!
//! ```text
//! clocks ─ samples (TIM6 ▶ ADC1 ▶ DMA) ─▶ sampler ──▶ evaluator        interrupt executor: sampler, transmit, reception
//!        ─ can (FDCAN1)                ─▶ transmit, node               thread executor:    everything else
//!        ─ flash (bank 2)              ─▶ storage
//!        ─ watchdog, identity, panic record, log
//! ```
//!
//! On a desktop the same package builds a program that prints what the board says about itself: `cargo run -p thud-firmware`.
#![cfg_attr(target_os = "none", no_std, no_main)]

// Without a chip in them, so that the desktop's tests reach them.
mod bit_timing;
#[cfg(any(test, target_os = "none"))]
mod call_chain;
#[cfg(any(test, target_os = "none"))]
mod conversion;
#[cfg(any(test, target_os = "none"))]
mod panic_record;
#[cfg(any(test, target_os = "none"))]
mod reset_flags;
#[cfg(any(test, target_os = "none"))]
mod transmit_buffers;

#[cfg(target_os = "none")]
mod chip;

#[cfg(not(target_os = "none"))]
mod description;

#[cfg(not(target_os = "none"))]
fn main() -> std::io::Result<()> {
    description::print(&mut std::io::stdout().lock())
}
