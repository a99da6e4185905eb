//! Replay.
pub mod padding;
pub mod resample;
