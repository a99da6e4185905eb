//! The tool a person runs: simulate, replay, configure, watch and record.
//!
//! The way of the data through this floor:
//!
//! ```text
//! CAN ─▶ bus (transports) ─▶ client (the sensor as an object) ─▶ command ─▶ terminal, JSON, report
//! rig ─▶ simulation ─▶ campaign (recordings with what is believed of them) ─▶ replay ─▶ report
//! URDF ─▶ robot (effective mass) ─▶ client; biomechanics (limits) ─▶ permitted speed
//! ```
//!
//! `demonstration` goes the whole way at once, from the simulated rig over the simulated bus to the report.

pub mod biomechanics;
pub mod bus;
pub mod campaign;
pub mod client;
pub mod command;
pub mod contact_law;
pub mod decimal;
pub mod demonstration;
pub mod diagnosis;
pub mod drop_test;
pub mod input;
pub mod interrupt;
pub mod json;
pub mod key_file;
pub mod model;
pub mod predict;
pub mod proof;
pub mod recording;
pub mod replay;
pub mod report;
pub mod robot;
pub mod settings;
pub mod simulated_sensor;
pub mod simulation;
pub mod standard_output;
pub mod table;
