//! Hides physics in campaigns, so that a diagnosis can be tried on data whose truth is known to nobody who diagnoses.
//!
//! ```text
//! plan ─▶ world of each recording ─▶ motion ─▶ readout ─▶ noise, converter ─▶ campaign (anyone may see)
//!            ▲                                    │
//!            └── hidden effects, scaled until ────┴─▶ strength d ──────────▶ answer (nobody may see)
//! ```
//!
//! # How this differs from the simulator that the diagnosis fits with
//!
//! It shares no code with it: this crate names no other crate of the workspace. And it resolves more:
//!
//! - Bodies are always separate: link, tip, moving piece (a light one even where nothing is hidden), springs on a load cell
//!   with its own stiffness, frame. They are stepped by a fixed-step position Verlet with implicit dampers and without
//!   location of events, a few microseconds a step.
//! - Friction is bristles that bend before they slide (LuGre), so there is presliding and no sign function. Stops come in
//!   over tenths of a millimetre. The pad's surface is crowned, its relaxation is a spectrum of three branches, its rate
//!   stiffening has a memory. A drive that pushes is a position servo that saturates; an arm that gives way creeps.
//! - The chain has its own anti-alias filter (Bessel), converter steps, drift, hum and coloured noise. Springs repeat to a
//!   per mille; speeds, masses, springs and pad differ from what is stated by draws of the stated uncertainty.
//!
//! What is benign stays below d = 1.5 by construction: before anything is hidden, the traces of damping, friction, hum,
//! drift and the piece's mass are lowered until a re-tuned half sine explains the campaign. That leaves a benign piece tenths
//! of a gram: one of a few grams rings with d = 20 to 60 at 0.3 N of noise, because the baseline has no piece at all. And
//! what the anti-alias filter rounds at the corners of the pulse is itself visible below a few kilohertz, so its corner is
//! raised, and where that is not enough the amplifier is noisier (at most 0.8 N).
//!
//! # Strength, and where an effect is
//!
//! d is relative to priors centred on the truth (in absorbed cases: on what is stated), so that what only contradicts a
//! stated uncertainty (gain, mass, speed) has strength as well. An answer gives two places: `rest`, where the re-tuned
//! baseline leaves something, and `signature`, where the effect acts before anything is re-tuned.

mod baseline;
mod bristle;
/// Cases: a plan with something hidden in it.
pub mod case;
/// A case of somebody's own choice.
pub mod chosen;
mod contact;
mod draw;
/// What can be hidden.
pub mod effect;
/// Campaigns and answers as files.
pub mod files;
/// The set that ships.
pub mod frozen;
/// Compositions of many cases.
pub mod mix;
mod motion;
mod noise;
/// Plans of campaigns.
pub mod plan;
mod readout;
mod strength;
/// What one recording truly was.
pub mod world;
