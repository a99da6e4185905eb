//! On a Cortex-M4F in QEMU: reads 16-bit counts (little-endian) from the host's file `counts` in the folder where QEMU was
//! started, and prints
//!
//! ```text
//! event HEX                         every event's record, as the desktop must have it
//! count PART SAMPLES INSTRUCTIONS   what each part of the per-sample path took
//! most PART INSTRUCTIONS            the most that one block took
//! ```
//!
//! On a desktop there is nothing to count; `tests/qemu.rs` runs the library there and compares.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target;

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), &'static str> {
    Err("this runs in QEMU: cargo xtask qemu")
}
