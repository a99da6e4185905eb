//! Guest time in picoseconds: a clock of 160 MHz is a whole number of them, one of 170 MHz very nearly.

/// Picoseconds since the emulator was made, or a span of them. 2⁶⁴ ps are 213 days.
pub type Picoseconds = u64;

/// In one microsecond, the unit of the simulated bus.
pub const MICROSECOND: Picoseconds = 1_000_000;
/// In one second.
pub const SECOND: Picoseconds = 1_000_000_000_000;

/// The period of a clock.
#[must_use]
pub const fn period(hertz: u64) -> Picoseconds {
    (SECOND + hertz / 2) / hertz
}

/// The same as whole microseconds, rounded up: when the bus notices.
#[must_use]
pub const fn microseconds_up(moment: Picoseconds) -> u64 {
    moment.div_ceil(MICROSECOND)
}
