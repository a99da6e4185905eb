//! What a body bears, and how fast a robot may therefore be.
//!
//! The force limits, stiffness and mass of the twelve regions, with their profiles and provenance, are the firmware's
//! ([`thud_firmware::limits`]), because the sensor judges by them. Here is what it does not judge: pressures of the 29
//! areas, the fifteen regions of the older table, and the speed that a limit permits.

pub mod area;
pub mod bgia_2011;
pub mod permission;
#[cfg(test)]
mod tests;
