//! Bit timing of the CAN controller.
//!
//! ```text
//!  ┌ sync ┬───────── segment 1 ──────────┬─ segment 2 ─┐   one bit, 80 quanta of 12.5 ns
//!  1      2                              71            81
//!                                        ▲ sample point: 87.5 %, CiA 301 for 1 Mbit/s
//! ```
//!
//! The kernel clock of 80 MHz is undivided: the shorter the quantum, the better an edge is located.

/// Clock of the FDCAN kernel, Hz: output Q of the PLL.
pub const KERNEL_HZ: u32 = 80_000_000;
/// Bit rate of the bus, bit/s.
pub const BIT_RATE: u32 = 1_000_000;

/// Kernel clocks in a quantum.
pub const PRESCALER: u16 = 1;
/// Quanta from the synchronisation quantum to the sample point.
pub const SEGMENT_1: u8 = 69;
/// Quanta from the sample point to the end of the bit.
pub const SEGMENT_2: u8 = 10;
/// Quanta by which an edge may move the sample point. ISO 11898-1: at most segment 2; the larger, the more clock tolerance.
pub const JUMP_WIDTH: u8 = 10;

/// Quanta in a bit.
pub const QUANTA: u32 = 1 + SEGMENT_1 as u32 + SEGMENT_2 as u32;
/// Sample point, per mille of the bit.
pub const SAMPLE_POINT_PER_MILLE: u32 = (1 + SEGMENT_1 as u32) * 1000 / QUANTA;

const _: () = assert!(
    KERNEL_HZ == BIT_RATE * PRESCALER as u32 * QUANTA,
    "the bit rate must come out exactly: CAN has no tolerance to give away"
);
const _: () = assert!(SAMPLE_POINT_PER_MILLE >= 850 && SAMPLE_POINT_PER_MILLE <= 900, "CiA 301: 87.5 % at 1 Mbit/s");
const _: () = assert!(JUMP_WIDTH <= SEGMENT_2 && JUMP_WIDTH <= 128, "ISO 11898-1");
// RM0440, FDCAN_NBTP; `NominalBitTiming` of embassy-stm32 0.6.0 masks larger values silently.
const _: () = assert!(PRESCALER >= 1 && PRESCALER <= 511 && SEGMENT_2 >= 2 && SEGMENT_2 <= 127);
