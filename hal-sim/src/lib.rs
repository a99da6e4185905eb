//! Simulation.

pub mod mechanism;
pub mod rig;
